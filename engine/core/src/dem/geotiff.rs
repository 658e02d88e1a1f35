//! Writes heights as a tiled GeoTIFF of 32-bit numbers, tile by tile in constant memory, with overviews if asked for.
//!
//! Directories lie at the start of the file, as cloud-optimised readers want them; the numbers in them that say where
//! tiles lie are filled in at the end. A file that could pass 4 GiB becomes a BigTIFF.
//!
//! ```text
//! header │ directory 0 (the raster) │ directory 1 (half its size) │ … │ tiles, in the order they are written
//! ```
//!
//! Based on: TIFF 6.0 (Adobe, 1992), its Technical Note 3 (floating-point predictor), the BigTIFF design (Joris Van
//! Damme, 2007), OGC GeoTIFF 1.1 (19-008r4).

mod directory;
mod encode;
mod keys;

use std::{
    fs::File,
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use self::{
    directory::{Directory, Format, Place},
    encode::encode,
};
use super::{DemError, Raster, Window};
use crate::geo::{Crs, Grid};

/// Pixels a side of a stored tile.
pub const TIFF_TILE: u32 = 512;

/// How tiles are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// As they are.
    None,
    /// With zstd at a level from 1, after the floating-point predictor.
    Zstd(i32),
}

/// What a file is to hold.
#[derive(Clone, Debug)]
pub struct GeoTiffLayout<'a> {
    /// The points of the raster's samples.
    pub grid: &'a Grid,
    /// What the grid's coordinates are.
    pub crs: &'a Crs,
    /// True where some heights may be NaN, which is then declared as void.
    pub voids: bool,
    /// How tiles are compressed.
    pub compression: Compression,
    /// True for half the size, a quarter of it, … down to one tile.
    pub overviews: bool,
}

impl GeoTiffLayout<'_> {
    /// Rows and columns of the raster and of its overviews.
    #[must_use]
    pub fn image_shapes(&self) -> Vec<[u32; 2]> {
        let mut shapes = vec![[self.grid.rows, self.grid.columns]];
        while self.overviews
            && let Some(&shape) = shapes.last()
            && shape.iter().any(|&side| side > TIFF_TILE)
        {
            shapes.push(shape.map(|side| side.div_ceil(2)));
        }
        shapes
    }
}

/// A GeoTIFF under way.
#[derive(Debug)]
pub struct GeoTiffWriter<'a> {
    file: &'a mut File,
    path: PathBuf,
    format: Format,
    compression: Compression,
    images: Vec<Image>,
    /// Where the next tile goes.
    end: u64,
}

/// One image of the file: the raster or an overview.
#[derive(Debug)]
struct Image {
    shape: [u32; 2],
    /// Offset and bytes of each tile; zeros where it is left out.
    tiles: Vec<[u64; 2]>,
    offsets: Place,
    byte_counts: Place,
}

impl<'a> GeoTiffWriter<'a> {
    /// Writes the directories. `path` is what to call the file in messages.
    ///
    /// # Errors
    /// [`DemError::Io`].
    pub fn new(
        file: &'a mut File,
        path: &Path,
        layout: &GeoTiffLayout<'_>,
    ) -> Result<Self, DemError> {
        let shapes = layout.image_shapes();
        let format = Format::for_bytes(shapes.iter().map(|&shape| most_bytes(shape)).sum());
        let mut bytes = format.header();
        let mut images = Vec::new();
        for (index, &shape) in shapes.iter().enumerate() {
            let directory = Directory::new(layout, index, shape, tile_count(shape));
            let last = index + 1 == shapes.len();
            let [offsets, byte_counts] = directory.write(format, last, &mut bytes);
            images.push(Image {
                shape,
                tiles: vec![[0; 2]; tile_count(shape)],
                offsets,
                byte_counts,
            });
        }
        file.write_all(&bytes)
            .map_err(|error| DemError::io(path, error))?;
        Ok(Self {
            file,
            path: path.into(),
            format,
            compression: layout.compression,
            images,
            end: bytes.len() as u64,
        })
    }

