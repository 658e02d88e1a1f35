//! From settled levels to records: summarised from the finest level up, and written shard by shard.

use std::collections::HashMap;
use std::num::NonZero;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;

use super::area::Area;
use super::errors::{Errors, ceil_f32};
use super::features::Features;
use super::journal::Made;
use super::levels::Levels;
use super::measure::PatchErrors;
use super::options::Stage;
use super::passes::in_order;
use super::quantise::Cage;
use super::samples::Samples;
use super::scratch::Plane;
use super::tasks::{Job, Tasks};
use crate::geo::{Grid, PATCH_COUNT, TILE_CELLS, TILE_QUADS, TileId};
use crate::pyramid::surface::{child_window, encode_detail, encode_key_controls};
use crate::pyramid::{
    Level, NEVER, PyramidError, PyramidWriter, RecordLayout, RecordParts, SHARD_TILES, ShardInfo,
    Summary, patch_nibble, shard_count,
};

/// Tiles a side of what is read at once.
const GROUP: u32 = 4;
/// Groups kept: twice what the writer compresses side by side.
const GROUPS: NonZero<usize> = NonZero::new(8).unwrap();

/// What the records of all levels are made from.
pub(super) struct Records<'a> {
    pub(super) levels: &'a Levels,
    pub(super) errors: &'a Errors,
    pub(super) features: &'a Features,
    pub(super) grid: &'a Grid,
    /// One height unit in metres.
    pub(super) unit: f64,
}

