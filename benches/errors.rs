//! How far a table's surface is from the limit, and the depths that keep it within a bound.
//!
//! Patches without an extraordinary vertex are the limit itself, to rounding; only caps are off. A cap's surface depends
//! on its place alone, not on the depths of other features, so every cap is measured once.

use std::collections::HashMap;

use anyhow::Result;
use drumlin_core::{
    cage::{self, Cage, LimitSample, LimitSurface},
    fas::{Blocks, MAX_DEPTH, Piece, Place, Positions},
};

/// Limit points looked at on the way to the nearest one.
const SEARCH_STEPS: usize = 5;

/// Distances of a cage's caps from the limit.
pub struct Errors<'a> {
    cage: &'a Cage,
    limit: LimitSurface<'a>,
    /// Steps along each side of a cap between places at which it is measured.
    steps: u32,
    known: HashMap<Place, f64>,
}

/// What one feature's caps are off by.
#[derive(Clone, Debug)]
pub struct FeatureErrors {
    /// The feature.
    pub vertex: u32,
    /// At depths from `least` on.
    pub by_depth: Vec<f64>,
    /// The least depth it may have.
    pub least: u8,
}

impl FeatureErrors {
    /// The least depth at which they are within `bound`, the greatest there is where none is.
    #[must_use]
    pub fn depth_within(&self, bound: f64) -> u8 {
        let above = self.by_depth.iter().take_while(|&&error| error > bound);
        self.least + above.count().min(self.by_depth.len() - 1) as u8
    }

    /// What they are off by at a depth.
    #[must_use]
    pub fn at(&self, depth: u8) -> f64 {
        let index = usize::from(depth.saturating_sub(self.least));
        self.by_depth[index.min(self.by_depth.len() - 1)]
    }
}

/// The least depth for each feature at which its own caps are within `bound`, its greatest where none is; one depth a
/// vertex.
#[must_use]
pub fn depths_within(bound: f64, features: &[FeatureErrors], vertices: usize) -> Vec<u8> {
    let mut depths = vec![0; vertices];
    for feature in features {
        depths[feature.vertex as usize] = feature.depth_within(bound);
    }
    depths
}

/// A cage's tables at these depths, one a vertex.
///
/// # Errors
/// When the depths do not fit the cage.
pub fn blocks_at(cage: &Cage, depths: &[u8]) -> Result<Blocks> {
    let mut blocks = Blocks::new(cage.topology()).map_err(anyhow::Error::msg)?;
    blocks.set_depths(depths).map_err(anyhow::Error::msg)?;
    Ok(blocks)
}

impl<'a> Errors<'a> {
    /// Of a cage, all quads, at places so many steps a side apart.
    ///
    /// # Errors
    /// When the cage has faces that are no quads.
    pub fn new(cage: &'a Cage, steps: u32) -> Result<Self> {
        Ok(Self {
            cage,
            limit: LimitSurface::new(cage)?,
            steps,
            known: HashMap::new(),
        })
    }

    /// The greatest distance from the limit at these depths.
    ///
    /// # Errors
    /// When the depths do not fit the cage, or its limit cannot be evaluated.
    pub fn worst(&mut self, depths: &[u8]) -> Result<f64> {
        let blocks = blocks_at(self.cage, depths)?;
        let points = Positions::new(&blocks, self.cage.positions());
        let mut caps = Vec::new();
        for part in 0..blocks.part_count() {
            points.visit_part(&blocks, part, &mut |piece| {
                if piece.is_cap {
                    caps.push(piece.clone());
                }
            });
        }
        let mut worst = 0.0_f64;
        for cap in &caps {
            worst = worst.max(self.of_cap(cap)?);
        }
        Ok(worst)
    }

    /// The least depth that, given to all features, keeps the worst error within `bound`.
    ///
    /// # Errors
    /// When no depth does, or the limit cannot be evaluated.
    pub fn classic_depth(&mut self, bound: f64) -> Result<u8> {
        for depth in 1..=MAX_DEPTH {
            let worst = self.worst(&vec![depth; self.cage.positions().len()])?;
            if worst <= bound {
                return Ok(depth);
            }
        }
        anyhow::bail!("no depth up to {MAX_DEPTH} keeps the error within {bound:e}")
    }

