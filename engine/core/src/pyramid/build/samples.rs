//! A rectangle of a level's samples in memory: heights in units, and which of them are void.

use super::area::Area;
use crate::geo::{TILE_CELLS, TILE_SAMPLE_COUNT, TILE_SAMPLES};

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

/// A rectangle of samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Samples {
    /// Where on the level it lies.
    pub(super) area: Area,
    /// Rows of samples.
    pub(super) rows: usize,
    /// Columns of samples.
    pub(super) columns: usize,
    /// Heights in units, row by row.
    pub(super) values: Vec<i32>,
    /// Void samples, where there are any.
    pub(super) voids: Option<BitGrid>,
}

impl Samples {
    /// Heights row by row, none of them void.
    pub(super) fn new(area: Area, values: Vec<i32>) -> Self {
        let [rows, columns] = area.size();
        debug_assert_eq!(values.len(), rows * columns);
        Self {
            area,
            rows,
            columns,
            values,
            voids: None,
        }
    }

    /// Heights of a tile, 129 × 129, whose first sample is at a row and column of the rectangle.
    pub(super) fn tile(&self, [first_row, first_column]: [usize; 2]) -> Vec<i32> {
        let mut heights = Vec::with_capacity(TILE_SAMPLE_COUNT);
        for row in first_row..first_row + TILE_SAMPLES {
            let start = row * self.columns + first_column;
            heights.extend_from_slice(&self.values[start..start + TILE_SAMPLES]);
        }
        heights
    }

    /// Puts a tile's heights where [`Self::tile`] takes them.
    pub(super) fn put_tile(&mut self, [first_row, first_column]: [usize; 2], heights: &[i32]) {
        for (line, heights) in heights.chunks_exact(TILE_SAMPLES).enumerate() {
            let start = (first_row + line) * self.columns + first_column;
            self.values[start..start + TILE_SAMPLES].copy_from_slice(heights);
        }
    }

    /// Void bits of a tile as a record has them, and how many are set.
    pub(super) fn tile_voids(&self, [first_row, first_column]: [usize; 2]) -> (Vec<u8>, usize) {
        let mut bits = vec![0_u8; TILE_SAMPLE_COUNT.div_ceil(8)];
        let mut count = 0;
        let Some(voids) = &self.voids else {
            return (bits, count);
        };
        for row in 0..TILE_SAMPLES {
            let [first, last] = [first_column, first_column + TILE_CELLS];
            if !voids.any_in(first_row + row, first, last) {
                continue;
            }
            for column in 0..TILE_SAMPLES {
                if voids.get(first_row + row, first_column + column) {
                    let index = row * TILE_SAMPLES + column;
                    bits[index / 8] |= 1 << (index % 8);
                    count += 1;
                }
            }
        }
        (bits, count)
    }

    /// Marks a sample void.
    pub(super) fn set_void(&mut self, row: usize, column: usize) {
        self.voids
            .get_or_insert_with(|| BitGrid::new(self.rows, self.columns))
            .set(row, column);
    }

    /// True for a void sample.
    pub(super) fn is_void(&self, row: usize, column: usize) -> bool {
        self.voids
            .as_ref()
            .is_some_and(|voids| voids.get(row, column))
    }

    /// A part of the rectangle.
    pub(super) fn crop(&self, area: &Area) -> Self {
        let [first_row, first_column] = self.area.offset_of(area);
        let [rows, columns] = area.size();
        let line = |row: usize| {
            let start = (first_row + row) * self.columns + first_column;
            &self.values[start..start + columns]
        };
        let values = (0..rows)
            .flat_map(|row| line(row).iter().copied())
            .collect();
        let mut part = Self::new(area.clone(), values);
        if self.voids.is_some() {
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |c| (row, c))) {
                if self.is_void(first_row + row, first_column + column) {
                    part.set_void(row, column);
                }
            }
        }
        part
    }

    /// Copies another rectangle that lies in this one.
    pub(super) fn put(&mut self, part: &Self) {
        let [first_row, first_column] = self.area.offset_of(&part.area);
        for row in 0..part.rows {
            let start = (first_row + row) * self.columns + first_column;
            let line = &part.values[row * part.columns..][..part.columns];
            self.values[start..start + part.columns].copy_from_slice(line);
            for column in (0..part.columns).filter(|column| part.is_void(row, *column)) {
                self.set_void(first_row + row, first_column + column);
            }
        }
    }

    /// The void marks of a coarser level's samples: void where all samples under their hat are.
    ///
    /// `coarse` is to be zeros; this rectangle reaches at least a sample past all its hats.
    pub(super) fn mark_coarser_voids(&self, coarse: &mut Self) {
        if self.voids.is_none() {
            return;
        }
        let place = |coarse: i64, first: i64| usize::try_from(2 * coarse - first).unwrap_or(0);
        for (row, at) in coarse.area.rows.clone().enumerate() {
            let fine_row = place(at, self.area.rows.start);
            for (column, at) in coarse.area.columns.clone().enumerate() {
                let fine_column = place(at, self.area.columns.start);
                let hat = |fine: usize| fine - 1..=fine + 1;
                if hat(fine_row).all(|r| hat(fine_column).all(|c| self.is_void(r, c))) {
                    coarse.set_void(row, column);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rough(area: Area) -> Samples {
        let count = i32::try_from(area.count()).unwrap();
        Samples::new(area, (0..count).map(|at| at * 7919 % 1001).collect())
    }

    #[test]
    fn parts_put_back_make_the_whole() {
        let mut whole = rough(Area::new(10..30, 5..200));
        whole.set_void(3, 70);
        let mut again = Samples::new(whole.area.clone(), vec![0; whole.values.len()]);
        for area in [
            Area::new(10..14, 5..200),
            Area::new(14..30, 5..70),
            Area::new(14..30, 70..200),
        ] {
            again.put(&whole.crop(&area));
        }
        assert_eq!(again, whole);
    }

    #[test]
    fn a_tile_goes_out_and_in() {
        let whole = rough(Area::new(0..140, 0..300));
        let mut again = Samples::new(whole.area.clone(), vec![0; whole.values.len()]);
        again.put_tile([3, 100], &whole.tile([3, 100]));
        assert_eq!(again.tile([3, 100]), whole.tile([3, 100]));
        assert_eq!(again.values[2 * 300 + 100], 0);
    }

    #[test]
    fn a_coarser_sample_is_void_only_when_all_under_its_hat_are() {
        let mut fine = rough(Area::new(0..20, 0..20));
        (3..=5).for_each(|row| (3..=6).for_each(|column| fine.set_void(row, column)));
        let mut coarse = Samples::new(Area::new(1..9, 1..9), vec![0; 64]);
        fine.mark_coarser_voids(&mut coarse);
        assert!(coarse.is_void(1, 1) && coarse.voids.unwrap().count() == 1);
    }
}
