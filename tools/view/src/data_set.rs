//! An open pyramid: what is said of it, and the path to fly over it.

use std::{path::Path as FilePath, sync::Arc};

use anyhow::Result;
use drumlin_core::{
    geo::{TILE_CELLS, TILE_SAMPLES, TileId, WorldFrame},
    pyramid::{Metadata, Pyramid, surface},
    stream::TileSource,
    terrain::PyramidSource,
};
use serde_json::{Value, json};

use crate::{
    auto_path::auto_path,
    path::{self, Key},
};

/// Levels looked at to find a way over the ground: at most 16 tiles are read, whatever the size of the pyramid.
const GROUND_LEVEL: u8 = 2;

/// An open pyramid.
pub(crate) struct DataSet {
    pub(crate) source: Arc<PyramidSource>,
    name: String,
}

impl DataSet {
    pub(crate) fn open(folder: &FilePath) -> Result<Self> {
        let name = folder
            .file_name()
            .unwrap_or(folder.as_os_str())
            .to_string_lossy()
            .into_owned();
        Ok(Self {
            source: Arc::new(PyramidSource::open(folder)?),
            name,
        })
    }

    pub(crate) fn metadata(&self) -> &Metadata {
        self.source.metadata()
    }

    pub(crate) fn frame(&self) -> WorldFrame {
        self.metadata().frame()
    }

    /// The longer side in metres; of a single sample, one metre.
    pub(crate) fn size_metres(&self) -> f64 {
        let extent = self.metadata().grid.extent();
        let [low, high] = [extent.min, extent.max].map(|corner| self.frame().to_world(corner));
        (high[0] - low[0]).max(high[1] - low[1]).max(1.0)
    }

    /// The keys of a path file, or of a path made from the terrain.
    pub(crate) fn keys(&self, file: Option<&FilePath>) -> Result<Vec<Key>> {
        match file {
            Some(file) => path::read(file),
            None => {
                let ground = Ground::read(self.source.pyramid())?;
                auto_path(&self.metadata().grid.extent(), &self.frame(), &|place| {
                    ground.height(place)
                })
            }
        }
    }

    /// What a report says of it.
    pub(crate) fn describe(&self) -> Value {
        let metadata = self.metadata();
        json!({
            "name": self.name,
            "samples": [metadata.grid.columns, metadata.grid.rows],
            "crs": metadata.crs.label(),
            "levels": metadata.levels.len(),
            "eps": metadata.eps,
            "unit": metadata.unit(),
            "height_range": metadata.height_range.map(|height| f64::from(height) * metadata.unit()),
            "sources": metadata.sources.iter().map(|source| &source.name).collect::<Vec<_>>(),
        })
    }
}

/// Heights of a coarse level that the ground is nowhere above.
struct Ground<'a> {
    metadata: &'a Metadata,
    level: u8,
    /// Metres, tile by tile, row by row, each with its tile's geometric error on top.
    tiles: Vec<Vec<f64>>,
}

impl<'a> Ground<'a> {
    fn read(pyramid: &'a Pyramid) -> Result<Self> {
        let metadata = pyramid.metadata();
        let level = metadata.finest().min(GROUND_LEVEL);
        let [rows, columns] = metadata.grid.tiles(level);
        let read = |index: u32| -> Result<Vec<f64>> {
            let tile =
                pyramid.read_tile_chain(TileId::new(level, index / columns, index % columns))?;
            let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
            let metres =
                |height: i32| f64::from(height) * metadata.unit() + f64::from(tile.summary.error);
            Ok(heights.into_iter().map(metres).collect())
        };
        Ok(Self {
            metadata,
            level,
            tiles: (0..rows * columns).map(read).collect::<Result<_>>()?,
        })
    }

    /// The highest corner of the cell at CRS coordinates; none outside.
    fn height(&self, place: [f64; 2]) -> Option<f64> {
        let grid = &self.metadata.grid;
        if !grid.extent().contains(place) {
            return None;
        }
        let place = grid.at_level(self.level).row_column(place);
        let [tile_rows, tile_columns] = grid.tiles(self.level).map(|count| count as usize);
        let [(tile_row, row), (tile_column, column)] =
            [(place[0], tile_rows), (place[1], tile_columns)].map(cell);
        let heights = &self.tiles[tile_row * tile_columns + tile_column];
        let corner = row * TILE_SAMPLES + column;
        let corners = [0, 1, TILE_SAMPLES, TILE_SAMPLES + 1].map(|step| heights[corner + step]);
        corners.into_iter().reduce(f64::max)
    }
}

/// The tile and the cell in it of a row or column with a fraction.
#[expect(
    clippy::cast_possible_truncation,
    reason = "clamped to the level's cells"
)]
fn cell((at, tiles): (f64, usize)) -> (usize, usize) {
    let cell = (at.max(0.0) as usize).min(tiles * TILE_CELLS - 1);
    (cell / TILE_CELLS, cell % TILE_CELLS)
}
