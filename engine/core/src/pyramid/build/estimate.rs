//! What a build would do, told without doing it: its tasks, and time and bytes from building a few small windows.

use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::area::Blocks;
use super::border::plane_size;
use super::levels::{fit_blocks, tile_count};
use super::options::{BuildOptions, Imagery, Stage};
use super::plan::Shape;
use super::{Plan, build, color, errors, read};
use crate::dem::{DemError, Raster, RasterHeader, Window};
use crate::geo::{Grid, TILE_CELLS};
use crate::pyramid::files::remove_folder;
use crate::pyramid::writer::check_target;
use crate::pyramid::{PyramidError, shard_count};

/// Samples a side of a window that is built to see what a tile takes: eight tiles.
const SAMPLE_SIDE: u32 = 8 * 128 + 1;
/// So many windows are built, spread over the raster's diagonal.
const SAMPLE_COUNT: u32 = 3;

/// What a build would do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuildPlan {
    /// Rows and columns of finest samples.
    pub samples: [u32; 2],
    /// Levels of heights.
    pub levels: u8,
    /// Tiles of all levels.
    pub tiles: u64,
    /// Threads, each with a task of its own.
    pub threads: usize,
    /// Tiles a side of a task's block.
    pub block_tiles: usize,
    /// Memory at the peak, in bytes.
    pub memory_bytes: u64,
    /// Files beside the output at the peak, in bytes, besides the pyramid.
    pub scratch_bytes: u64,
    /// The passes, in order; each starts when the one before is done, a level at a time.
    pub passes: Vec<PassPlan>,
    /// Bytes of heights, estimated; none where all windows that were tried are void.
    pub height_bytes: Option<u64>,
    /// Wall time in seconds, estimated likewise.
    pub seconds: Option<f64>,
}

/// One pass of a build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassPlan {
    /// What it does.
    pub name: &'static str,
    /// Its tasks: windows, blocks or shards.
    pub tasks: u64,
    /// Tiles they make or measure.
    pub tiles: u64,
}

/// Plans a build: the same plan that [`build`] goes by.
///
/// Three windows of 1025 × 1025 samples are built in the system's folder for temporary files and removed again, for the
/// estimates; that stops when `cancel` becomes true. Not tried are the rest of the raster (damage or a height out of
/// range there shows when it is built), features, imagery, and whether the output's disk has room. The times are of
/// this disk and of one thread at work, divided by the threads.
///
/// # Errors
/// As [`build`], as far as it is tried.
pub fn plan(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    options: &BuildOptions,
    cancel: &AtomicBool,
) -> Result<BuildPlan, PyramidError> {
    check_target(&options.output, options.overwrite)?;
    let Plan { grid, shape, .. } = Plan::new(raster, imagery, options)?;
    let estimate = estimate(raster, options, cancel)?;
    let finest = tile_count(&grid, grid.level_count() - 1) as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an estimate of bytes"
    )]
    let height_bytes = estimate.map(|[bytes, _]| (bytes * finest) as u64);
    Ok(BuildPlan {
        samples: [grid.rows, grid.columns],
        levels: grid.level_count(),
        tiles: (0..grid.level_count())
            .map(|level| tile_count(&grid, level))
            .sum(),
        threads: shape.threads,
        block_tiles: shape.block_tiles,
        memory_bytes: shape.memory_bytes,
        scratch_bytes: scratch_bytes(&grid),
        passes: passes(raster, imagery, &grid, &shape),
        height_bytes,
        seconds: estimate.map(|[_, seconds]| seconds * finest / shape.threads as f64),
    })
}

