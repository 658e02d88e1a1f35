//! A step of the camera: only what changes is done again.

use anyhow::Result;
use drumlin_benches::measure::Clock;
use drumlin_core::{
    cage::Cage,
    fas::{Blocks, DepthRule, DepthWatch, Features, Positions},
};
use serde::Serialize;

use crate::path::{self, Station};

/// Steps from every station.
const STEPS: usize = 40;

/// Steps of the camera along its heading, all stations together; seconds of one thread.
#[derive(Serialize)]
pub(crate) struct Steps {
    pub(crate) metres: f64,
    pub(crate) count: usize,
    pub(crate) median: f64,
    pub(crate) p95: f64,
    pub(crate) greatest: f64,
    /// Seconds of choosing, tables and points anew at the stations, in the median.
    pub(crate) rebuild: f64,
    /// Features of the cage, looked at a step and changed a step, in the mean.
    pub(crate) features: usize,
    pub(crate) looked_at: f64,
    pub(crate) changed: f64,
}

/// Measures steps of so many metres from every station.
pub(crate) fn measure(
    cage: &Cage,
    stations: &[Station],
    metres: f64,
    rebuild: f64,
) -> Result<Steps> {
    let features = Features::of(cage);
    let pixels = path::pixels_per_radian();
    let narrow: Vec<_> = cage
        .positions()
        .iter()
        .map(|at| at.map(|x| x as f32))
        .collect();
    let mut blocks = Blocks::new(cage.topology()).map_err(anyhow::Error::msg)?;
    let mut seconds = Vec::new();
    let [mut looked_at, mut changed] = [0, 0];
    for station in stations {
        let mut watch = DepthWatch::new(features.clone(), station.eye, pixels, DepthRule::DEFAULT);
        blocks
            .set_depths(watch.depths())
            .map_err(anyhow::Error::msg)?;
        let mut points = Positions::new(&blocks, &narrow);
        for step in 1..=STEPS {
            let way = metres * step as f64;
            let eye = [0, 1, 2].map(|axis| station.eye[axis] + way * station.heading[axis]);
            let (time, moved) = Clock::Thread.time(|| {
                let moved = watch.step(eye);
                let changes = blocks.change_depths(watch.depths(), &moved)?;
                points.update(&blocks, &changes);
                Ok::<_, &'static str>(moved.len())
            });
            changed += moved.map_err(anyhow::Error::msg)?;
            looked_at += watch.looked_at();
            seconds.push(time);
        }
    }
    seconds.sort_by(f64::total_cmp);
    let count = seconds.len();
    let quantile = |share: f64| seconds[((count - 1) as f64 * share).round() as usize];
    let mean = |sum: usize| sum as f64 / count as f64;
    Ok(Steps {
        metres,
        count,
        median: quantile(0.5),
        p95: quantile(0.95),
        greatest: quantile(1.0),
        rebuild,
        features: features.list.len(),
        looked_at: mean(looked_at),
        changed: mean(changed),
    })
}
