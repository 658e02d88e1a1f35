//! Our own figures: link, tables, update and limit evaluation, step by step.

use anyhow::{Context as _, Result};
use drumlin_benches::measure::{Timing, thread_median_of};
use drumlin_core::{
    cage::{Cage, Crease, LimitPattern, Tags, Topology},
    fas::{Blocks, Positions},
};
use serde::Serialize;

use crate::{
    Arguments,
    compare::{Spread, distances},
};

/// Times, bytes and counts.
#[derive(Serialize)]
pub(crate) struct Ours {
    /// From faces to a checked topology.
    pub(crate) link: Timing,
    /// From topology to tables.
    pub(crate) tables: Timing,
    /// All points from the cage's, f32.
    pub(crate) update: Timing,
    /// Making the limit stencils of all places.
    pub(crate) stencils: Timing,
    /// Limit positions, f32.
    pub(crate) positions: Timing,
    /// Limit positions and derivatives, f32.
    pub(crate) derivatives: Timing,
    /// Bytes of the topology.
    pub(crate) link_bytes: u64,
    /// Bytes of the tables.
    pub(crate) table_bytes: u64,
    /// Points made by refinement.
    pub(crate) refined_points: u64,
    /// Patches.
    pub(crate) patches: u64,
    /// Places at which the limit is evaluated.
    pub(crate) places: u64,
    /// From f32 to f64 limit positions, over the cage's extent.
    pub(crate) f32_distance: Spread,
}

/// Measures all steps; also the limit positions.
pub(crate) fn measure(
    cage: &Cage,
    creases: &[Crease],
    arguments: &Arguments,
) -> Result<(Ours, Vec<[f32; 3]>)> {
    let runs = usize::from(arguments.runs);
    let (link, topology) = link(cage, creases, runs)?;
    let depths = vec![arguments.depth; topology.vertex_count() as usize];
    let (tables, blocks) = thread_median_of(runs, || {
        let mut blocks = Blocks::new(&topology)?;
        blocks.set_depths(&depths).map(|_| blocks)
    });
    let blocks = blocks.map_err(anyhow::Error::msg)?;
    let narrow = narrow(cage.positions());
    let mut points = Positions::new(&blocks, &narrow);
    let (update, ()) = thread_median_of(runs, || points.execute(&blocks, &narrow));
    drop(points);
    let limit = Limit::measure(cage, &topology, &narrow, arguments)?;
    let ours = Ours {
        link,
        tables,
        update,
        stencils: limit.stencils,
        positions: limit.positions,
        derivatives: limit.derivatives,
        link_bytes: topology.byte_count() as u64,
        table_bytes: blocks.byte_count() as u64,
        refined_points: u64::from(blocks.refined_point_count()),
        patches: u64::from(blocks.patch_count()),
        places: limit.found.len() as u64,
        f32_distance: limit.f32_distance,
    };
    Ok((ours, limit.found))
}

/// Links the cage with creases; copies of what linking takes over are made before.
fn link(cage: &Cage, creases: &[Crease], runs: usize) -> Result<(Timing, Topology)> {
    let tags = Tags {
        creases: creases.to_vec(),
        ..Tags::default()
    };
    let copy = |_| (cage.positions().to_vec(), cage.topology().faces().clone());
    let mut copies: Vec<_> = (0..=runs).map(copy).collect();
    let (timing, linked) = thread_median_of(runs, || {
        let (positions, faces) = copies.pop().context("a copy a run")?;
        Cage::new(positions, faces, &tags).context("linking the cage")
    });
    Ok((timing, linked?.topology().clone()))
}

/// Limit evaluation at the same places of every face.
struct Limit {
    stencils: Timing,
    positions: Timing,
    derivatives: Timing,
    found: Vec<[f32; 3]>,
    f32_distance: Spread,
}

impl Limit {
    fn measure(
        cage: &Cage,
        topology: &Topology,
        narrow_cage: &[[f32; 3]],
        arguments: &Arguments,
    ) -> Result<Self> {
        let (runs, places) = (usize::from(arguments.runs), middles(arguments.places));
        let (stencils, pattern) =
            thread_median_of(runs, || LimitPattern::<f32>::new(topology, &places));
        let pattern = pattern?;
        let place_count = topology.face_count() as usize * places.len();
        let [mut found, mut du, mut dv] = [0, 1, 2].map(|_| vec![[0.0_f32; 3]; place_count]);
        let (derivatives, ()) = thread_median_of(runs, || {
            pattern.jets_into(narrow_cage, [&mut found, &mut du, &mut dv]);
        });
        let (positions, ()) =
            thread_median_of(runs, || pattern.positions_into(narrow_cage, &mut found));
        let exact = LimitPattern::new(topology, &places)?.positions(cage.positions());
        let off = distances(&found, &narrow(&exact), cage.extent());
        Ok(Self {
            stencils,
            positions,
            derivatives,
            found,
            f32_distance: Spread::of(off),
        })
    }
}

fn narrow(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|at| at.map(|x| x as f32)).collect()
}

/// Places in the middles of a face's squares, row by row.
fn middles(count: u8) -> Vec<[f64; 2]> {
    let middle = |index: u8| (f64::from(index) + 0.5) / f64::from(count);
    let row = |v: u8| (0..count).map(move |u| [middle(u), middle(v)]);
    (0..count).flat_map(row).collect()
}
