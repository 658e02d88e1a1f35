use super::layers::samples_per_texel;
use super::*;
use crate::dem::Image;
use crate::geo::{Extent, TILE_CELLS};
use crate::pyramid::ColorCodec;
use crate::pyramid::light::{LINEAR, encode};

fn grid(rows: u32, columns: u32) -> Grid {
    Grid {
        columns,
        rows,
        origin: [0.0, 0.0],
        step: [1.0, -1.0],
    }
}

fn image(side: u32, extent: Option<Extent>, color: impl Fn(u32, u32) -> Texel) -> Image {
    let pixels = (0..side * side).map(|at| color(at / side, at % side));
    Image::from_pixels(side, side, pixels.collect(), extent).unwrap()
}

fn opaque(side: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Image {
    image(side, None, |row, column| {
        let [r, g, b] = color(row, column);
        [r, g, b, 255]
    })
}

fn extent(west: f64, north: f64, side: f64) -> Option<Extent> {
    Some(Extent {
        min: [west, -north - side],
        max: [west + side, -north],
    })
}

/// Something of everything.
fn motley(row: u32, column: u32) -> [u8; 3] {
    [
        (row * 7) as u8,
        (column * 3) as u8,
        (row / 3 * 5 + column * column) as u8,
    ]
}

fn imagery(images: &[Image]) -> Imagery<'_> {
    Imagery {
        images,
        codec: ColorCodec::Zstd,
        sources: Vec::new(),
    }
}

/// The texels of all levels' tiles, coarsest first, row by row; none where a tile has none of its own.
fn tiles(images: &[Image], grid: &Grid, wide: bool) -> Vec<Vec<Option<Vec<Texel>>>> {
    let imagery = imagery(images);
    let layers = Layers::new(&imagery, grid);
    let folder = tempfile::tempdir().unwrap();
    let mut finer: Option<Slots> = None;
    let mut levels: Vec<_> = (0..layers.levels())
        .rev()
        .map(|level| {
            let own = make(
                &layers,
                level,
                Cut { wide },
                finer.as_ref(),
                folder.path(),
                &|_| Ok(()),
            );
            let own = own.unwrap();
            let [rows, columns] = grid.tiles(level);
            let ids = (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column]));
            let texels = ids
                .map(|[row, column]| TileId::new(level, row, column))
                .map(|tile| layers.has(tile).then(|| own.tile(tile).unwrap()))
                .collect();
            finer = Some(own);
            texels
        })
        .collect();
    levels.reverse();
    levels
}

/// A level of one opaque picture in one piece, straight from what the format says.
struct Lattice {
    columns: usize,
    texels: Vec<Texel>,
}

impl Lattice {
    fn finest(image: &Image, grid: &Grid, level: u8) -> Self {
        let [rows, columns] = grid.tiles(level).map(|count| count as usize * STEPS + 1);
        let step = samples_per_texel(grid, level);
        let span = [f64::from(grid.rows), f64::from(grid.columns)];
        let size = [image.height, image.width].map(f64::from);
        let factors = [0, 1].map(|axis| (size[axis] / span[axis] * step).round().max(1.0));
        let count = [0, 1].map(|axis| (size[axis] / factors[axis]).ceil() as usize);
        let mut pixels = vec![[0; 4]; (size[0] * size[1]) as usize];
        let whole = crate::dem::Window {
            row: 0,
            column: 0,
            rows: image.height,
            columns: image.width,
        };
        image.read(whole, &mut pixels).unwrap();
        let shrunk = |row: usize, column: usize, channel: usize| {
            let range = |at: usize, axis: usize| {
                let factor = factors[axis] as usize;
                at * factor..((at + 1) * factor).min(size[axis] as usize)
            };
            let mut sum = (0.0_f32, 0.0_f32);
            for row in range(row, 0) {
                for column in range(column, 1) {
                    let value = pixels[row * image.width as usize + column][channel];
                    sum = (sum.0 + LINEAR[usize::from(value)], sum.1 + 1.0);
                }
            }
            LINEAR[usize::from(encode(sum.0 / sum.1))]
        };
        let at = |row: usize, column: usize| -> Texel {
            let place = [row, column].map(|index| index as f64 * step + 0.5);
            let place = [0, 1].map(|axis| place[axis] / span[axis] * size[axis]);
            if place[0] > size[0] || place[1] > size[1] {
                return [0; 4];
            }
            let split = |axis: usize| {
                let last = (count[axis] - 1) as f64;
                let place = (place[axis] / factors[axis] - 0.5).clamp(0.0, last);
                let first = place.floor() as usize;
                let share = (place - place.floor()) as f32;
                (first, (first + 1).min(count[axis] - 1), share)
            };
            let ((north, south, down), (west, east, across)) = (split(0), split(1));
            let [r, g, b] = [0, 1, 2].map(|channel| {
                let line = |row: usize| {
                    shrunk(row, west, channel) * (1.0 - across)
                        + shrunk(row, east, channel) * across
                };
                encode(line(north) * (1.0 - down) + line(south) * down)
            });
            [r, g, b, 255]
        };
        Self {
            columns,
            texels: (0..rows * columns)
                .map(|index| at(index / columns, index % columns))
                .collect(),
        }
    }

