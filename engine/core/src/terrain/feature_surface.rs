//! A feature's mesh on the CPU, for heights, rays and physics inside its cut.
//!
//! Meshed to within a height unit of its limit surface everywhere, whatever is drawn at the time. Triangles lie in
//! buckets, one a patch of the cut.

use std::ops::RangeInclusive;

use super::{
    Collider, Hit,
    feature_mesh::{CutPlace, FeatureMesh},
    mesher::shape,
};
use crate::{
    cage::Cage,
    geo::QUAD_SAMPLES,
    pyramid::{PyramidError, Tile},
    reference::shared::NONE,
};

/// Metres by which a triangle's sides may be missed: neighbours round their common side alike, but not a place beside it.
const NEAR: f64 = 1e-6;

/// The triangles of a feature, in buckets.
#[derive(Debug)]
pub(super) struct FeatureSurface {
    place: CutPlace,
    mesh: FeatureMesh,
    /// The mesh's positions; on the cut's border exactly where the samples are, whose cells meet it there.
    positions: Vec<[f64; 3]>,
    /// Buckets a row.
    columns: usize,
    buckets: Vec<Bucket>,
}

/// Triangles whose boxes in plan reach into a patch, and the box over all of them.
#[derive(Clone, Debug)]
struct Bucket {
    triangles: Vec<u32>,
    low: [f64; 3],
    high: [f64; 3],
}

impl FeatureSurface {
    /// Meshes a laid cage.
    pub(super) fn new<'a>(
        cage: &Cage,
        place: CutPlace,
        tiles: impl Iterator<Item = &'a Tile>,
    ) -> Result<Self, PyramidError> {
        let shape = shape(cage, place, tiles)?;
        let mesh = shape.mesh(&shape.equal_error_depths(place.unit))?;
        let [rows, columns] = [0, 1].map(|axis| (place.cut[axis + 2] - place.cut[axis]) as usize);
        let empty = Bucket {
            triangles: Vec::new(),
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        };
        let mut surface = Self {
            place,
            positions: positions(&mesh, place.step),
            mesh,
            columns,
            buckets: vec![empty; rows * columns],
        };
        surface.fill([rows, columns]);
        Ok(surface)
    }

    fn fill(&mut self, [rows, columns]: [usize; 2]) {
        for triangle in 0..self.mesh.indices.len() / 3 {
            let corners = self.corners(triangle);
            let (mut low, mut high) = (corners[0], corners[0]);
            for corner in corners {
                for axis in 0..3 {
                    low[axis] = low[axis].min(corner[axis]);
                    high[axis] = high[axis].max(corner[axis]);
                }
            }
            let across = self.span(0, low[0], high[0], columns);
            for row in self.span(1, high[1], low[1], rows) {
                for column in across.clone() {
                    let bucket = &mut self.buckets[row * columns + column];
                    bucket
                        .triangles
                        .push(u32::try_from(triangle).unwrap_or(u32::MAX));
                    for axis in 0..3 {
                        bucket.low[axis] = bucket.low[axis].min(low[axis]);
                        bucket.high[axis] = bucket.high[axis].max(high[axis]);
                    }
                }
            }
        }
    }

    /// Patches between two places along an axis; what reaches past the cut belongs to its outermost patches.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the cut's patches"
    )]
    fn span(&self, axis: usize, from: f64, to: f64, count: usize) -> RangeInclusive<usize> {
        let patch = self.place.step[axis] * QUAD_SAMPLES as f64;
        let last = (count - 1) as f64;
        let at = |place: f64| (place / patch).floor().clamp(0.0, last) as usize;
        // A little wide, so that what is rounded to the other side of a line is there too.
        let near = NEAR * patch.signum();
        at(from - near)..=at(to + near)
    }

    /// A triangle's corners, metres from the origin.
    fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        [0, 1, 2].map(|corner| {
            let vertex = self.mesh.indices[3 * triangle + corner] as usize;
            self.positions[vertex]
        })
    }

    /// The highest place over world x and y, and the unit normal of its triangle.
    pub(super) fn height_at(&self, place: [f64; 2]) -> Option<(f64, [f64; 3])> {
        let [x, y] = [0, 1].map(|axis| place[axis] - self.mesh.origin[axis]);
        let rows = self.buckets.len() / self.columns;
        let (row, column) = (
            *self.span(1, y, y, rows).start(),
            *self.span(0, x, x, self.columns).start(),
        );
        let bucket = &self.buckets[row * self.columns + column];
        let hits = bucket.triangles.iter().filter_map(|&triangle| {
            let corners = self.corners(triangle as usize);
            Some((height_over(corners, [x, y])?, corners))
        });
        let (height, corners) = hits.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((height + self.mesh.origin[2], normal(corners)?))
    }

    /// The nearest place where a ray meets the feature, `from..=to` metres along it.
    pub(super) fn raycast(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        [from, to]: [f64; 2],
    ) -> Option<Hit> {
        let start = [0, 1, 2].map(|axis| origin[axis] - self.mesh.origin[axis]);
        let met = self
            .buckets
            .iter()
            .filter(|bucket| passes(bucket, start, direction, [from, to]));
        let hits = met.flat_map(|bucket| &bucket.triangles).filter_map(|&at| {
            let corners = self.corners(at as usize);
            let distance = crossing(corners, start, direction)?;
            (from..=to)
                .contains(&distance)
                .then_some((distance, corners))
        });
        let (distance, corners) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Hit {
            distance,
            position: [0, 1, 2].map(|axis| origin[axis] + distance * direction[axis]),
            normal: normal(corners)?,
        })
    }

    /// Adds the triangles over one of the feature's tiles to a mesh for physics.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "positions in a tile are f32"
    )]
    pub(super) fn add_to(&self, collider: &mut Collider, tile: u32) {
        let mut places = vec![None; self.mesh.positions.len()];
        for triangle in self.mesh.indices.chunks_exact(3) {
            if self.mesh.tiles[triangle[0] as usize] != tile {
                continue;
            }
            for &vertex in triangle {
                let place = *places[vertex as usize].get_or_insert_with(|| {
                    let position = self.mesh.positions[vertex as usize];
                    collider.positions.push([0, 1, 2].map(|axis| {
                        let world = f64::from(position[axis]) + self.mesh.origin[axis];
                        (world - collider.origin[axis]) as f32
                    }));
                    u32::try_from(collider.positions.len() - 1).unwrap_or(u32::MAX)
                });
                collider.indices.push(place);
            }
        }
    }
}

