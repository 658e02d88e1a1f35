//! Fills void samples smoothly from their surroundings, so that neighbours fit well: a membrane, near enough.
//!
//! Means of known samples are pulled up a pyramid of halved planes; on the way down each plane's gaps take the coarser
//! plane's heights between its cells and are relaxed by a few sweeps.
//!
//! Based on: S. Gortler, R. Grzeszczuk, R. Szeliski, M. Cohen, "The lumigraph", 1996 (pull-push); the relaxation makes
//! it a cascadic multigrid for Laplace's equation.

use super::samples::LevelSamples;
use crate::pyramid::PyramidError;

/// Sweeps on each plane.
const SWEEPS: usize = 8;

/// Fills the void samples of the first rows and columns of a level.
///
/// # Errors
/// [`PyramidError::Unfit`] when all are void.
pub(super) fn fill(
    level: &mut LevelSamples,
    [rows, columns]: [usize; 2],
) -> Result<(), PyramidError> {
    let Some(voids) = &level.voids else {
        return Ok(());
    };
    if voids.count() == (rows * columns) as u64 {
        return Err(PyramidError::Unfit(format!(
            "all {rows} x {columns} samples are void: there is no terrain"
        )));
    }
    let width = level.columns;
    let finest = Cells {
        rows,
        columns,
        known: |row, column| !voids.get(row, column),
        height: |row, column| f64::from(level.values[row * width + column]),
    };
    let mut planes = vec![pull(&finest)];
    while let Some(last) = planes
        .last()
        .filter(|plane| plane.heights.iter().any(Option::is_none))
    {
        let next = pull(&last.cells());
        planes.push(next);
    }
    let mut coarser: Option<Plane> = None;
    for mut plane in planes.into_iter().rev() {
        if let Some(coarser) = coarser {
            plane.push(&coarser);
        }
        coarser = Some(plane);
    }
    if let Some(coarser) = coarser {
        fill_finest(level, [rows, columns], &coarser);
    }
    Ok(())
}

/// Heights of cells, of which some are known.
struct Cells<K, H> {
    rows: usize,
    columns: usize,
    known: K,
    height: H,
}

/// One halved plane: the mean of the known finer cells, none where no finer cell is known.
struct Plane {
    rows: usize,
    columns: usize,
    heights: Vec<Option<f32>>,
}

/// Halves a plane.
fn pull(fine: &Cells<impl Fn(usize, usize) -> bool, impl Fn(usize, usize) -> f64>) -> Plane {
    let [rows, columns] = [fine.rows, fine.columns].map(|count| count.div_ceil(2));
    let mut heights = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        for column in 0..columns {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in 2 * row..(2 * row + 2).min(fine.rows) {
                for column in 2 * column..(2 * column + 2).min(fine.columns) {
                    if (fine.known)(row, column) {
                        sum += (fine.height)(row, column);
                        count += 1.0;
                    }
                }
            }
            #[expect(
                clippy::cast_possible_truncation,
                reason = "a starting point for sweeps needs no more"
            )]
            heights.push((count > 0.0).then_some((sum / count) as f32));
        }
    }
    Plane {
        rows,
        columns,
        heights,
    }
}

impl Plane {
    fn cells(&self) -> Cells<impl Fn(usize, usize) -> bool, impl Fn(usize, usize) -> f64> {
        let at = |row: usize, column: usize| self.heights[row * self.columns + column];
        Cells {
            rows: self.rows,
            columns: self.columns,
            known: move |row, column| at(row, column).is_some(),
            height: move |row, column| f64::from(at(row, column).unwrap_or(0.0)),
        }
    }

    /// Fills the gaps from a filled coarser plane.
    fn push(&mut self, coarser: &Self) {
        let gaps: Vec<usize> = (0..self.heights.len())
            .filter(|index| self.heights[*index].is_none())
            .collect();
        for index in &gaps {
            self.heights[*index] =
                Some(coarser.between(index / self.columns, index % self.columns));
        }
        for _ in 0..SWEEPS {
            for index in &gaps {
                let around = neighbours(*index, [self.rows, self.columns], self.columns);
                let (sum, count) = around.fold((0.0, 0.0), |(sum, count), at| {
                    (sum + self.heights[at].unwrap_or(0.0), count + 1.0)
                });
                self.heights[*index] = Some(sum / f32::max(count, 1.0));
            }
        }
    }

