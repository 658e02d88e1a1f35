//! One way of giving depths, measured: its counts, and the time of its steps.

use std::{collections::VecDeque, hint::black_box};

use anyhow::{Context as _, Result};
use drumlin_benches::measure::{self, Timing, median_of, thread_median_of};
use drumlin_core::{
    cage::Cage,
    fas::{Blocks, Entry, PatchPattern, Positions},
};
use rayon::prelude::*;
use serde::Serialize;

use crate::errors::blocks_at;

/// Places along each side of a patch at which it is drawn.
const DRAWN: u32 = 5;

/// Counts of the tables, and times.
#[derive(Serialize)]
pub(crate) struct Scheme {
    /// Greatest depth of a feature.
    pub(crate) deepest: u8,
    /// Greatest distance from the limit.
    pub(crate) worst_error: f64,
    /// All patches.
    pub(crate) patches: u64,
    /// Patches of levels from 2 on, and caps.
    pub(crate) feature_patches: u64,
    /// Points made by refinement.
    pub(crate) refined_points: u64,
    /// On one thread, by that thread's clock.
    pub(crate) one_thread: Times,
    /// On all threads, by the clock on the wall.
    pub(crate) all_threads: Times,
}

/// Times of the steps.
#[derive(Serialize)]
pub(crate) struct Times {
    /// Giving every feature its depth.
    pub(crate) choosing: Timing,
    /// Laying the tables from those of depth 0.
    pub(crate) tables: Timing,
    /// Making all points, f32.
    pub(crate) points: Timing,
    /// Evaluating all patches, f32.
    pub(crate) drawing: Timing,
}

impl Times {
    /// Seconds of all that comes before drawing.
    pub(crate) fn subdivision(&self) -> f64 {
        self.choosing.median + self.tables.median + self.points.median
    }

    /// Seconds of everything.
    pub(crate) fn total(&self) -> f64 {
        self.subdivision() + self.drawing.median
    }
}

/// Measures the depths that `choose` gives; `worst_error` is theirs.
pub(crate) fn measure(
    cage: &Cage,
    choose: &(impl Fn() -> Vec<u8> + Sync),
    worst_error: f64,
    runs: usize,
) -> Result<Scheme> {
    let depths = choose();
    let blocks = blocks_at(cage, &depths)?;
    let (mut patches, mut feature_patches) = (0, 0);
    blocks.visit(|entry| {
        let at_feature = matches!(entry, Entry::Cap(_)) || entry.place().level > 1;
        patches += 1;
        feature_patches += u64::from(at_feature);
    });
    let deepest = blocks.features().map(|vertex| blocks.depth(vertex)).max();
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let timed = |threads| measure::with_threads(threads, || times(cage, choose, threads, runs))?;
    Ok(Scheme {
        deepest: deepest.unwrap_or(0),
        worst_error,
        patches,
        feature_patches,
        refined_points: u64::from(blocks.refined_point_count()),
        one_thread: timed(1)?,
        all_threads: timed(all)?,
    })
}

/// Times the steps on the caller's pool of so many threads.
fn times(
    cage: &Cage,
    choose: &(impl Fn() -> Vec<u8> + Sync),
    threads: usize,
    runs: usize,
) -> Result<Times> {
    let (choosing, depths) = timed(threads, runs, choose);
    // Linking is the same for all depths, so it stays outside of the time: linked tables of depth 0, one a run.
    let flat = vec![0; depths.len()];
    let linked: Result<VecDeque<_>> = (0..=runs).map(|_| blocks_at(cage, &flat)).collect();
    let mut linked = linked?;
    let (tables, blocks) = timed(threads, runs, || {
        let mut blocks = linked.pop_front().context("tables a run")?;
        blocks.set_depths(&depths).map_err(anyhow::Error::msg)?;
        anyhow::Ok(blocks)
    });
    let blocks = blocks?;
    let narrow = cage.positions().iter().map(|at| at.map(|x| x as f32));
    let narrow: Vec<_> = narrow.collect();
    let (points, positions) = timed(threads, runs, || Positions::new(&blocks, &narrow));
    let pattern = PatchPattern::new(&drawn_places());
    let (drawing, ()) = timed(threads, runs, || draw(&blocks, &positions, &pattern));
    Ok(Times {
        choosing,
        tables,
        points,
        drawing,
    })
}

fn timed<T>(threads: usize, runs: usize, work: impl FnMut() -> T) -> (Timing, T) {
    if threads == 1 {
        thread_median_of(runs, work)
    } else {
        median_of(runs, work)
    }
}

/// Position and derivatives at the places of every patch, on the caller's pool.
fn draw(blocks: &Blocks, positions: &Positions<f32>, pattern: &PatchPattern<f32>) {
    (0..blocks.part_count()).into_par_iter().for_each(|part| {
        let [mut at, mut du, mut dv] = [0, 1, 2].map(|_| vec![[0.0_f32; 3]; pattern.place_count()]);
        positions.visit_part(blocks, part, &mut |piece| {
            pattern.jets_into(piece, [&mut at, &mut du, &mut dv]);
            black_box((&at, &du, &dv));
        });
    });
}

fn drawn_places() -> Vec<[f64; 2]> {
    let step = |index: u32| f64::from(index) / f64::from(DRAWN - 1);
    let row = |v: u32| (0..DRAWN).map(move |u| [step(u), step(v)]);
    (0..DRAWN).flat_map(row).collect()
}
