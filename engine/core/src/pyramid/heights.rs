//! The heights of one level by window, as of a raster: what exports, extracts and comparisons read.
//!
//! Knows tiles and their order; what windows are wanted for is the caller's.

use std::{
    num::NonZero,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

use super::{Pyramid, PyramidError, Tile, surface};
use crate::{
    dem::{DemError, Raster, RasterHeader, SourceInfo, Window},
    geo::{TILE_CELLS, TILE_SAMPLES, TileId},
};

/// Tiles kept, most of them ancestors that others are stored against: about 5 MB.
const KEPT_TILES: NonZero<usize> = NonZero::new(64).unwrap();

/// Samples a side of the windows that read every tile but once.
const CELLS: u32 = {
    #[expect(clippy::cast_possible_truncation, reason = "128")]
    let cells = TILE_CELLS as u32;
    cells
};

/// One level of a pyramid as a raster of heights in metres, NaN where void. Read from any number of threads.
#[derive(Debug)]
pub struct LevelHeights<'a> {
    pyramid: &'a Pyramid,
    level: u8,
    header: RasterHeader,
    kept: Mutex<LruCache<TileId, Arc<Tile>>>,
}

impl<'a> LevelHeights<'a> {
    /// A level's heights; 0 is the coarsest level.
    ///
    /// # Errors
    ///
    /// Refused where the pyramid has no such level.
    pub fn new(pyramid: &'a Pyramid, level: u8) -> Result<Self, PyramidError> {
        let metadata = pyramid.metadata();
        if level > metadata.finest() {
            return Err(PyramidError::Refused(format!(
                "level {level}: the pyramid has levels 0 to {}",
                metadata.finest()
            )));
        }
        let name = pyramid.store().name("");
        let header = RasterHeader {
            grid: metadata.grid.at_level(level),
            crs: metadata.crs.clone(),
            integer: false,
            georeferenced: true,
            reading: format!("level {level} of {name}"),
            source: SourceInfo { name, bytes: 0 },
        };
        Ok(Self {
            pyramid,
            level,
            header,
            kept: Mutex::new(LruCache::new(KEPT_TILES)),
        })
    }

    /// Reads the heights of a window, row by row, north first.
    ///
    /// # Errors
    ///
    /// Where the window leaves the level, or a tile is missing, cut short or damaged.
    pub fn heights(&self, window: Window, out: &mut [f64]) -> Result<(), PyramidError> {
        self.header.check(window, out.len())?;
        if out.is_empty() {
            return Ok(());
        }
        let [first_row, first_column] = [window.row, window.column].map(|at| at / CELLS);
        // The last sample of a level lies on the border of its last tile.
        let [rows, columns] = self.pyramid.metadata().grid.tiles(self.level);
        let last = |at: u64, tiles: u32| {
            u32::try_from((at - 1) / u64::from(CELLS)).map_or(tiles - 1, |tile| tile.min(tiles - 1))
        };
        let [first_row, first_column] = [first_row.min(rows - 1), first_column.min(columns - 1)];
        for row in first_row..=last(window.row_end(), rows) {
            for column in first_column..=last(window.column_end(), columns) {
                let tile = self.tile(TileId::new(self.level, row, column))?;
                self.copy(&tile, window, out);
            }
        }
        Ok(())
    }

    /// Copies what a tile has of a window.
    fn copy(&self, tile: &Tile, window: Window, out: &mut [f64]) {
        let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
        let unit = self.pyramid.metadata().unit();
        let first = [tile.id.row, tile.id.column].map(|at| i64::from(at) * i64::from(CELLS));
        let shared = |first: i64, start: u32, end: u64| {
            let samples = 0..TILE_SAMPLES;
            samples.filter(move |&at| {
                let at = first + at as i64;
                at >= i64::from(start) && at.unsigned_abs() < end
            })
        };
        for row in shared(first[0], window.row, window.row_end()) {
            for column in shared(first[1], window.column, window.column_end()) {
                let height = if tile.is_void(row, column) {
                    f64::NAN
                } else {
                    f64::from(heights[row * TILE_SAMPLES + column]) * unit
                };
                let [to_row, to_column] = [
                    first[0] + row as i64 - i64::from(window.row),
                    first[1] + column as i64 - i64::from(window.column),
                ];
                let at = to_row * i64::from(window.columns) + to_column;
                if let Some(out) = usize::try_from(at).ok().and_then(|at| out.get_mut(at)) {
                    *out = height;
                }
            }
        }
    }

