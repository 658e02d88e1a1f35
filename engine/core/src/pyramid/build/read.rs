//! The finest level's samples: the raster's own heights, rounded to units.

use super::area::Area;
use super::passes::in_order;
use super::planes::SamplePlane;
use super::samples::Samples;
use crate::dem::{Raster, Window};
use crate::geo::Grid;
use crate::pyramid::PyramidError;
use crate::pyramid::surface::CONTROL_LIMIT;

/// Rows of the narrowest window: so few calls that their cost does not show.
const LEAST_ROWS: u32 = 16;

/// Reads a raster into the finest level's plane, windows of at most about `window_samples` at a time; void samples get
/// height 0 and a mark. Returns how many those are. Nothing is filled or continued yet. `advance` hears of every
/// sample read.
///
/// # Errors
/// What the raster says; heights out of range.
pub(super) fn read_finest(
    raster: &dyn Raster,
    unit: f64,
    plane: &SamplePlane,
    window_samples: u64,
    advance: &(dyn Fn(u64) -> Result<(), PyramidError> + Sync),
) -> Result<u64, PyramidError> {
    let grid = raster.header().grid;
    let shape = window_shape(&grid, raster.part_shape(), window_samples);
    let windows = Windows { grid, shape };
    in_order(
        windows.count(),
        |index| {
            let window = windows.at(index);
            let samples = read_window(raster, unit, window)?;
            plane.write(&samples.area, &samples)?;
            advance(window.sample_count())?;
            Ok(samples.voids.map_or(0, |voids| voids.count()))
        },
        |a, b| a + b,
    )
}

/// The most samples a window of [`read_finest`] has.
pub(super) fn window_samples(raster: &dyn Raster, window_samples: u64) -> u64 {
    let shape = window_shape(&raster.header().grid, raster.part_shape(), window_samples);
    u64::from(shape[0]) * u64::from(shape[1])
}

/// How many windows [`read_finest`] reads.
pub(super) fn window_count(raster: &dyn Raster, window_samples: u64) -> u64 {
    let grid = raster.header().grid;
    let shape = window_shape(&grid, raster.part_shape(), window_samples);
    Windows { grid, shape }.count() as u64
}

/// Rows and columns of the windows: whole parts of the file, or pieces of one where it is larger than a window may be;
/// rather wide than high, so that parts as wide as the raster are read once.
fn window_shape(grid: &Grid, [part_rows, part_columns]: [u32; 2], samples: u64) -> [u32; 2] {
    let fit = |count: u64, part: u32, all: u32| {
        let count = u32::try_from(count).unwrap_or(u32::MAX).clamp(1, all);
        count - if count < part { 0 } else { count % part.max(1) }
    };
    let least = u64::from(part_rows.max(LEAST_ROWS).min(grid.rows));
    let columns = fit(samples / least, part_columns, grid.columns);
    [
        fit(samples / u64::from(columns), part_rows, grid.rows),
        columns,
    ]
}

/// The windows of a grid, row by row.
struct Windows {
    grid: Grid,
    shape: [u32; 2],
}

impl Windows {
    fn count(&self) -> usize {
        let [rows, columns] = self.counts();
        rows as usize * columns as usize
    }

    fn counts(&self) -> [u32; 2] {
        [
            self.grid.rows.div_ceil(self.shape[0]),
            self.grid.columns.div_ceil(self.shape[1]),
        ]
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "rows and columns of windows are u32"
    )]
    fn at(&self, index: usize) -> Window {
        let across = self.counts()[1] as usize;
        let row = (index / across) as u32 * self.shape[0];
        let column = (index % across) as u32 * self.shape[1];
        Window {
            row,
            column,
            rows: self.shape[0].min(self.grid.rows - row),
            columns: self.shape[1].min(self.grid.columns - column),
        }
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
    use super::super::testing::Field;
    use super::*;

    fn read(field: &Field, unit: f64, samples: u64) -> Result<(Samples, u64), PyramidError> {
        let folder = tempfile::tempdir().unwrap();
        let grid = field.header().grid;
        let size = [grid.rows, grid.columns].map(|count| count as usize);
        let plane = SamplePlane::create(folder.path(), "a", size).unwrap();
        let voids = read_finest(field, unit, &plane, samples, &|_| Ok(()))?;
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
}