    /// Writes an image's tiles: 0 the raster, 1 its first overview.
    ///
    /// `heights` is asked for every tile's window, from several threads, and fills it row by row; windows end where the
    /// image does. A tile of which every height is NaN is left out. `progress` is told how many tiles are done.
    ///
    /// # Errors
    /// What `heights` says; [`DemError::Io`].
    pub fn write_image<E: From<DemError> + Send>(
        &mut self,
        image: usize,
        heights: impl Fn(Window, &mut [f32]) -> Result<(), E> + Sync,
        mut progress: impl FnMut(u64),
    ) -> Result<(), E> {
        let shape = self.images[image].shape;
        let count = tile_count(shape);
        let compression = self.compression;
        let make = |tile: usize| {
            let window = tile_window(shape, tile);
            let mut samples = vec![0.0; (window.rows * window.columns) as usize];
            heights(window, &mut samples)?;
            if samples.iter().all(|height| height.is_nan()) {
                return Ok(None);
            }
            let bytes = encode(&padded(&samples, window), compression);
            bytes
                .map(Some)
                .map_err(|error| E::from(DemError::io(&self.path, error)))
        };
        // So many at a time that all threads have work; memory is a few tiles a thread.
        let batch = 4 * rayon::current_num_threads();
        for first in (0..count).step_by(batch) {
            let tiles: Result<Vec<Option<Vec<u8>>>, E> = (first..count.min(first + batch))
                .into_par_iter()
                .map(&make)
                .collect();
            for (tile, bytes) in (first..).zip(tiles?) {
                let Some(bytes) = bytes else { continue };
                self.file
                    .write_all(&bytes)
                    .map_err(|error| DemError::io(&self.path, error))?;
                self.images[image].tiles[tile] = [self.end, bytes.len() as u64];
                self.end += bytes.len() as u64;
            }
            progress(count.min(first + batch) as u64);
        }
        Ok(())
    }

    /// Fills in where the tiles lie. Without it the file is none.
    ///
    /// # Errors
    /// [`DemError::Io`].
    pub fn finish(self) -> Result<(), DemError> {
        let mut fill = || -> io::Result<()> {
            for image in &self.images {
                for (place, which) in [(&image.offsets, 0), (&image.byte_counts, 1)] {
                    self.file.seek(SeekFrom::Start(place.offset))?;
                    let numbers = image.tiles.iter().map(|tile| tile[which]);
                    self.file.write_all(&self.format.numbers(numbers))?;
                }
            }
            Ok(())
        };
        fill().map_err(|error| DemError::io(&self.path, error))
    }
}

/// Writes a raster as a GeoTIFF. `progress` is told how many tiles of how many are done.
///
/// # Errors
/// What the raster says; [`DemError::Io`].
pub fn write_raster(
    raster: &dyn Raster,
    compression: Compression,
    file: &mut File,
    path: &Path,
    mut progress: impl FnMut(u64, u64),
) -> Result<(), DemError> {
    let header = raster.header();
    let layout = GeoTiffLayout {
        grid: &header.grid,
        crs: &header.crs,
        voids: true,
        compression,
        overviews: false,
    };
    let mut writer = GeoTiffWriter::new(file, path, &layout)?;
    let total = tile_count([header.grid.rows, header.grid.columns]) as u64;
    let heights = |window: Window, out: &mut [f32]| -> Result<(), DemError> {
        let mut metres = vec![0.0; out.len()];
        raster.read(window, &mut metres)?;
        for (out, metres) in out.iter_mut().zip(metres) {
            #[expect(clippy::cast_possible_truncation, reason = "the file holds 32 bits")]
            let height = metres as f32;
            *out = height;
        }
        Ok(())
    };
    writer.write_image(0, heights, |done| progress(done, total))?;
    writer.finish()
}

fn tiles_across(shape: [u32; 2]) -> [usize; 2] {
    shape.map(|side| side.div_ceil(TIFF_TILE) as usize)
}

fn tile_count(shape: [u32; 2]) -> usize {
    let [rows, columns] = tiles_across(shape);
    rows * columns
}

/// No image is larger in the file.
fn most_bytes(shape: [u32; 2]) -> u64 {
    // Tiles that do not compress grow by less than 1 in 128; an entry of a directory takes 16 bytes.
    let tile = 4 * u64::from(TIFF_TILE) * u64::from(TIFF_TILE);
    tile_count(shape) as u64 * (tile + tile / 128 + 16) + 4096
}

fn tile_window([rows, columns]: [u32; 2], tile: usize) -> Window {
    let [_, across] = tiles_across([rows, columns]);
    #[expect(clippy::cast_possible_truncation, reason = "rows and columns are u32")]
    let [row, column] = [tile / across, tile % across].map(|at| at as u32 * TIFF_TILE);
    Window {
        row,
        column,
        rows: TIFF_TILE.min(rows - row),
        columns: TIFF_TILE.min(columns - column),
    }
}

/// A whole tile: the last row and column repeated past the image's end, which compresses well.
fn padded(samples: &[f32], window: Window) -> Vec<f32> {
    let [rows, columns, side] = [window.rows, window.columns, TIFF_TILE].map(|n| n as usize);
    let mut tile = Vec::with_capacity(side * side);
    for row in 0..side {
        let row = &samples[row.min(rows - 1) * columns..][..columns];
        tile.extend_from_slice(row);
        tile.extend(std::iter::repeat_n(row[columns - 1], side - columns));
    }
    tile
}

#[cfg(test)]
mod tests;
