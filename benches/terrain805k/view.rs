//! Seen along the path: classic's one depth against a depth each, by the same error in pixels.

use anyhow::Result;
use drumlin_benches::scheme::{self, Scheme};
use drumlin_core::{
    cage::Cage,
    fas::{DepthRule, Features},
};
use serde::Serialize;

use crate::path::{self, Station};

/// One station's figures.
#[derive(Serialize)]
pub(crate) struct Seen {
    pub(crate) along: f64,
    /// The depth the rule asks for where it asks for most: what classic must give to all features.
    pub(crate) depth: u8,
    pub(crate) adaptive: Scheme,
}

/// Both ways along the path.
#[derive(Serialize)]
pub(crate) struct Path {
    pub(crate) seen: Vec<Seen>,
    /// Classic at every depth that some station asks for: its cost does not depend on the view.
    pub(crate) classic: Vec<Scheme>,
}

impl Path {
    /// Classic at a station.
    pub(crate) fn classic_at(&self, seen: &Seen) -> Result<&Scheme> {
        let found = self
            .classic
            .iter()
            .find(|scheme| scheme.deepest == seen.depth);
        found.ok_or_else(|| anyhow::anyhow!("depth {} was not measured", seen.depth))
    }
}

/// Measures every station; each is a rebuild of its own, without the depths of the one before.
pub(crate) fn measure(cage: &Cage, stations: &[Station], runs: usize) -> Result<Path> {
    let features = Features::of(cage);
    let pixels = path::pixels_per_radian();
    let mut seen = Vec::new();
    for station in stations {
        let choose = || features.depths(station.eye, pixels, DepthRule::DEFAULT, &[]);
        let depths = choose();
        seen.push(Seen {
            along: station.along,
            depth: depths.into_iter().max().unwrap_or(0),
            adaptive: scheme::measure(cage, &choose, runs)?,
        });
    }
    let mut asked: Vec<_> = seen.iter().map(|seen| seen.depth).collect();
    asked.sort_unstable();
    asked.dedup();
    let vertices = cage.positions().len();
    let same = |depth: u8| scheme::measure(cage, &|| vec![depth; vertices], runs);
    let classic = asked.into_iter().map(same).collect::<Result<Vec<_>>>()?;
    Ok(Path { seen, classic })
}