impl Records<'_> {
    /// Writes all shards, finest level first. Returns them, and the root's error.
    pub(super) fn write(
        &self,
        writer: &PyramidWriter,
        scratch: &Path,
        tasks: &Tasks<'_>,
    ) -> Result<(Vec<ShardInfo>, f32), PyramidError> {
        let levels = 0..self.grid.level_count();
        let total = levels.clone().map(|level| shards(self.grid, level).len());
        let advance = tasks.watch.stage(Stage::Write, total.sum::<usize>() as u64);
        let mut infos = Vec::new();
        let mut root_error = 0.0;
        let mut finer: Option<Plane<4>> = None;
        for level in levels.rev() {
            let size = self.grid.tiles(level).map(|count| count as usize);
            let side = SHARD_TILES as usize;
            let own = Plane::create(scratch, &format!("summary-{level}"), size, side)?;
            let job = Job {
                pass: &format!("write-{level}"),
                planes: &[&own],
                in_turn: true,
                advance: &advance,
            };
            let shards = shards(self.grid, level);
            let shard = |shard| self.write_shard(level, shard, writer, &own, finer.as_ref());
            let made = tasks.run(&job, |task| vec![shards[task]], shard, u32::max)?;
            infos.extend(made.shards);
            // Errors are no less than 0, and so of the order of their bits.
            root_error = f32::from_bits(made.found);
            finer = Some(own);
        }
        Ok((infos, root_error))
    }

    fn write_shard(
        &self,
        level: u8,
        shard: [u32; 2],
        writer: &PyramidWriter,
        own: &Plane<4>,
        finer: Option<&Plane<4>>,
    ) -> Result<Made<u32>, PyramidError> {
        let tiles = self.grid.tiles(level);
        let groups: Vec<[u32; 2]> = groups_of(tiles, shard);
        let measure = |index: usize| {
            let ground = self.ground(level, groups[index])?;
            ground
                .tiles(tiles)
                .map(|tile| self.measure(&ground, tile, finer))
                .collect()
        };
        let join = |mut all: Vec<Measured>, mut more: Vec<Measured>| {
            all.append(&mut more);
            all
        };
        let measured = in_order(groups.len(), measure, join)?;
        let first = shard.map(|index| (index * SHARD_TILES) as usize);
        let area = Area::new(
            first[0]..(first[0] + SHARD_TILES as usize).min(tiles[0] as usize),
            first[1]..(first[1] + SHARD_TILES as usize).min(tiles[1] as usize),
        );
        let mut summaries = vec![[0; 4]; area.count()];
        for tile in &measured {
            let [row, column] = [tile.id.row, tile.id.column].map(|index| index as usize);
            let at = (row - first[0]) * area.size()[1] + column - first[1];
            summaries[at] = to_bits(&tile.summary);
        }
        let summaries = own.write(&area, &area, &summaries)?;
        let error = measured.iter().map(|tile| tile.summary.error.to_bits());
        let error = error.max().unwrap_or(0);
        let by_tile: HashMap<TileId, Measured> =
            measured.into_iter().map(|tile| (tile.id, tile)).collect();
        let about = &self.levels.levels[usize::from(level)];
        let layout = RecordLayout::new(about);
        let groups = Mutex::new(LruCache::new(GROUPS));
        let record = |tile: TileId| {
            let Some(measured) = by_tile.get(&tile) else {
                return Ok(None);
            };
            let group = self.kept_group(&groups, tile)?;
            Ok(Some(group.record(about, &layout, measured)))
        };
        let shard = writer.write_shard(level, &layout, tiles, shard, &record)?;
        Ok(Made {
            shards: vec![shard],
            ..Made::new(error, [summaries])
        })
    }

    /// A tile's group, from the last used ones or read.
    fn kept_group(
        &self,
        kept: &Mutex<LruCache<[u32; 2], Slot>>,
        tile: TileId,
    ) -> Result<Arc<Group>, PyramidError> {
        let place = [tile.row, tile.column].map(|index| index / GROUP);
        let slot = kept
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert(place, Slot::default)
            .clone();
        // Others wait here for this group, and not for all.
        let mut group = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(group) = &*group {
            return Ok(group.clone());
        }
        let read = Arc::new(self.group(tile.level, place)?);
        *group = Some(read.clone());
        Ok(read)
    }

    /// Rows and columns of a group's tiles.
    fn tiles_of(&self, level: u8, place: [u32; 2]) -> [Range<usize>; 2] {
        let tiles = self.grid.tiles(level);
        [0, 1].map(|axis| {
            let first = place[axis] * GROUP;
            first as usize..(first + GROUP).min(tiles[axis]) as usize
        })
    }

    fn ground(&self, level: u8, place: [u32; 2]) -> Result<Ground, PyramidError> {
        let tiles = self.tiles_of(level, place);
        let area = window(&tiles, TILE_CELLS, 1);
        Ok(Ground {
            level,
            first: [tiles[0].start, tiles[1].start],
            samples: self.levels.samples[usize::from(level)].read(&area)?,
        })
    }

    fn group(&self, level: u8, place: [u32; 2]) -> Result<Group, PyramidError> {
        let index = usize::from(level);
        let tiles = self.tiles_of(level, place);
        let cage = |level: usize, area: &Area| -> Result<Cage, PyramidError> {
            Ok(Cage::new(
                area.size()[1],
                self.levels.cages[level].controls(area)?,
            ))
        };
        let parent = if self.levels.levels[index].key {
            None
        } else {
            // Groups start at even tiles; of an odd number, the last parent is read whole.
            let parents = tiles
                .each_ref()
                .map(|tiles| tiles.start / 2..tiles.end.div_ceil(2));
            Some(cage(index - 1, &window(&parents, TILE_QUADS, 3))?)
        };
        Ok(Group {
            ground: self.ground(level, place)?,
            cage: cage(index, &window(&tiles, TILE_QUADS, 3))?,
            parent,
        })
    }

    fn measure(
        &self,
        ground: &Ground,
        id: TileId,
        finer: Option<&Plane<4>>,
    ) -> Result<Measured, PyramidError> {
        let children = child_summaries(id, finer)?;
        let errors = self.errors.tile(id)?;
        let patches = errors.as_deref().unwrap_or_default();
        let whole = patches
            .iter()
            .fold(0.0, |worst: f64, patch| worst.max(patch.whole));
        let heights = ground.samples.tile(ground.first_sample(id));
        let (_, voids) = ground.samples.tile_voids(ground.first_sample(id));
        let error = ceil_f32(whole * self.unit);
        let mut summary = summarise(&heights, voids, error, &children);
        self.features.add_to(&mut summary, id);
        let base = summary.error.max(ceil_f32(self.unit));
        Ok(Measured {
            id,
            summary,
            children,
            patch_codes: patch_codes(patches, base, self.unit),
        })
    }
}

/// The shards of a level, row by row.
pub(super) fn shards(grid: &Grid, level: u8) -> Vec<[u32; 2]> {
    let [rows, columns] = shard_count(grid.tiles(level));
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| [row, column]))
        .collect()
}

/// The groups of a shard, row by row.
fn groups_of(tiles: [u32; 2], shard: [u32; 2]) -> Vec<[u32; 2]> {
    let range = |axis: usize| {
        let first = shard[axis] * SHARD_TILES;
        let end = (first + SHARD_TILES).min(tiles[axis]);
        first / GROUP..end.div_ceil(GROUP)
    };
    range(0)
        .flat_map(|row| range(1).map(move |column| [row, column]))
        .collect()
}

