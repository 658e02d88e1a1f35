//! Imagery over the terrain: colour tiles whose border texels are their neighbours' too.
//!
//! Texel (i, j) of a tile lies at i / 255 and j / 255 of its sides, so a level's texels form one lattice of 255 steps a
//! tile, and every second step of a level is a step of the next coarser one. Means are taken of linear light.
//!
//! ```text
//! images ─▶ layers ─▶ sample ─▶ finest level ─▶ slots ─▶ shards
//!                     sample, reduce ─▶ next level ─▶ slots ─▶ shards  …
//! ```
//!
//! A level is made block by block into slots on the disk, then written from there and reduced to the next. A texel is a
//! function of its place in the lattice alone, so tiles that share it agree, however blocks are cut.

mod block;
mod layers;
mod reduce;
mod sample;
mod slots;
#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "test pictures wrap")]
mod tests;

use std::path::Path;

use rayon::prelude::*;

use self::block::{Block, Cut};
pub(super) use self::layers::level_count;
use self::layers::{Layer, Layers};
use self::slots::Slots;
use super::options::{Imagery, Stage, Watch};
use crate::geo::{Grid, TileId};
use crate::pyramid::files::unique;
use crate::pyramid::{
    COLOR_TEXELS, ColorMetadata, PyramidError, PyramidWriter, SHARD_TILES, ShardInfo, shard_count,
};

/// Steps of the lattice across a tile.
const STEPS: usize = COLOR_TEXELS - 1;

/// A texel: red, green, blue (sRGB, not multiplied with alpha) and alpha. All are 0 where there is nothing.
type Texel = [u8; 4];

/// Makes and writes all colour levels.
pub(super) fn write(
    imagery: &Imagery<'_>,
    grid: &Grid,
    writer: &PyramidWriter,
    watch: &Watch<'_>,
) -> Result<(ColorMetadata, Vec<ShardInfo>), PyramidError> {
    let layers = Layers::new(imagery, grid);
    let levels = layers.levels();
    let tiles = |level: u8| grid.tiles(level).map(u64::from);
    let total = (0..levels)
        .map(tiles)
        .map(|[rows, columns]| 2 * rows * columns);
    let advance = watch.stage(Stage::Color, total.sum::<u64>() * COLOR_TEXELS as u64);
    // Of its own: another process may do the same.
    let scratch = writer.scratch().join(format!("color-{}", unique()));
    let mut infos = Vec::new();
    let mut finer: Option<Slots> = None;
    for level in (0..levels).rev() {
        let cut = Cut::of(&layers, level);
        let own = make(&layers, level, cut, finer.as_ref(), &scratch, &advance)?;
        if let Some(finer) = finer.take() {
            finer.remove()?;
        }
        let tiles = grid.tiles(level);
        let [rows, columns] = shard_count(tiles);
        let texels = |tile: TileId| {
            let texels = layers.has(tile).then(|| own.tile(tile)).transpose()?;
            // A tile without any picture is left out: its parent's, which shows none there, is drawn.
            let shown = texels.filter(|texels| texels.iter().any(|texel| texel[3] > 0));
            Ok(shown.map(Vec::into_flattened))
        };
        for shard in (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column])) {
            infos.extend(writer.write_color_shard(imagery.codec, level, tiles, shard, &texels)?);
            let inside = [0, 1]
                .map(|axis| u64::from((tiles[axis] - shard[axis] * SHARD_TILES).min(SHARD_TILES)));
            advance(inside[0] * inside[1] * COLOR_TEXELS as u64)?;
        }
        finer = Some(own);
    }
    if let Some(finer) = finer {
        finer.remove()?;
    }
    let texels = u32::try_from(COLOR_TEXELS).unwrap_or(u32::MAX);
    Ok((
        ColorMetadata {
            levels,
            texels,
            codec: imagery.codec,
            sources: imagery.sources.clone(),
        },
        infos,
    ))
}

/// Bytes the imagery takes while it is built, on so many threads: what images keep, and a block a thread.
pub(super) fn memory_bytes(imagery: &Imagery<'_>) -> u64 {
    let kept = imagery.images.iter().map(crate::dem::Image::memory_bytes);
    // The writer's batch of chunks: 64 tiles that do not compress.
    kept.sum::<u64>() + (16 << 20)
}

/// Bytes a thread takes for it.
pub(super) fn thread_bytes(imagery: &Imagery<'_>) -> u64 {
    let read = imagery
        .images
        .iter()
        .map(|image| image.read_bytes(sample::WINDOW_PIXELS));
    block::BYTES + read.max().unwrap_or(0)
}

/// Makes a level's texels, from the next finer level's and from what the images show themselves.
fn make(
    layers: &Layers<'_>,
    level: u8,
    cut: Cut,
    finer: Option<&Slots>,
    scratch: &Path,
    advance: &(impl Fn(u64) -> Result<(), PyramidError> + Sync),
) -> Result<Slots, PyramidError> {
    let slots = Slots::create(scratch, level, layers.grid.tiles(level))?;
    let below: Vec<&Layer<'_>> = layers.shown_at(level).collect();
    let [rows, columns] = layers.grid.tiles(level);
    (0..rows)
        .flat_map(|row| cut.blocks(layers, TileId::new(level, row, 0), columns))
        .par_bridge()
        .try_for_each(|block| {
            if let Block::Made(area) = &block {
                let texels = area.texels(layers, &below, finer)?;
                slots.write(area, &texels)?;
            }
            advance(block.steps())
        })?;
    Ok(slots)
}