fn passes(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    grid: &Grid,
    shape: &Shape,
) -> Vec<PassPlan> {
    let side = shape.block_side();
    let finest = grid.level_count() - 1;
    let settled = |level: u8| {
        let size = grid
            .tiles(level)
            .map(|count| count as usize * TILE_CELLS + 1);
        Blocks::new(size, side).count() as u64
    };
    let shards = |levels: std::ops::Range<u8>| -> u64 {
        levels
            .map(|level| shard_count(grid.tiles(level)).map(u64::from))
            .map(|[rows, columns]| rows * columns)
            .sum()
    };
    let pass = |stage: Stage, levels: std::ops::Range<u8>, tasks: u64| PassPlan {
        name: stage.label(),
        tasks,
        tiles: levels.map(|level| tile_count(grid, level)).sum(),
    };
    let all = 0..finest + 1;
    let mut passes = vec![
        pass(
            Stage::Read,
            finest..finest + 1,
            read::window_count(raster, shape.window_samples),
        ),
        pass(
            Stage::Fit,
            0..finest,
            (0..finest)
                .map(|level| fit_blocks(grid, level, side).count() as u64)
                .sum(),
        ),
        pass(Stage::Encode, all.clone(), all.clone().map(settled).sum()),
        pass(Stage::Measure, 0..finest, errors::block_count(grid)),
        pass(Stage::Write, all.clone(), shards(all)),
    ];
    if let Some(imagery) = imagery {
        let levels = 0..color::level_count(imagery, grid);
        passes.push(pass(Stage::Color, levels.clone(), shards(levels)));
    }
    passes
}

/// Bytes of planes at the end: all levels' samples as fitted and as settled, cages and errors; without the halved planes
/// that voids take.
fn scratch_bytes(grid: &Grid) -> u64 {
    let plane = |level: u8| -> u64 {
        let size = plane_size(grid, level).map(|count| count as u64);
        4 * size[0] * size[1]
    };
    let all: u64 = (0..grid.level_count()).map(plane).sum();
    2 * all + all / 8
}

/// Bytes and seconds of one thread a finest tile takes, those of all levels above it included.
fn estimate(
    raster: &dyn Raster,
    options: &BuildOptions,
    cancel: &AtomicBool,
) -> Result<Option<[f64; 2]>, PyramidError> {
    let grid = raster.header().grid;
    let folder = Temporary::new()?;
    let options = BuildOptions {
        output: folder.0.join("window"),
        overwrite: true,
        threads: Some(1),
        sources: Vec::new(),
        features: Vec::new(),
        ..options.clone()
    };
    let (mut tiles, mut sums) = (0.0, [0.0, 0.0]);
    for index in 0..SAMPLE_COUNT {
        let part = Part::new(raster, SAMPLE_SIDE, [index, SAMPLE_COUNT - 1]);
        let level = part.header.grid.level_count() - 1;
        let report = match build(&part, None, &options, &|_| (), cancel) {
            Ok(report) => report,
            // A window without any height tells nothing.
            Err(PyramidError::Unfit(_)) if part.is_void()? => continue,
            Err(error) => return Err(error),
        };
        tiles += tile_count(&part.header.grid, level) as f64;
        sums[0] += report.height_bytes as f64;
        sums[1] += report.seconds;
        if part.window == Window::whole(&grid) {
            break;
        }
    }
    Ok((tiles > 0.0).then(|| sums.map(|sum| sum / tiles)))
}

/// A new folder of the system's for temporary files, removed when it is dropped.
struct Temporary(PathBuf);

impl Temporary {
    fn new() -> Result<Self, PyramidError> {
        let (all, process) = (std::env::temp_dir(), std::process::id());
        for number in 0_u32.. {
            let folder = all.join(format!("drumlin-dry-run-{process}-{number}"));
            match fs::create_dir(&folder) {
                Ok(()) => return Ok(Self(folder)),
                // Another's: what is there is never touched.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(PyramidError::io("creating", folder)(error)),
            }
        }
        Err(PyramidError::Refused(format!(
            "{}: is full of dry runs",
            all.display()
        )))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // What cannot be removed is the system's to clear, as all in that folder.
        let _ = remove_folder(&self.0);
    }
}

/// A window of a raster.
struct Part<'a> {
    raster: &'a dyn Raster,
    header: RasterHeader,
    window: Window,
}

