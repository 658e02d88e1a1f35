//! Imagery over the terrain: colour tiles whose border texels are their neighbours' too.
//!
//! Texel (i, j) of a tile lies at i / 255 and j / 255 of its sides, so a level's texels form one lattice of 255 steps a
//! tile, and every second step of a level is a step of the next coarser one. Means are taken of linear light.

use rayon::prelude::*;

use super::options::{Imagery, Stage, Watch};
use crate::dem::Image;
use crate::geo::{Extent, Grid, TILE_CELLS, TileId};
use crate::pyramid::{
    COLOR_TEXELS, ColorMetadata, PyramidError, PyramidWriter, ShardInfo,
    light::{LINEAR, encode},
    shard_count,
};

/// Steps of the lattice across a tile.
const STEPS: usize = COLOR_TEXELS - 1;

/// Makes and writes all colour levels.
pub(super) fn write(
    imagery: &Imagery<'_>,
    grid: &Grid,
    writer: &PyramidWriter,
    watch: &Watch<'_>,
) -> Result<(ColorMetadata, Vec<ShardInfo>), PyramidError> {
    let place = Placed::new(imagery.image, grid);
    let levels = place.level_count(grid);
    let shards_of = |level: u8| {
        let [rows, columns] = shard_count(grid.tiles(level));
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [row, column]))
    };
    let total = (0..levels).map(|level| shards_of(level).count() as u64);
    let advance = watch.stage(Stage::Color, total.sum());
    let mut lattice = Lattice::sample(&place, grid, levels - 1);
    let mut infos = Vec::new();
    for level in (0..levels).rev() {
        let tiles = grid.tiles(level);
        if level + 1 < levels {
            lattice = lattice.coarser(tiles);
        }
        for shard in shards_of(level) {
            let texels = |tile: TileId| Ok(Some(lattice.tile(tile)));
            infos.push(writer.write_color_shard(level, tiles, shard, &texels)?);
            advance(1)?;
        }
    }
    let texels = u32::try_from(COLOR_TEXELS).unwrap_or(u32::MAX);
    Ok((
        ColorMetadata {
            levels,
            texels,
            sources: imagery.sources.clone(),
        },
        infos,
    ))
}

/// Levels of imagery that a picture makes.
pub(super) fn level_count(image: &Image, grid: &Grid) -> u8 {
    Placed::new(image, grid).level_count(grid)
}

/// Bytes the imagery takes while it is built, besides the picture itself.
pub(super) fn memory_bytes(image: &Image, grid: &Grid) -> u64 {
    let [rows, columns] = grid
        .tiles(level_count(image, grid) - 1)
        .map(|count| u64::from(count) * STEPS as u64 + 1);
    rows * columns * 5 + image.rgb.len() as u64
}

/// A picture and where it lies.
struct Placed<'a> {
    image: &'a Image,
    extent: Extent,
}

impl<'a> Placed<'a> {
    /// A picture that does not say where it lies covers the samples' own squares.
    fn new(image: &'a Image, grid: &Grid) -> Self {
        let all = grid.extent();
        let half = grid.step.map(|step| 0.5 * step.abs());
        let squares = Extent {
            min: [all.min[0] - half[0], all.min[1] - half[1]],
            max: [all.max[0] + half[0], all.max[1] + half[1]],
        };
        Self {
            image,
            extent: image.extent.unwrap_or(squares),
        }
    }

    /// Pixels a finest sample, down and across.
    fn pixels_per_sample(&self, grid: &Grid) -> [f64; 2] {
        let span = [
            self.extent.max[1] - self.extent.min[1],
            self.extent.max[0] - self.extent.min[0],
        ];
        [
            f64::from(self.image.height) / span[0] * grid.step[1].abs(),
            f64::from(self.image.width) / span[1] * grid.step[0].abs(),
        ]
    }

    /// As many levels as the picture's resolution deserves: texels no wider than 1.4 pixels.
    fn level_count(&self, grid: &Grid) -> u8 {
        let [down, across] = self.pixels_per_sample(grid);
        let finest_pixel = down.max(across);
        let enough =
            |level: &u8| samples_per_texel(grid, *level) * finest_pixel <= std::f64::consts::SQRT_2;
        (0..grid.level_count())
            .find(enough)
            .map_or(grid.level_count(), |level| level + 1)
    }
}

fn samples_per_texel(grid: &Grid, level: u8) -> f64 {
    f64::from(grid.stride(level)) * TILE_CELLS as f64 / STEPS as f64
}

