//! From the axes of a sector, which leave the feature, to those of the cage's face.
//!
//! A sector's x axis runs along the side that leaves the corner of the face where the feature is, its y axis back along
//! the side that arrives: the face's own axes, turned by a quarter for every corner.

/// Quarters from a face's axes to a sector's: the number of the face's corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn(pub(super) u8);

impl Turn {
    /// Sixteen controls, row by row.
    pub(super) fn grid<T: Copy>(self, grid: [T; 16]) -> [T; 16] {
        let mut turned = grid;
        for (index, &control) in grid.iter().enumerate() {
            let [column, row] = self.cell([(index % 4) as u16, (index / 4) as u16], 4);
            turned[usize::from(column + 4 * row)] = control;
        }
        turned
    }

    /// A cell of a square of `side` cells a side.
    pub(super) fn cell(self, [x, y]: [u16; 2], side: u16) -> [u16; 2] {
        let last = side - 1;
        match self.0 {
            0 => [x, y],
            1 => [last - y, x],
            2 => [last - x, last - y],
            _ => [y, last - x],
        }
    }

    /// One bit a side.
    pub(super) fn sides(self, sides: u8) -> u8 {
        (sides << self.0 | sides >> (4 - self.0)) & 15
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_quarters_are_one_turn_and_corners_follow_sides() {
        let grid: [u16; 16] = std::array::from_fn(|index| index as u16);
        let quarter = Turn(1);
        let mut turned = grid;
        (0..4).for_each(|_| turned = quarter.grid(turned));
        assert_eq!(turned, grid);
        // Corners of a grid of sixteen, in the order of corners: each quarter moves one to the next.
        let corners = [0, 3, 15, 12];
        for quarters in 0..4 {
            let turned = Turn(quarters).grid(grid);
            for corner in 0..4 {
                let there = corners[(corner + usize::from(quarters)) % 4];
                assert_eq!(usize::from(turned[there]), corners[corner]);
            }
            assert_eq!(Turn(quarters).sides(1), 1 << quarters);
        }
    }
}
