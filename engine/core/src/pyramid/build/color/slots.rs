//! A level's texels on the disk, a slot a tile: what is written as shards and reduced to the next level.
//!
//! ```text
//! scratch/color-L   slot = tile row · tile columns + tile column
//!                   256 × 256 texels, row by row; then columns 0, 1, 254 and 255 once more, each in one piece
//! ```
//!
//! Any number of threads write rows of tiles, each place by one of them, and read once all is written. Slots of tiles
//! without texels of their own are holes in the file.

use std::fs::{self, File};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::block::Area;
use super::{STEPS, Texel};
use crate::geo::TileId;
use crate::pyramid::files::{read_exact_at, write_all_at};
use crate::pyramid::{COLOR_TEXELS, PyramidError};

/// A texel of a tile that has none of its own. No texel is made so: without alpha all is 0.
pub(super) const NOT_MADE: Texel = [1, 0, 0, 0];
/// The columns that are there twice, for the tiles beside.
const EDGES: [usize; 4] = [0, 1, COLOR_TEXELS - 2, COLOR_TEXELS - 1];
/// Texels of a slot.
const SLOT_TEXELS: usize = COLOR_TEXELS * (COLOR_TEXELS + EDGES.len());

/// The texels of a level.
pub(super) struct Slots {
    file: File,
    path: PathBuf,
    columns: u32,
}

impl Slots {
    /// A file for a level of so many rows and columns of tiles.
    pub(super) fn create(scratch: &Path, level: u8, tiles: [u32; 2]) -> Result<Self, PyramidError> {
        fs::create_dir_all(scratch).map_err(PyramidError::io("creating", scratch))?;
        let path = scratch.join(format!("color-{level}"));
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(&path)
            .map_err(PyramidError::io("creating", &path))?;
        Ok(Self {
            file,
            path,
            columns: tiles[1],
        })
    }

    /// Writes the texels of a block.
    pub(super) fn write(&self, area: &Area, texels: &[Texel]) -> Result<(), PyramidError> {
        let (width, rows) = (area.lattice_columns().len(), area.rows.len());
        let mut part = Vec::with_capacity(rows * COLOR_TEXELS);
        for (index, column) in area.tiles.clone().enumerate() {
            let line = |row: usize| &texels[row * width + index * STEPS..][..COLOR_TEXELS];
            part.clear();
            (0..rows).for_each(|row| part.extend_from_slice(line(row)));
            self.put([area.row, column], area.rows.start * COLOR_TEXELS, &part)?;
            for (edge, inside) in EDGES.into_iter().enumerate() {
                part.clear();
                part.extend((0..rows).map(|row| line(row)[inside]));
                let first = (COLOR_TEXELS + edge) * COLOR_TEXELS + area.rows.start;
                self.put([area.row, column], first, &part)?;
            }
        }
        Ok(())
    }

    /// The texels of a tile, row by row.
    pub(super) fn tile(&self, tile: TileId) -> Result<Vec<Texel>, PyramidError> {
        let mut texels = vec![[0; 4]; COLOR_TEXELS * COLOR_TEXELS];
        self.get([tile.row, tile.column], 0, &mut texels)?;
        Ok(texels)
    }

    /// The texels of a rectangle of the level's lattice, [`NOT_MADE`] in tiles that have none.
    pub(super) fn lattice(
        &self,
        level: u8,
        rows: &Range<usize>,
        columns: &Range<usize>,
        has: impl Fn(TileId) -> bool,
    ) -> Result<Vec<Texel>, PyramidError> {
        let mut out = vec![NOT_MADE; rows.len() * columns.len()];
        let mut part = Vec::new();
        for (row, inside_rows) in tiles_of(rows) {
            for (column, inside_columns) in tiles_of(columns) {
                if column >= self.columns || !has(TileId::new(level, row, column)) {
                    continue;
                }
                let place = |inside_row: usize| {
                    let down = row as usize * STEPS + inside_row - rows.start;
                    let across = column as usize * STEPS + inside_columns.start - columns.start;
                    down * columns.len() + across
                };
                let strips: Vec<usize> = (0..EDGES.len())
                    .filter(|&edge| inside_columns.contains(&EDGES[edge]))
                    .collect();
                if strips.len() == inside_columns.len() {
                    for (offset, edge) in strips.into_iter().enumerate() {
                        part.resize(inside_rows.len(), [0; 4]);
                        let first = (COLOR_TEXELS + edge) * COLOR_TEXELS + inside_rows.start;
                        self.get([row, column], first, &mut part)?;
                        for (inside, texel) in inside_rows.clone().zip(&part) {
                            out[place(inside) + offset] = *texel;
                        }
                    }
                } else {
                    part.resize(inside_rows.len() * COLOR_TEXELS, [0; 4]);
                    self.get([row, column], inside_rows.start * COLOR_TEXELS, &mut part)?;
                    let lines = part.chunks_exact(COLOR_TEXELS);
                    for (inside, line) in inside_rows.clone().zip(lines) {
                        let line = &line[inside_columns.clone()];
                        out[place(inside)..][..line.len()].copy_from_slice(line);
                    }
                }
            }
        }
        Ok(out)
    }

    /// Removes the file.
    pub(super) fn remove(self) -> Result<(), PyramidError> {
        fs::remove_file(&self.path).map_err(PyramidError::io("removing", self.path))
    }

    fn put(&self, tile: [u32; 2], first: usize, texels: &[Texel]) -> Result<(), PyramidError> {
        write_all_at(&self.file, texels.as_flattened(), self.offset(tile, first))
            .map_err(PyramidError::io("writing", &self.path))
    }

    fn get(&self, tile: [u32; 2], first: usize, out: &mut [Texel]) -> Result<(), PyramidError> {
        read_exact_at(&self.file, out.as_flattened_mut(), self.offset(tile, first))
            .map_err(PyramidError::io("reading", &self.path))
    }

    /// The byte of a tile's texel.
    fn offset(&self, [row, column]: [u32; 2], texel: usize) -> u64 {
        let slot = u64::from(row) * u64::from(self.columns) + u64::from(column);
        (slot * SLOT_TEXELS as u64 + texel as u64) * size_of::<Texel>() as u64
    }
}

/// The tiles that hold some rows (or columns) of a lattice, and which of their own those are. Lines on tiles' borders
/// belong to two tiles.
fn tiles_of(lines: &Range<usize>) -> impl Iterator<Item = (u32, Range<usize>)> + use<> {
    let lines = lines.clone();
    let first = lines.start.saturating_sub(1) / STEPS;
    let last = lines.end.saturating_sub(1) / STEPS;
    (first..=last).filter_map(move |tile| {
        let inside = lines.start.max(tile * STEPS)..lines.end.min(tile * STEPS + COLOR_TEXELS);
        let own =
            inside.start.saturating_sub(tile * STEPS)..inside.end.saturating_sub(tile * STEPS);
        (!inside.is_empty()).then(|| (u32::try_from(tile).unwrap_or(u32::MAX), own))
    })
}
