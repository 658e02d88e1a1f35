//! The same ground through the engine's own tiles, at the same pixel error: the planner's cut, and the reference of every
//! stage on the CPU, one thread.
//!
//! All tiles count as seen, and the cut is as fine behind the camera as before it, since the cage is refined all round
//! too.

use std::{path::Path, sync::Arc, sync::atomic::AtomicBool};

use anyhow::{Context as _, Result, ensure};
use drumlin_benches::measure::{Clock, Timing, clocked_median_of};
use drumlin_core::{
    dem::{self, OpenOptions},
    geo::PATCH_COUNT,
    pyramid::build::{BuildOptions, build},
    reference::{
        balance, decode, depth, draw, emit,
        shared::{
            DRAW_LIST_WORDS, INDEX_COUNT_WORD, SHIFT_COUNTS_WORD, SLOT_WORDS, SLOTS_PER_PAGE,
            TILE_VISIBLE, UPLOAD_WORDS, UploadHeader,
        },
    },
    terrain::{FramePlan, Planner, PlannerDescriptor, PyramidSource},
};
use serde::Serialize;

use crate::path::Station;

/// One station's figures.
#[derive(Serialize)]
pub(crate) struct Tiled {
    pub(crate) along: f64,
    pub(crate) tiles: u64,
    pub(crate) patches: u64,
    pub(crate) triangles: u64,
    /// Vertices that are placed.
    pub(crate) points: u64,
    /// Bytes of the slots in use and of the list of indices.
    pub(crate) bytes: u64,
    /// The error kept, pixels.
    pub(crate) tolerance_px: f64,
    /// Milliseconds the last plan took, all tiles there.
    pub(crate) planning_millis: f64,
    /// Depths of all patches, balanced, and the list of triangles.
    pub(crate) stages: Timing,
    /// Every vertex placed.
    pub(crate) drawing: Timing,
}

impl Tiled {
    /// Seconds of all.
    pub(crate) fn total(&self) -> f64 {
        1e-3 * self.planning_millis + self.stages.median + self.drawing.median
    }
}

/// Builds the pyramid of an elevation model into a folder that goes away, and plans every station.
pub(crate) fn measure(
    dem_file: &Path,
    stations: &[Station],
    error_px: f64,
    runs: usize,
) -> Result<Vec<Tiled>> {
    let folder = tempfile::tempdir().context("making a folder for the pyramid")?;
    let output = folder.path().join("ground.zarr");
    let raster = dem::open(dem_file, &OpenOptions::default())?;
    let options = BuildOptions {
        output: output.clone(),
        ..BuildOptions::default()
    };
    build(&*raster, None, &options, &|_| (), &AtomicBool::new(false))?;
    let source = Arc::new(PyramidSource::open(&output)?);
    let unit = source.pyramid().metadata().unit() as f32;
    let descriptor = PlannerDescriptor {
        ram_budget_bytes: 3 << 30,
        vram_budget_bytes: 3 << 30,
        error_px,
        outside: 1.0,
        wait_for_tiles: true,
        prefetch_seconds: 0.0,
        ..PlannerDescriptor::default()
    };
    let mut planner = Planner::new(source, descriptor)?;
    let slots = planner.pool().slots as usize;
    let mut pool = Pool {
        words: vec![0; slots * SLOT_WORDS],
        unit,
    };
    let mut tiled = Vec::new();
    for station in stations {
        tiled.push(pool.measure(&mut planner, station, runs)?);
    }
    Ok(tiled)
}

/// The tile pool as the device would hold it.
struct Pool {
    words: Vec<u32>,
    unit: f32,
}

impl Pool {
    fn measure(&mut self, planner: &mut Planner, station: &Station, runs: usize) -> Result<Tiled> {
        let view = station.view();
        let (plan, _) = planner.plan(&view);
        self.upload(&plan);
        // Again, with nothing left to fetch.
        let (mut plan, stats) = planner.plan(&view);
        self.upload(&plan);
        ensure!(
            stats.tiles_missing == 0,
            "{} tiles are missing",
            stats.tiles_missing
        );
        for tile in &mut plan.drawn {
            tile.flags |= TILE_VISIBLE;
        }
        let mut frame = plan.frame.context("a valid view gives a frame")?;
        let page = SLOTS_PER_PAGE as usize * SLOT_WORDS;
        let mut parts = self.words.chunks(page);
        let pages = std::array::from_fn(|_| parts.next().unwrap_or(&[]));
        let patch_count = plan.drawn.len() * PATCH_COUNT;
        let [mut depths, mut raised, mut patches] = [0, 1, 2].map(|_| vec![0; patch_count]);
        let (stages, indices) = clocked_median_of(Clock::Thread, runs, || {
            depth::depth(&frame, &plan.drawn, &pages, &mut depths);
            balance::balance(&frame, &plan.drawn, &depths, &mut raised, &mut patches);
            let mut draw_list = vec![0; DRAW_LIST_WORDS];
            emit::count(&frame, &plan.drawn, &patches, &mut draw_list);
            frame.index_capacity = draw_list[SHIFT_COUNTS_WORD];
            let mut indices = vec![0; frame.index_capacity as usize];
            emit::write(
                &frame,
                &plan.drawn,
                &pages,
                &patches,
                &mut draw_list,
                &mut indices,
            );
            indices.truncate(draw_list[INDEX_COUNT_WORD] as usize);
            indices
        });
        let mut vertices = indices.clone();
        vertices.sort_unstable();
        vertices.dedup();
        let (drawing, ()) = clocked_median_of(Clock::Thread, runs, || {
            for &vertex in &vertices {
                std::hint::black_box(draw::vertex_position(&frame, &plan.drawn, &pages, vertex));
            }
        });
        Ok(Tiled {
            along: station.along,
            tiles: plan.drawn.len() as u64,
            patches: patch_count as u64,
            triangles: indices.len() as u64 / 3,
            points: vertices.len() as u64,
            bytes: 4 * (u64::from(stats.slots_used) * SLOT_WORDS as u64 + indices.len() as u64),
            tolerance_px: stats.tolerance_px,
            planning_millis: stats.update_millis,
            stages,
            drawing,
        })
    }

    /// Decodes what a plan brings.
    fn upload(&mut self, plan: &FramePlan) {
        let mut staging = vec![0; UPLOAD_WORDS];
        for upload in &plan.uploads {
            decode::stage_tile(&upload.tile, &mut staging);
            let first = upload.slot as usize * SLOT_WORDS;
            let header = UploadHeader {
                slot: 0,
                quantum: upload.tile.step,
                unit: self.unit,
                reserved: 0,
                step: upload.step,
                reserved_2: [0.0; 2],
            };
            decode::decode(
                &mut self.words[first..first + SLOT_WORDS],
                &[header],
                &staging,
            );
        }
    }
}
