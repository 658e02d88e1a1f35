//! The finest level's samples: the raster's own heights, rounded to units.

use std::ops::Range;

use super::area::Area;
use super::journal::Made;
use super::planes::{SamplePlane, TASK_SAMPLES};
use super::samples::Samples;
use super::tasks::{Job, Tasks};
use crate::dem::{Raster, Window};
use crate::geo::Grid;
use crate::pyramid::PyramidError;
use crate::pyramid::surface::CONTROL_LIMIT;

/// Rows of the narrowest window: so few calls that their cost does not show.
const LEAST_ROWS: u32 = 16;

/// Reads a raster into the finest level's plane, windows of at most about `window_samples` at a time; void samples get
/// height 0 and a mark. Returns how many those are. Nothing is filled or continued yet. `advance` hears of every
/// window read.
///
/// # Errors
/// What the raster says; heights out of range.
pub(super) fn read_finest(
    raster: &dyn Raster,
    unit: f64,
    plane: &SamplePlane,
    window_samples: u64,
    (tasks, advance): (
        &Tasks<'_>,
        &(dyn Fn(u64) -> Result<(), PyramidError> + Sync),
    ),
) -> Result<u64, PyramidError> {
    let (grid, part) = (raster.header().grid, raster.part_shape());
    let job = Job {
        pass: "read",
        planes: &[plane],
        in_turn: false,
        advance,
    };
    let bands = bands(&grid, part);
    let windows = |task: usize| Windows::new(&grid, part, &bands[task], window_samples).all();
    let read = |window| {
        let samples = read_window(raster, unit, window)?;
        let written = plane.write_unfilled(&samples)?;
        let voids = samples.voids.map_or(0, |voids| voids.count());
        Ok(Made::new(voids, [written]))
    };
    Ok(tasks.run(&job, windows, read, |a, b| a + b)?.found)
}

/// The rows that each task of [`read_finest`] reads: of whole parts of the file, unless those are larger than a task.
pub(super) fn bands(grid: &Grid, [part_rows, _]: [u32; 2]) -> Vec<Range<u32>> {
    let rows = fit(TASK_SAMPLES / u64::from(grid.columns), part_rows, grid.rows);
    (0..grid.rows.div_ceil(rows))
        .map(|band| band * rows..((band + 1).saturating_mul(rows)).min(grid.rows))
        .collect()
}

/// The most samples a window of [`read_finest`] has.
pub(super) fn window_samples(raster: &dyn Raster, window_samples: u64) -> u64 {
    let shape = window_shape(&raster.header().grid, raster.part_shape(), window_samples);
    u64::from(shape[0]) * u64::from(shape[1])
}

/// How many windows [`read_finest`] reads.
pub(super) fn window_count(raster: &dyn Raster, window_samples: u64) -> u64 {
    let (grid, part) = (raster.header().grid, raster.part_shape());
    bands(&grid, part)
        .iter()
        .map(|band| Windows::new(&grid, part, band, window_samples).count())
        .sum()
}

/// Rows and columns of the windows: whole parts of the file, or pieces of one where it is larger than a window may be;
/// rather wide than high, so that parts as wide as the raster are read once.
fn window_shape(grid: &Grid, [part_rows, part_columns]: [u32; 2], samples: u64) -> [u32; 2] {
    let least = u64::from(part_rows.max(LEAST_ROWS).min(grid.rows));
    let columns = fit(samples / least, part_columns, grid.columns);
    [
        fit(samples / u64::from(columns), part_rows, grid.rows),
        columns,
    ]
}

/// A number of rows or columns, of which there are `all`: of whole parts, where one fits.
fn fit(count: u64, part: u32, all: u32) -> u32 {
    let count = u32::try_from(count).unwrap_or(u32::MAX).clamp(1, all);
    count - if count < part { 0 } else { count % part.max(1) }
}

/// The windows of a band of rows, row by row.
struct Windows<'a> {
    band: &'a Range<u32>,
    columns: u32,
    shape: [u32; 2],
}

impl<'a> Windows<'a> {
    fn new(grid: &Grid, part: [u32; 2], band: &'a Range<u32>, samples: u64) -> Self {
        let rows = band.end - band.start;
        Self {
            band,
            columns: grid.columns,
            shape: window_shape(&Grid { rows, ..*grid }, part, samples),
        }
    }

    fn count(&self) -> u64 {
        let [rows, columns] = self.shape;
        let across = u64::from(self.columns.div_ceil(columns));
        u64::from((self.band.end - self.band.start).div_ceil(rows)) * across
    }

    fn all(&self) -> Vec<Window> {
        let [rows, columns] = self.shape;
        let steps = |range: Range<u32>, step: u32| range.step_by(step as usize);
        steps(self.band.clone(), rows)
            .flat_map(|row| steps(0..self.columns, columns).map(move |column| [row, column]))
            .map(|[row, column]| Window {
                row,
                column,
                rows: rows.min(self.band.end - row),
                columns: columns.min(self.columns - column),
            })
            .collect()
    }
}

