//! Reads a pyramid: metadata once, then tiles, each checked.
//!
//! A tile passes its checksum, says whose record it is, and holds possible numbers, or it is an error: never silent
//! flat ground. Knows stores and records; starts no thread and keeps no tile.

use std::{
    num::NonZero,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

use super::{
    COLOR_TEXELS, ColorCodec, FeatureGroup, Metadata, PyramidError, Record, RecordLayout, Store,
    StoreError, Tile, feature, open_store,
    shard::{SHARD_TILES, ShardIndex, decode_chunk, decode_jpeg, shard_shape},
    surface::{self, CONTROL_LIMIT},
    zarr,
};
use crate::geo::{CAGE_CONTROL_COUNT, TileId};

/// Indices kept in memory: 24 KiB each, so 6 MiB, whatever the pyramid's size.
const INDEX_COUNT: NonZero<usize> = NonZero::new(256).unwrap();
/// No code stands for as many units.
const RESIDUAL_LIMIT: u64 = 1 << 28;

/// What is stored a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Array {
    Tile,
    Color,
    Alpha,
    Feature,
}

impl Array {
    /// The file of a tile's shard.
    pub(super) fn shard_key(self, tile: TileId) -> String {
        let shard = [tile.row / SHARD_TILES, tile.column / SHARD_TILES];
        match self {
            Self::Tile => zarr::shard_key(&format!("tile/{}", tile.level), shard, 1),
            Self::Feature => zarr::shard_key(&format!("feature/{}", tile.level), shard, 1),
            Self::Color => zarr::shard_key(&format!("color/{}", tile.level), shard, 3),
            Self::Alpha => zarr::shard_key(&format!("alpha/{}", tile.level), shard, 2),
        }
    }
}

/// A pyramid, open for reading from any number of threads.
///
/// One that is replaced on the disk while it is open must be opened again.
#[derive(Debug)]
pub struct Pyramid {
    store: Box<dyn Store>,
    metadata: Metadata,
    layouts: Vec<RecordLayout>,
    indices: Mutex<LruCache<(Array, TileId), Arc<ShardIndex>>>,
}

impl Pyramid {
    /// Opens a folder or a ZIP archive, to be read through memory maps.
    ///
    /// # Errors
    ///
    /// Where it is no finished pyramid, or one of another version.
    pub fn open(path: &Path) -> Result<Self, PyramidError> {
        Self::with_store(open_store(path)?)
    }