/// What some rows and columns of tiles take up of a plane with so many entries a tile and so many more.
fn window([rows, columns]: &[Range<usize>; 2], per_tile: usize, more: usize) -> Area {
    let range = |tiles: &Range<usize>| tiles.start * per_tile..tiles.end * per_tile + more;
    Area::new(range(rows), range(columns))
}

/// A group that is read, or will be by whoever holds its lock.
type Slot = Arc<Mutex<Option<Arc<Group>>>>;

/// Samples of up to 4 × 4 tiles of a level, as stored.
struct Ground {
    level: u8,
    /// Row and column of the first tile.
    first: [usize; 2],
    samples: Samples,
}

impl Ground {
    fn tiles(&self, tiles: [u32; 2]) -> impl Iterator<Item = TileId> {
        let first = self
            .first
            .map(|index| u32::try_from(index).unwrap_or(u32::MAX));
        let [rows, columns] =
            [0, 1].map(|axis| first[axis]..(first[axis] + GROUP).min(tiles[axis]));
        let level = self.level;
        rows.flat_map(move |row| {
            columns
                .clone()
                .map(move |column| TileId::new(level, row, column))
        })
    }

    fn place(&self, tile: TileId) -> [usize; 2] {
        [
            tile.row as usize - self.first[0],
            tile.column as usize - self.first[1],
        ]
    }

    fn first_sample(&self, tile: TileId) -> [usize; 2] {
        self.place(tile).map(|index| index * TILE_CELLS)
    }
}

/// All that the records of up to 4 × 4 tiles hold.
struct Group {
    ground: Ground,
    cage: Cage,
    /// The parents' controls; none at a key level.
    parent: Option<Cage>,
}

impl Group {
    /// The record of a tile.
    fn record(&self, level: &Level, layout: &RecordLayout, measured: &Measured) -> Vec<u8> {
        let id = measured.id;
        let Ground { samples, .. } = &self.ground;
        let (place, first) = (self.ground.place(id), self.ground.first_sample(id));
        let controls = self.cage.tile(place);
        let heights = samples.tile(first);
        let detail = encode_detail(&heights, &controls, level.step);
        let (voids, _) = samples.tile_voids(first);
        let cage = match &self.parent {
            None => encode_key_controls(&controls, level.step),
            Some(parent) => {
                let above = place.map(|index| index / 2);
                let predicted = child_window(&parent.tile(above), id.quadrant());
                controls
                    .iter()
                    .zip(predicted)
                    .map(|(control, predicted)| (control - predicted) / level.step)
                    .collect()
            }
        };
        layout.encode(&RecordParts {
            id,
            summary: measured.summary,
            children: measured.children,
            patch_codes: &measured.patch_codes,
            voids: level.voids.then_some(voids.as_slice()),
            cage: &cage,
            detail: &detail,
        })
    }
}

/// What was measured of a tile.
struct Measured {
    id: TileId,
    /// What it says of itself.
    summary: Summary,
    /// What it says of its children.
    children: [Summary; 4],
    /// Its patch error codes.
    patch_codes: Vec<u8>,
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
fn patch_codes(patches: &[PatchErrors], base: f32, unit: f64) -> Vec<u8> {
    if patches.is_empty() {
        return vec![NEVER | NEVER << 4; PATCH_COUNT];
    }
    let nibble = |error: f64| patch_nibble(error * unit, base);
    patches
        .iter()
        .map(|patch| nibble(patch.coarse) | nibble(patch.middle) << 4)
        .collect()
}

/// The summaries of a tile's children, of which those the pyramid lacks are empty.
fn child_summaries(tile: TileId, finer: Option<&Plane<4>>) -> Result<[Summary; 4], PyramidError> {
    let mut summaries = [Summary::default(); 4];
    let Some(finer) = finer else {
        return Ok(summaries);
    };
    let [row, column] = [tile.row, tile.column].map(|index| 2 * index as usize);
    let area = Area::new(row..row + 2, column..column + 2).and(&Area::whole(finer.size()));
    let [_, columns] = area.size();
    for (at, bits) in finer.read(&area)?.into_iter().enumerate() {
        summaries[at / columns * 2 + at % columns] = from_bits(bits);
    }
    Ok(summaries)
}

fn to_bits(summary: &Summary) -> [i32; 4] {
    [
        summary.min,
        summary.max,
        summary.error.to_bits().cast_signed(),
        summary.flags.cast_signed(),
    ]
}

fn from_bits([min, max, error, flags]: [i32; 4]) -> Summary {
    Summary {
        min,
        max,
        error: f32::from_bits(error.cast_unsigned()),
        flags: flags.cast_unsigned(),
    }
}
