//! Builds a pyramid from a raster: up fitting samples, down quantising cages, up again measuring true errors, out.
//!
//! ```text
//! read ─▶ voids ─▶ fit (samples, cages) ─▶ quantise ─▶ levels::settle ─▶ errors ─▶ records ─▶ PyramidWriter
//!                                                                       color ──────────────▶
//! ```
//!
//! Passes go over planes on the disk, block by block; what a block becomes is a function of the planes around it and not
//! of how a plane is cut, in integers or a fixed order of float operations. So neither memory depends on the raster's
//! size, nor bytes on memory or threads. Knows rasters and tiles; knows no screen.

mod area;
mod border;
mod color;
mod distribute;
mod errors;
mod estimate;
mod features;
mod finished;
mod fit;
mod graph;
mod ground;
mod inputs;
mod journal;
mod levels;
mod measure;
mod options;
mod passes;
mod plan;
mod planes;
mod quantise;
mod read;
mod records;
mod samples;
mod scale;
mod scratch;
mod tasks;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers")]
mod tests;
mod voids;

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

pub use distribute::{PlannedTask, finish, plan_tasks, run_task};
pub use estimate::{BuildPlan, PassPlan, plan};
pub use inputs::InputStamp;
pub use options::{BuildOptions, BuildReport, Imagery, Progress, Stage};

use self::errors::Errors;
use self::features::Features;
use self::journal::{Journal, Made};
use self::levels::Levels;
use self::options::Watch;
use self::plan::Shape;
use self::records::Records;
use self::scale::Scale;
use self::tasks::{Job, Tasks, Want};
use super::{BuildMetadata, ColorMetadata, Metadata, PyramidError, PyramidWriter, ShardInfo};
use crate::dem::{DemError, Image, Raster};
use crate::geo::Grid;

/// The version of the builder's arithmetic: to be raised with every change after which the same input gives other
/// bytes, so that no build is gone on with by a builder that would have made it otherwise.
const BUILDER: u32 = 2;

