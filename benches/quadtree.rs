//! A restricted quadtree and its quads: how a terrain cage of an exact size is laid out.
//!
//! Leaves that share a side differ by at most one level. A leaf with finer neighbours has a corner in the middle of
//! such a side; so a leaf is a polygon of 4 to 8 corners, and every polygon of n corners is n quads about its centre:
//!
//! ```text
//!   ·───┬───·───────┬───────·      a leaf with one finer neighbour, to the west:
//!   │   │   │       │       │      five quads, one for each corner of the pentagon;
//!   ├───┼───┤       │       │      o has three edges and the centre five: both are
//!   │   │   │       │       │      extraordinary vertices of the cage
//!   ·───┼───o───────┼───────┤
//!   │   │   │       │       │      No side of a quad ends in the middle of another's:
//!   ├───┼───┤       │       │      the quads conform without a template for each case.
//!   │   │   │       │       │
//!   ·───┴───·───────┴───────·
//! ```
//!
//! Splitting a leaf adds 12 quads, one more for each side with an equal neighbour and one less for each with a finer
//! one; the last splits are chosen by that, so that the count is met exactly.
//!
//! Knows no heights: the caller says how urgent a leaf is.

use std::{cmp::Ordering, collections::BinaryHeap};

use anyhow::{Result, bail};

/// A square of units, `size` of them a side; row 0 is north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Leaf {
    /// Westmost column.
    pub column: u32,
    /// Northmost row.
    pub row: u32,
    /// Units a side: a power of two.
    pub size: u32,
}

/// A quadtree whose leaves differ from their neighbours across sides by one level at most.
#[derive(Clone, Debug)]
pub struct Quadtree {
    side: u32,
    /// Size of the leaf at every unit, row by row, as its exponent of two.
    exponents: Vec<u8>,
    quad_count: u64,
}

/// What lies across a side of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Across {
    Outside,
    Coarser(Leaf),
    Equal,
    Finer,
}

/// When so many quads are missing, splits are chosen by what they add.
const FINISH_QUADS: u64 = 1000;

impl Quadtree {
    /// One leaf of 2^`exponent` units a side; at most 2^12.
    #[must_use]
    pub fn new(exponent: u8) -> Self {
        let exponent = exponent.min(12);
        let side = 1 << exponent;
        Self {
            side,
            exponents: vec![exponent; (side * side) as usize],
            quad_count: 4,
        }
    }

    /// Splits leaves, the most urgent first, until there are exactly `quads` quads.
    ///
    /// # Errors
    /// When no choice of splits gives that number: the tree has too few units, or `quads` is below what one more split
    /// would give.
    pub fn refine(&mut self, quads: u64, urgency: impl Fn(Leaf) -> f64) -> Result<()> {
        let ranked = |leaf| Ranked {
            urgency: urgency(leaf),
            leaf,
        };
        let mut heap: BinaryHeap<_> = self.leaves().map(ranked).collect();
        while self.quad_count + FINISH_QUADS.min(quads / 2) < quads {
            let Some(Ranked { leaf, .. }) = heap.pop() else {
                bail!(
                    "a quadtree of {0} x {0} units has no {quads} quads",
                    self.side
                );
            };
            if leaf.size > 1 && self.leaf_at(leaf.column, leaf.row) == leaf {
                self.split(leaf, &mut |child| heap.push(ranked(child)));
            }
        }
        self.finish(quads, heap.into_sorted_vec())
    }

    /// Splits leaves that disturb no neighbour until the count is met; `ranked` ends with the most urgent.
    fn finish(&mut self, quads: u64, ranked: Vec<Ranked>) -> Result<()> {
        while self.quad_count != quads {
            let missing = quads.saturating_sub(self.quad_count);
            let fits = |leaf: &Leaf| {
                let alive = self.leaf_at(leaf.column, leaf.row) == *leaf;
                let gain = if alive { self.gain(*leaf) } else { None };
                gain.is_some_and(|gain| leads_to_zero(missing, gain))
            };
            let found = ranked.iter().rev().map(|ranked| ranked.leaf).find(fits);
            let Some(leaf) = found else {
                bail!(
                    "no split of a leaf leads from {} quads to {quads}",
                    self.quad_count
                );
            };
            self.split(leaf, &mut |_| ());
        }
        Ok(())
    }

