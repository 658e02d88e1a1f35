//! The samples of one level while a pyramid is built: heights in units over whole tiles, and which of them are void.
//!
//! The array covers an even number of tiles each way (one on level 0), so that the next coarser level can be fitted to
//! it without asking what lies beyond.

use rayon::prelude::*;

use crate::geo::{Grid, TILE_CELLS, TILE_SAMPLE_COUNT, TILE_SAMPLES};

/// Bits in rows, for void samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BitGrid {
    words_per_row: usize,
    words: Vec<u64>,
}

impl BitGrid {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        let words_per_row = columns.div_ceil(64);
        Self {
            words_per_row,
            words: vec![0; rows * words_per_row],
        }
    }

    pub(super) fn get(&self, row: usize, column: usize) -> bool {
        self.words[row * self.words_per_row + column / 64] >> (column % 64) & 1 == 1
    }

    pub(super) fn set(&mut self, row: usize, column: usize) {
        self.words[row * self.words_per_row + column / 64] |= 1 << (column % 64);
    }

    /// True when any of the columns `first` … `last` of a row is set.
    pub(super) fn any_in(&self, row: usize, first: usize, last: usize) -> bool {
        let words = &self.words[row * self.words_per_row..][..self.words_per_row];
        let (from, to) = (first / 64, last / 64);
        let (head, tail) = (u64::MAX << (first % 64), u64::MAX >> (63 - last % 64));
        if from == to {
            return words[from] & head & tail != 0;
        }
        words[from] & head != 0
            || words[to] & tail != 0
            || words[from + 1..to].iter().any(|word| *word != 0)
    }

    pub(super) fn count(&self) -> u64 {
        self.words
            .iter()
            .map(|word| u64::from(word.count_ones()))
            .sum()
    }
}

/// The samples of one level.
#[derive(Clone, Debug)]
pub(super) struct LevelSamples {
    /// Rows of samples in the array.
    pub(super) rows: usize,
    /// Columns of samples in the array.
    pub(super) columns: usize,
    /// Heights in units, row by row.
    pub(super) values: Vec<i32>,
    /// Void samples, where there are any.
    pub(super) voids: Option<BitGrid>,
}

impl LevelSamples {
    /// Zero heights for a level of a grid.
    pub(super) fn new(grid: &Grid, level: u8) -> Self {
        let [rows, columns] = array_size(grid, level);
        Self {
            rows,
            columns,
            values: vec![0; rows * columns],
            voids: None,
        }
    }

    /// Heights of a tile, 129 × 129.
    pub(super) fn tile(&self, [row, column]: [u32; 2]) -> Vec<i32> {
        let [first_row, first_column] = [row, column].map(|index| index as usize * TILE_CELLS);
        let mut heights = Vec::with_capacity(TILE_SAMPLE_COUNT);
        for row in first_row..first_row + TILE_SAMPLES {
            let start = row * self.columns + first_column;
            heights.extend_from_slice(&self.values[start..start + TILE_SAMPLES]);
        }
        heights
    }

    /// Puts a tile's heights into the array.
    pub(super) fn put_tile(&mut self, [row, column]: [u32; 2], heights: &[i32]) {
        let [first_row, first_column] = [row, column].map(|index| index as usize * TILE_CELLS);
        for (line, heights) in heights.chunks_exact(TILE_SAMPLES).enumerate() {
            let start = (first_row + line) * self.columns + first_column;
            self.values[start..start + TILE_SAMPLES].copy_from_slice(heights);
        }
    }

    /// Void bits of a tile as a record has them, and how many are set; none where the level has no voids.
    pub(super) fn tile_voids(&self, [row, column]: [u32; 2]) -> Option<(Vec<u8>, usize)> {
        let voids = self.voids.as_ref()?;
        let [first_row, first_column] = [row, column].map(|index| index as usize * TILE_CELLS);
        let mut bits = vec![0_u8; TILE_SAMPLE_COUNT.div_ceil(8)];
        let mut count = 0;
        for index in 0..TILE_SAMPLE_COUNT {
            if voids.get(
                first_row + index / TILE_SAMPLES,
                first_column + index % TILE_SAMPLES,
            ) {
                bits[index / 8] |= 1 << (index % 8);
                count += 1;
            }
        }
        Some((bits, count))
    }

    /// Continues heights and voids past the first rows and columns to the whole array.
    ///
    /// Heights run on with a slope that fades, and are smoothed along the border, the more the farther out: noise
    /// must not make ridges.
    pub(super) fn continue_past(&mut self, [rows, columns]: [usize; 2]) {
        let width = self.columns;
        for column in columns..width {
            continue_column(
                &mut self.values[..rows * width],
                width,
                column,
                column - columns,
            );
        }
        for row in rows..self.rows {
            let (done, rest) = self.values.split_at_mut(row * width);
            let last = &done[(row - 1) * width..];
            let before = &done[row.saturating_sub(2) * width..][..width];
            let line = continued(
                row - rows,
                width,
                |place| last[place],
                |place| before[place],
            );
            rest[..width].copy_from_slice(&line);
        }
        if let Some(voids) = &mut self.voids {
            continue_voids(voids, [rows, columns], [self.rows, self.columns]);
        }
    }

    /// The void mask of the next coarser level: a sample is void when all samples under its hat are.
    pub(super) fn coarser_voids(&self, coarse: &Self) -> Option<BitGrid> {
        let voids = self.voids.as_ref()?;
        let mut bits = BitGrid::new(coarse.rows, coarse.columns);
        let mut any = false;
        for row in 0..self.rows.div_ceil(2) {
            for column in 0..self.columns.div_ceil(2) {
                if hat(row, self.rows).all(|r| hat(column, self.columns).all(|c| voids.get(r, c))) {
                    bits.set(row, column);
                    any = true;
                }
            }
        }
        any.then_some(bits)
    }