    /// What every feature's own caps are off by at depths from 1 to `deepest`, all of which were measured before.
    #[must_use]
    pub fn by_feature(&self, blocks: &Blocks, deepest: u8) -> Vec<FeatureErrors> {
        let topology = self.cage.topology();
        let of_cap = |corner: u32, level: u8| {
            let [u, v] = [[0, 0], [1, 0], [1, 1], [0, 1]][topology.corner_place(corner)];
            let last = (1_u16 << level) - 1;
            let place = Place {
                face: topology.corner_face(corner),
                u: u * last,
                v: v * last,
                level,
            };
            self.known.get(&place).copied().unwrap_or(f64::INFINITY)
        };
        let of_feature = |vertex: u32| FeatureErrors {
            vertex,
            least: 1,
            by_depth: (1..=deepest)
                .map(|depth| {
                    let corners = topology.vertex_corners(vertex).iter();
                    corners.fold(0.0, |most, &corner| of_cap(corner, depth).max(most))
                })
                .collect(),
        };
        blocks.features().map(of_feature).collect()
    }

    /// From points to the limit of the face they are on: to the nearest of the limit points that some steps find from
    /// `places`, so never less than the true distance. A cap's parameters run at another speed than the limit's, so the
    /// limit at the same parameters alone would not do.
    fn greatest_distance(&self, found: Vec<[f64; 3]>, mut places: Vec<cage::Place>) -> Result<f64> {
        let mut nearest: Vec<_> = places.iter().map(|&at| (f64::INFINITY, at)).collect();
        for _ in 0..SEARCH_STEPS {
            let samples = self.limit.evaluate_many(&places)?;
            for (index, sample) in samples.iter().enumerate() {
                let away = distance(found[index], sample.position);
                let (least, best) = nearest[index];
                places[index] = if away < least {
                    nearest[index] = (away, places[index]);
                    nearer(places[index], found[index], sample)
                } else {
                    // A step too far: half of it.
                    cage::Place {
                        face: best.face,
                        u: 0.5 * (best.u + places[index].u),
                        v: 0.5 * (best.v + places[index].v),
                    }
                };
            }
        }
        let nearest = nearest.into_iter().map(|(least, _)| least);
        Ok(nearest.fold(0.0, f64::max))
    }

    fn of_cap(&mut self, cap: &Piece<f64>) -> Result<f64> {
        if let Some(&error) = self.known.get(&cap.place) {
            return Ok(error);
        }
        let steps = self.steps;
        let side = f64::from(cap.place.level).exp2();
        let step = |index: u32| f64::from(index) / f64::from(steps);
        let inside = (0..=steps).flat_map(|v| (0..=steps).map(move |u| [step(u), step(v)]));
        let inside: Vec<[f64; 2]> = inside.collect();
        let on_face = |[u, v]: &[f64; 2]| cage::Place {
            face: cap.place.face,
            u: (f64::from(cap.place.u) + u) / side,
            v: (f64::from(cap.place.v) + v) / side,
        };
        let places = inside.iter().map(on_face).collect();
        let found = inside.iter().map(|&uv| cap.evaluate(uv).position).collect();
        let error = self.greatest_distance(found, places)?;
        self.known.insert(cap.place, error);
        Ok(error)
    }
}

/// The mean length of a cage's edges.
#[must_use]
pub fn mean_edge_length(cage: &Cage) -> f64 {
    let (topology, positions) = (cage.topology(), cage.positions());
    let length = |edge: u32| {
        let [a, b] = topology.edge_vertices(edge);
        distance(positions[a as usize], positions[b as usize])
    };
    let edges = topology.edge_count();
    (0..edges).map(length).sum::<f64>() / f64::from(edges)
}

/// Closer by a Gauss-Newton step to the place of a face whose limit is nearest to `found`; `sample` is the limit at `place`.
fn nearer(place: cage::Place, found: [f64; 3], sample: &LimitSample) -> cage::Place {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (du, dv) = (sample.du, sample.dv);
    let off = [0, 1, 2].map(|axis| found[axis] - sample.position[axis]);
    let (uu, uv, vv) = (dot(du, du), dot(du, dv), dot(dv, dv));
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-12 * uu * vv {
        return place;
    }
    let (u, v) = (dot(du, off), dot(dv, off));
    cage::Place {
        face: place.face,
        u: (place.u + (vv * u - uv * v) / determinant).clamp(0.0, 1.0),
        v: (place.v + (uu * v - uv * u) / determinant).clamp(0.0, 1.0),
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3)
        .map(|axis| (a[axis] - b[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}
