//! A pyramid as a cloud-optimised GeoTIFF: the finest heights as they are, and an overview a level.
//!
//! The pixels of an overview are the areas of 2 × 2 finer ones, so their middles lie half a finest pixel, one and a
//! half, … off the samples of the level of that size. Heights there are between four samples of the level, which is a
//! least-squares fit of that very surface to the finest heights.
//!
//! ```text
//! level      ×───────×───────×
//! overview     ■       ■            (s − 1) / 2 s of a step further on, s the level's stride
//! finest     × ■ × ■ × ■ × ■ ×
//! ```

use std::{fs::File, path::Path};

use super::{LevelHeights, Pyramid, PyramidError};
use crate::dem::{Compression, GeoTiffLayout, GeoTiffWriter, Raster, Window};

/// Writes the heights of a pyramid as a GeoTIFF of 32-bit numbers, NaN where void, with overviews; the coarsest come
/// first, as readers over a network want it. Works on the caller's threads in constant memory. `path` is what to call
/// the file in messages; `progress` is told how many pixels of how many are done.
///
/// # Errors
///
/// Where a tile cannot be read, or the file cannot be written.
pub fn export_geotiff(
    pyramid: &Pyramid,
    compression: Compression,
    file: &mut File,
    path: &Path,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), PyramidError> {
    let metadata = pyramid.metadata();
    let layout = GeoTiffLayout {
        grid: &metadata.grid,
        crs: &metadata.crs,
        voids: true,
        compression,
        overviews: true,
    };
    let shapes = layout.image_shapes();
    let pixels = |shape: [u32; 2]| u64::from(shape[0]) * u64::from(shape[1]);
    let total = shapes.iter().map(|&shape| pixels(shape)).sum();
    let mut done = 0;
    let mut writer = GeoTiffWriter::new(file, path, &layout)?;
    for (image, level) in (0..shapes.len()).zip((0..=metadata.finest()).rev()).rev() {
        let level = LevelHeights::new(pyramid, level)?;
        let heights = |window: Window, out: &mut [f32]| pixels_of(&level, image, window, out);
        writer.write_image::<PyramidError>(image, heights, |_| {})?;
        done += pixels(shapes[image]);
        progress(done, total);
    }
    Ok(writer.finish()?)
}

/// The pixels of an image, 0 the finest, from the level of its size.
fn pixels_of(
    level: &LevelHeights<'_>,
    image: usize,
    window: Window,
    out: &mut [f32],
) -> Result<(), PyramidError> {
    let grid = &level.header().grid;
    // One more row and column, where there are any, to be between.
    let samples = Window {
        rows: (window.rows + 1).min(grid.rows - window.row),
        columns: (window.columns + 1).min(grid.columns - window.column),
        ..window
    };
    let [rows, columns] = [samples.rows as usize, samples.columns as usize];
    let mut heights = vec![0.0; rows * columns];
    level.heights(samples, &mut heights)?;
    let stride = (image as f64).exp2();
    let off = (stride - 1.0) / (2.0 * stride);
    for (row, out) in out.chunks_exact_mut(window.columns as usize).enumerate() {
        let next_row = (row + 1).min(rows - 1);
        for (column, out) in out.iter_mut().enumerate() {
            let next_column = (column + 1).min(columns - 1);
            let mut sum = [0.0; 2];
            for (row, down) in [(row, 1.0 - off), (next_row, off)] {
                for (column, across) in [(column, 1.0 - off), (next_column, off)] {
                    let height = heights[row * columns + column];
                    let weight = down * across;
                    if weight > 0.0 && !height.is_nan() {
                        sum = [sum[0] + weight * height, sum[1] + weight];
                    }
                }
            }
            #[expect(clippy::cast_possible_truncation, reason = "the file holds 32 bits")]
            let height = (sum[0] / sum[1]) as f32;
            // 0 / 0 where all four are void.
            *out = height;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        dem::{OpenOptions, open},
        pyramid::sample,
    };

    fn exported(rows: u32, columns: u32) -> (tempfile::TempDir, Pyramid, Box<dyn Raster>) {
        let folder = tempfile::tempdir().unwrap();
        let [path, tif] = ["out.zarr", "out.tif"].map(|name| folder.path().join(name));
        sample::write(&path, rows, columns);
        let pyramid = Pyramid::open(&path).unwrap();
        let mut file = File::create(&tif).unwrap();
        let mut told = Vec::new();
        export_geotiff(
            &pyramid,
            Compression::Zstd(3),
            &mut file,
            &tif,
            &mut |done, total| told.push([done, total]),
        )
        .unwrap();
        assert!(told.last().is_some_and(|told| told[0] == told[1]));
        let raster = open(&tif, &OpenOptions::default()).unwrap();
        (folder, pyramid, raster)
    }

    #[test]
    fn the_finest_heights_come_out_as_they_are() {
        let (_folder, pyramid, raster) = exported(700, 600);
        let metadata = pyramid.metadata();
        assert_eq!(raster.header().grid, metadata.grid);
        assert_eq!(raster.header().crs.kind, metadata.crs.kind);
        let level = LevelHeights::new(&pyramid, metadata.finest()).unwrap();
        let whole = Window::whole(&metadata.grid);
        let read = |raster: &dyn Raster| {
            let mut out = vec![0.0; 700 * 600];
            raster.read(whole, &mut out).unwrap();
            out
        };
        for (at, (found, want)) in read(&*raster).into_iter().zip(read(&level)).enumerate() {
            // Units are powers of two and heights small: 32 bits hold them.
            assert!(
                found == want || found.is_nan() && want.is_nan(),
                "{at}: {found} {want}"
            );
        }
    }

    #[test]
    fn overviews_lie_between_the_samples_of_their_level() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.zarr");
        sample::write(&path, 700, 300);
        let pyramid = Pyramid::open(&path).unwrap();
        let level = LevelHeights::new(&pyramid, pyramid.metadata().finest() - 1).unwrap();
        let window = |row, column, rows, columns| Window {
            row,
            column,
            rows,
            columns,
        };
        let mut four = [0.0; 4];
        level.heights(window(200, 100, 2, 2), &mut four).unwrap();
        let mut pixel = [0.0_f32];
        pixels_of(&level, 1, window(200, 100, 1, 1), &mut pixel).unwrap();
        // A quarter of a step from the first sample: weights of 3/4 and 1/4 each way.
        let want = (9.0 * four[0] + 3.0 * four[1] + 3.0 * four[2] + four[3]) / 16.0;
        assert!(
            (f64::from(pixel[0]) - want).abs() < 1e-3,
            "{pixel:?} {want}"
        );
        // The last pixel of an image of 350 x 150 has no sample beyond it to be between.
        let mut last = [0.0_f32];
        pixels_of(&level, 1, window(350, 150, 1, 1), &mut last).unwrap();
        assert!(last[0].is_finite());
    }
}