    /// How many of the first rows' and columns' samples are void.
    pub(super) fn void_count(&self, [rows, columns]: [usize; 2]) -> u64 {
        let Some(voids) = &self.voids else { return 0 };
        (0..rows)
            .map(|row| {
                (0..columns)
                    .filter(|column| voids.get(row, *column))
                    .count() as u64
            })
            .sum()
    }

    /// Remembers which samples hold `sentinel` as void and makes them 0.
    pub(super) fn take_voids(&mut self, sentinel: i32) {
        if self.values.par_iter().all(|value| *value != sentinel) {
            return;
        }
        let mut voids = BitGrid::new(self.rows, self.columns);
        for (row, line) in self.values.chunks_exact_mut(self.columns).enumerate() {
            for (column, value) in line
                .iter_mut()
                .enumerate()
                .filter(|(_, value)| **value == sentinel)
            {
                voids.set(row, column);
                *value = 0;
            }
        }
        self.voids = Some(voids);
    }
}

/// Rows and columns of a level's array: whole tiles, an even number of them unless the level is the coarsest.
pub(super) fn array_size(grid: &Grid, level: u8) -> [usize; 2] {
    let even = |count: u32| {
        if level == 0 {
            count
        } else {
            count.next_multiple_of(2)
        }
    };
    grid.tiles(level)
        .map(|count| even(count) as usize * TILE_CELLS + 1)
}

/// The finer samples under a coarser sample's hat.
fn hat(coarse: usize, finer_count: usize) -> impl Iterator<Item = usize> {
    (2 * coarse).saturating_sub(1)..(2 * coarse + 2).min(finer_count)
}

/// One more column past the border.
fn continue_column(values: &mut [i32], width: usize, column: usize, distance: usize) {
    let rows = values.len() / width;
    let before = column.saturating_sub(2);
    let line = continued(
        distance,
        rows,
        |row| values[row * width + column - 1],
        |row| values[row * width + before],
    );
    for (row, height) in line.into_iter().enumerate() {
        values[row * width + column] = height;
    }
}

/// One more line past the border: the last one smoothed along itself, plus half its smoothed slope.
fn continued(
    distance: usize,
    len: usize,
    last: impl Fn(usize) -> i32,
    before: impl Fn(usize) -> i32,
) -> Vec<i32> {
    // Whole units: past some lines the slope is rounding and no more.
    let slope = |place: usize| {
        if distance < 8 {
            (last(place) - before(place)) / 2
        } else {
            0
        }
    };
    let around = |place: usize| [place.saturating_sub(1), place, (place + 1).min(len - 1)];
    (0..len)
        .map(|place| weigh(around(place).map(&last)) + weigh(around(place).map(slope)))
        .collect()
}

/// (1, 2, 1) / 4, rounded.
fn weigh([a, b, c]: [i32; 3]) -> i32 {
    (a + 2 * b + c + 2) >> 2
}

fn continue_voids(
    voids: &mut BitGrid,
    [rows, columns]: [usize; 2],
    [all_rows, all_columns]: [usize; 2],
) {
    for row in 0..all_rows {
        let first = if row < rows { columns } else { 0 };
        for column in first..all_columns {
            if voids.get(row.min(rows - 1), column.min(columns - 1)) {
                voids.set(row, column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(rows: u32, columns: u32) -> Grid {
        Grid {
            columns,
            rows,
            origin: [0.0, 0.0],
            step: [1.0, -1.0],
        }
    }

    #[test]
    fn arrays_cover_an_even_number_of_tiles_except_at_the_root() {
        let grid = grid(1201, 300);
        assert_eq!(array_size(&grid, 4), [1281, 513]);
        assert_eq!(array_size(&grid, 3), [769, 257]);
        assert_eq!(array_size(&grid, 0), [129, 129]);
    }

    #[test]
    fn a_plane_runs_on_without_a_step() {
        let mut level = LevelSamples::new(&grid(200, 200), 1);
        for row in 0..200 {
            for column in 0..200 {
                level.values[row * level.columns + column] =
                    16 * i32::try_from(row + column).unwrap();
            }
        }
        level.continue_past([200, 200]);
        for row in 0..level.rows - 1 {
            for column in 0..level.columns - 1 {
                let at = row * level.columns + column;
                assert!((level.values[at + 1] - level.values[at]).abs() <= 17);
                assert!((level.values[at + level.columns] - level.values[at]).abs() <= 17);
            }
        }
    }

    #[test]
    fn one_sample_runs_on_as_flat_ground() {
        let mut level = LevelSamples::new(&grid(1, 1), 0);
        level.values[0] = 77;
        level.continue_past([1, 1]);
        assert!(level.values.iter().all(|height| *height == 77));
    }

    #[test]
    fn a_coarser_sample_is_void_only_when_all_under_its_hat_are() {
        let grid = grid(257, 257);
        let mut fine = LevelSamples::new(&grid, 1);
        for row in 3..=5 {
            for column in 3..=6 {
                fine.values[row * fine.columns + column] = i32::MIN;
            }
        }
        fine.take_voids(i32::MIN);
        let coarse = fine.coarser_voids(&LevelSamples::new(&grid, 0)).unwrap();
        assert!(coarse.get(2, 2) && coarse.count() == 1);
    }
}
