//! Rectangles of a plane, and how a plane is cut into blocks.

use std::ops::Range;

/// A rectangle of rows and columns, which may reach past a plane's ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Area {
    /// From the north.
    pub(super) rows: Range<i64>,
    /// From the west.
    pub(super) columns: Range<i64>,
}

impl Area {
    /// The rows and columns between two ranges' ends.
    pub(super) fn new(rows: Range<usize>, columns: Range<usize>) -> Self {
        let signed = |range: Range<usize>| to_signed(range.start)..to_signed(range.end);
        Self {
            rows: signed(rows),
            columns: signed(columns),
        }
    }

    /// All of a plane.
    pub(super) fn whole([rows, columns]: [usize; 2]) -> Self {
        Self::new(0..rows, 0..columns)
    }

    /// Rows and columns it has.
    pub(super) fn size(&self) -> [usize; 2] {
        [&self.rows, &self.columns]
            .map(|range| usize::try_from(range.end - range.start).unwrap_or(0))
    }

    /// Places it has.
    pub(super) fn count(&self) -> usize {
        let [rows, columns] = self.size();
        rows * columns
    }

    /// True when there is no place in it.
    pub(super) fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// What it shares with another.
    pub(super) fn and(&self, other: &Self) -> Self {
        let both = |a: &Range<i64>, b: &Range<i64>| a.start.max(b.start)..a.end.min(b.end);
        Self {
            rows: both(&self.rows, &other.rows),
            columns: both(&self.columns, &other.columns),
        }
    }

    /// With so many more rows and columns on every side.
    pub(super) fn grown(&self, [rows, columns]: [usize; 2]) -> Self {
        let grow =
            |range: &Range<i64>, by: usize| range.start - to_signed(by)..range.end + to_signed(by);
        Self {
            rows: grow(&self.rows, rows),
            columns: grow(&self.columns, columns),
        }
    }

    /// True when the other lies in it.
    pub(super) fn contains(&self, other: &Self) -> bool {
        self.and(other) == *other
    }

    /// Row and column, counted from this area's first, of another's first place, which lies in it.
    pub(super) fn offset_of(&self, other: &Self) -> [usize; 2] {
        debug_assert!(self.contains(other), "{other:?} in {self:?}");
        [
            other.rows.start - self.rows.start,
            other.columns.start - self.columns.start,
        ]
        .map(|offset| usize::try_from(offset).unwrap_or(0))
    }
}

/// A plane cut into blocks of `side` rows and columns, row by row; the last of each direction take what is left, be it
/// less or, for one row or column more than whole blocks, that too.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    size: [usize; 2],
    side: usize,
}

impl Blocks {
    /// Cuts a plane of some rows and columns.
    pub(super) const fn new(size: [usize; 2], side: usize) -> Self {
        Self { size, side }
    }

    /// Rows and columns of blocks.
    pub(super) fn shape(&self) -> [usize; 2] {
        self.size
            .map(|count| count.saturating_sub(1).div_ceil(self.side).max(1))
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        let [rows, columns] = self.shape();
        rows * columns
    }

    /// One of them.
    pub(super) fn area(&self, index: usize) -> Area {
        let [rows, columns] = self.shape();
        let range = |at: usize, count: usize, size: usize| {
            let end = if at + 1 == count {
                size
            } else {
                (at + 1) * self.side
            };
            at * self.side..end
        };
        Area::new(
            range(index / columns, rows, self.size[0]),
            range(index % columns, columns, self.size[1]),
        )
    }
}

impl Area {
    /// The area's blocks of `side` rows and columns.
    pub(super) fn blocks(&self, side: usize) -> Vec<Self> {
        let blocks = Blocks::new(self.size(), side);
        let shift = |range: Range<i64>, first: i64| range.start + first..range.end + first;
        (0..blocks.count())
            .map(|index| blocks.area(index))
            .map(|Self { rows, columns }| Self {
                rows: shift(rows, self.rows.start),
                columns: shift(columns, self.columns.start),
            })
            .collect()
    }
}

/// Planes have fewer than 2⁶³ rows.
pub(super) fn to_signed(place: usize) -> i64 {
    i64::try_from(place).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_a_plane_once() {
        for (size, side, shape) in [
            ([129, 257], 128, [1, 2]),
            ([1, 1], 128, [1, 1]),
            ([300, 256], 128, [3, 2]),
        ] {
            let blocks = Blocks::new(size, side);
            assert_eq!(blocks.shape(), shape);
            let mut covered = vec![0; size[0] * size[1]];
            for area in (0..blocks.count()).map(|index| blocks.area(index)) {
                for row in area.rows {
                    for column in area.columns.clone() {
                        covered[usize::try_from(row).unwrap() * size[1]
                            + usize::try_from(column).unwrap()] += 1;
                    }
                }
            }
            assert!(covered.iter().all(|count| *count == 1));
        }
    }

    #[test]
    fn blocks_of_blocks_are_blocks() {
        for size in [[129, 257], [300, 256], [513, 1]] {
            let [fine, coarse] = [64, 128].map(|side| Blocks::new(size, side));
            let coarse = (0..coarse.count()).flat_map(|index| coarse.area(index).blocks(64));
            let coarse: Vec<Area> = coarse.collect();
            assert_eq!(coarse.len(), fine.count());
            assert!((0..fine.count()).all(|index| coarse.contains(&fine.area(index))));
        }
    }

    #[test]
    fn what_is_shared_with_an_area_elsewhere_is_empty() {
        let [a, b] = [Area::new(0..4, 0..9), Area::new(6..8, 0..9)];
        assert!(a.and(&b).is_empty() && !a.contains(&b));
        assert_eq!(a.grown([2, 0]).and(&b), Area::new(6..6, 0..9));
    }
}
