//! One way of giving depths, measured: its counts, its memory, and the time of its steps.

use std::hint::black_box;

use anyhow::Result;
use drumlin_core::{
    cage::Cage,
    fas::{Blocks, Entry, PatchPattern, Positions},
};
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    errors::blocks_at,
    measure::{self, Clock, Timing, clocked_median_of, prepared_median_of},
};

/// Places along each side of a patch at which it is drawn.
const DRAWN: u32 = 5;

/// Counts of the tables, bytes and times.
#[derive(Clone, Debug, Serialize)]
pub struct Scheme {
    /// Greatest depth of a feature.
    pub deepest: u8,
    /// All patches.
    pub patches: u64,
    /// Patches of levels from 2 on, and caps.
    pub feature_patches: u64,
    /// Points made by refinement.
    pub refined_points: u64,
    /// Bytes of tables and points, f32.
    pub bytes: u64,
    /// On one thread, by that thread's clock.
    pub one_thread: Times,
    /// On all threads, by the clock on the wall.
    pub all_threads: Times,
}

/// Times of the steps.
#[derive(Clone, Debug, Serialize)]
pub struct Times {
    /// Giving every feature its depth.
    pub choosing: Timing,
    /// Laying the tables from those of depth 0.
    pub tables: Timing,
    /// Making all points, f32.
    pub points: Timing,
    /// Evaluating all patches, f32.
    pub drawing: Timing,
}

impl Times {
    /// Seconds of all that comes before drawing.
    #[must_use]
    pub fn subdivision(&self) -> f64 {
        self.choosing.median + self.tables.median + self.points.median
    }

    /// Seconds of everything.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.subdivision() + self.drawing.median
    }
}

/// Measures the depths that `choose` gives.
///
/// # Errors
/// When the depths do not fit the cage, or the threads cannot be started.
pub fn measure(cage: &Cage, choose: &(impl Fn() -> Vec<u8> + Sync), runs: usize) -> Result<Scheme> {
    let depths = choose();
    let mut blocks = blocks_at(cage, &depths)?;
    let (mut patches, mut feature_patches) = (0, 0);
    blocks.visit(|entry| {
        let at_feature = matches!(entry, Entry::Cap(_)) || entry.place().level > 1;
        patches += 1;
        feature_patches += u64::from(at_feature);
    });
    let deepest = blocks.features().map(|vertex| blocks.depth(vertex)).max();
    let point_bytes = size_of::<[f32; 3]>() as u64 * u64::from(blocks.point_count());
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let refined_points = u64::from(blocks.refined_point_count());
    let bytes = blocks.byte_count() as u64 + point_bytes;
    let mut timed = |threads, clock| {
        measure::with_threads(threads, || times(cage, choose, &mut blocks, clock, runs))?
    };
    Ok(Scheme {
        deepest: deepest.unwrap_or(0),
        patches,
        feature_patches,
        refined_points,
        bytes,
        one_thread: timed(1, Clock::Thread)?,
        all_threads: timed(all, Clock::Wall)?,
    })
}

/// Times the steps on the caller's pool.
fn times(
    cage: &Cage,
    choose: &impl Fn() -> Vec<u8>,
    blocks: &mut Blocks,
    clock: Clock,
    runs: usize,
) -> Result<Times> {
    let (choosing, depths) = clocked_median_of(clock, runs, choose);
    // Linking is the same for all depths, so it stays outside of the time: every run begins at depth 0.
    let flat = vec![0; depths.len()];
    let (tables, laid) = prepared_median_of(
        clock,
        runs,
        blocks,
        |blocks| {
            // It cannot fail where the depths of the counts did not.
            let _ = blocks.set_depths(&flat);
        },
        |blocks| blocks.set_depths(&depths),
    );
    laid.map_err(anyhow::Error::msg)?;
    let narrow = cage.positions().iter().map(|at| at.map(|x| x as f32));
    let narrow: Vec<_> = narrow.collect();
    let mut positions = Positions::new(blocks, &narrow);
    let (points, ()) = clocked_median_of(clock, runs, || positions.execute(blocks, &narrow));
    let pattern = PatchPattern::new(&drawn_places());
    let (drawing, ()) = clocked_median_of(clock, runs, || draw(blocks, &positions, &pattern));
    Ok(Times {
        choosing,
        tables,
        points,
        drawing,
    })
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