    /// A tile, read against its ancestors where it has to be.
    fn tile(&self, id: TileId) -> Result<Arc<Tile>, PyramidError> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(tile) = kept().get(&id) {
            return Ok(Arc::clone(tile));
        }
        let parent = match id.parent() {
            Some(parent) if !self.pyramid.is_key(id) => Some(self.tile(parent)?),
            _ => None,
        };
        let parent = parent.as_ref().map(|parent| &*parent.controls);
        let tile = Arc::new(self.pyramid.read_tile(id, parent)?);
        kept().put(id, Arc::clone(&tile));
        Ok(tile)
    }
}

impl Raster for LevelHeights<'_> {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.heights(window, out).map_err(|error| match error {
            PyramidError::Dem(error) => error,
            error => DemError::Format {
                file: self.header.source.name.clone(),
                what: error.to_string(),
            },
        })
    }

    fn part_shape(&self) -> [u32; 2] {
        [CELLS; 2]
    }

    fn memory_bytes(&self) -> u64 {
        (KEPT_TILES.get() * 5 * TILE_SAMPLES * TILE_SAMPLES) as u64
    }

    fn read_bytes(&self, _samples: u64) -> u64 {
        // A decoded tile and its heights.
        (16 * TILE_SAMPLES * TILE_SAMPLES) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::sample;

    fn opened(rows: u32, columns: u32) -> (tempfile::TempDir, Pyramid) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        sample::write(&path, rows, columns);
        let pyramid = Pyramid::open(&path).unwrap();
        (folder, pyramid)
    }

    #[test]
    fn windows_hold_the_heights_of_their_tiles() {
        let (_folder, pyramid) = opened(700, 300);
        for level in 0..=pyramid.metadata().finest() {
            let heights = LevelHeights::new(&pyramid, level).unwrap();
            let grid = heights.header().grid;
            let whole = Window::whole(&grid);
            let mut all = vec![0.0; (grid.rows * grid.columns) as usize];
            heights.heights(whole, &mut all).unwrap();
            for window in [
                [0, 0, 1, 1],
                [127, 0, 3, 9],
                [grid.rows - 1, grid.columns - 2, 1, 2],
            ] {
                let [row, column, rows, columns] = window;
                if row + rows > grid.rows || column + columns > grid.columns {
                    continue;
                }
                let window = Window {
                    row,
                    column,
                    rows,
                    columns,
                };
                let mut part = vec![0.0; (rows * columns) as usize];
                heights.heights(window, &mut part).unwrap();
                for (at, part) in (0..).zip(part) {
                    let [row, column] = [row + at / columns, column + at % columns];
                    let want = all[(row * grid.columns + column) as usize];
                    assert_eq!(
                        part.to_bits(),
                        want.to_bits(),
                        "level {level}: {row}, {column}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_finest_heights_are_the_sources_within_the_bound_and_voids_are_void() {
        let (_folder, pyramid) = opened(300, 200);
        let metadata = pyramid.metadata();
        let heights = LevelHeights::new(&pyramid, metadata.finest()).unwrap();
        let mut all = vec![0.0; 300 * 200];
        let whole = Window::whole(&metadata.grid);
        heights.heights(whole, &mut all).unwrap();
        let mut voids = 0;
        for (at, &height) in (0..).zip(&all) {
            let [row, column] = [at / 200, at % 200];
            if sample::is_void(row, column) {
                assert!(height.is_nan());
                voids += 1;
            } else {
                let want = f64::from(sample::height(row, column)) * metadata.unit();
                // Half a step of the level, 3 units.
                assert!(
                    (height - want).abs() <= 1.5 * metadata.unit(),
                    "{height} {want}"
                );
            }
        }
        assert!(voids > 1000);
    }

    #[test]
    fn what_is_not_there_is_an_error() {
        let (_folder, pyramid) = opened(300, 200);
        assert!(matches!(
            LevelHeights::new(&pyramid, 9),
            Err(PyramidError::Refused(_))
        ));
        let heights = LevelHeights::new(&pyramid, 0).unwrap();
        let window = Window {
            row: 0,
            column: 0,
            rows: 500,
            columns: 1,
        };
        assert!(heights.heights(window, &mut vec![0.0; 500]).is_err());
    }
}
