//! A build as tasks for many processes, on one machine or on many that see the same files: listed, done one at a time in
//! whichever order the passes allow, and finished.
//!
//! ```text
//! plan_tasks ─▶ run_task … run_task ─▶ finish        =  build, in one process
//! ```
//!
//! Tasks leave their marks in `OUT.building`, so nothing but that folder and the inputs has to be shared, and a task
//! that is done does nothing when it is run again.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde::Serialize;

use super::options::{BuildOptions, BuildReport, Imagery, Progress, Watch};
use super::plan::Shape;
use super::records::shards;
use super::tasks::{Pass, Want};
use super::{Plan, finished, graph};
use crate::dem::Raster;
use crate::geo::Grid;
use crate::pyramid::{PyramidError, PyramidWriter, zarr};

/// A task of a build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedTask {
    /// Its number, from 0.
    pub task: usize,
    /// The pass it is part of.
    pub pass: String,
    /// The pass of which all tasks must be done before.
    pub needs: Option<String>,
    /// What it reads: `inputs`, `imagery`, or planes in `OUT.building/scratch`.
    pub reads: Vec<String>,
    /// What it writes: planes there (a part of each), or shards and arrays of the pyramid.
    pub writes: Vec<String>,
    /// Memory it takes on one thread, in bytes.
    pub memory_bytes: u64,
    /// How long it takes beside others: about nanoseconds on one thread of a machine of 2020.
    pub weight: u64,
}

/// Lists the tasks of a build, and makes the folder in which they are done; what an earlier plan or build of the same
/// has done there is kept.
///
/// # Errors
/// As [`super::build`]; [`PyramidError::Refused`] where the sources are not named.
pub fn plan_tasks(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
) -> Result<Vec<PlannedTask>, PyramidError> {
    let plan = Plan::new(raster, imagery, options)?;
    if plan.fingerprint.is_empty() {
        return Err(PyramidError::Refused(
            "only a build of named sources can be planned".into(),
        ));
    }
    let alone = BuildOptions {
        threads: Some(1),
        ..options.clone()
    };
    let memory_bytes = Shape::new(raster, imagery, &alone)?.memory_bytes;
    let passes = graph::passes(raster, imagery, !options.features.is_empty());
    PyramidWriter::resume(&options.output, options.overwrite, &plan.fingerprint)?;
    let mut tasks = Vec::new();
    let mut needs: Option<String> = None;
    for pass in passes.iter().filter(|pass| pass.tasks > 0) {
        for index in 0..pass.tasks {
            tasks.push(PlannedTask {
                task: tasks.len(),
                pass: pass.name.clone(),
                needs: needs.clone(),
                reads: pass.reads.clone(),
                writes: writes(pass, index, &plan.grid),
                memory_bytes,
                weight: pass.samples / pass.tasks as u64 * graph::nanos(&pass.name),
            });
        }
        needs = Some(pass.name.clone());
    }
    Ok(tasks)
}

/// What one task of a pass writes: of shards, its own.
fn writes(pass: &Pass, index: usize, grid: &Grid) -> Vec<String> {
    let level = pass.name.strip_prefix("write-");
    match level.and_then(|level| level.parse().ok()) {
        Some(level) => {
            let shard = shards(grid, level)[index];
            let key = zarr::shard_key(&format!("tile/{level}"), shard, 1);
            [key].into_iter().chain(pass.writes.clone()).collect()
        }
        None => pass.writes.clone(),
    }
}

/// Does one task of a build that was planned, where it is not done already: the passes before are.
///
/// # Errors
/// As [`super::build`]; [`PyramidError::Refused`] where there is no such task, where one that it needs is not done, or
/// where what is planned there is something else.
pub fn run_task(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
    task: usize,
    (progress, cancel): (&(dyn Fn(Progress) + Sync), &AtomicBool),
) -> Result<(), PyramidError> {
    let plan = Plan::new(raster, imagery, options)?;
    if finished::report(&options.output, &plan.fingerprint).is_some() {
        return Ok(());
    }
    let passes = graph::passes(raster, imagery, !options.features.is_empty());
    let count: usize = passes.iter().map(|pass| pass.tasks).sum();
    if task >= count {
        return Err(PyramidError::Refused(format!(
            "there is no task {task}; they are numbered from 0 to {}",
            count - 1
        )));
    }
    let writer = PyramidWriter::join(&options.output, options.overwrite, &plan.fingerprint, false)?;
    let watch = Watch::new(progress, cancel);
    let want = (writer, Want::Task(task));
    plan.carry_out(raster, imagery, options, want, &watch)?;
    Ok(())
}

/// Publishes a pyramid of which all tasks are done.
///
/// # Errors
/// As [`super::build`]; [`PyramidError::Refused`] naming a task that is not done.
pub fn finish(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
) -> Result<BuildReport, PyramidError> {
    let start = Instant::now();
    let plan = Plan::new(raster, imagery, options)?;
    if let Some(report) = finished::report(&options.output, &plan.fingerprint) {
        return Ok(report);
    }
    let writer = PyramidWriter::join(&options.output, options.overwrite, &plan.fingerprint, true)?;
    let cancel = AtomicBool::new(false);
    let watch = Watch::new(&|_| (), &cancel);
    let report = plan.carry_out(raster, imagery, options, (writer, Want::Finish), &watch)?;
    Ok(BuildReport {
        seconds: start.elapsed().as_secs_f64(),
        ..report.unwrap_or_default()
    })
}