    /// Opens whatever a store holds.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn with_store(store: Box<dyn Store>) -> Result<Self, PyramidError> {
        let metadata = read_root(&*store)?;
        let layouts = metadata.levels.iter().map(RecordLayout::new).collect();
        Ok(Self {
            store,
            metadata,
            layouts,
            indices: Mutex::new(LruCache::new(INDEX_COUNT)),
        })
    }

    /// Where its bytes come from.
    #[must_use]
    pub fn store(&self) -> &dyn Store {
        &*self.store
    }

    /// What the pyramid says of itself.
    #[must_use]
    pub const fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// True when the pyramid has this tile.
    #[must_use]
    pub fn has(&self, tile: TileId) -> bool {
        self.metadata.grid.has(tile)
    }

    /// True when a tile is read without its parent's controls.
    #[must_use]
    pub fn is_key(&self, tile: TileId) -> bool {
        self.metadata
            .levels
            .get(usize::from(tile.level))
            .is_some_and(|level| level.key)
    }

    /// Reads and checks a tile. Tiles of key levels need no parent; others take their parent's 35 × 35 controls.
    ///
    /// # Errors
    ///
    /// Where there is no such tile, it is missing, cut short or damaged, or the parent's controls are not given.
    pub fn read_tile(
        &self,
        tile: TileId,
        parent_controls: Option<&[i32]>,
    ) -> Result<Tile, PyramidError> {
        if !self.has(tile) {
            return Err(damaged(tile, "the pyramid has no such tile"));
        }
        let key = self.is_key(tile);
        let parent = parent_controls.filter(|controls| controls.len() == CAGE_CONTROL_COUNT);
        if !key && parent.is_none() {
            return Err(damaged(
                tile,
                "its cage is stored against its parent's, whose controls were not given",
            ));
        }
        let record = self.read_record(tile)?;
        let step = self.metadata.levels[usize::from(tile.level)].step;
        let controls: Box<[i32]> = match parent.filter(|_| !key) {
            Some(parent) => {
                surface::decode_controls(parent, tile.quadrant(), &record.cage, step).into()
            }
            None => surface::decode_key_controls(&record.cage, step).into(),
        };
        if let Some(control) = controls
            .iter()
            .find(|control| control.unsigned_abs() >= CONTROL_LIMIT as u32)
        {
            return Err(damaged(
                tile,
                format!("a control of {control} units; the limit is 2^25"),
            ));
        }
        Ok(Tile {
            id: tile,
            summary: record.summary,
            children: record.children,
            step,
            controls,
            detail: record.detail,
            patch_codes: record.patch_codes,
            voids: record.voids,
        })
    }

    /// Reads a tile and the ancestors its cage is stored against: at most four records.
    ///
    /// # Errors
    ///
    /// As [`Self::read_tile`], for any of them.
    pub fn read_tile_chain(&self, tile: TileId) -> Result<Tile, PyramidError> {
        if !self.has(tile) {
            return Err(damaged(tile, "the pyramid has no such tile"));
        }
        let key_level = (0..=tile.level)
            .rev()
            .find(|&level| self.is_key(tile.ancestor(level)))
            .unwrap_or(0);
        let mut read = self.read_tile(tile.ancestor(key_level), None)?;
        for level in key_level + 1..=tile.level {
            read = self.read_tile(tile.ancestor(level), Some(&read.controls))?;
        }
        Ok(read)
    }

    /// The imagery of a tile: 256 × 256 RGBA texels, row by row from the north-west; none where there is none.
    ///
    /// # Errors
    ///
    /// Where the imagery is missing, cut short or damaged.
    pub fn read_color(&self, tile: TileId) -> Result<Option<Vec<u8>>, PyramidError> {
        let Some(color) = &self.metadata.color else {
            return Ok(None);
        };
        if tile.level >= color.levels || !self.has(tile) {
            return Ok(None);
        }
        let count = COLOR_TEXELS * COLOR_TEXELS;
        if color.codec == ColorCodec::Zstd {
            return self.read_chunk(Array::Color, tile, 4 * count);
        }
        let Some(mut texels) = self.read_chunk_by(Array::Color, tile, decode_jpeg)? else {
            return Ok(None);
        };
        if let Some(alpha) = self.read_chunk(Array::Alpha, tile, count)? {
            for (texel, alpha) in texels.as_chunks_mut::<4>().0.iter_mut().zip(alpha) {
                *texel = if alpha == 0 {
                    [0; 4]
                } else {
                    [texel[0], texel[1], texel[2], alpha]
                };
            }
        }
        Ok(Some(texels))
    }

    /// The features laid into a tile: those its record names, with the cages of those whose home it is. None where the
    /// pyramid has no features, or none there.
    ///
    /// # Errors
    ///
    /// Where the record is missing, cut short or damaged, or holds a cage that is none.
    pub fn read_features(&self, tile: TileId) -> Result<Vec<FeatureGroup>, PyramidError> {
        let Some(features) = self.metadata.features else {
            return Ok(Vec::new());
        };
        if tile.level != features.level || !self.has(tile) {
            return Ok(Vec::new());
        }
        match self.read_chunk(Array::Feature, tile, features.record_bytes as usize)? {
            None => Ok(Vec::new()),
            Some(bytes) => feature::decode(&bytes, tile).map_err(|what| {
                let name = self.store.name(&Array::Feature.shard_key(tile));
                damaged(tile, format!("{name}: {what}"))
            }),
        }
    }

    /// Reads the record of a tile that the pyramid has, and checks all that can be checked without its parent.
    pub(super) fn read_record(&self, tile: TileId) -> Result<Record, PyramidError> {
        let layout = &self.layouts[usize::from(tile.level)];
        let wrap = |what| {
            damaged(
                tile,
                format!("{}: {what}", self.store.name(&Array::Tile.shard_key(tile))),
            )
        };
        let bytes = self.read_chunk(Array::Tile, tile, layout.byte_count())?;
        let record = layout
            .decode(&bytes.ok_or_else(|| wrap("has no chunk for it".into()))?)
            .map_err(wrap)?;
        if record.id != tile {
            return Err(wrap(format!("holds {} in its place", record.id)));
        }
        let step = u64::from(
            self.metadata.levels[usize::from(tile.level)]
                .step
                .unsigned_abs(),
        );
        let worst = record
            .detail
            .iter()
            .map(|code| code.unsigned_abs())
            .max()
            .unwrap_or(0);
        if u64::from(worst) * step >= RESIDUAL_LIMIT {
            return Err(wrap(format!(
                "a residual of {worst} steps of {step} units; the limit is 2^28 units"
            )));
        }
        Ok(record)
    }

    /// Reads, checks and inflates a tile's chunk; none where the index says that it is absent.
    fn read_chunk(
        &self,
        array: Array,
        tile: TileId,
        byte_count: usize,
    ) -> Result<Option<Vec<u8>>, PyramidError> {
        self.read_chunk_by(array, tile, |chunk| decode_chunk(chunk, byte_count))
    }

    /// The same, decoded by `decode`.
    fn read_chunk_by(
        &self,
        array: Array,
        tile: TileId,
        decode: impl FnOnce(&[u8]) -> Result<Vec<u8>, String>,
    ) -> Result<Option<Vec<u8>>, PyramidError> {
        let key = array.shard_key(tile);
        let index = self.index(array, tile, &key)?;
        let Some(range) = index.chunk([tile.row % SHARD_TILES, tile.column % SHARD_TILES]) else {
            return Ok(None);
        };
        let length = range.end - range.start;
        let chunk = self
            .store
            .read(&key, range)
            .map_err(|error| damaged(tile, error))?;
        let wrap = |what| damaged(tile, format!("{}: {what}", self.store.name(&key)));
        if chunk.len() as u64 != length {
            return Err(wrap(format!(
                "{} bytes came where {length} were asked for",
                chunk.len()
            )));
        }
        decode(&chunk).map(Some).map_err(wrap)
    }

    /// The index of a tile's shard, from memory where it is there.
    fn index(
        &self,
        array: Array,
        tile: TileId,
        key: &str,
    ) -> Result<Arc<ShardIndex>, PyramidError> {
        let lock = || self.indices.lock().unwrap_or_else(PoisonError::into_inner);
        let id = (
            array,
            TileId::new(
                tile.level,
                tile.row / SHARD_TILES,
                tile.column / SHARD_TILES,
            ),
        );
        if let Some(index) = lock().get(&id) {
            return Ok(index.clone());
        }
        let shape = shard_shape(self.metadata.grid.tiles(tile.level));
        let bytes = self
            .store
            .read(key, 0..ShardIndex::byte_count(shape) as u64);
        let bytes = bytes.map_err(|error| damaged(tile, error))?;
        let index = ShardIndex::decode(&bytes, shape)
            .map_err(|what| damaged(tile, format!("{}: {what}", self.store.name(key))))?;
        let index = Arc::new(index);
        lock().put(id, index.clone());
        Ok(index)
    }
}

/// Reads and checks the root.
fn read_root(store: &dyn Store) -> Result<Metadata, PyramidError> {
    let invalid = |what| PyramidError::Invalid {
        path: PathBuf::from(store.name(zarr::NODE)),
        what,
    };
    let wrap = |error| match error {
        StoreError::Missing { .. } => invalid("is missing: this is not a finished pyramid".into()),
        StoreError::Io { name, source } => PyramidError::Io {
            action: "reading",
            path: name.into(),
            source,
        },
        StoreError::Short { .. } => invalid("is cut short".into()),
    };
    let bytes = store.size(zarr::NODE).map_err(wrap)?;
    if bytes > zarr::ROOT_LIMIT_BYTES {
        return Err(invalid(format!(
            "has {bytes} bytes; the limit is {}",
            zarr::ROOT_LIMIT_BYTES
        )));
    }
    let root = store.read(zarr::NODE, 0..bytes).map_err(wrap)?;
    zarr::parse_root(&root).map_err(invalid)
}

/// What is wrong with a tile.
fn damaged(tile: TileId, what: impl ToString) -> PyramidError {
    PyramidError::Tile {
        tile,
        what: what.to_string(),
    }
}

#[cfg(test)]
mod tests;
