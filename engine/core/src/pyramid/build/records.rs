//! From settled levels to records: measured from the finest level up, then written shard by shard.

use rayon::prelude::*;

use super::features::Features;
use super::levels::Levels;
use super::measure::{Finest, TileErrors, measure};
use super::options::{Stage, Watch};
use crate::geo::{Grid, TileId};
use crate::pyramid::surface::{child_window, encode_detail, encode_key_controls};
use crate::pyramid::{
    NEVER, PyramidError, PyramidWriter, RecordLayout, RecordParts, ShardInfo, Summary,
    patch_nibble, shard_count,
};

/// What was measured of a tile.
pub(super) struct Measured {
    /// What it says of itself.
    pub(super) summary: Summary,
    /// Its patch error codes.
    patch_codes: Vec<u8>,
}

/// What was measured of every tile: by level, coarsest first, row by row.
pub(super) type Measures = Vec<Vec<Measured>>;

/// Measures all tiles, from the finest level up.
pub(super) fn measure_all(
    levels: &Levels,
    grid: &Grid,
    unit: f64,
    features: &Features,
    watch: &Watch<'_>,
) -> Result<Measures, PyramidError> {
    let tiles = levels
        .levels
        .iter()
        .map(|level| tile_count(level.tiles))
        .sum();
    let advance = watch.stage(Stage::Measure, tiles);
    let mut measures = Measures::new();
    for level in (0..grid.level_count()).rev() {
        let finer = measures.last();
        let count = tile_count(grid.tiles(level));
        let measured: Result<Vec<_>, PyramidError> = (0..count)
            .into_par_iter()
            .map(|index| {
                let tile = tile_at(grid, level, index);
                let children = child_summaries(grid, tile, finer);
                let measured = measure_tile(levels, grid, tile, &children, unit, features);
                advance(1)?;
                Ok(measured)
            })
            .collect();
        measures.push(measured?);
    }
    measures.reverse();
    Ok(measures)
}

/// Writes all shards, finest level first.
pub(super) fn write_all(
    levels: &Levels,
    measures: &Measures,
    grid: &Grid,
    writer: &PyramidWriter,
    watch: &Watch<'_>,
) -> Result<Vec<ShardInfo>, PyramidError> {
    let shards_of = |level: u8| {
        let [rows, columns] = shard_count(grid.tiles(level));
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [row, column]))
    };
    let total = (0..grid.level_count())
        .map(|level| shards_of(level).count() as u64)
        .sum();
    let advance = watch.stage(Stage::Write, total);
    let mut infos = Vec::new();
    for level in (0..grid.level_count()).rev() {
        let layout = RecordLayout::new(&levels.levels[usize::from(level)]);
        for shard in shards_of(level) {
            let record = |tile: TileId| Some(record(levels, measures, grid, &layout, tile));
            infos.push(writer.write_shard(level, &layout, grid.tiles(level), shard, &record)?);
            advance(1)?;
        }
    }
    Ok(infos)
}

fn measure_tile(
    levels: &Levels,
    grid: &Grid,
    tile: TileId,
    children: &[Summary; 4],
    unit: f64,
    features: &Features,
) -> Measured {
    let place = [tile.row, tile.column];
    let samples = &levels.samples[usize::from(tile.level)];
    let heights = samples.tile(place);
    let finest = Finest::new(
        &levels.samples[levels.samples.len() - 1],
        [grid.rows, grid.columns].map(|count| count as usize),
    );
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a sample's row and column, under 2^27"
    )]
    let first = grid.first_sample(tile).map(|first| first as usize);
    let errors = measure(&heights, first, grid.stride(tile.level) as usize, &finest);
    let voids = samples.tile_voids(place).map_or(0, |(_, count)| count);
    let mut summary = summarise(&heights, voids, ceil_f32(errors.whole * unit), children);
    features.add_to(&mut summary, tile);
    let base = summary.error.max(ceil_f32(unit));
    let patch_codes = patch_codes(&errors, tile, grid, base, unit);
    Measured {
        summary,
        patch_codes,
    }
}

