//! Heights at places: the finest level's surface, exactly as drawn at full depth.
//!
//! Every cell is cut along the diagonal **from its north-west to its south-east sample**; this is the rule of the whole
//! project.
//!
//! ```text
//!  NW────NE      x grows east, y grows south, both 0 to 1 in the cell
//!   │╲   │       y ≥ x: NW-SW-SE     h = (1 − y) NW + (y − x) SW + x SE
//!   │ ╲  │       x ≥ y: NW-SE-NE     h = (1 − x) NW + (x − y) NE + y SE
//!   │  ╲ │
//!  SW────SE
//! ```
//!
//! A triangle with a void corner is void. Knows tiles and their cages; knows no view.

use std::{
    num::NonZero,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

use super::{Pyramid, PyramidError, Tile, surface};
use crate::geo::{TILE_CELLS, TILE_SAMPLES, TileId};

/// Tiles kept with their heights: 150 KiB each, so 10 MiB.
const TILE_COUNT: NonZero<usize> = NonZero::new(64).unwrap();
/// Cages kept of coarser tiles: 5 KiB each.
const CAGE_COUNT: NonZero<usize> = NonZero::new(256).unwrap();
/// Places so near to a sample's row or column, in cells, lie on it: coordinates are rounded on their way here.
const SNAP: f64 = 1e-6;

/// Answers for heights, with the tiles it used last.
///
/// ```no_run
/// use std::{path::Path, sync::Arc};
///
/// use drumlin_core::pyramid::{Heights, Pyramid, PyramidError};
///
/// fn main() -> Result<(), PyramidError> {
///     let heights = Heights::new(Arc::new(Pyramid::open(Path::new("rainier.zarr"))?));
///     match heights.height_at([-121.76, 46.853])? {
///         Some(metres) => println!("{metres} m"),
///         None => println!("void, or outside"),
///     }
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Heights {
    pyramid: Arc<Pyramid>,
    tiles: Mutex<LruCache<TileId, Arc<Decoded>>>,
    cages: Mutex<LruCache<TileId, Arc<[i32]>>>,
}

/// A tile with its heights.
#[derive(Debug)]
struct Decoded {
    tile: Tile,
    heights: Vec<i32>,
}

impl Heights {
    /// Heights of a pyramid.
    #[must_use]
    pub fn new(pyramid: Arc<Pyramid>) -> Self {
        let (tiles, cages) = (LruCache::new(TILE_COUNT), LruCache::new(CAGE_COUNT));
        Self {
            pyramid,
            tiles: Mutex::new(tiles),
            cages: Mutex::new(cages),
        }
    }

    /// The height in metres at CRS coordinates; none where the surface is void and outside the data.
    ///
    /// On an edge between two triangles of which one is void, the other answers.
    ///
    /// # Errors
    ///
    /// Where a tile cannot be read.
    pub fn height_at(&self, place: [f64; 2]) -> Result<Option<f64>, PyramidError> {
        let metadata = self.pyramid.metadata();
        let grid = &metadata.grid;
        let [row, column] = grid.row_column(place);
        let (Some(row), Some(column)) =
            (Place::new(row, grid.rows), Place::new(column, grid.columns))
        else {
            return Ok(None);
        };
        let tile = self.tile(TileId::new(metadata.finest(), row.tile, column.tile))?;
        let height = tile.height(row.cell, column.cell, row.part, column.part);
        Ok(height.map(|units| units * metadata.unit()))
    }

    fn tile(&self, id: TileId) -> Result<Arc<Decoded>, PyramidError> {
        if let Some(tile) = self
            .tiles
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&id)
        {
            return Ok(tile.clone());
        }
        let tile = self.read(id)?;
        let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
        let decoded = Arc::new(Decoded { tile, heights });
        self.tiles
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .put(id, decoded.clone());
        Ok(decoded)
    }

    /// Reads a tile, with its ancestors' cages from memory where they are there.
    fn read(&self, id: TileId) -> Result<Tile, PyramidError> {
        match id.parent() {
            Some(parent) if !self.pyramid.is_key(id) => {
                self.pyramid.read_tile(id, Some(&*self.cage(parent)?))
            }
            _ => self.pyramid.read_tile(id, None),
        }
    }

    fn cage(&self, id: TileId) -> Result<Arc<[i32]>, PyramidError> {
        if let Some(cage) = self
            .cages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&id)
        {
            return Ok(cage.clone());
        }
        let cage: Arc<[i32]> = self.read(id)?.controls.into();
        self.cages
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .put(id, cage.clone());
        Ok(cage)
    }
}

/// A row or column with a fraction, as tile, cell in the tile and part of the cell.
struct Place {
    tile: u32,
    cell: usize,
    part: f64,
}

