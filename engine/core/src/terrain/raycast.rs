//! Where a ray meets the surface.
//!
//! Down the pyramid from the root, near tiles first, past every box that the ray misses; in a finest tile block by
//! block and then triangle by triangle. Boxes of one level lie side by side, so the first hit found is the nearest.
//!
//! A triangle is tested as the ray's height above its plane at both ends of the ray's way over it: ways of neighbouring
//! triangles meet, so no ray slips through between them.

use std::collections::BTreeMap;

use super::{
    surface::Surface,
    tile_surface::{BLOCK_CELLS, BLOCKS, TileFrame, TileSurface},
};
use crate::{
    geo::{TILE_CELLS, TileId},
    pyramid::{PyramidError, Summary, feature::FeatureGroup},
    stream::Bounds,
};

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Metres from the ray's origin.
    pub distance: f64,
    /// World metres.
    pub position: [f64; 3],
    /// Upward unit normal of the triangle.
    pub normal: [f64; 3],
}

/// `origin + t · direction`, with unit direction, for t in `from..=to`.
#[derive(Clone, Copy)]
struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
    from: f64,
    to: f64,
}

impl Ray {
    fn at(&self, t: f64) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.origin[axis] + t * self.direction[axis])
    }

    /// The part of the ray between two planes across an axis; none when it misses.
    fn between(&self, axis: usize, low: f64, high: f64) -> Option<Self> {
        let (origin, direction) = (self.origin[axis], self.direction[axis]);
        if direction == 0.0 {
            return (low..=high).contains(&origin).then_some(*self);
        }
        let (a, b) = ((low - origin) / direction, (high - origin) / direction);
        let part = Self {
            from: self.from.max(a.min(b)),
            to: self.to.min(a.max(b)),
            ..*self
        };
        (part.from <= part.to).then_some(part)
    }

    fn within(&self, bounds: &Bounds) -> Option<Self> {
        (0..3).try_fold(*self, |ray, axis| {
            ray.between(axis, bounds.min[axis], bounds.max[axis])
        })
    }
}

impl Surface {
    /// The nearest place where a ray meets the surface, from above or from below, at most `max` metres away; none when
    /// it meets nothing. `direction` need not be of unit length.
    ///
    /// Reads the tiles along the ray where it is near the ground: a long ray that grazes the ground reads many.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn raycast(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        max: f64,
    ) -> Result<Option<Hit>, PyramidError> {
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(length > 0.0
            && length.is_finite()
            && origin.iter().all(|part| part.is_finite())
            && max >= 0.0)
        {
            return Ok(None);
        }
        let ray = Ray {
            origin,
            direction: direction.map(|part| part / length),
            from: 0.0,
            to: max,
        };
        let root = self.tile(TileId::ROOT)?.tile.summary;
        let Some(part) = ray.within(&self.bounds(TileId::ROOT, &root)) else {
            return Ok(None);
        };
        let mut features = BTreeMap::new();
        let mut nearest = self.descend(TileId::ROOT, &part, &mut features)?;
        for group in features.values() {
            let to = nearest.map_or(ray.to, |hit| hit.distance);
            let hit = self
                .feature(group)?
                .raycast(ray.origin, ray.direction, [ray.from, to]);
            nearest = hit.or(nearest);
        }
        Ok(nearest)
    }

    /// The first hit of the ground, and the features of the tiles on the way there.
    fn descend(
        &self,
        id: TileId,
        ray: &Ray,
        features: &mut BTreeMap<u32, FeatureGroup>,
    ) -> Result<Option<Hit>, PyramidError> {
        let kept = self.tile(id)?;
        if id.level == self.finest() {
            features.extend(kept.features.iter().map(|group| (group.id, group.clone())));
            return Ok(over_tile(&kept, &self.tile_frame(id), ray));
        }
        let children = id.children().into_iter().zip(kept.tile.children);
        let met = children
            .filter(|(_, summary)| summary.is_present() && summary.flags & Summary::ALL_VOID == 0);
        let met = met.filter_map(|(child, summary)| {
            Some((child, ray.within(&self.bounds(child, &summary))?))
        });
        let mut met: Vec<_> = met.collect();
        met.sort_by(|a, b| a.1.from.total_cmp(&b.1.from));
        for (child, part) in met {
            if let Some(hit) = self.descend(child, &part, features)? {
                return Ok(Some(hit));
            }
        }
        Ok(None)
    }

    fn bounds(&self, id: TileId, summary: &Summary) -> Bounds {
        let frame = self.tile_frame(id);
        box_over(&frame, [0; 2], TILE_CELLS, [summary.min, summary.max])
    }
}

