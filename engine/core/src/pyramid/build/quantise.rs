//! Cages: fitted and quantised from the coarsest level down, block by block.
//!
//! A control depends on the samples around it and on the parent's controls, whichever block asks, so blocks and tiles
//! that share controls hold equal numbers.

use crate::geo::{CAGE_CONTROL_COUNT, CAGE_CONTROLS, TILE_QUADS};
use crate::pyramid::surface::{CONTROL_LIMIT, encode_key_controls};
use crate::pyramid::{PyramidError, number_bytes};

/// Every fourth level stores its controls whole.
const KEY_PERIOD: u8 = 4;

/// The cage of a block of tiles: the lattice points of r × c tiles and a ring of one, 32 r + 3 rows of them.
#[derive(Clone, Debug)]
pub(super) struct Cage {
    columns: usize,
    controls: Vec<i32>,
}

impl Cage {
    /// Controls row by row, so many a row.
    pub(super) fn new(columns: usize, controls: Vec<i32>) -> Self {
        debug_assert_eq!(controls.len() % columns, 0);
        Self { columns, controls }
    }

    /// All controls, row by row.
    pub(super) fn controls(&self) -> &[i32] {
        &self.controls
    }

    /// The 35 × 35 controls of a tile of the block, counted from its first.
    pub(super) fn tile(&self, [row, column]: [usize; 2]) -> Vec<i32> {
        self.window([row * TILE_QUADS, column * TILE_QUADS])
    }

    /// The 35 × 35 controls whose first is at a row and column of the block's.
    pub(super) fn window(&self, [first_row, first_column]: [usize; 2]) -> Vec<i32> {
        let mut controls = Vec::with_capacity(CAGE_CONTROL_COUNT);
        for row in first_row..first_row + CAGE_CONTROLS {
            let start = row * self.columns + first_column;
            controls.extend_from_slice(&self.controls[start..start + CAGE_CONTROLS]);
        }
        controls
    }

    /// What subdividing this cage once predicts at a row of the cage of its north-west children: Catmull-Clark on a
    /// lattice.
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
    cage: &mut Cage,
    parent: Option<&Cage>,
    step: i32,
) -> Result<u8, PyramidError> {
    let columns = cage.columns;
    let mut predicted = vec![0; columns];
    let (mut width, mut greatest) = (1, 0);
    for (row, line) in cage.controls.chunks_exact_mut(columns).enumerate() {
        if let Some(parent) = parent {
            parent.predict_row(row, &mut predicted);
        }
        for (control, predicted) in line.iter_mut().zip(&predicted) {
            let code = nearest(*control - predicted, step);
            *control = predicted + code * step;
            let stored = if parent.is_some() { code } else { *control };
            width = width.max(number_bytes(stored));
            greatest = greatest.max(control.unsigned_abs());
        }
    }
    if greatest >= CONTROL_LIMIT.unsigned_abs() {
        return Err(PyramidError::Unfit(format!(
            "a cage's control of {greatest} units is over the limit of 2^25; a greater error bound or unit allows it"
        )));
    }
    Ok(width)
}

/// How many bytes the widest stored number of a key level's tiles takes.
pub(super) fn key_width(cage: &Cage, [rows, columns]: [usize; 2], step: i32) -> u8 {
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| [row, column]))
        .flat_map(|place| encode_key_controls(&cage.tile(place), step))
        .map(number_bytes)
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

    fn noise(tiles: [usize; 2], scale: i32) -> Cage {
        let [rows, columns] = tiles.map(|count| count * TILE_QUADS + 3);
        let count = rows * columns;
        let controls = (0..i32::try_from(count).unwrap())
            .map(|i| (i * 7919 % 4001 - 2000) * scale)
            .collect();
        Cage::new(columns, controls)
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
            let quadrant = u32::try_from(row % 2 * 2 + column % 2).unwrap();
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
