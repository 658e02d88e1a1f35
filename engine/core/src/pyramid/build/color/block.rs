//! Which texels of a level are made at once: some rows of neighbouring tiles.

use std::ops::Range;

use super::layers::{Layer, Layers};
use super::reduce::reduce;
use super::sample::sample_under;
use super::slots::Slots;
use super::{STEPS, Texel};
use crate::geo::TileId;
use crate::pyramid::{COLOR_TEXELS, PyramidError};

/// Texels of a block, or a few more.
const TEXELS: usize = 4 * COLOR_TEXELS * COLOR_TEXELS;
/// Bytes a block takes: its texels as light and stored, the finer level's around them and their rows as light, and a
/// window of pixels.
pub(super) const BYTES: u64 = 15 * 4 * TEXELS as u64;
/// Stored parts wider than this many pixels are read by bands of all their columns, so that each is decoded once.
const WIDE_PIXELS: u32 = 2048;
/// Tiles of a band at most.
const MOST_TILES: u32 = 1024;

/// How a level is cut.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    /// In bands of many tiles and few rows, else in few tiles and all their rows.
    pub(super) wide: bool,
}

/// A part of a level.
pub(super) enum Block {
    /// So many tiles that have no texels of their own.
    Absent(u32),
    /// Texels to be made.
    Made(Area),
}

/// Rows of texels of neighbouring tiles.
pub(super) struct Area {
    pub(super) level: u8,
    /// The row of tiles.
    pub(super) row: u32,
    /// Tiles from west to east.
    pub(super) tiles: Range<u32>,
    /// Rows of texels in the tiles: some of 0..256.
    pub(super) rows: Range<usize>,
}

impl Cut {
    /// A cut that suits the parts in which the images are stored that a level shows itself.
    pub(super) fn of(layers: &Layers<'_>, level: u8) -> Self {
        let is_wide = |layer: &Layer<'_>| layer.image.part_shape()[1] > WIDE_PIXELS;
        Self {
            wide: layers.shown_at(level).any(is_wide),
        }
    }

    /// The blocks of a row of tiles, north to south, then west to east.
    pub(super) fn blocks(self, layers: &Layers<'_>, first: TileId, columns: u32) -> Vec<Block> {
        let has = |column: u32| layers.has(TileId { column, ..first });
        let mut blocks = Vec::new();
        let mut start = 0;
        while start < columns {
            let own = has(start);
            let most = if own { self.most_tiles() } else { u32::MAX };
            let end = (start + 1..columns)
                .find(|&column| has(column) != own || column - start == most)
                .unwrap_or(columns);
            if own {
                blocks.extend(self.bands(first, start..end).map(Block::Made));
            } else {
                blocks.push(Block::Absent(end - start));
            }
            start = end;
        }
        blocks
    }

    const fn most_tiles(self) -> u32 {
        if self.wide { MOST_TILES } else { 4 }
    }

    fn bands(self, first: TileId, tiles: Range<u32>) -> impl Iterator<Item = Area> {
        let rows = (TEXELS / (tiles.len() * COLOR_TEXELS)).clamp(1, COLOR_TEXELS);
        (0..COLOR_TEXELS).step_by(rows).map(move |start| Area {
            level: first.level,
            row: first.row,
            tiles: tiles.clone(),
            rows: start..(start + rows).min(COLOR_TEXELS),
        })
    }
}

impl Block {
    /// Rows of tiles' texels in it.
    pub(super) fn steps(&self) -> u64 {
        match self {
            Self::Absent(tiles) => u64::from(*tiles) * COLOR_TEXELS as u64,
            Self::Made(area) => (area.tiles.len() * area.rows.len()) as u64,
        }
    }
}

impl Area {
    /// The rows in the level's lattice.
    pub(super) fn lattice_rows(&self) -> Range<usize> {
        let first = self.row as usize * STEPS;
        first + self.rows.start..first + self.rows.end
    }

    /// The columns in the level's lattice.
    pub(super) fn lattice_columns(&self) -> Range<usize> {
        self.tiles.start as usize * STEPS..self.tiles.end as usize * STEPS + 1
    }

    /// Its texels, row by row: means of the finer level's, and under them the images that no finer level shows.
    pub(super) fn texels(
        &self,
        layers: &Layers<'_>,
        below: &[&Layer<'_>],
        finer: Option<&Slots>,
    ) -> Result<Vec<Texel>, PyramidError> {
        let (mut texels, whole) = reduce(self, layers, finer)?;
        if !whole.is_whole() {
            sample_under(self, layers.grid, below, &whole, &mut texels)?;
        }
        Ok(texels)
    }
}
