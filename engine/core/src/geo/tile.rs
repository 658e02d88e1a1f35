//! The address of a tile, and the fixed sizes every tile has.
//!
//! Levels count from 0, the coarsest, which is one tile; every tile has four children.

use std::fmt;

/// Cage quads a side of a tile; a quad is also a patch.
pub const TILE_QUADS: usize = 32;
/// Samples from one corner of a quad to the next.
pub const QUAD_SAMPLES: usize = 4;
/// Cells a side of a tile: the spaces between samples.
pub const TILE_CELLS: usize = TILE_QUADS * QUAD_SAMPLES;
/// Samples a side of a tile; neighbours share their border samples.
pub const TILE_SAMPLES: usize = TILE_CELLS + 1;
/// Samples of a tile.
pub const TILE_SAMPLE_COUNT: usize = TILE_SAMPLES * TILE_SAMPLES;
/// Controls a side of a tile's cage: 33 lattice points and a ring of one.
pub const CAGE_CONTROLS: usize = TILE_QUADS + 3;
/// Controls of a tile's cage.
pub const CAGE_CONTROL_COUNT: usize = CAGE_CONTROLS * CAGE_CONTROLS;
/// Patches of a tile.
pub const PATCH_COUNT: usize = TILE_QUADS * TILE_QUADS;

/// A tile of a pyramid: level (0 is the coarsest), row from the north, column from the west.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileId {
    /// Pyramid level, 0 the coarsest.
    pub level: u8,
    /// Row from the north.
    pub row: u32,
    /// Column from the west.
    pub column: u32,
}

impl TileId {
    /// The one tile of level 0.
    pub const ROOT: Self = Self {
        level: 0,
        row: 0,
        column: 0,
    };

    /// The tile at `row`, `column` of `level`.
    #[must_use]
    pub const fn new(level: u8, row: u32, column: u32) -> Self {
        Self { level, row, column }
    }

    /// The tile this one is a quarter of; none for level 0.
    #[must_use]
    pub fn parent(self) -> Option<Self> {
        let level = self.level.checked_sub(1)?;
        Some(Self::new(level, self.row / 2, self.column / 2))
    }

    /// The child in a quadrant (0 north-west, 1 north-east, 2 south-west, 3 south-east).
    #[must_use]
    pub const fn child(self, quadrant: u32) -> Self {
        Self::new(
            self.level + 1,
            self.row * 2 + quadrant / 2,
            self.column * 2 + quadrant % 2,
        )
    }

    /// All four children, whether or not the pyramid has them, in the order of their quadrants.
    #[must_use]
    pub fn children(self) -> [Self; 4] {
        [0, 1, 2, 3].map(|quadrant| self.child(quadrant))
    }

    /// Which quadrant of its parent this tile is: `row % 2 * 2 + column % 2`.
    #[must_use]
    pub const fn quadrant(self) -> u32 {
        self.row % 2 * 2 + self.column % 2
    }

    /// The ancestor at a coarser (or the same) level.
    #[must_use]
    pub const fn ancestor(self, level: u8) -> Self {
        let up = self.level - level;
        Self::new(level, self.row >> up, self.column >> up)
    }
}

impl fmt::Display for TileId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tile {}/{}/{}", self.level, self.row, self.column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parent_of_a_child_is_the_tile() {
        let tile = TileId::new(5, 11, 20);
        for (quadrant, child) in (0..).zip(tile.children()) {
            assert_eq!(child.parent(), Some(tile));
            assert_eq!(child.quadrant(), quadrant);
            assert_eq!(child.ancestor(5), tile);
        }
        assert_eq!(TileId::ROOT.parent(), None);
    }
}
