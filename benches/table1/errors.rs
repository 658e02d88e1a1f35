//! How far a table's surface is from the limit, and the depths that keep it within a bound.
//!
//! Patches without an extraordinary vertex are the limit itself, to rounding; only caps are off. A cap's surface depends
//! on its place alone, not on the depths of other features, so every cap is measured once.

use std::collections::HashMap;

use anyhow::{Result, ensure};
use drumlin_core::{
    cage::{self, Cage, LimitSurface},
    fas::{Blocks, Features, MAX_DEPTH, Piece, Place, Positions},
};

/// Places along each side of a cap at which it is measured.
const PLACES: u32 = 8;
/// Halvings of the interval, of logarithms, that the tolerance lies in.
const HALVINGS: usize = 30;

/// Distances of a cage's caps from the limit.
pub(crate) struct Errors<'a> {
    cage: &'a Cage,
    limit: LimitSurface<'a>,
    known: HashMap<Place, f64>,
}

/// A cage's tables at these depths, one a vertex.
pub(crate) fn blocks_at(cage: &Cage, depths: &[u8]) -> Result<Blocks> {
    let mut blocks = Blocks::new(cage.topology()).map_err(anyhow::Error::msg)?;
    blocks.set_depths(depths).map_err(anyhow::Error::msg)?;
    Ok(blocks)
}

impl<'a> Errors<'a> {
    /// Of a cage, all quads.
    pub(crate) fn new(cage: &'a Cage) -> Result<Self> {
        Ok(Self {
            cage,
            limit: LimitSurface::new(cage)?,
            known: HashMap::new(),
        })
    }

    /// The greatest distance from the limit at these depths.
    pub(crate) fn worst(&mut self, depths: &[u8]) -> Result<f64> {
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
    pub(crate) fn classic_depth(&mut self, bound: f64) -> Result<u8> {
        for depth in 1..=MAX_DEPTH {
            if self.worst(&vec![depth; self.cage.positions().len()])? <= bound {
                return Ok(depth);
            }
        }
        anyhow::bail!("no depth up to {MAX_DEPTH} keeps the error within {bound:e}")
    }

    /// The greatest tolerance, to one part in a million or so, at which the depth rule keeps the worst error within
    /// `bound`.
    pub(crate) fn tolerance(&mut self, features: &Features, bound: f64) -> Result<f64> {
        let (mut least, mut greatest) = (bound * 1e-6, bound * 1e6);
        let at_least = self.worst(&features.equal_error_depths(least))?;
        ensure!(
            at_least <= bound,
            "the rule's greatest depths leave an error of {at_least:e}, more than the bound {bound:e}"
        );
        for _ in 0..HALVINGS {
            let middle = (least * greatest).sqrt();
            if self.worst(&features.equal_error_depths(middle))? <= bound {
                least = middle;
            } else {
                greatest = middle;
            }
        }
        Ok(least)
    }

    fn of_cap(&mut self, cap: &Piece<f64>) -> Result<f64> {
        if let Some(&error) = self.known.get(&cap.place) {
            return Ok(error);
        }
        let side = f64::from(cap.place.level).exp2();
        let step = |index: u32| f64::from(index) / f64::from(PLACES);
        let inside = (0..=PLACES).flat_map(|v| (0..=PLACES).map(move |u| [step(u), step(v)]));
        let inside: Vec<[f64; 2]> = inside.collect();
        let on_face = |[u, v]: &[f64; 2]| cage::Place {
            face: cap.place.face,
            u: (f64::from(cap.place.u) + u) / side,
            v: (f64::from(cap.place.v) + v) / side,
        };
        let places: Vec<_> = inside.iter().map(on_face).collect();
        let wanted = self.limit.positions_many(&places)?;
        let error = inside
            .iter()
            .zip(wanted)
            .map(|(&uv, wanted)| distance(cap.evaluate(uv).position, wanted))
            .fold(0.0, f64::max);
        self.known.insert(cap.place, error);
        Ok(error)
    }
}

/// The mean length of a cage's edges.
pub(crate) fn mean_edge_length(cage: &Cage) -> f64 {
    let (topology, positions) = (cage.topology(), cage.positions());
    let length = |edge: u32| {
        let [a, b] = topology.edge_vertices(edge);
        distance(positions[a as usize], positions[b as usize])
    };
    let edges = topology.edge_count();
    (0..edges).map(length).sum::<f64>() / f64::from(edges)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3)
        .map(|axis| (a[axis] - b[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}
