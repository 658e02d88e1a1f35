//! Builds a pyramid from a raster: up fitting samples, down quantising cages, up again measuring true errors, out.
//!
//! ```text
//! sample ─▶ voids ─▶ fit (samples, cages) ─▶ quantise ─▶ levels::settle ─▶ measure ─▶ records ─▶ PyramidWriter
//!                                                                          color ──────────────▶
//! ```
//!
//! Everything that decides bytes is integers or a fixed order of float operations, so they do not depend on threads.
//! Holds all levels in memory, each as one array. Knows rasters and tiles; knows no screen.

mod color;
mod features;
mod fit;
mod levels;
mod measure;
mod options;
mod quantise;
mod records;
mod sample;
mod samples;
mod scale;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers")]
mod tests;
mod voids;

use std::sync::atomic::AtomicBool;
use std::time::Instant;

pub use options::{BuildOptions, BuildReport, Imagery, Progress, Stage};

use self::features::Features;
use self::levels::Levels;
use self::measure::Finest;
use self::options::Watch;
use self::records::{measure_all, write_all};
use self::scale::Scale;
use super::{Metadata, PyramidError, PyramidWriter, ShardInfo};
use crate::dem::Raster;
use crate::geo::Grid;

/// Bytes a thread needs for itself, and bytes that are needed whatever the raster.
const THREAD_BYTES: u64 = 4 << 20;
const FIXED_BYTES: u64 = 32 << 20;

/// Builds a pyramid.
///
/// `progress` is called often and from any thread. When `cancel` becomes true the build stops at the next shard, strip
/// or level; what it has written is gone on with by the next run with the same options, where sources are named.
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
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads.unwrap_or(0))
        .build()
        .map_err(|error| {
            PyramidError::Refused(format!("the threads could not be started: {error}"))
        })?;
    let writer = PyramidWriter::resume(&options.output, options.overwrite, &plan.fingerprint)?;
    let watch = Watch::new(progress, cancel);
    let made = pool.install(|| plan.run(raster, imagery, options, &writer, &watch));
    match made {
        Ok((metadata, shards, report)) => {
            writer.publish(&metadata, &shards)?;
            Ok(BuildReport {
                seconds: start.elapsed().as_secs_f64(),
                ..report
            })
        }
        Err(error) => {
            let resumable = matches!(error, PyramidError::Interrupted | PyramidError::Io { .. });
            if !resumable || plan.fingerprint.is_empty() {
                writer.discard()?;
            }
            Err(error)
        }
    }
}

/// What is settled before anything is read.
struct Plan {
    grid: Grid,
    scale: Scale,
    memory_bytes: u64,
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
        let memory_bytes = memory_bytes(&grid, imagery, options);
        if let Some(budget) = options
            .memory_budget
            .filter(|budget| *budget < memory_bytes)
        {
            return Err(PyramidError::Refused(format!(
                "building {} x {} samples takes about {} MiB of memory; the budget is {} MiB",
                grid.rows,
                grid.columns,
                memory_bytes.div_ceil(1 << 20),
                budget >> 20
            )));
        }
        let fingerprint = if options.sources.is_empty() {
            String::new()
        } else {
            fingerprint(raster, imagery, options, &scale)
        };
        Ok(Self {
            grid,
            scale,
            memory_bytes,
            fingerprint,
        })
    }

    fn run(
        &self,
        raster: &dyn Raster,
        imagery: Option<&Imagery<'_>>,
        options: &BuildOptions,
        writer: &PyramidWriter,
        watch: &Watch<'_>,
    ) -> Result<(Metadata, Vec<ShardInfo>, BuildReport), PyramidError> {
        let (grid, unit) = (&self.grid, self.scale.unit());
        let levels = Levels::new(raster, &self.scale, watch)?;
        let features = Features::new(&options.features, &levels, raster.header(), unit)?;
        let measures = measure_all(&levels, grid, unit, &features, watch)?;
        let mut shards = write_all(&levels, &measures, grid, writer, watch)?;
        let finest = &levels.samples[levels.samples.len() - 1];
        let data = [grid.rows, grid.columns].map(|count| count as usize);
        let height_range = Finest::new(finest, data).range();
        let root_error = f64::from(measures[0][0].summary.error);
        let mut report = self.report(options, &shards, root_error);
        report.void_samples = finest.void_count(data);
        let feature_shards = features.write(grid, writer)?;
        report.features = features.count();
        report.feature_bytes = feature_shards.iter().map(|info| info.bytes).sum();
        shards.extend(feature_shards);
        let levels = { levels }.levels;
        let color = imagery
            .map(|imagery| color::write(imagery, grid, writer, watch))
            .transpose()?
            .map(|(color, infos)| {
                report.color_levels = color.levels;
                report.color_bytes = infos.iter().map(|info| info.bytes).sum();
                shards.extend(infos);
                color
            });
        let metadata = Metadata {
            version: Metadata::VERSION,
            grid: *grid,
            crs: raster.header().crs.clone(),
            vertical: options.vertical,
            unit_exponent: self.scale.unit_exponent,
            eps: self.scale.eps,
            height_range,
            levels,
            color,
            features: features.metadata(),
            sources: options.sources.clone(),
        };
        Ok((metadata, shards, report))
    }

    fn report(&self, options: &BuildOptions, shards: &[ShardInfo], root_error: f64) -> BuildReport {
        let grid = &self.grid;
        let level_bytes: Vec<u64> = (0..grid.level_count())
            .map(|level| {
                let prefix = format!("tile/{level}/");
                shards
                    .iter()
                    .filter(|info| info.key.starts_with(&prefix))
                    .map(|info| info.bytes)
                    .sum()
            })
            .collect();
        BuildReport {
            samples: [grid.rows, grid.columns],
            source_bytes: options.sources.iter().map(|source| source.bytes).sum(),
            levels: grid.level_count(),
            tiles: shards.iter().map(|info| u64::from(info.chunks)).sum(),
            eps: self.scale.eps,
            unit: self.scale.unit(),
            root_error,
            height_bytes: level_bytes.iter().sum(),
            level_bytes,
            memory_bytes: self.memory_bytes,
            ..BuildReport::default()
        }
    }
}

/// The memory a build takes at its peak, in bytes.
fn memory_bytes(grid: &Grid, imagery: Option<&Imagery<'_>>, options: &BuildOptions) -> u64 {
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads) as u64;
    let imagery = imagery.map_or(0, |imagery| {
        3 * imagery.image.rgb.len() as u64 + color::memory_bytes(imagery.image, grid)
    });
    // A thread reads 64 rows at a time.
    let strip = 64 * 8 * u64::from(grid.columns);
    FIXED_BYTES + threads * (THREAD_BYTES + strip) + Levels::memory_bytes(grid) + imagery
}

/// One line that says all that decides the bytes: an interrupted build of the same is gone on with.
fn fingerprint(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
    scale: &Scale,
) -> String {
    let header = raster.header();
    let imagery = imagery.map(|imagery| (&imagery.sources, imagery.image.extent));
    let version = env!("CARGO_PKG_VERSION");
    format!(
        "{version} {:?} {:?} {:?} {:?} {imagery:?} {}",
        header.grid,
        header.crs,
        scale,
        options.sources,
        features::fingerprint(&options.features)
    )
    .replace('\n', " ")
}
