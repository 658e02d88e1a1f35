//! A regular grid of samples in a coordinate system, and the tiles that cover it.

use serde::{Deserialize, Serialize};

use super::{TILE_CELLS, TileId};

#[expect(clippy::cast_possible_truncation, reason = "128 fits")]
const CELLS: u32 = TILE_CELLS as u32;

/// A box in CRS coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Least x and y.
    pub min: [f64; 2],
    /// Greatest x and y.
    pub max: [f64; 2],
}

impl Extent {
    /// True for points inside or on the border.
    #[must_use]
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        (self.min[0]..=self.max[0]).contains(&x) && (self.min[1]..=self.max[1]).contains(&y)
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: [self.min[0].min(other.min[0]), self.min[1].min(other.min[1])],
            max: [self.max[0].max(other.max[0]), self.max[1].max(other.max[1])],
        }
    }

    /// The middle.
    #[must_use]
    pub fn center(&self) -> [f64; 2] {
        [
            0.5 * (self.min[0] + self.max[0]),
            0.5 * (self.min[1] + self.max[1]),
        ]
    }
}

/// Points of samples: `origin + (column · step.x, row · step.y)` in CRS coordinates.
///
/// Row 0 is north and column 0 is west, so `step[0] > 0` and `step[1] < 0`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Samples from west to east.
    pub columns: u32,
    /// Samples from north to south.
    pub rows: u32,
    /// CRS coordinates of the north-west sample's point.
    pub origin: [f64; 2],
    /// CRS x a column (positive) and CRS y a row (negative).
    pub step: [f64; 2],
}

impl Grid {
    /// CRS coordinates of a place given in rows and columns, fractions allowed.
    #[must_use]
    pub fn position(&self, row: f64, column: f64) -> [f64; 2] {
        [
            self.origin[0] + column * self.step[0],
            self.origin[1] + row * self.step[1],
        ]
    }

    /// Row and column, with fractions, of CRS coordinates.
    #[must_use]
    pub fn row_column(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            (y - self.origin[1]) / self.step[1],
            (x - self.origin[0]) / self.step[0],
        ]
    }

    /// The box around all sample points.
    #[must_use]
    pub fn extent(&self) -> Extent {
        let [x0, y0] = self.origin;
        let [x1, y1] = self.position(f64::from(self.rows) - 1.0, f64::from(self.columns) - 1.0);
        Extent {
            min: [x0.min(x1), y0.min(y1)],
            max: [x0.max(x1), y0.max(y1)],
        }
    }

    /// Rows and columns of tiles that cover the grid at its finest level; at least one of each.
    #[must_use]
    pub fn finest_tiles(&self) -> [u32; 2] {
        [self.rows, self.columns].map(|samples| samples.saturating_sub(1).div_ceil(CELLS).max(1))
    }

    /// Levels from the one tile of level 0 to the finest.
    #[must_use]
    pub fn level_count(&self) -> u8 {
        let [rows, columns] = self.finest_tiles();
        let side = rows.max(columns);
        (0..32).find(|&level| side <= 1 << level).unwrap_or(32) + 1
    }

    /// Rows and columns of tiles at a level.
    #[must_use]
    pub fn tiles(&self, level: u8) -> [u32; 2] {
        let up = self.level_count() - 1 - level;
        self.finest_tiles().map(|count| count.div_ceil(1 << up))
    }

    /// True when the tile is one of the pyramid's.
    #[must_use]
    pub fn has(&self, tile: TileId) -> bool {
        tile.level < self.level_count() && {
            let [rows, columns] = self.tiles(tile.level);
            tile.row < rows && tile.column < columns
        }
    }

    /// Finest samples from one sample of a level to the next.
    #[must_use]
    pub fn stride(&self, level: u8) -> u32 {
        1 << (self.level_count() - 1 - level)
    }

    /// The grid of a level's samples: same origin, `stride` times the step, up to the last sample at or past the end.
    #[must_use]
    pub fn at_level(&self, level: u8) -> Self {
        let stride = self.stride(level);
        Self {
            columns: (self.columns - 1).div_ceil(stride) + 1,
            rows: (self.rows - 1).div_ceil(stride) + 1,
            origin: self.origin,
            step: self.step.map(|step| step * f64::from(stride)),
        }
    }

    /// Row and column, in finest samples, of a tile's north-west sample.
    #[must_use]
    pub fn first_sample(&self, tile: TileId) -> [u64; 2] {
        let span = u64::from(self.stride(tile.level)) * TILE_CELLS as u64;
        [u64::from(tile.row) * span, u64::from(tile.column) * span]
    }

    /// The box of a tile in CRS coordinates; tiles on the south and east reach past the data.
    #[must_use]
    pub fn tile_extent(&self, tile: TileId) -> Extent {
        let span = f64::from(self.stride(tile.level)) * TILE_CELLS as f64;
        let [row, column] = self.first_sample(tile).map(|first| first as f64);
        let [x0, y0] = self.position(row, column);
        let [x1, y1] = self.position(row + span, column + span);
        Extent {
            min: [x0.min(x1), y0.min(y1)],
            max: [x0.max(x1), y0.max(y1)],
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
            origin: [10.0, 50.0],
            step: [0.5, -0.25],
        }
    }

    #[test]
    fn level_zero_is_one_tile() {
        for (rows, columns, levels) in [
            (1, 1, 1),
            (129, 129, 1),
            (130, 2, 2),
            (1201, 1201, 5),
            (8192, 8192, 7),
        ] {
            let grid = grid(rows, columns);
            assert_eq!(grid.level_count(), levels);
            assert_eq!(grid.tiles(0), [1, 1]);
            assert_eq!(grid.tiles(levels - 1), grid.finest_tiles());
        }
    }

    #[test]
    fn row_column_inverts_position() {
        let grid = grid(300, 200);
        assert_eq!(grid.row_column(grid.position(17.25, 31.5)), [17.25, 31.5]);
    }

    #[test]
    fn children_fill_their_parent() {
        let grid = grid(1201, 1201);
        let parent = TileId::new(3, 1, 2);
        let whole = parent.children().map(|child| grid.tile_extent(child));
        let union = whole.iter().fold(whole[0], |a, b| a.union(b));
        assert_eq!(union, grid.tile_extent(parent));
    }
}