/// The positions of a mesh's vertices, metres from its origin; those on the cut's border not rounded to floats.
fn positions(mesh: &FeatureMesh, step: [f64; 2]) -> Vec<[f64; 3]> {
    let position = |(position, &border): (&[f32; 3], &u32)| {
        let [x, y, z] = position.map(f64::from);
        if border == NONE {
            return [x, y, z];
        }
        [
            (x / step[0]).round() * step[0],
            (y / step[1]).round() * step[1],
            z,
        ]
    };
    mesh.positions
        .iter()
        .zip(&mesh.border)
        .map(position)
        .collect()
}

fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

fn normal([a, b, c]: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    let area = cross(subtract(b, a), subtract(c, a));
    let length = dot(area, area).sqrt();
    (length > 0.0).then(|| area.map(|part| part / length))
}

/// The height of a triangle over a place in plan; none beside it, and of one that stands upright.
fn height_over([a, b, c]: [[f64; 3]; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let side = |from: [f64; 3], to: [f64; 3]| {
        let along = [to[0] - from[0], to[1] - from[1]];
        along[0] * (y - from[1]) - along[1] * (x - from[0])
    };
    let shares = [side(b, c), side(c, a), side(a, b)];
    let area: f64 = shares.iter().sum();
    let longest = [(a, b), (b, c), (c, a)]
        .map(|(from, to)| (to[0] - from[0]).hypot(to[1] - from[1]))
        .into_iter()
        .fold(0.0, f64::max);
    let near = NEAR * longest;
    if area.abs() <= near || shares.iter().any(|share| share * area.signum() < -near) {
        return None;
    }
    Some((shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2]) / area)
}

/// Metres along a ray to a triangle, from either side.
fn crossing([a, b, c]: [[f64; 3]; 3], start: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    let (along, other) = (subtract(b, a), subtract(c, a));
    let across = cross(direction, other);
    let volume = dot(along, across);
    if volume == 0.0 {
        return None;
    }
    let from = subtract(start, a);
    let u = dot(from, across) / volume;
    let turned = cross(from, along);
    let v = dot(direction, turned) / volume;
    let inside = u >= -NEAR && v >= -NEAR && u + v <= 1.0 + NEAR;
    inside.then(|| dot(other, turned) / volume)
}

/// True when a ray comes through a bucket's box.
fn passes(bucket: &Bucket, start: [f64; 3], direction: [f64; 3], [from, to]: [f64; 2]) -> bool {
    let (mut near, mut far) = (from, to);
    for axis in 0..3 {
        let (low, high) = (bucket.low[axis] - NEAR, bucket.high[axis] + NEAR);
        if direction[axis] == 0.0 {
            if !(low..=high).contains(&start[axis]) {
                return false;
            }
            continue;
        }
        let ends = [low, high].map(|plane| (plane - start[axis]) / direction[axis]);
        near = near.max(ends[0].min(ends[1]));
        far = far.min(ends[0].max(ends[1]));
    }
    near <= far
}
