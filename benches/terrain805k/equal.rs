//! The same worst error everywhere: one depth for all features against a depth each that leaves no greater error.

use anyhow::Result;
use drumlin_benches::{
    cap_errors,
    errors::{FeatureErrors, depths_within, mean_edge_length},
    scheme::{self, Scheme},
};
use drumlin_core::cage::Cage;
use serde::Serialize;

/// Figures; lengths are metres.
#[derive(Serialize)]
pub(crate) struct Equal {
    pub(crate) mean_edge_length: f64,
    pub(crate) rows: [Row; 2],
}

/// One way of giving depths.
#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) worst_error: f64,
    pub(crate) scheme: Scheme,
}

/// Measures classic at `depth`, and the least depth each that leaves no more.
pub(crate) fn measure(cage: &Cage, depth: u8, runs: usize) -> Result<Equal> {
    let vertices = cage.positions().len();
    let errors = cap_errors::by_feature(cage, depth)?;
    let worst = |depths: &[u8]| {
        let error = |feature: &FeatureErrors| feature.at(depths[feature.vertex as usize]);
        errors.iter().map(error).fold(0.0, f64::max)
    };
    let same = || vec![depth; vertices];
    let bound = worst(&same());
    let own = || depths_within(bound, &errors, vertices);
    Ok(Equal {
        mean_edge_length: mean_edge_length(cage),
        rows: [
            Row {
                name: "classic, one for all",
                worst_error: bound,
                scheme: scheme::measure(cage, &same, runs)?,
            },
            Row {
                name: "adaptive",
                worst_error: worst(&own()),
                scheme: scheme::measure(cage, &own, runs)?,
            },
        ],
    })
}