    fn coarser(&self, tiles: [u32; 2]) -> Self {
        let [rows, columns] = tiles.map(|count| count as usize * STEPS + 1);
        let (own_rows, own_columns) = (self.texels.len() / self.columns, self.columns);
        let mean = |row: usize, column: usize| -> Texel {
            let (mut sum, mut weights) = ([0.0_f32; 4], 0.0);
            for (down, row_weight) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                for (across, column_weight) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                    let (row, column) = (2 * row as i64 + down, 2 * column as i64 + across);
                    if !(0..own_rows as i64).contains(&row)
                        || !(0..own_columns as i64).contains(&column)
                    {
                        continue;
                    }
                    let [r, g, b, alpha] =
                        self.texels[row as usize * own_columns + column as usize];
                    let weight: f32 = row_weight * column_weight;
                    weights += weight;
                    let covered = weight * f32::from(alpha);
                    for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                        *sum += covered * LINEAR[usize::from(value)];
                    }
                    sum[3] += covered;
                }
            }
            let alpha = (sum[3] / weights).round() as u8;
            if !sum[3].is_normal() || alpha == 0 {
                return [0; 4];
            }
            let [r, g, b] = [sum[0], sum[1], sum[2]].map(|light| encode(light / sum[3]));
            [r, g, b, alpha]
        };
        Self {
            columns,
            texels: (0..rows * columns)
                .map(|index| mean(index / columns, index % columns))
                .collect(),
        }
    }

    fn tile(&self, tile: usize, columns: u32) -> Vec<Texel> {
        let [row, column] = [tile / columns as usize, tile % columns as usize];
        (0..COLOR_TEXELS)
            .flat_map(|down| {
                let first = (row * STEPS + down) * self.columns + column * STEPS;
                self.texels[first..first + COLOR_TEXELS].to_vec()
            })
            .collect()
    }
}

#[test]
fn blocks_of_either_shape_make_the_texels_of_one_piece() {
    // Fewer pixels than texels, as many, and so many more that they are shrunk; three tiles by two.
    let grid = grid(300, 220);
    for side in [90, 500, 1400] {
        let images = [opaque(side, motley)];
        let [blocks, bands] = [false, true].map(|wide| tiles(&images, &grid, wide));
        assert!(blocks == bands, "{side}");
        let finest = blocks.len() as u8 - 1;
        let mut lattice = Lattice::finest(&images[0], &grid, finest);
        for level in (0..=finest).rev() {
            let [_, columns] = grid.tiles(level);
            for (index, texels) in blocks[usize::from(level)].iter().enumerate() {
                let same = *texels == Some(lattice.tile(index, columns));
                assert!(same, "{side}: tile {index} of level {level}");
            }
            if level > 0 {
                lattice = lattice.coarser(grid.tiles(level - 1));
            }
        }
    }
}

