//! A small pyramid for tests: hills from a formula, a round void, imagery that names its tile.

use std::{collections::HashMap, path::Path};

use super::{
    COLOR_TEXELS, ColorCodec, ColorMetadata, Level, Metadata, PyramidWriter, RecordLayout,
    RecordParts, SourceMetadata, Summary, VOID_BYTES, VerticalReference, shard_count, surface,
};
use crate::geo::{
    CAGE_CONTROL_COUNT, CAGE_CONTROLS, Crs, Grid, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS,
    TILE_SAMPLE_COUNT, TILE_SAMPLES, TileId,
};

/// Height in units at a finest sample, data or not.
pub(crate) fn height(row: i64, column: i64) -> i32 {
    let hills = 900.0 * (row as f64 / 37.0).sin() + 700.0 * (column as f64 / 53.0).cos();
    let noise = (row * 7919 + column * 104_729).rem_euclid(31) - 15;
    #[expect(clippy::cast_possible_truncation, reason = "small numbers")]
    let height = hills.floor() as i32 + noise as i32;
    height
}

/// True for the finest samples of a round hole.
pub(crate) fn is_void(row: i64, column: i64) -> bool {
    (row - 120).pow(2) + (column - 60).pow(2) < 900
}

/// What the small pyramid says of itself.
pub(super) fn metadata(rows: u32, columns: u32) -> Metadata {
    let grid = Grid {
        columns,
        rows,
        origin: [500_000.0, 5_200_000.0],
        step: [10.0, -10.0],
    };
    let finest = grid.level_count() - 1;
    let level = |index: u8| Level {
        tiles: grid.tiles(index),
        step: 3 << (finest - index),
        key: index.is_multiple_of(4),
        cage_bytes: if index.is_multiple_of(4) { 4 } else { 2 },
        detail_bytes: 2,
        voids: true,
    };
    let source = SourceMetadata {
        name: "hills.tif".into(),
        bytes: 1,
        blake3: "00".into(),
    };
    Metadata {
        version: Metadata::VERSION,
        build: None,
        grid,
        crs: Crs {
            code: Some("EPSG:32610".into()),
            ..Crs::unknown()
        },
        vertical: VerticalReference::Unknown,
        unit_exponent: -4,
        eps: 0.1,
        height_range: [-1700, 1700],
        levels: (0..=finest).map(level).collect(),
        features: None,
        color: Some(ColorMetadata {
            levels: 1,
            texels: 256,
            codec: ColorCodec::Zstd,
            sources: vec![source.clone()],
        }),
        sources: vec![source],
    }
}

/// Writes the small pyramid.
pub(crate) fn write(path: &Path, rows: u32, columns: u32) -> Metadata {
    let metadata = metadata(rows, columns);
    let writer = PyramidWriter::create(path, false).unwrap();
    let shards = write_with(&writer, rows, columns);
    writer.publish(&metadata, &shards).unwrap();
    metadata
}

/// Writes a pyramid of one tile whose imagery is stored as JPEG.
pub(super) fn write_with_jpeg(path: &Path, texels: &[u8]) {
    let mut metadata = metadata(100, 100);
    let codec = ColorCodec::Jpeg { quality: 90 };
    metadata.color.as_mut().unwrap().codec = codec;
    let writer = PyramidWriter::create(path, false).unwrap();
    let mut shards = write_with(&writer, 100, 100);
    shards.retain(|shard| !shard.key.starts_with("color"));
    let contents = |_| Ok(Some(texels.to_vec()));
    shards.extend(
        writer
            .write_color_shard(codec, 0, [1, 1], [0, 0], &contents)
            .unwrap(),
    );
    writer.publish(&metadata, &shards).unwrap();
}

/// Writes the shards of the small pyramid.
pub(super) fn write_with(writer: &PyramidWriter, rows: u32, columns: u32) -> Vec<super::ShardInfo> {
    let metadata = metadata(rows, columns);
    let records = records(&metadata);
    let mut shards = Vec::new();
    for (index, level) in (0..).zip(&metadata.levels) {
        let [shard_rows, shard_columns] = shard_count(level.tiles);
        for shard in
            (0..shard_rows).flat_map(|row| (0..shard_columns).map(move |column| [row, column]))
        {
            let layout = RecordLayout::new(level);
            let record = |tile: TileId| Ok(records.get(&tile).cloned());
            shards.push(
                writer
                    .write_shard(index, &layout, level.tiles, shard, &record)
                    .unwrap(),
            );
        }
    }
    let texels = |tile: TileId| Ok(Some(vec![tile.level + 9; COLOR_TEXELS * COLOR_TEXELS * 4]));
    shards.extend(
        writer
            .write_color_shard(ColorCodec::Zstd, 0, [1, 1], [0, 0], &texels)
            .unwrap(),
    );
    shards
}