/// A tile's summary from its own samples and its children's summaries.
fn summarise(heights: &[i32], voids: usize, error: f32, children: &[Summary; 4]) -> Summary {
    let own = heights
        .iter()
        .fold((i32::MAX, i32::MIN), |(min, max), height| {
            (min.min(*height), max.max(*height))
        });
    let mut summary = Summary {
        min: own.0,
        max: own.1,
        error,
        flags: Summary::PRESENT,
    };
    for child in children.iter().filter(|child| child.is_present()) {
        summary.min = summary.min.min(child.min);
        summary.max = summary.max.max(child.max);
        summary.error = summary.error.max(child.error);
    }
    if voids > 0 {
        summary.flags |= Summary::VOID;
    }
    if voids == heights.len() {
        summary.flags |= Summary::ALL_VOID;
    }
    summary
}

/// A finest tile stores no patch errors: there they equal the stride errors of its own heights, which every reader
/// computes and takes the lesser of, exactly and without a byte.
fn patch_codes(errors: &TileErrors, tile: TileId, grid: &Grid, base: f32, unit: f64) -> Vec<u8> {
    let finest = tile.level + 1 == grid.level_count();
    let nibble = |error: f64| {
        if finest {
            NEVER
        } else {
            patch_nibble(error * unit, base)
        }
    };
    errors
        .patches
        .iter()
        .map(|[coarse, middle]| nibble(*coarse) | nibble(*middle) << 4)
        .collect()
}

/// The record of a tile.
pub(super) fn record(
    levels: &Levels,
    measures: &Measures,
    grid: &Grid,
    layout: &RecordLayout,
    tile: TileId,
) -> Vec<u8> {
    let index = usize::from(tile.level);
    let (level, place) = (&levels.levels[index], [tile.row, tile.column]);
    let controls = levels.cages[index].tile(place);
    let detail = encode_detail(&levels.samples[index].tile(place), &controls, level.step);
    let measured = &measures[index][index_of(grid, tile)];
    let voids = levels.samples[index].tile_voids(place);
    let cage = match tile.parent().filter(|_| !level.key) {
        None => encode_key_controls(&controls, level.step),
        Some(parent) => {
            let above = levels.cages[usize::from(parent.level)].tile([parent.row, parent.column]);
            let predicted = child_window(&above, tile.quadrant());
            controls
                .iter()
                .zip(predicted)
                .map(|(control, predicted)| (control - predicted) / level.step)
                .collect()
        }
    };
    layout.encode(&RecordParts {
        id: tile,
        summary: measured.summary,
        children: child_summaries(grid, tile, measures.get(index + 1)),
        patch_codes: &measured.patch_codes,
        voids: voids.as_ref().map(|(bits, _)| bits.as_slice()),
        cage: &cage,
        detail: &detail,
    })
}

/// The summaries of a tile's children, of which those the pyramid lacks are empty.
fn child_summaries(grid: &Grid, tile: TileId, finer: Option<&Vec<Measured>>) -> [Summary; 4] {
    tile.children().map(|child| match finer {
        Some(measured) if grid.has(child) => measured[index_of(grid, child)].summary,
        _ => Summary::default(),
    })
}

fn index_of(grid: &Grid, tile: TileId) -> usize {
    tile.row as usize * grid.tiles(tile.level)[1] as usize + tile.column as usize
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rows and columns of tiles are u32"
)]
fn tile_at(grid: &Grid, level: u8, index: u64) -> TileId {
    let columns = u64::from(grid.tiles(level)[1]);
    TileId::new(level, (index / columns) as u32, (index % columns) as u32)
}

fn tile_count([rows, columns]: [u32; 2]) -> u64 {
    u64::from(rows) * u64::from(columns)
}

/// The least f32 that is no less.
#[expect(clippy::cast_possible_truncation, reason = "corrected upwards")]
pub(super) fn ceil_f32(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value {
        nearest.next_up()
    } else {
        nearest
    }
}