#[test]
fn black_and_white_mix_to_half_the_light() {
    let checker = [opaque(512, |row, column| {
        [if (row + column) % 2 == 0 { 255 } else { 0 }; 3]
    })];
    let levels = tiles(&checker, &grid(257, 257), false);
    let [r, _, _, alpha] = levels[0][0].as_ref().unwrap()[100 * 256 + 100];
    assert!((i32::from(r) - 188).abs() < 3 && alpha == 255, "{r}");
}

#[test]
fn levels_follow_the_pictures_resolution() {
    let grid = grid(1025, 1025);
    let levels = |side| level_count(&imagery(&[opaque(side, |_, _| [1; 3])]), &grid);
    assert_eq!(
        [levels(100), levels(300), levels(1025), levels(4000)],
        [1, 1, 3, 4]
    );
}

#[test]
fn a_finer_picture_has_tiles_of_its_own_and_the_coarser_one_shows_around_it() {
    // Four by four finest tiles; a small fine picture from the middle of the second tile to that of the third.
    let grid = grid(513, 513);
    let coarse = image(300, extent(-0.5, -0.5, 514.0), |_, _| [10, 20, 30, 255]);
    let fine = image(300, extent(192.0, 192.0, 128.0), |_, _| [200, 100, 50, 255]);
    let levels = tiles(&[coarse, fine], &grid, false);
    assert_eq!(levels.len(), 3);
    let own: Vec<bool> = levels[2].iter().map(Option::is_some).collect();
    assert_eq!(own.iter().filter(|own| **own).count(), 4);
    assert!(own[5] && own[6] && own[9] && own[10]);
    for (index, texels) in levels.iter().flatten().enumerate() {
        for texel in texels.iter().flatten() {
            // One or the other, or on the edge between them, coarser levels' texels, a mixture; never a hole.
            assert!(
                texel[3] == 255 && texel[0] >= 10 && texel[2] >= 30,
                "{index}: {texel:?}"
            );
        }
    }
    let at = |level: usize, tile: usize, row: usize, column: usize| {
        levels[level][tile].as_ref().unwrap()[row * 256 + column]
    };
    assert_eq!(at(2, 5, 120, 200), [10, 20, 30, 255]);
    assert_eq!(at(2, 5, 200, 200), [200, 100, 50, 255]);
    assert_eq!(at(1, 0, 250, 250), [200, 100, 50, 255]);
    assert_eq!(at(1, 0, 100, 250), [10, 20, 30, 255]);
    assert_eq!(at(0, 0, 128, 128), [200, 100, 50, 255]);
    for (column, texel) in (0..256).map(|column| (column, at(1, 0, 255, column))) {
        assert_eq!(texel, at(1, 2, 0, column), "{column}");
    }
}

#[test]
fn where_the_later_picture_has_nothing_the_earlier_one_shows_and_where_none_has_it_is_clear() {
    let grid = grid(257, 257);
    let half = |color: [u8; 3], shown: fn(u32, u32) -> bool| {
        image(600, extent(-0.5, -0.5, 258.0), move |row, column| {
            let [r, g, b] = color;
            if shown(row, column) {
                [r, g, b, 255]
            } else {
                [0; 4]
            }
        })
    };
    let below = half([9, 9, 9], |row, _| row < 300);
    let above = half([99, 99, 99], |_, column| column < 300);
    let levels = tiles(&[below, above], &grid, true);
    let root = levels[0][0].as_ref().unwrap();
    let at = |row: usize, column: usize| root[row * 256 + column];
    assert_eq!(at(50, 50), [99, 99, 99, 255]);
    assert_eq!(at(200, 50), [99, 99, 99, 255]);
    assert_eq!(at(50, 200), [9, 9, 9, 255]);
    assert_eq!(at(200, 200), [0; 4]);
    // Half there: nothing dark is mixed in at the edge.
    let edge = (100..156)
        .map(|column| at(200, column))
        .filter(|texel| texel[3] > 0);
    assert!(edge.clone().all(|texel| texel[..3] == [99; 3]) && edge.count() > 0);
}