/// Builds a pyramid.
///
/// `progress` is called often and from any thread. When `cancel` becomes true the build stops at the next window, block
/// or shard; what it has done is kept by the next run with the same options, where sources are named.
///
/// # Errors
/// [`PyramidError::Refused`] for options that cannot be met or an output that is something else;
/// [`PyramidError::Unfit`] for heights out of range, a raster that is all void, or features that cannot be laid;
/// [`PyramidError::Dem`] where an input fails; [`PyramidError::Io`] where writing does; [`PyramidError::Interrupted`].
/// Nothing is called by the output's name unless it is whole.
pub fn build(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
    progress: &(dyn Fn(Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<BuildReport, PyramidError> {
    let start = Instant::now();
    let plan = Plan::new(raster, imagery, options)?;
    if !options.overwrite
        && let Some(report) = finished::report(&options.output, &plan.fingerprint)
    {
        return Ok(report);
    }
    let writer = PyramidWriter::resume(&options.output, options.overwrite, &plan.fingerprint)?;
    let watch = Watch::new(progress, cancel);
    if writer.started_over() {
        drop(watch.stage(Stage::StartOver, 0));
    }
    let report = plan.carry_out(raster, imagery, options, (writer, Want::Whole), &watch)?;
    Ok(BuildReport {
        seconds: start.elapsed().as_secs_f64(),
        ..report.unwrap_or_default()
    })
}

/// What is settled before anything is read.
struct Plan {
    grid: Grid,
    scale: Scale,
    shape: Shape,
    fingerprint: String,
}

impl Plan {
    fn new(
        raster: &dyn Raster,
        imagery: Option<&Imagery<'_>>,
        options: &BuildOptions,
    ) -> Result<Self, PyramidError> {
        let header = raster.header();
        let grid = header.grid;
        let scale = Scale::new(options.eps, options.unit, header.integer)?;
        let shape = Shape::new(raster, imagery, options)?;
        let fingerprint = if options.sources.is_empty() {
            String::new()
        } else {
            fingerprint(raster, imagery, options, &scale)
        };
        Ok(Self {
            grid,
            scale,
            shape,
            fingerprint,
        })
    }

    /// Does what is wanted; a report where that is a pyramid.
    fn carry_out(
        &self,
        raster: &dyn Raster,
        imagery: Option<&Imagery<'_>>,
        options: &BuildOptions,
        (writer, want): (PyramidWriter, Want),
        watch: &Watch<'_>,
    ) -> Result<Option<BuildReport>, PyramidError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.shape.threads)
            .build()
            .map_err(|error| {
                PyramidError::Refused(format!("the threads could not be started: {error}"))
            })?;
        let tasks = Tasks {
            passes: graph::passes(raster, imagery, !options.features.is_empty()),
            want,
            folder: writer.folder().to_owned(),
            watch,
            journal: Journal::new(writer.journal()),
            kept: AtomicUsize::new(0),
            done: AtomicBool::new(false),
        };
        let made = pool.install(|| {
            let made = self.run(raster, imagery, options, &writer, &tasks);
            match (&made, tasks.done.load(Ordering::Relaxed)) {
                (Ok(_), _) | (_, true) => inputs::check(&options.inputs).and(made),
                _ => made,
            }
        });
        match made {
            Ok(_) if matches!(want, Want::Task(_)) => Ok(None),
            Ok((metadata, shards, report)) => {
                if want == Want::Finish {
                    check_there(writer.folder(), &shards)?;
                }
                writer.publish(&metadata, &shards)?;
                Ok(Some(BuildReport {
                    memory_bytes: self.shape.memory_bytes,
                    kept_tasks: tasks.kept.load(Ordering::Relaxed),
                    ..report
                }))
            }
            Err(PyramidError::Interrupted) if tasks.done.load(Ordering::Relaxed) => Ok(None),
            Err(error) => {
                let resumable = matches!(
                    error,
                    PyramidError::Interrupted
                        | PyramidError::Io { .. }
                        | PyramidError::Dem(DemError::Io { .. })
                );
                if want == Want::Whole && (!resumable || self.fingerprint.is_empty()) {
                    // The first error is the one to tell; what cannot be removed now, the next run removes.
                    let _ = writer.discard();
                }
                Err(error)
            }
        }
    }

    fn run(
        &self,
        raster: &dyn Raster,
        imagery: Option<&Imagery<'_>>,
        options: &BuildOptions,
        writer: &PyramidWriter,
        tasks: &Tasks<'_>,
    ) -> Result<(Metadata, Vec<ShardInfo>, BuildReport), PyramidError> {
        let (grid, unit) = (&self.grid, self.scale.unit());
        let scratch = writer.scratch();
        let levels = Levels::new(raster, &self.scale, &self.shape, &scratch, tasks)?;
        let errors = Errors::measure(&levels, grid, &scratch, tasks)?;
        let features = Features::new(&options.features, &levels, raster.header(), unit)?;
        let records = Records {
            levels: &levels,
            errors: &errors,
            features: &features,
            grid,
            unit,
        };
        let (mut shards, root_error) = records.write(writer, &scratch, tasks)?;
        let height_range = errors.height_range;
        shards.extend(features.write(grid, writer, tasks)?);
        let color = imagery
            .map(|imagery| self.color(imagery, writer, tasks))
            .transpose()?
            .map(|(color, infos)| {
                shards.extend(infos);
                color
            });
        let build = BuildMetadata {
            key: finished::key(&self.fingerprint),
            void_samples: levels.void_count,
            root_error: f64::from(root_error),
        };
        let mut metadata = Metadata {
            version: Metadata::VERSION,
            grid: *grid,
            crs: raster.header().crs.clone(),
            vertical: options.vertical,
            unit_exponent: self.scale.unit_exponent,
            eps: self.scale.eps,
            height_range,
            levels: levels.levels,
            color,
            features: features.metadata(),
            sources: options.sources.clone(),
            build: None,
        };
        let report = finished::of(&metadata, &build, &shards);
        metadata.build = (!self.fingerprint.is_empty()).then_some(build);
        Ok((metadata, shards, report))
    }

    /// The imagery: one task, whose shards are kept by the writer where it is interrupted.
    fn color(
        &self,
        imagery: &Imagery<'_>,
        writer: &PyramidWriter,
        tasks: &Tasks<'_>,
    ) -> Result<(ColorMetadata, Vec<ShardInfo>), PyramidError> {
        let job = Job {
            pass: "color",
            planes: &[],
            in_turn: true,
            advance: &|_| Ok(()),
        };
        let work = |()| {
            let (color, shards) = color::write(imagery, &self.grid, writer, tasks.watch)?;
            Ok(Made {
                shards,
                ..Made::new(Some(color), [])
            })
        };
        let made = tasks.run(&job, |_| vec![()], work, Option::or)?;
        let color = made.found.ok_or_else(|| {
            PyramidError::Refused("the imagery of an earlier run was not understood".into())
        })?;
        Ok((color, made.shards))
    }
}

/// Says which shard is not there, or not of its size.
fn check_there(folder: &Path, shards: &[ShardInfo]) -> Result<(), PyramidError> {
    let there = |shard: &&ShardInfo| {
        fs::metadata(folder.join(&shard.key)).is_ok_and(|about| about.len() == shard.bytes)
    };
    match shards.iter().find(|shard| !there(shard)) {
        None => Ok(()),
        Some(shard) => Err(PyramidError::Invalid {
            path: folder.join(&shard.key),
            what: format!(
                "is to be a shard of {} bytes; do its task again",
                shard.bytes
            ),
        }),
    }
}

/// One line that says all that decides the bytes: an interrupted build of the same is gone on with.
fn fingerprint(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
    scale: &Scale,
) -> String {
    let header = raster.header();
    let extents = |images: &[Image]| images.iter().map(|image| image.extent).collect::<Vec<_>>();
    let imagery = imagery.map(|imagery| (&imagery.sources, extents(imagery.images), imagery.codec));
    format!(
        "builder {BUILDER} {:?} {:?} {} {scale:?} {:?} {:?} {imagery:?} {}",
        header.grid,
        header.crs,
        header.reading,
        options.vertical,
        options.sources,
        features::fingerprint(&options.features)
    )
    .replace('\n', " ")
}