/// The box over some cells, with room for rounding.
fn box_over(
    frame: &TileFrame,
    [row, column]: [usize; 2],
    cells: usize,
    [low, high]: [i32; 2],
) -> Bounds {
    let x = |column: usize| frame.corner[0] + column as f64 * frame.step[0];
    let y = |row: usize| frame.corner[1] + row as f64 * frame.step[1];
    let z = |units: i32, room: f64| (f64::from(units) + room) * frame.unit;
    Bounds {
        min: [x(column), y(row + cells), z(low, -1.0)],
        max: [x(column + cells), y(row), z(high, 1.0)],
    }
}

fn over_tile(kept: &TileSurface, frame: &TileFrame, ray: &Ray) -> Option<Hit> {
    let blocks = &kept.heights().blocks;
    let place = |block: usize| [block / BLOCKS * BLOCK_CELLS, block % BLOCKS * BLOCK_CELLS];
    let met = (0..blocks.len()).filter_map(|block| {
        let part = ray.within(&box_over(frame, place(block), BLOCK_CELLS, blocks[block]))?;
        Some((part.from, place(block), part))
    });
    let mut met: Vec<_> = met.collect();
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    met.iter()
        .find_map(|(_, place, part)| over_block(kept, frame, *place, part))
}

fn over_block(
    kept: &TileSurface,
    frame: &TileFrame,
    [row, column]: [usize; 2],
    ray: &Ray,
) -> Option<Hit> {
    let ends = [row, column].map(|at| at + BLOCK_CELLS);
    let (rows, columns) = (
        row..ends[0].min(frame.cells[0]),
        column..ends[1].min(frame.cells[1]),
    );
    let x = |column: usize| frame.corner[0] + column as f64 * frame.step[0];
    let y = |row: usize| frame.corner[1] + row as f64 * frame.step[1];
    let hits = rows
        .filter_map(|row| Some((row, ray.between(1, y(row + 1), y(row))?)))
        .flat_map(|(row, strip)| {
            columns.clone().filter_map(move |column| {
                let part = strip.between(0, x(column), x(column + 1))?;
                over_cell(kept, frame, [row, column], &part)
            })
        });
    hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// The ray's way over a cell, cut in two where it crosses the diagonal.
fn over_cell(kept: &TileSurface, frame: &TileFrame, cell: [usize; 2], ray: &Ray) -> Option<Hit> {
    let [row, column] = cell;
    let in_cell = |t: f64| {
        let [x, y, _] = ray.at(t);
        [
            (x - frame.corner[0]) / frame.step[0] - column as f64,
            (y - frame.corner[1]) / frame.step[1] - row as f64,
        ]
    };
    let below = |t: f64| {
        let [x, y] = in_cell(t);
        y - x
    };
    let (first, last) = (below(ray.from), below(ray.to));
    let middle = if first * last < 0.0 {
        ray.from + (ray.to - ray.from) * first / (first - last)
    } else {
        ray.to
    };
    let way = |from: f64, to: f64| {
        let lower = below(0.5 * (from + to)) >= 0.0;
        over_triangle(
            kept,
            frame,
            cell,
            lower,
            &Ray { from, to, ..*ray },
            &in_cell,
        )
    };
    way(ray.from, middle).or_else(|| {
        if middle < ray.to {
            way(middle, ray.to)
        } else {
            None
        }
    })
}

fn over_triangle(
    kept: &TileSurface,
    frame: &TileFrame,
    [row, column]: [usize; 2],
    lower: bool,
    ray: &Ray,
    in_cell: &impl Fn(f64) -> [f64; 2],
) -> Option<Hit> {
    if !kept.has_triangle(row, column, lower) {
        return None;
    }
    let above = |t: f64| ray.at(t)[2] - frame.unit * kept.units(row, column, lower, in_cell(t)).0;
    let (first, last) = (above(ray.from), above(ray.to));
    // Neighbouring triangles disagree about their common edge in the last bits: what is so near counts as met.
    let near = 1e-9 * (1.0 + ray.at(ray.from)[2].abs());
    let t = if first.abs() <= near {
        ray.from
    } else if last.abs() <= near {
        ray.to
    } else if first * last < 0.0 {
        ray.from + (ray.to - ray.from) * first / (first - last)
    } else {
        return None;
    };
    let (_, slope) = kept.units(row, column, lower, [0.0; 2]);
    let [east, north] = [0, 1].map(|axis| slope[axis] * frame.unit / frame.step[axis]);
    let length = (east * east + north * north + 1.0).sqrt();
    Some(Hit {
        distance: t,
        position: ray.at(t),
        normal: [-east / length, -north / length, 1.0 / length],
    })
}

#[cfg(test)]
#[path = "surface_tests.rs"]
mod tests;
