//! Two pyramids of one grid, compared height by height.
//!
//! Compares what the pyramids say, whatever their units, steps and files are. Imagery and features are not looked at.

use rayon::prelude::*;
use serde::Serialize;

use super::{LevelHeights, Pyramid, PyramidError};
use crate::dem::{Raster, Window};

/// Samples a side of what is compared at a time.
const BLOCK: u32 = 512;

/// In what a level of two pyramids differs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LevelDifference {
    /// The level, 0 the coarsest.
    pub level: u8,
    /// Samples that have a height in both.
    pub sample_count: u64,
    /// Samples whose heights differ.
    pub differing_count: u64,
    /// Samples that are void in one of the two only.
    pub void_count: u64,
    /// Mean distance of the heights of samples that have one in both, metres.
    pub mean: f64,
    /// The largest distance, metres.
    pub max: f64,
    /// CRS coordinates of the northmost, then westmost sample with the largest distance; none where all are equal.
    pub place: Option<[f64; 2]>,
}

impl LevelDifference {
    /// True where a height differs by more than `tolerance` metres, or a void by being one.
    #[must_use]
    pub fn passes(&self, tolerance: f64) -> bool {
        self.void_count > 0 || self.max > tolerance
    }
}

/// Compares two pyramids level by level, coarsest first, on the caller's threads. `progress` is told how many samples
/// of how many are compared.
///
/// # Errors
///
/// Refused where their grids or coordinates are not the same; where a tile of either cannot be read.
pub fn diff(
    a: &Pyramid,
    b: &Pyramid,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Vec<LevelDifference>, PyramidError> {
    check(a, b)?;
    let grid = &a.metadata().grid;
    let levels = 0..=a.metadata().finest();
    let samples = |level| Window::whole(&grid.at_level(level)).sample_count();
    let total = levels.clone().map(samples).sum();
    let mut done = 0;
    levels
        .map(|level| {
            let difference = diff_level(a, b, level, &|part| progress(done + part, total))?;
            done += samples(level);
            progress(done, total);
            Ok(difference)
        })
        .collect()
}

fn check(a: &Pyramid, b: &Pyramid) -> Result<(), PyramidError> {
    let [one, other] = [a.metadata(), b.metadata()];
    let what = if one.grid != other.grid {
        "grids"
    } else if !one.crs.same_as(&other.crs) {
        "coordinate systems"
    } else {
        return Ok(());
    };
    Err(PyramidError::Refused(format!(
        "{} and {} have different {what}: their heights cannot be compared sample by sample",
        a.store().name(""),
        b.store().name("")
    )))
}

fn diff_level(
    a: &Pyramid,
    b: &Pyramid,
    level: u8,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<LevelDifference, PyramidError> {
    let [a, b] = [LevelHeights::new(a, level)?, LevelHeights::new(b, level)?];
    let grid = &a.header().grid;
    let across = grid.columns.div_ceil(BLOCK);
    let mut whole = Sum::default();
    // A row of blocks at a time, summed in order, so that means do not depend on the number of threads.
    for row in 0..grid.rows.div_ceil(BLOCK) {
        let blocks: Result<Vec<Sum>, PyramidError> = (0..across)
            .into_par_iter()
            .map(|column| {
                let [row, column] = [row * BLOCK, column * BLOCK];
                let window = Window {
                    row,
                    column,
                    rows: BLOCK.min(grid.rows - row),
                    columns: BLOCK.min(grid.columns - column),
                };
                block(&a, &b, window)
            })
            .collect();
        for block in blocks? {
            whole.add(&block);
        }
        progress(u64::from(grid.columns) * u64::from(grid.rows.min((row + 1) * BLOCK)));
    }
    let place = whole
        .greatest
        .map(|(_, [row, column])| grid.position(f64::from(row), f64::from(column)));
    Ok(LevelDifference {
        level,
        sample_count: whole.samples,
        differing_count: whole.differing,
        void_count: whole.voids,
        mean: whole.distance / (whole.samples.max(1) as f64),
        max: whole.greatest.map_or(0.0, |(distance, _)| distance),
        place,
    })
}

#[derive(Default)]
struct Sum {
    samples: u64,
    differing: u64,
    voids: u64,
    distance: f64,
    /// The largest distance over 0, and the first row and column that has it.
    greatest: Option<(f64, [u32; 2])>,
}

impl Sum {
    fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.differing += other.differing;
        self.voids += other.voids;
        self.distance += other.distance;
        if let Some((distance, place)) = other.greatest {
            self.see(distance, place);
        }
    }

    fn see(&mut self, distance: f64, place: [u32; 2]) {
        let better = self.greatest.is_none_or(|(greatest, first)| {
            distance > greatest || (distance == greatest && place < first)
        });
        if better {
            self.greatest = Some((distance, place));
        }
    }
}

fn block(a: &LevelHeights<'_>, b: &LevelHeights<'_>, window: Window) -> Result<Sum, PyramidError> {
    let count = window.rows as usize * window.columns as usize;
    let [mut one, mut other] = [vec![0.0; count], vec![0.0; count]];
    a.heights(window, &mut one)?;
    b.heights(window, &mut other)?;
    let mut sum = Sum::default();
    for (at, (one, other)) in (0..).zip(one.into_iter().zip(other)) {
        match (one.is_nan(), other.is_nan()) {
            (true, true) => {}
            (false, false) => {
                let distance = f64::abs(one - other);
                sum.samples += 1;
                sum.distance += distance;
                if distance > 0.0 {
                    sum.differing += 1;
                    let place = [
                        window.row + at / window.columns,
                        window.column + at % window.columns,
                    ];
                    sum.see(distance, place);
                }
            }
            _ => sum.voids += 1,
        }
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        dem::Synth,
        pyramid::{
            build::{BuildOptions, build},
            sample,
        },
    };

    fn built(folder: &tempfile::TempDir, name: &str, seed: u64, rows: u32, eps: f64) -> Pyramid {
        let window = Window {
            row: 4000,
            column: 9000,
            rows,
            columns: 300,
        };
        let synth = Synth::new(seed, window).unwrap();
        let options = BuildOptions {
            output: folder.path().join(name),
            eps: Some(eps),
            ..BuildOptions::default()
        };
        build(&synth, None, &options, &|_| {}, &false.into()).unwrap();
        Pyramid::open(&options.output).unwrap()
    }

    #[test]
    fn a_pyramid_does_not_differ_from_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        sample::write(&path, 700, 300);
        let pyramid = Pyramid::open(&path).unwrap();
        let levels = diff(&pyramid, &pyramid, &|done, total| assert!(done <= total)).unwrap();
        assert_eq!(levels.len(), pyramid.metadata().levels.len());
        for level in levels {
            assert!(!level.passes(0.0) && level.place.is_none() && level.sample_count > 0);
        }
    }

    #[test]
    fn pyramids_of_one_source_differ_by_no_more_than_their_bounds() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = [("a", 0.25), ("b", 1.0)].map(|(name, eps)| built(&folder, name, 1, 400, eps));
        let levels = diff(&a, &b, &|_, _| {}).unwrap();
        let finest = levels.last().unwrap();
        assert_eq!(finest.sample_count, 400 * 300);
        assert!(finest.max > 0.25 && finest.max <= 1.25, "{}", finest.max);
        assert!(finest.mean > 0.0 && finest.mean < finest.max);
        assert!(finest.passes(0.0) && !finest.passes(1.25));
        let place = finest.place.unwrap();
        let level = LevelHeights::new(&a, a.metadata().finest()).unwrap();
        assert!(level.header().grid.extent().contains(place));
    }

    #[test]
    fn other_grids_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] =
            [("a", 400), ("b", 401)].map(|(name, rows)| built(&folder, name, 1, rows, 1.0));
        let error = diff(&a, &b, &|_, _| {}).unwrap_err();
        assert!(matches!(error, PyramidError::Refused(_)) && error.to_string().contains("grids"));
    }
}