/// All tiles of a pyramid, coarsest level first.
pub(super) fn tiles(metadata: &Metadata) -> Vec<TileId> {
    let of_level = |level: u8| {
        let [rows, columns] = metadata.grid.tiles(level);
        (0..rows)
            .flat_map(move |row| (0..columns).map(move |column| TileId::new(level, row, column)))
    };
    (0..metadata.grid.level_count())
        .flat_map(of_level)
        .collect()
}

/// Row and column in finest samples of a tile's sample, or of a control with `quad` samples between.
fn place(metadata: &Metadata, tile: TileId, at: [i64; 2]) -> [i64; 2] {
    let stride = i64::from(metadata.grid.stride(tile.level));
    let cells = i64::try_from(TILE_CELLS).unwrap();
    [
        (i64::from(tile.row) * cells + at[0]) * stride,
        (i64::from(tile.column) * cells + at[1]) * stride,
    ]
}

fn grid_of<T>(side: usize, f: impl Fn([i64; 2]) -> T) -> Vec<T> {
    let side = i64::try_from(side).unwrap();
    (0..side * side)
        .map(|at| f([at / side, at % side]))
        .collect()
}

fn records(metadata: &Metadata) -> HashMap<TileId, Vec<u8>> {
    let tiles = tiles(metadata);
    let mut controls = HashMap::new();
    let mut cages = HashMap::new();
    for &tile in &tiles {
        let quad = i64::try_from(QUAD_SAMPLES).unwrap();
        let wanted = grid_of(CAGE_CONTROLS, |[i, j]| {
            let [row, column] = place(metadata, tile, [(i - 1) * quad, (j - 1) * quad]);
            height(row, column)
        });
        let level = &metadata.levels[usize::from(tile.level)];
        let (stored, decoded) = match tile.parent().filter(|_| !level.key) {
            None => {
                let codes = surface::encode_key_controls(&wanted, level.step);
                let decoded = surface::decode_key_controls(&codes, level.step);
                (codes, decoded)
            }
            Some(parent) => {
                let parent: &Vec<i32> = &controls[&parent];
                let codes = surface::encode_controls(&wanted, parent, tile.quadrant(), level.step);
                let decoded = surface::decode_controls(parent, tile.quadrant(), &codes, level.step);
                (codes, decoded)
            }
        };
        assert_eq!(decoded.len(), CAGE_CONTROL_COUNT);
        cages.insert(tile, stored);
        controls.insert(tile, decoded);
    }
    let mut summaries: HashMap<TileId, Summary> = HashMap::new();
    let mut records = HashMap::new();
    for &tile in tiles.iter().rev() {
        let level = &metadata.levels[usize::from(tile.level)];
        let at = |[i, j]: [i64; 2]| place(metadata, tile, [i, j]);
        let wanted = grid_of(TILE_SAMPLES, |sample| height(at(sample)[0], at(sample)[1]));
        let detail = surface::encode_detail(&wanted, &controls[&tile], level.step);
        let heights = surface::decode_heights(&controls[&tile], &detail, level.step);
        let holes = grid_of(TILE_SAMPLES, |sample| is_void(at(sample)[0], at(sample)[1]));
        let children = tile
            .children()
            .map(|child| summaries.get(&child).copied().unwrap_or_default());
        let summary = summarise(tile, &heights, &holes, &children);
        summaries.insert(tile, summary);
        let parts = RecordParts {
            id: tile,
            summary,
            children,
            patch_codes: &[0x21; PATCH_COUNT],
            voids: Some(&bits(&holes)),
            cage: &cages[&tile],
            detail: &detail,
        };
        records.insert(tile, RecordLayout::new(level).encode(&parts));
    }
    records
}

fn summarise(tile: TileId, heights: &[i32], holes: &[bool], children: &[Summary; 4]) -> Summary {
    let present = || children.iter().filter(|child| child.is_present());
    let min = present()
        .map(|child| child.min)
        .chain(heights.iter().copied())
        .min()
        .unwrap();
    let max = present()
        .map(|child| child.max)
        .chain(heights.iter().copied())
        .max()
        .unwrap();
    let below = present().map(|child| child.error).fold(0.0, f32::max);
    let void = holes.contains(&true) || present().any(|child| child.flags & Summary::VOID != 0);
    let flags = Summary::PRESENT | if void { Summary::VOID } else { 0 };
    Summary {
        min,
        max,
        error: below + 1.0 / f32::from(tile.level + 1),
        flags,
    }
}

fn bits(holes: &[bool]) -> Vec<u8> {
    assert_eq!(holes.len(), TILE_SAMPLE_COUNT);
    let mut bits = vec![0; VOID_BYTES];
    for (at, _) in holes.iter().enumerate().filter(|(_, hole)| **hole) {
        bits[at / 8] |= 1 << (at % 8);
    }
    bits
}