impl<'a> Part<'a> {
    /// A square window as far along the diagonal as index is of count.
    fn new(raster: &'a dyn Raster, side: u32, [index, count]: [u32; 2]) -> Self {
        let mut header = raster.header().clone();
        let place = |all: u32| {
            let rest = u64::from(all.saturating_sub(side));
            u32::try_from(rest * u64::from(index) / u64::from(count)).unwrap_or(0)
        };
        let grid = &mut header.grid;
        let window = Window {
            row: place(grid.rows),
            column: place(grid.columns),
            rows: side.min(grid.rows),
            columns: side.min(grid.columns),
        };
        grid.origin = grid.position(f64::from(window.row), f64::from(window.column));
        [grid.rows, grid.columns] = [window.rows, window.columns];
        Self {
            raster,
            header,
            window,
        }
    }

    fn is_void(&self) -> Result<bool, DemError> {
        let grid = &self.header.grid;
        let mut heights = vec![0.0; grid.rows as usize * grid.columns as usize];
        self.read(Window::whole(grid), &mut heights)?;
        Ok(heights.iter().all(|height| !height.is_finite()))
    }
}

impl Raster for Part<'_> {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let inside = Window {
            row: window.row + self.window.row,
            column: window.column + self.window.column,
            ..window
        };
        self.raster.read(inside, out)
    }

    fn part_shape(&self) -> [u32; 2] {
        self.raster.part_shape()
    }

    fn memory_bytes(&self) -> u64 {
        self.raster.memory_bytes()
    }

    fn read_bytes(&self, samples: u64) -> u64 {
        self.raster.read_bytes(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Field, hills};
    use super::*;

    fn options(folder: &std::path::Path) -> BuildOptions {
        BuildOptions {
            output: folder.join("out"),
            threads: Some(2),
            ..BuildOptions::default()
        }
    }

    #[test]
    fn a_plan_is_what_the_build_does_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let options = options(folder.path());
        let raster = Field::new(1500, 1300, hills);
        let plan = plan(&raster, None, &options, &AtomicBool::new(false)).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        let report = build(&raster, None, &options, &|_| (), &AtomicBool::new(false)).unwrap();
        assert_eq!(
            (plan.tiles, plan.levels, plan.memory_bytes),
            (report.tiles, report.levels, report.memory_bytes)
        );
        // The same hills everywhere, but windows are of whole tiles: 64, with 21 above them and 4 shards' indices of
        // 16 KiB. The whole has 132 tiles with data for 119 of them, 50 above and 5 indices; its tiles take about 7 kB.
        // So the estimate misses 182/132 : 85/64 = 1.04 above, and adds 132/119 = 1.11 at the border, and at most
        // 64 KiB in 85 · 7 kB for indices less 80 KiB in 182 · 7 kB, 1.05.
        let ratio = plan.height_bytes.unwrap() as f64 / report.height_bytes as f64;
        assert!((1.0 / 1.04..1.11 * 1.05).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_raster_void_where_it_is_tried_has_a_plan_without_estimates() {
        let folder = tempfile::tempdir().unwrap();
        let raster = Field::new(4200, 40, |row, _| if row == 1100 { 5.0 } else { f64::NAN });
        let plan = plan(
            &raster,
            None,
            &options(folder.path()),
            &AtomicBool::new(false),
        )
        .unwrap();
        assert_eq!((plan.height_bytes, plan.seconds), (None, None));
        assert_eq!(plan.passes.len(), 5);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_plan_refuses_what_the_build_refuses_and_touches_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let options = options(folder.path());
        let raster = Field::new(60, 70, hills);
        let planned = |options: &BuildOptions, cancel: bool| {
            plan(&raster, None, options, &AtomicBool::new(cancel)).map(|_| ())
        };
        // Something of the user's with a likely name.
        let mine = BuildOptions {
            output: folder.path().join("out.dry-run"),
            ..options.clone()
        };
        build(&raster, None, &mine, &|_| (), &AtomicBool::new(false)).unwrap();
        planned(&options, false).unwrap();
        let stopped = planned(&options, true);
        assert!(matches!(stopped, Err(PyramidError::Interrupted)));
        let refused = planned(&mine, false);
        assert!(matches!(refused, Err(PyramidError::Refused(_))));
        let overwrite = BuildOptions {
            overwrite: true,
            ..mine.clone()
        };
        planned(&overwrite, false).unwrap();
        assert!(mine.output.join("zarr.json").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