/// The texels of a level: red, green, blue and alpha, row by row.
struct Lattice {
    rows: usize,
    columns: usize,
    texels: Vec<[u8; 4]>,
}

impl Lattice {
    fn new(tiles: [u32; 2]) -> Self {
        let [rows, columns] = tiles.map(|count| count as usize * STEPS + 1);
        Self {
            rows,
            columns,
            texels: vec![[0; 4]; rows * columns],
        }
    }

    /// Samples a picture at the texels of a level; outside of it alpha is 0.
    fn sample(place: &Placed<'_>, grid: &Grid, level: u8) -> Self {
        let mut lattice = Self::new(grid.tiles(level));
        let step = samples_per_texel(grid, level);
        let factors = place
            .pixels_per_sample(grid)
            .map(|pixels| (pixels * step).round().clamp(1.0, 65_536.0));
        let shrunk = Shrunk::new(place.image, factors);
        let (extent, columns) = (&place.extent, lattice.columns);
        let [height, width] = [place.image.height, place.image.width].map(f64::from);
        lattice
            .texels
            .par_chunks_exact_mut(columns)
            .enumerate()
            .for_each(|(row, line)| {
                for (column, texel) in line.iter_mut().enumerate() {
                    let [x, y] = grid.position(row as f64 * step, column as f64 * step);
                    let across = (x - extent.min[0]) / (extent.max[0] - extent.min[0]) * width;
                    let down = (extent.max[1] - y) / (extent.max[1] - extent.min[1]) * height;
                    if (0.0..=height).contains(&down) && (0.0..=width).contains(&across) {
                        *texel = shrunk.at([down / factors[0] - 0.5, across / factors[1] - 0.5]);
                    }
                }
            });
        lattice
    }

    /// The next coarser level: every second texel, weighed (1, 2, 1) with its neighbours each way.
    fn coarser(&self, tiles: [u32; 2]) -> Self {
        let mut coarse = Self::new(tiles);
        let columns = coarse.columns;
        coarse
            .texels
            .par_chunks_exact_mut(columns)
            .enumerate()
            .for_each(|(row, line)| {
                for (column, texel) in line.iter_mut().enumerate() {
                    *texel = self.mean(2 * row, 2 * column);
                }
            });
        coarse
    }

    fn mean(&self, row: usize, column: usize) -> [u8; 4] {
        let mut sum = [0.0_f32; 4];
        let mut weights = 0.0;
        for (down, row_weight) in [(0, 1.0), (1, 2.0), (2, 1.0)] {
            for (across, column_weight) in [(0, 1.0), (1, 2.0), (2, 1.0)] {
                let inside = |place: usize, count: usize| {
                    place.checked_sub(1).filter(|place| *place < count)
                };
                let (Some(row), Some(column)) = (
                    inside(row + down, self.rows),
                    inside(column + across, self.columns),
                ) else {
                    continue;
                };
                let [r, g, b, alpha] = self.texels[row * self.columns + column];
                let weight = row_weight * column_weight;
                weights += weight;
                let covered = weight * f32::from(alpha);
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    *sum += covered * LINEAR[usize::from(value)];
                }
                sum[3] += covered;
            }
        }
        if sum[3] == 0.0 {
            return [0; 4];
        }
        let [r, g, b] = [sum[0], sum[1], sum[2]].map(|light| encode(light / sum[3]));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a mean of u8"
        )]
        let alpha = (sum[3] / weights).round() as u8;
        [r, g, b, alpha]
    }

    /// A tile's texels as bytes.
    fn tile(&self, tile: TileId) -> Vec<u8> {
        let [first_row, first_column] = [tile.row, tile.column].map(|index| index as usize * STEPS);
        let line = |row: usize| &self.texels[row * self.columns + first_column..][..COLOR_TEXELS];
        (first_row..first_row + COLOR_TEXELS)
            .flat_map(|row| line(row).as_flattened().iter().copied())
            .collect()
    }
}

/// A picture shrunk by whole factors where texels are wider than pixels.
struct Shrunk<'a> {
    rows: usize,
    columns: usize,
    rgb: std::borrow::Cow<'a, [[u8; 3]]>,
}

