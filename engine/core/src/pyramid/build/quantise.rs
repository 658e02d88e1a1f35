//! Cages: fitted as a whole, quantised from the coarsest level down, and only then cut into tiles, so that neighbours
//! hold equal numbers.

use rayon::prelude::*;

use crate::geo::{CAGE_CONTROL_COUNT, CAGE_CONTROLS, TILE_QUADS};
use crate::pyramid::surface::{CONTROL_LIMIT, encode_key_controls};
use crate::pyramid::{PyramidError, number_bytes};

/// Every fourth level stores its controls whole.
const KEY_PERIOD: u8 = 4;

/// The cage of a whole level: lattice points −1 … 32 t + 1 each way, for t tiles.
#[derive(Clone, Debug)]
pub(super) struct LevelCage {
    columns: usize,
    controls: Vec<i32>,
}

impl LevelCage {
    /// A cage of so many rows and columns of tiles.
    pub(super) fn new(tiles: [u32; 2], controls: Vec<i32>) -> Self {
        let [rows, columns] = tiles.map(|count| count as usize * TILE_QUADS + 3);
        debug_assert_eq!(controls.len(), rows * columns);
        Self { columns, controls }
    }

    /// The 35 × 35 controls of a tile.
    pub(super) fn tile(&self, [row, column]: [u32; 2]) -> Vec<i32> {
        let [first_row, first_column] = [row, column].map(|index| index as usize * TILE_QUADS);
        let mut controls = Vec::with_capacity(CAGE_CONTROL_COUNT);
        for row in first_row..first_row + CAGE_CONTROLS {
            let start = row * self.columns + first_column;
            controls.extend_from_slice(&self.controls[start..start + CAGE_CONTROLS]);
        }
        controls
    }

    /// The control of a lattice point, −1 … 32 t + 1 each way.
    pub(super) fn control(&self, row: i64, column: i64) -> i32 {
        let [row, column] = [row, column].map(|at| usize::try_from(at + 1).unwrap_or(0));
        self.controls[row * self.columns + column]
    }

    /// What subdividing this cage once predicts at a row of the child level: Catmull-Clark on a lattice.
    fn predict_row(&self, row: usize, out: &mut [i32]) {
        let coarse = |tap: usize| &self.controls[(row / 2 + tap) * self.columns..][..self.columns];
        let sums: Vec<i64> = match row % 2 {
            0 => coarse(0)
                .iter()
                .zip(coarse(1))
                .map(|(a, b)| 4 * (i64::from(*a) + i64::from(*b)))
                .collect(),
            _ => (0..self.columns)
                .map(|at| {
                    i64::from(coarse(0)[at])
                        + 6 * i64::from(coarse(1)[at])
                        + i64::from(coarse(2)[at])
                })
                .collect(),
        };
        for (column, out) in out.iter_mut().enumerate() {
            let at = column / 2;
            let sum = match column % 2 {
                0 => 4 * (sums[at] + sums[at + 1]),
                _ => sums[at] + 6 * sums[at + 1] + sums[at + 2],
            };
            #[expect(clippy::cast_possible_truncation, reason = "a mean of i32 is an i32")]
            let mean = ((sum + 32) >> 6) as i32;
            *out = mean;
        }
    }
}

/// True for the levels that store their controls whole.
pub(super) fn is_key(level: u8) -> bool {
    level.is_multiple_of(KEY_PERIOD)
}

/// Makes a fitted cage the one a decoder will see: prediction + q r, or on a key level (no parent given) whole steps.
/// Returns how many bytes the widest r takes.
///
/// # Errors
/// [`PyramidError::Unfit`] where a control leaves the range of the 32-bit rule.
pub(super) fn quantise(
    cage: &mut LevelCage,
    parent: Option<&LevelCage>,
    step: i32,
) -> Result<u8, PyramidError> {
    let columns = cage.columns;
    let lines = cage
        .controls
        .par_chunks_exact_mut(columns)
        .enumerate()
        .map(|(row, line)| {
            let mut predicted = vec![0; columns];
            if let Some(parent) = parent {
                parent.predict_row(row, &mut predicted);
            }
            let (mut width, mut greatest) = (1, 0);
            for (control, predicted) in line.iter_mut().zip(predicted) {
                let code = nearest(*control - predicted, step);
                *control = predicted + code * step;
                let stored = if parent.is_some() { code } else { *control };
                width = width.max(number_bytes(stored));
                greatest = greatest.max(control.unsigned_abs());
            }
            (width, greatest)
        });
    let (width, control) = lines.reduce(|| (1, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    if control >= CONTROL_LIMIT.unsigned_abs() {
        return Err(PyramidError::Unfit(format!(
            "a cage's control of {control} units is over the limit of 2^25; a greater error bound or unit allows it"
        )));
    }
    Ok(width)
}

/// How many bytes the widest stored number of a key level takes.
pub(super) fn key_width(cage: &LevelCage, tiles: [u32; 2], step: i32) -> u8 {
    let width = |row: u32, column: u32| {
        let codes = encode_key_controls(&cage.tile([row, column]), step);
        codes.into_iter().map(number_bytes).max().unwrap_or(1)
    };
    let row_width = |row| (0..tiles[1]).map(|column| width(row, column)).max();
    (0..tiles[0])
        .into_par_iter()
        .filter_map(row_width)
        .max()
        .unwrap_or(1)
}

/// `difference / step` rounded to nearest.
fn nearest(difference: i32, step: i32) -> i32 {
    (difference + step / 2).div_euclid(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::surface::{child_window, decode_controls};

    fn noise(tiles: [u32; 2], scale: i32) -> LevelCage {
        let count = tiles
            .map(|count| count as usize * TILE_QUADS + 3)
            .iter()
            .product::<usize>();
        let controls = (0..i32::try_from(count).unwrap())
            .map(|i| (i * 7919 % 4001 - 2000) * scale)
            .collect();
        LevelCage::new(tiles, controls)
    }

    #[test]
    fn tiles_decode_to_the_level_s_controls() {
        let mut parent = noise([2, 1], 100);
        quantise(&mut parent, None, 34).unwrap();
        let fitted = noise([3, 2], 37);
        let mut child = fitted.clone();
        quantise(&mut child, Some(&parent), 17).unwrap();
        for (row, column) in (0..3).flat_map(|row| (0..2).map(move |column| (row, column))) {
            let above = parent.tile([row / 2, column / 2]);
            let quadrant = row % 2 * 2 + column % 2;
            let controls = child.tile([row, column]);
            let codes: Vec<i32> = controls
                .iter()
                .zip(child_window(&above, quadrant))
                .map(|(control, predicted)| {
                    assert_eq!((control - predicted) % 17, 0);
                    (control - predicted) / 17
                })
                .collect();
            assert_eq!(decode_controls(&above, quadrant, &codes, 17), controls);
            for (control, fitted) in controls.iter().zip(fitted.tile([row, column])) {
                assert!((control - fitted).abs() <= 8);
            }
        }
    }

    #[test]
    fn controls_out_of_range_are_refused() {
        let mut cage = noise([1, 1], 20_000);
        assert!(quantise(&mut cage, None, 1).is_err());
    }
}