fn read_window(raster: &dyn Raster, unit: f64, window: Window) -> Result<Samples, PyramidError> {
    let columns = window.columns as usize;
    let mut heights = vec![0.0; window.rows as usize * columns];
    raster.read(window, &mut heights)?;
    let [row, column] = [window.row as usize, window.column as usize];
    let area = Area::new(row..row + window.rows as usize, column..column + columns);
    let mut samples = Samples::new(area, vec![0; heights.len()]);
    for (at, height) in heights.into_iter().enumerate() {
        let [down, across] = [at / columns, at % columns];
        if height.is_finite() {
            samples.values[at] = to_units(height, unit)
                .ok_or_else(|| out_of_range(row + down, column + across, height, unit))?;
        } else {
            samples.set_void(down, across);
        }
    }
    Ok(samples)
}

/// A height in units, none when it is too far from 0.
fn to_units(height: f64, unit: f64) -> Option<i32> {
    let units = (height / unit).round();
    #[expect(clippy::cast_possible_truncation, reason = "a whole number under 2^25")]
    (units.abs() < f64::from(CONTROL_LIMIT)).then_some(units as i32)
}

fn out_of_range(row: usize, column: usize, height: f64, unit: f64) -> PyramidError {
    PyramidError::Unfit(format!(
        "the height {height} m at row {row}, column {column} is over the limit of 2^25 units of {unit} m; a greater \
         error bound or unit allows it, and a value that means void must be declared"
    ))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::super::options::Watch;
    use super::super::testing::Field;
    use super::*;

    fn read(field: &Field, unit: f64, samples: u64) -> Result<(Samples, u64), PyramidError> {
        let folder = tempfile::tempdir().unwrap();
        let grid = field.header().grid;
        let size = [grid.rows, grid.columns].map(|count| count as usize);
        let plane = SamplePlane::create(folder.path(), "a", size).unwrap();
        let cancel = AtomicBool::new(false);
        let watch = Watch::new(&|_| (), &cancel);
        let tasks = Tasks::of_pass("read", 1, folder.path(), &watch);
        let voids = read_finest(field, unit, &plane, samples, (&tasks, &|_| Ok(())))?;
        Ok((plane.read(&Area::whole(size)).unwrap(), voids))
    }

    #[test]
    fn heights_are_rounded_and_voids_marked() {
        let field = Field::new(70, 3, |row, column| {
            if row == 69 {
                f64::NAN
            } else {
                f64::from(row) + 0.3 * f64::from(column)
            }
        });
        for samples in [1, 40, 1000] {
            let (level, count) = read(&field, 0.25, samples).unwrap();
            assert_eq!(&level.values[68 * 3..][..3], &[272, 273, 274]);
            assert!(level.is_void(69, 0) && level.is_void(69, 2) && count == 3);
            assert_eq!(level.voids.unwrap().count(), 3);
        }
    }

    #[test]
    fn heights_out_of_range_are_named() {
        let field = Field::new(2, 2, |row, _| if row == 1 { 1e12 } else { 0.0 });
        let error = read(&field, 1.0, 100).unwrap_err().to_string();
        assert!(
            error.contains("row 1, column 0") && error.contains("2^25"),
            "{error}"
        );
    }

    #[test]
    fn windows_are_whole_parts_where_they_fit() {
        let grid = |rows, columns| Field::new(rows, columns, |_, _| 0.0).header().grid;
        let shape = |rows, columns, part| window_shape(&grid(rows, columns), part, 1 << 16);
        assert_eq!(shape(1000, 1000, [1, 1000]), [65, 1000]);
        assert_eq!(shape(1000, 1000, [128, 128]), [128, 512]);
        assert_eq!(shape(10, 1000, [1000, 1000]), [10, 1000]);
        assert_eq!(shape(1000, 1000, [1000, 1000]), [1000, 65]);
    }

    #[test]
    fn bands_are_whole_parts_and_their_windows_cover_them() {
        let grid = Field::new(1, 1, |_, _| 0.0).header().grid;
        let grid = Grid {
            rows: 5000,
            columns: 8192,
            ..grid
        };
        assert_eq!(bands(&grid, [1, 8192]), [0..2048, 2048..4096, 4096..5000]);
        assert_eq!(bands(&grid, [300, 512])[0], 0..1800);
        assert_eq!(bands(&grid, [5000, 8192])[2], 4096..5000);
        for band in bands(&grid, [300, 512]) {
            let windows = Windows::new(&grid, [300, 512], &band, 1 << 18);
            let all = windows.all();
            assert_eq!(all.len() as u64, windows.count());
            let samples: u64 = all.iter().map(|window| window.sample_count()).sum();
            assert_eq!(samples, u64::from(band.end - band.start) * 8192);
        }
    }
}