impl Place {
    /// None outside a grid of `samples`.
    fn new(at: f64, samples: u32) -> Option<Self> {
        let last = f64::from(samples - 1);
        if !(-SNAP..=last + SNAP).contains(&at) {
            return None;
        }
        let nearest = at.round();
        let at = if (at - nearest).abs() <= SNAP {
            nearest
        } else {
            at
        };
        // The last sample is the end of the last cell.
        let cell = at.floor().min((last - 1.0).max(0.0));
        #[expect(
            clippy::cast_possible_truncation,
            reason = "at least 0 and under `samples`"
        )]
        let index = cell as u32;
        #[expect(clippy::cast_possible_truncation, reason = "it is 128")]
        let cells = TILE_CELLS as u32;
        Some(Self {
            tile: index / cells,
            cell: (index % cells) as usize,
            part: at - cell,
        })
    }
}

impl Decoded {
    /// The height in units at a part of a cell.
    fn height(&self, row: usize, column: usize, y: f64, x: f64) -> Option<f64> {
        let corners = if y >= x {
            [(0, 0, 1.0 - y), (1, 0, y - x), (1, 1, x)]
        } else {
            [(0, 0, 1.0 - x), (0, 1, x - y), (1, 1, y)]
        };
        // Corners without weight have no say, so that edges and samples belong to whichever triangle is there.
        corners
            .into_iter()
            .filter(|corner| corner.2 > 0.0)
            .try_fold(0.0, |sum, (down, right, weight)| {
                let (row, column) = (row + down, column + right);
                let there = !self.tile.is_void(row, column);
                there.then(|| sum + weight * f64::from(self.heights[row * TILE_SAMPLES + column]))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::sample;

    fn heights(rows: u32, columns: u32) -> (tempfile::TempDir, Heights) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        sample::write(&path, rows, columns);
        (
            folder,
            Heights::new(Arc::new(Pyramid::open(&path).unwrap())),
        )
    }

    fn at(heights: &Heights, row: f64, column: f64) -> Option<f64> {
        let metadata = heights.pyramid.metadata();
        let height = heights
            .height_at(metadata.grid.position(row, column))
            .unwrap();
        height.map(|metres| metres / metadata.unit())
    }

    #[test]
    fn samples_have_their_stored_heights_and_voids_have_none() {
        let (_folder, heights) = heights(300, 200);
        let half_step = 1.0;
        for row in (0..300).step_by(23).chain([127, 128, 129, 299]) {
            for column in (0..200).step_by(17).chain([127, 128, 129, 199]) {
                let want =
                    (!sample::is_void(row, column)).then(|| f64::from(sample::height(row, column)));
                let got = at(&heights, row as f64, column as f64);
                assert_eq!(got.is_some(), want.is_some(), "{row} {column}");
                assert!(
                    got.zip(want)
                        .is_none_or(|(got, want)| (got - want).abs() <= half_step),
                    "{row} {column}"
                );
            }
        }
    }

    #[test]
    fn cells_are_cut_from_north_west_to_south_east() {
        let (_folder, heights) = heights(300, 200);
        let corner =
            |row: i32, column: i32| at(&heights, f64::from(row), f64::from(column)).unwrap();
        let [nw, ne, sw, se] = [
            corner(200, 150),
            corner(200, 151),
            corner(201, 150),
            corner(201, 151),
        ];
        let close = |a: f64, b: f64| (a - b).abs() < 1e-4;
        assert!(close(at(&heights, 200.5, 150.5).unwrap(), 0.5 * (nw + se)));
        assert!(close(
            at(&heights, 200.75, 150.25).unwrap(),
            0.25 * nw + 0.5 * sw + 0.25 * se
        ));
        assert!(close(
            at(&heights, 200.25, 150.75).unwrap(),
            0.25 * nw + 0.5 * ne + 0.25 * se
        ));
    }

    #[test]
    fn a_triangle_with_a_void_corner_is_void_and_its_neighbour_is_not() {
        let (_folder, heights) = heights(300, 200);
        // The hole's westernmost sample of row 120 is column 31; north-west of it all is there.
        assert!(sample::is_void(120, 31) && !sample::is_void(120, 30) && !sample::is_void(119, 30));
        assert_eq!(at(&heights, 119.9, 30.5), None);
        assert!(!sample::is_void(119, 31) || at(&heights, 119.2, 30.9).is_none());
        assert!(at(&heights, 120.0, 30.0).is_some());
    }

    #[test]
    fn outside_is_none_and_the_border_is_inside() {
        let (_folder, heights) = heights(300, 200);
        for (row, column) in [
            (-0.1, 5.0),
            (5.0, -0.1),
            (299.1, 5.0),
            (5.0, 199.1),
            (f64::NAN, 5.0),
            (1e300, 5.0),
        ] {
            assert_eq!(at(&heights, row, column), None);
        }
        for (row, column) in [(0.0, 0.0), (299.0, 199.0), (0.0, 199.0), (299.0, 100.5)] {
            assert!(at(&heights, row, column).is_some());
        }
    }

    #[test]
    fn one_sample_and_one_row_have_heights() {
        let (_folder, one) = heights(1, 1);
        assert!(at(&one, 0.0, 0.0).is_some() && at(&one, 0.5, 0.0).is_none());
        let (_folder, row) = heights(1, 140);
        assert!(at(&row, 0.0, 139.0).is_some() && at(&row, 0.0, 130.5).is_some());
    }
}