#[test]
fn tiles_are_there_where_pictures_are() {
    let grid = grid(TILE_CELLS as u32 * 8, TILE_CELLS as u32 * 8);
    let fine = image(512, extent(300.0, 10.0, 100.0), |_, _| [1; 4]);
    let images = [fine];
    let imagery = imagery(&images);
    let layers = Layers::new(&imagery, &grid);
    let own = |level: u8| {
        let [rows, columns] = grid.tiles(level);
        let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column]));
        all.filter(|&[row, column]| layers.has(TileId::new(level, row, column)))
            .collect::<Vec<_>>()
    };
    assert_eq!((own(3), own(2)), (vec![[0, 2], [0, 3]], vec![[0, 1]]));
    assert_eq!(own(0), [[0, 0]]);
}

/// A built pyramid of two by three finest tiles with a picture of a hole.
fn built(codec: ColorCodec) -> (tempfile::TempDir, crate::pyramid::Pyramid) {
    let folder = tempfile::tempdir().unwrap();
    let raster = super::super::testing::Field::new(250, 350, |row, column| (row + column) as f64);
    let wave = |at: u32, period: f64| 100.0 + 90.0 * (f64::from(at) / period).sin();
    let picture = image(700, None, |row, column| {
        let hole = row.abs_diff(300).pow(2) + column.abs_diff(200).pow(2) < 900;
        let color = [
            wave(row, 9.0) as u8,
            wave(column, 5.0) as u8,
            wave(row + column, 31.0) as u8,
        ];
        if hole {
            [0; 4]
        } else {
            [color[0], color[1], color[2], 255]
        }
    });
    let images = [picture];
    let imagery = Imagery {
        codec,
        ..imagery(&images)
    };
    let options = super::super::BuildOptions {
        output: folder.path().join("out.zarr"),
        ..Default::default()
    };
    let cancel = std::sync::atomic::AtomicBool::new(false);
    super::super::build(&raster, Some(&imagery), &options, &|_| (), &cancel).unwrap();
    let report = crate::pyramid::validate(&options.output, true, &mut |_, _| ()).unwrap();
    assert!(report.findings.is_empty(), "{:?}", report.findings);
    let pyramid = crate::pyramid::Pyramid::open(&options.output).unwrap();
    (folder, pyramid)
}

#[test]
fn tiles_of_jpeg_agree_on_their_borders_at_every_level_and_keep_their_holes() {
    let (_kept, exact) = built(ColorCodec::Zstd);
    let (_folder, pyramid) = built(ColorCodec::Jpeg { quality: 60 });
    let grid = pyramid.metadata().grid;
    let read = |pyramid: &crate::pyramid::Pyramid, tile| {
        pyramid
            .read_color(tile)
            .unwrap()
            .unwrap()
            .as_chunks::<4>()
            .0
            .to_vec()
    };
    let (mut square, mut count) = (0.0, 0.0);
    for level in 0..pyramid.metadata().color.as_ref().unwrap().levels {
        let [rows, columns] = grid.tiles(level);
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            let tile = TileId::new(level, row, column);
            let [own, source] = [&pyramid, &exact].map(|pyramid| read(pyramid, tile));
            for (own, source) in own.iter().zip(&source) {
                assert_eq!(own[3], source[3]);
                square += (0..3)
                    .map(|at| f64::from(own[at].abs_diff(source[at])).powi(2))
                    .sum::<f64>();
                count += 3.0;
            }
            if column + 1 < columns {
                let east = read(
                    &pyramid,
                    TileId {
                        column: column + 1,
                        ..tile
                    },
                );
                assert!(
                    (0..256).all(|at| own[at * 256 + 255] == east[at * 256]),
                    "{tile}"
                );
            }
            if row + 1 < rows {
                let south = read(
                    &pyramid,
                    TileId {
                        row: row + 1,
                        ..tile
                    },
                );
                assert!(own[255 * 256..] == south[..256], "{tile}");
            }
        }
    }
    let psnr = 10.0 * (255.0 * 255.0 * count / square).log10();
    assert!(psnr > 30.0, "{psnr} dB");
}