impl<'a> Shrunk<'a> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole numbers from 1 to 65,536"
    )]
    fn new(image: &'a Image, factors: [f64; 2]) -> Self {
        let [down, across] = factors.map(|factor| factor as usize);
        let [height, width] = [image.height, image.width].map(|side| side as usize);
        if [down, across] == [1, 1] {
            return Self {
                rows: height,
                columns: width,
                rgb: (&image.rgb).into(),
            };
        }
        let [rows, columns] = [height.div_ceil(down), width.div_ceil(across)];
        let mean = |row: usize, column: usize| {
            let mut sum = [0.0_f32; 3];
            let mut count = 0.0;
            for row in row * down..((row + 1) * down).min(height) {
                for pixel in
                    &image.rgb[row * width..][column * across..((column + 1) * across).min(width)]
                {
                    sum.iter_mut()
                        .zip(pixel)
                        .for_each(|(sum, value)| *sum += LINEAR[usize::from(*value)]);
                    count += 1.0;
                }
            }
            sum.map(|sum| encode(sum / count))
        };
        let rgb: Vec<[u8; 3]> = (0..rows * columns)
            .into_par_iter()
            .map(|at| mean(at / columns, at % columns))
            .collect();
        Self {
            rows,
            columns,
            rgb: rgb.into(),
        }
    }

    /// The colour at a row and column counted between pixel centres, linear between them.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the picture"
    )]
    fn at(&self, [row, column]: [f64; 2]) -> [u8; 4] {
        let split = |place: f64, count: usize| {
            let place = place.clamp(0.0, (count - 1) as f64);
            let first = place.floor() as usize;
            (
                first,
                (first + 1).min(count - 1),
                (place - place.floor()) as f32,
            )
        };
        let (north, south, down) = split(row, self.rows);
        let (west, east, across) = split(column, self.columns);
        let light = |row: usize, column: usize, channel: usize| {
            LINEAR[usize::from(self.rgb[row * self.columns + column][channel])]
        };
        let [r, g, b] = [0, 1, 2].map(|channel| {
            let line = |row: usize| {
                light(row, west, channel) * (1.0 - across) + light(row, east, channel) * across
            };
            encode(line(north) * (1.0 - down) + line(south) * down)
        });
        [r, g, b, u8::MAX]
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "test pictures wrap")]
mod tests {
    use super::*;
    use crate::geo::Crs;

    fn grid(side: u32) -> Grid {
        Grid {
            columns: side,
            rows: side,
            origin: [0.0, 0.0],
            step: [1.0, -1.0],
        }
    }

    fn image(side: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Image {
        let rgb = (0..side * side)
            .map(|at| color(at / side, at % side))
            .collect();
        Image {
            width: side,
            height: side,
            rgb,
            extent: None,
            crs: Crs::unknown(),
        }
    }

    #[test]
    fn black_and_white_mix_to_half_the_light() {
        let checker = image(512, |row, column| {
            [if (row + column) % 2 == 0 { 255 } else { 0 }; 3]
        });
        let grid = grid(257);
        let place = Placed::new(&checker, &grid);
        let lattice = Lattice::sample(&place, &grid, 0);
        let [r, _, _, alpha] = lattice.texels[100 * 256 + 100];
        assert!((i32::from(r) - 188).abs() < 3 && alpha == 255, "{r}");
    }

    #[test]
    fn levels_follow_the_picture_s_resolution() {
        let grid = grid(1025);
        let levels = |side| Placed::new(&image(side, |_, _| [1; 3]), &grid).level_count(&grid);
        assert_eq!(
            [levels(100), levels(300), levels(1025), levels(4000)],
            [1, 1, 3, 4]
        );
    }

    #[test]
    fn neighbours_share_border_texels_and_outside_is_clear() {
        let grid = grid(300);
        let picture = image(600, |row, column| {
            [row as u8, column as u8, (row / 3 + column) as u8]
        });
        let finest = Lattice::sample(&Placed::new(&picture, &grid), &grid, 2);
        for lattice in [&finest.coarser(grid.tiles(1)), &finest] {
            let level = if lattice.columns == finest.columns {
                2
            } else {
                1
            };
            let [west, east] = [0, 1].map(|column| lattice.tile(TileId::new(level, 0, column)));
            for row in 0..256 {
                assert_eq!(
                    west[(row * 256 + 255) * 4..][..4],
                    east[row * 256 * 4..][..4]
                );
            }
        }
        assert_eq!(finest.texels[finest.texels.len() - 1], [0; 4]);
        assert_eq!(finest.texels[0][3], 255);
    }
}