    /// All leaves, by the row and column of their north-west unit.
    pub fn leaves(&self) -> impl Iterator<Item = Leaf> + '_ {
        let units = (0..self.side).flat_map(|row| (0..self.side).map(move |column| (column, row)));
        units.filter_map(|(column, row)| {
            let leaf = self.leaf_at(column, row);
            ((leaf.column, leaf.row) == (column, row)).then_some(leaf)
        })
    }

    /// Quads of all leaves.
    #[must_use]
    pub fn quad_count(&self) -> u64 {
        self.quad_count
    }

    /// Units a side.
    #[must_use]
    pub fn side(&self) -> u32 {
        self.side
    }

    /// A leaf's corners in half units, (column, row), counter-clockwise seen from above, from the north-west one on: four,
    /// and one in the middle of every side with finer neighbours.
    #[must_use]
    pub fn polygon(&self, leaf: Leaf) -> Vec<[u32; 2]> {
        let Leaf { column, row, size } = leaf;
        let corners = [[0, 0], [0, 2 * size], [2 * size; 2], [2 * size, 0]];
        let mut polygon = Vec::with_capacity(8);
        for side in 0..4 {
            let [a, b] = [corners[side], corners[(side + 1) % 4]];
            polygon.push([2 * column + a[0], 2 * row + a[1]]);
            if self.across(leaf, side) == Across::Finer {
                let middle = [0, 1].map(|axis| (a[axis] + b[axis]) / 2);
                polygon.push([2 * column + middle[0], 2 * row + middle[1]]);
            }
        }
        polygon
    }

    /// The leaf of a unit.
    fn leaf_at(&self, column: u32, row: u32) -> Leaf {
        let exponent = self.exponents[(row * self.side + column) as usize];
        let mask = u32::MAX << exponent;
        Leaf {
            column: column & mask,
            row: row & mask,
            size: 1 << exponent,
        }
    }

    /// Sides in the order of [`Quadtree::polygon`]: west, south, east, north.
    fn across(&self, leaf: Leaf, side: usize) -> Across {
        let Leaf { column, row, size } = leaf;
        let unit = match side {
            0 => column.checked_sub(1).map(|west| (west, row)),
            1 => Some((column, row + size)),
            2 => Some((column + size, row)),
            _ => row.checked_sub(1).map(|north| (column, north)),
        };
        let inside = |&(column, row): &(u32, u32)| column < self.side && row < self.side;
        let Some((column, row)) = unit.filter(inside) else {
            return Across::Outside;
        };
        let other = self.leaf_at(column, row);
        match other.size.cmp(&size) {
            Ordering::Less => Across::Finer,
            Ordering::Equal => Across::Equal,
            Ordering::Greater => Across::Coarser(other),
        }
    }

    /// Quads a split adds; none for a leaf of one unit and beside a coarser one, which would have to split first.
    fn gain(&self, leaf: Leaf) -> Option<u64> {
        let mut gain = 12;
        for side in 0..4 {
            match self.across(leaf, side) {
                Across::Outside => {}
                Across::Equal => gain += 1,
                Across::Finer => gain -= 1,
                Across::Coarser(_) => return None,
            }
        }
        (leaf.size > 1).then_some(gain)
    }

    /// Splits a leaf of more than one unit, coarser neighbours first, and hands out all new leaves.
    fn split(&mut self, leaf: Leaf, made: &mut impl FnMut(Leaf)) {
        for side in 0..4 {
            if let Across::Coarser(other) = self.across(leaf, side) {
                self.split(other, made);
            }
        }
        self.quad_count += self.gain(leaf).unwrap_or(0);
        let size = leaf.size / 2;
        for row in leaf.row..leaf.row + leaf.size {
            let first = (row * self.side + leaf.column) as usize;
            self.exponents[first..first + leaf.size as usize].fill(size.ilog2() as u8);
        }
        for [column, row] in [[0, 0], [size, 0], [0, size], [size, size]] {
            made(Leaf {
                column: leaf.column + column,
                row: leaf.row + row,
                size,
            });
        }
    }
}

/// True when splits of common gains can add what is missing after this one.
///
/// Inside, gains are even, from 8 to 16, and 12, 14 and 16 are common: they add up to any even number but 2 to 10, 18 to
/// 22 and 34. An odd number needs one leaf on the border first.
fn leads_to_zero(missing: u64, gain: u64) -> bool {
    let Some(rest) = missing.checked_sub(gain) else {
        return false;
    };
    rest.is_multiple_of(2) && !matches!(rest, 2..=10 | 18..=22 | 34)
}

/// A leaf in the order of its urgency, then of its place, so that the same input gives the same tree.
struct Ranked {
    urgency: f64,
    leaf: Leaf,
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_urgency = self.urgency.total_cmp(&other.urgency);
        by_urgency.then_with(|| other.leaf.cmp(&self.leaf))
    }
}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ranked {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ranked {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Urgent near a bent line, so that many levels meet.
    fn bent(leaf: Leaf) -> f64 {
        let [x, y] = [leaf.column, leaf.row].map(|at| f64::from(at) + 0.5 * f64::from(leaf.size));
        let off = (y - 90.0 - 40.0 * (0.03 * x).sin()).abs();
        f64::from(leaf.size) / (off + f64::from(leaf.size))
    }

    #[test]
    fn the_count_is_met_exactly_odd_or_even() {
        for quads in [3000, 5001, 9999, 20_002] {
            let mut tree = Quadtree::new(8);
            tree.refine(quads, bent).expect("units enough");
            let corners: usize = tree.leaves().map(|leaf| tree.polygon(leaf).len()).sum();
            assert_eq!((tree.quad_count(), corners as u64), (quads, quads));
        }
    }

    #[test]
    fn leaves_cover_the_square_and_differ_by_one_level_from_their_neighbours() {
        let mut tree = Quadtree::new(8);
        tree.refine(5001, bent).expect("units enough");
        let area: u32 = tree.leaves().map(|leaf| leaf.size * leaf.size).sum();
        assert_eq!(area, tree.side() * tree.side());
        let sizes: std::collections::BTreeSet<_> = tree.leaves().map(|leaf| leaf.size).collect();
        assert!(sizes.len() > 3, "{sizes:?}");
        for leaf in tree.leaves() {
            for side in 0..4 {
                if let Across::Coarser(other) = tree.across(leaf, side) {
                    assert_eq!(other.size, 2 * leaf.size, "{leaf:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn more_quads_than_units_allow_are_an_error() {
        assert!(Quadtree::new(3).refine(100_000, bent).is_err());
        assert!(Quadtree::new(3).refine(5, bent).is_err());
    }
}