    /// The height at a finer plane's cell, linear between this plane's cells.
    fn between(&self, row: usize, column: usize) -> f32 {
        let near = |fine: usize, count: usize| {
            let cell = fine / 2;
            let other = if fine.is_multiple_of(2) {
                cell.saturating_sub(1)
            } else {
                (cell + 1).min(count - 1)
            };
            [cell, other]
        };
        let [rows, columns] = [near(row, self.rows), near(column, self.columns)];
        let at =
            |row: usize, column: usize| self.heights[row * self.columns + column].unwrap_or(0.0);
        let line = |row: usize| 0.75 * at(row, columns[0]) + 0.25 * at(row, columns[1]);
        0.75 * line(rows[0]) + 0.25 * line(rows[1])
    }
}

/// Fills the samples themselves, in whole units.
fn fill_finest(level: &mut LevelSamples, [rows, columns]: [usize; 2], coarser: &Plane) {
    let Some(voids) = &level.voids else { return };
    let width = level.columns;
    let gaps: Vec<usize> = (0..rows)
        .flat_map(|row| {
            (0..columns)
                .filter(move |column| voids.get(row, *column))
                .map(move |column| row * width + column)
        })
        .collect();
    for index in &gaps {
        #[expect(clippy::cast_possible_truncation, reason = "means of heights in units")]
        let height = coarser.between(index / width, index % width).round() as i32;
        level.values[*index] = height;
    }
    for _ in 0..SWEEPS {
        for index in &gaps {
            let around = neighbours(*index, [rows, columns], width);
            let (sum, count) = around.fold((0_i64, 0), |(sum, count), at| {
                (sum + i64::from(level.values[at]), count + 1)
            });
            #[expect(
                clippy::cast_possible_truncation,
                reason = "a mean of heights in units"
            )]
            let mean = (sum + count / 2).div_euclid(count.max(1)) as i32;
            level.values[*index] = mean;
        }
    }
}

/// Indices of the up to four neighbours inside the first rows and columns of an array of some width.
fn neighbours(
    index: usize,
    [rows, columns]: [usize; 2],
    width: usize,
) -> impl Iterator<Item = usize> {
    let (row, column) = (index / width, index % width);
    let north = (row > 0).then(|| index - width);
    let south = (row + 1 < rows).then(|| index + width);
    let west = (column > 0).then(|| index - 1);
    let east = (column + 1 < columns).then(|| index + 1);
    [north, west, east, south].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Grid;

    fn level(side: u32, height: impl Fn(usize, usize) -> Option<i32>) -> LevelSamples {
        let mut level = LevelSamples::new(
            &Grid {
                columns: side,
                rows: side,
                origin: [0.0; 2],
                step: [1.0, -1.0],
            },
            0,
        );
        for row in 0..side as usize {
            for column in 0..side as usize {
                level.values[row * level.columns + column] =
                    height(row, column).unwrap_or(i32::MIN);
            }
        }
        level.take_voids(i32::MIN);
        level
    }

    #[test]
    fn a_hole_in_a_slope_is_filled_with_the_slope() {
        let slope = |row: usize, column: usize| i32::try_from(40 * row + 24 * column).unwrap();
        let hole = |row: usize, column: usize| row.abs_diff(60) < 20 && column.abs_diff(50) < 12;
        let mut level = level(129, |row, column| {
            (!hole(row, column)).then(|| slope(row, column))
        });
        fill(&mut level, [129, 129]).unwrap();
        for row in 0..129 {
            for column in 0..129 {
                let error = (level.values[row * 129 + column] - slope(row, column)).abs();
                assert!(
                    error <= if hole(row, column) { 120 } else { 0 },
                    "{row} {column} {error}"
                );
            }
        }
    }

    #[test]
    fn one_known_sample_fills_all() {
        let mut level = level(100, |row, column| (row == 3 && column == 99).then_some(41));
        fill(&mut level, [100, 100]).unwrap();
        assert!((0..100).all(|row| {
            level.values[row * 129..][..100]
                .iter()
                .all(|height| *height == 41)
        }));
    }

    #[test]
    fn all_void_is_refused() {
        let error = fill(&mut level(5, |_, _| None), [5, 5]).unwrap_err();
        assert!(error.to_string().contains("all 5 x 5 samples are void"));
    }
}
