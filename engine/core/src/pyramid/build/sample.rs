//! The finest level's samples: the raster's own heights, rounded to units.

use rayon::prelude::*;

use super::samples::LevelSamples;
use crate::dem::{Raster, Window};
use crate::pyramid::PyramidError;
use crate::pyramid::surface::CONTROL_LIMIT;

/// Rows read at once.
const STRIP_ROWS: usize = 64;
/// What a void sample holds until it is filled.
const VOID: i32 = i32::MIN;

/// Reads a raster into the finest level's array, strip by strip on all threads; void samples get height 0 and a bit.
/// Nothing is filled or continued yet. `advance` hears of every row read.
///
/// # Errors
/// What the raster says; heights out of range.
pub(super) fn read_finest(
    raster: &dyn Raster,
    unit: f64,
    advance: &(dyn Fn(u64) -> Result<(), PyramidError> + Sync),
) -> Result<LevelSamples, PyramidError> {
    let grid = raster.header().grid;
    let mut level = LevelSamples::new(&grid, grid.level_count() - 1);
    let width = level.columns;
    let used = grid.rows as usize * width;
    level.values[..used]
        .par_chunks_mut(STRIP_ROWS * width)
        .enumerate()
        .try_for_each(|(strip, out)| {
            read_strip(raster, unit, strip * STRIP_ROWS, width, out)?;
            advance((out.len() / width) as u64)
        })?;
    level.take_voids(VOID);
    Ok(level)
}

/// Reads the rows of one strip into rows of `width`.
fn read_strip(
    raster: &dyn Raster,
    unit: f64,
    first: usize,
    width: usize,
    out: &mut [i32],
) -> Result<(), PyramidError> {
    let columns = raster.header().grid.columns;
    let rows = out.len() / width;
    let mut heights = vec![0.0; rows * columns as usize];
    let [row, rows] = [first, rows].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
    raster.read(
        Window {
            row,
            column: 0,
            rows,
            columns,
        },
        &mut heights,
    )?;
    for (line, (heights, out)) in heights
        .chunks_exact(columns as usize)
        .zip(out.chunks_exact_mut(width))
        .enumerate()
    {
        for (column, (height, out)) in heights.iter().zip(out).enumerate() {
            *out = to_units(*height, unit)
                .ok_or_else(|| out_of_range(first + line, column, *height, unit))?;
        }
    }
    Ok(())
}

/// A height in units, the void mark for what is not finite, none when it is too far from 0.
fn to_units(height: f64, unit: f64) -> Option<i32> {
    if !height.is_finite() {
        return Some(VOID);
    }
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

    #[test]
    fn heights_are_rounded_and_voids_marked() {
        let field = Field::new(70, 3, |row, column| {
            if row == 69 {
                f64::NAN
            } else {
                row as f64 + 0.3 * column as f64
            }
        });
        let level = read_finest(&field, 0.25, &|_| Ok(())).unwrap();
        assert_eq!(&level.values[68 * level.columns..][..3], &[272, 273, 274]);
        let voids = level.voids.unwrap();
        assert!(voids.get(69, 0) && voids.get(69, 2) && voids.count() == 3);
    }

    #[test]
    fn heights_out_of_range_are_named() {
        let field = Field::new(2, 2, |row, _| if row == 1 { 1e12 } else { 0.0 });
        let error = read_finest(&field, 1.0, &|_| Ok(()))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("row 1, column 0") && error.contains("2^25"),
            "{error}"
        );
    }
}
