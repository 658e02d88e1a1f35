//! Writes a pyramid so that it is whole or not there.
//!
//! ```text
//! OUT.building/   unfinished    what is being built, locked by who builds it
//!                 manifest/journal.jsonl    a line a finished shard
//!                 tile/…, color/…           shards, each written whole
//! publish:        array metadata, manifest, the root zarr.json, then the folder becomes OUT
//! ```
//!
//! Until then nothing is called OUT (or the old pyramid still is), so a build that is killed leaves nothing that looks
//! finished; a second run takes over what is there. Knows files and bytes; knows no heights.

use std::{
    collections::HashMap,
    fs::{self, File, TryLockError},
    io::{BufRead, BufReader, ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    COLOR_TEXELS, Metadata, PyramidError, RecordLayout,
    files::{sibling, sync_folder, write_whole, write_whole_with},
    shard::{SHARD_TILES, ShardIndex, ZSTD_LEVEL, encode_chunk, shard_count, shard_shape, z_order},
    zarr,
};
use crate::geo::TileId;

/// Says that a folder is a build, and of what.
const MARKER: &str = "unfinished";
/// One line a finished shard, while building.
const JOURNAL: &str = "manifest/journal.jsonl";
/// One line a shard, when done.
pub(super) const MANIFEST: &str = "manifest/shards.jsonl";
/// How hard zstd tries on imagery, which gives little for more.
const COLOR_ZSTD_LEVEL: i32 = 6;
/// Chunks in memory at once, for each of which a record is made.
const BATCH: usize = 64;

/// A shard that is on the disk: a line of the manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardInfo {
    /// Its file, from the root, with slashes.
    pub key: String,
    /// Size of the file.
    pub bytes: u64,
    /// Chunks that are there.
    pub chunks: u32,
    /// BLAKE3 of the file, in hexadecimal.
    pub blake3: String,
}

/// Writes one pyramid.
#[derive(Debug)]
pub struct PyramidWriter {
    target: PathBuf,
    folder: PathBuf,
    overwrite: bool,
    /// Held open for its lock.
    _marker: File,
    journal: Mutex<File>,
    /// What an earlier, interrupted run of the same build wrote.
    kept: HashMap<String, ShardInfo>,
}

impl PyramidWriter {
    /// Starts a build from nothing; what an interrupted one left is removed.
    ///
    /// # Errors
    ///
    /// Refused where `path` exists and is no pyramid, or is one and `overwrite` is false, or another process is
    /// building it; nothing is touched then.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self, PyramidError> {
        Self::resume(path, overwrite, "")
    }

    /// Starts a build, or goes on with an interrupted one of the same `fingerprint`: a line that says all that decides
    /// the bytes (inputs, options, version). Shards of it that are on the disk and whole are not written again. An
    /// empty fingerprint equals none.
    ///
    /// # Errors
    ///
    /// As [`Self::create`].
    pub fn resume(path: &Path, overwrite: bool, fingerprint: &str) -> Result<Self, PyramidError> {
        if path.file_name().is_none() {
            return Err(PyramidError::Refused(format!(
                "{}: not a name for a pyramid",
                path.display()
            )));
        }
        settle_replacement(path)?;
        check_target(path, overwrite)?;
        let folder = sibling(path, ".building");
        let mut marker = claim(&folder)?;
        let found = std::io::read_to_string(&marker)
            .map_err(PyramidError::io("reading", folder.join(MARKER)))?;
        let kept = if fingerprint.is_empty() || found != fingerprint {
            start_over(&folder, &mut marker, fingerprint)?;
            HashMap::new()
        } else {
            read_journal(&folder)?
        };
        let journal_path = folder.join(JOURNAL);
        let journal = File::options()
            .append(true)
            .create(true)
            .open(&journal_path)
            .map_err(PyramidError::io("opening", journal_path))?;
        let target = path.into();
        Ok(Self {
            target,
            folder,
            overwrite,
            _marker: marker,
            journal: Mutex::new(journal),
            kept,
        })
    }

    /// Writes the records of one level's 32 × 32 block of tiles: row and column `shard` of its shards.
    ///
    /// `record` is asked for every tile of the level in the block, from several threads; tiles it has none for are
    /// absent. Where an interrupted run has written this shard, nothing is asked.
    ///
    /// # Errors
    ///
    /// Where the disk is full or a file cannot be written.
    pub fn write_shard(
        &self,
        level: u8,
        layout: &RecordLayout,
        tiles: [u32; 2],
        shard: [u32; 2],
        records: &(dyn Fn(TileId) -> Option<Vec<u8>> + Sync),
    ) -> Result<ShardInfo, PyramidError> {
        let key = zarr::shard_key(&format!("tile/{level}"), shard, 1);
        let block = Block {
            level,
            tiles,
            shard,
            chunk_bytes: layout.byte_count(),
            zstd_level: ZSTD_LEVEL,
        };
        self.write_block(key, &block, records)
    }

    /// Writes one block of a level's imagery: RGBA texels, 256 × 256 a tile, row by row from the north-west.
    ///
    /// # Errors
    ///
    /// As [`Self::write_shard`].
    pub fn write_color_shard(
        &self,
        level: u8,
        tiles: [u32; 2],
        shard: [u32; 2],
        texels: &(dyn Fn(TileId) -> Option<Vec<u8>> + Sync),
    ) -> Result<ShardInfo, PyramidError> {
        let key = zarr::shard_key(&format!("color/{level}"), shard, 3);
        let chunk_bytes = COLOR_TEXELS * COLOR_TEXELS * 4;
        let block = Block {
            level,
            tiles,
            shard,
            chunk_bytes,
            zstd_level: COLOR_ZSTD_LEVEL,
        };
        self.write_block(key, &block, texels)
    }

    /// Writes array metadata, manifest and root, and gives the pyramid its name.
    ///
    /// # Errors
    ///
    /// Where a shard is missing from `shards`, metadata make no sense, or a file cannot be written.
    pub fn publish(self, metadata: &Metadata, shards: &[ShardInfo]) -> Result<(), PyramidError> {
        let invalid = |what| PyramidError::Invalid {
            path: self.target.clone(),
            what,
        };
        zarr::check(metadata).map_err(invalid)?;
        check_complete(metadata, shards).map_err(invalid)?;
        self.write_nodes(metadata)?;
        self.write_manifest(shards)?;
        remove_if_there(&self.folder.join(JOURNAL))?;
        let root = zarr::root_json(metadata).map_err(|error| invalid(error.to_string()))?;
        write_whole(&self.folder.join(zarr::NODE), &root)?;
        remove_if_there(&self.folder.join(MARKER))?;
        sync_folder(&self.folder)?;
        self.take_name()
    }

    /// Removes what was written: for a build that failed and would fail again.
    ///
    /// # Errors
    ///
    /// Where the folder cannot be removed.
    pub fn discard(self) -> Result<(), PyramidError> {
        fs::remove_dir_all(&self.folder).map_err(PyramidError::io("removing", &self.folder))
    }

    fn write_block(
        &self,
        key: String,
        block: &Block,
        contents: &(dyn Fn(TileId) -> Option<Vec<u8>> + Sync),
    ) -> Result<ShardInfo, PyramidError> {
        let path = self.folder.join(&key);
        if let Some(kept) = self.kept.get(&key)
            && file_hash(&path)
                .is_ok_and(|(bytes, hash)| bytes == kept.bytes && hash == kept.blake3)
        {
            return Ok(kept.clone());
        }
        let mut chunks = 0;
        write_whole_with(&path, |file| {
            chunks = block.write(file, contents)?;
            Ok(())
        })?;
        let (bytes, blake3) = file_hash(&path).map_err(PyramidError::io("reading back", &path))?;
        let info = ShardInfo {
            key,
            bytes,
            chunks,
            blake3,
        };
        self.note(&info)
            .map_err(PyramidError::io("writing", self.folder.join(JOURNAL)))?;
        Ok(info)
    }

    /// Adds a line to the journal, in one write.
    fn note(&self, info: &ShardInfo) -> std::io::Result<()> {
        let mut line = serde_json::to_vec(info)?;
        line.push(b'\n');
        self.journal
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .write_all(&line)
    }

    fn write_nodes(&self, metadata: &Metadata) -> Result<(), PyramidError> {
        let node =
            |name: &str, text: &[u8]| write_whole(&self.folder.join(name).join(zarr::NODE), text);
        node("tile", &zarr::group_json())?;
        for (index, level) in metadata.levels.iter().enumerate() {
            node(
                &format!("tile/{index}"),
                &zarr::tile_array_json(level.tiles, &RecordLayout::new(level)),
            )?;
        }
        let Some(color) = &metadata.color else {
            return Ok(());
        };
        node("color", &zarr::group_json())?;
        (0..color.levels).try_for_each(|level| {
            node(
                &format!("color/{level}"),
                &zarr::color_array_json(metadata.grid.tiles(level)),
            )
        })
    }

    fn write_manifest(&self, shards: &[ShardInfo]) -> Result<(), PyramidError> {
        let path = self.folder.join(MANIFEST);
        let mut shards: Vec<_> = shards.iter().collect();
        shards.sort_by(|a, b| a.key.cmp(&b.key));
        let mut text = Vec::new();
        for shard in shards {
            serde_json::to_writer(&mut text, shard)
                .map_err(|error| PyramidError::io("writing", &path)(error.into()))?;
            text.push(b'\n');
        }
        write_whole(&path, &text)
    }

    /// Renames the folder to what it is to be called. An old pyramid steps aside first and is then removed.
    fn take_name(&self) -> Result<(), PyramidError> {
        let Self { target, folder, .. } = self;
        check_target(target, self.overwrite)?;
        let replaced = sibling(target, ".replaced");
        let replaces = target.exists();
        if replaces {
            fs::rename(target, &replaced).map_err(PyramidError::io("renaming", target))?;
        }
        fs::rename(folder, target).map_err(PyramidError::io("renaming", folder))?;
        sync_folder(target.parent().unwrap_or(Path::new(".")))?;
        if replaces {
            fs::remove_dir_all(&replaced).map_err(PyramidError::io("removing", &replaced))?;
        }
        Ok(())
    }
}

/// What one shard holds.
struct Block {
    level: u8,
    tiles: [u32; 2],
    shard: [u32; 2],
    chunk_bytes: usize,
    zstd_level: i32,
}

impl Block {
    /// Writes chunks after the place of the index, then the index; returns how many chunks there are.
    fn write(
        &self,
        file: &mut File,
        contents: &(dyn Fn(TileId) -> Option<Vec<u8>> + Sync),
    ) -> std::io::Result<u32> {
        let shape = shard_shape(self.tiles);
        let mut index = ShardIndex::new(shape);
        let mut offset = ShardIndex::byte_count(shape) as u64;
        file.seek(SeekFrom::Start(offset))?;
        for slots in z_order(shape).chunks(BATCH) {
            let chunks: Vec<_> = slots
                .par_iter()
                .map(|&slot| self.chunk(slot, contents))
                .collect();
            for (&slot, chunk) in slots.iter().zip(chunks) {
                let Some(chunk) = chunk? else { continue };
                file.write_all(&chunk)?;
                index.set(slot, offset..offset + chunk.len() as u64);
                offset += chunk.len() as u64;
            }
        }
        file.rewind()?;
        file.write_all(&index.encode())?;
        Ok(u32::try_from(index.chunk_count()).unwrap_or(u32::MAX))
    }

    fn chunk(
        &self,
        slot: [u32; 2],
        contents: &(dyn Fn(TileId) -> Option<Vec<u8>> + Sync),
    ) -> std::io::Result<Option<Vec<u8>>> {
        let [row, column] = [0, 1].map(|axis| self.shard[axis] * SHARD_TILES + slot[axis]);
        if row >= self.tiles[0] || column >= self.tiles[1] {
            return Ok(None);
        }
        let Some(bytes) = contents(TileId::new(self.level, row, column)) else {
            return Ok(None);
        };
        assert_eq!(
            bytes.len(),
            self.chunk_bytes,
            "bytes of a chunk of level {}",
            self.level
        );
        encode_chunk(&bytes, self.zstd_level).map(Some)
    }
}

/// True for a folder with a pyramid's root in it, of whatever version.
fn is_pyramid(path: &Path) -> bool {
    fs::read(path.join(zarr::NODE)).is_ok_and(|bytes| zarr::is_root(&bytes))
}

/// Refuses what must not be replaced.
fn check_target(path: &Path, overwrite: bool) -> Result<(), PyramidError> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(PyramidError::io("looking at", path)(error)),
        Ok(_) if !is_pyramid(path) => Err(PyramidError::Refused(format!(
            "{}: exists and is not a Drumlin pyramid; it was left as it is",
            path.display()
        ))),
        Ok(_) if overwrite => Ok(()),
        Ok(_) => Err(PyramidError::Refused(format!(
            "{}: a pyramid is there already; ask to overwrite it, or choose another name",
            path.display()
        ))),
    }
}

/// Ends a replacement that was killed between its steps: the old pyramid gets its name back, or goes.
fn settle_replacement(path: &Path) -> Result<(), PyramidError> {
    let replaced = sibling(path, ".replaced");
    if !is_pyramid(&replaced) {
        return Ok(());
    }
    if path.symlink_metadata().is_ok() {
        fs::remove_dir_all(&replaced).map_err(PyramidError::io("removing", &replaced))
    } else {
        fs::rename(&replaced, path).map_err(PyramidError::io("renaming", &replaced))
    }
}

/// Makes the folder of a build, or takes over one that nobody works on; returns its marker, locked.
fn claim(folder: &Path) -> Result<File, PyramidError> {
    let marker = folder.join(MARKER);
    let refused = |what: &str| PyramidError::Refused(format!("{}: {what}", folder.display()));
    match fs::create_dir(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            if !marker.is_file()
                && !is_pyramid(folder)
                && fs::read_dir(folder).is_ok_and(|mut it| it.next().is_some())
            {
                return Err(refused(
                    "is in the way of the build, and is not the rest of one",
                ));
            }
        }
        other => other.map_err(PyramidError::io("creating", folder))?,
    }
    let file = File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&marker)
        .map_err(PyramidError::io("opening", &marker))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(refused("another process is building this pyramid")),
        Err(TryLockError::Error(error)) => Err(PyramidError::io("locking", marker)(error)),
    }
}

/// Empties a build's folder and says what is being built now.
fn start_over(folder: &Path, marker: &mut File, fingerprint: &str) -> Result<(), PyramidError> {
    for name in ["tile", "color", "manifest"] {
        let path = folder.join(name);
        match fs::remove_dir_all(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            other => other.map_err(PyramidError::io("removing", path))?,
        }
    }
    remove_if_there(&folder.join(zarr::NODE))?;
    let manifest = folder.join("manifest");
    fs::create_dir(&manifest).map_err(PyramidError::io("creating", manifest))?;
    marker
        .set_len(0)
        .and_then(|()| marker.rewind())
        .and_then(|()| marker.write_all(fingerprint.as_bytes()))
        .and_then(|()| marker.sync_all())
        .map_err(PyramidError::io("writing", folder.join(MARKER)))
}

/// The shards an interrupted run has finished; a line cut short is the one it was killed in.
fn read_journal(folder: &Path) -> Result<HashMap<String, ShardInfo>, PyramidError> {
    let path = folder.join(JOURNAL);
    let file = match File::open(&path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(HashMap::new()),
        other => other.map_err(PyramidError::io("opening", &path))?,
    };
    let lines = BufReader::new(file)
        .split(b'\n')
        .collect::<Result<Vec<_>, _>>();
    let lines = lines.map_err(PyramidError::io("reading", path))?;
    let infos = lines
        .iter()
        .filter_map(|line| serde_json::from_slice::<ShardInfo>(line).ok());
    Ok(infos.map(|info| (info.key.clone(), info)).collect())
}

/// Says which shard of the levels is not in the list.
fn check_complete(metadata: &Metadata, shards: &[ShardInfo]) -> Result<(), String> {
    let known: HashMap<&str, &ShardInfo> = shards
        .iter()
        .map(|info| (info.key.as_str(), info))
        .collect();
    match shard_keys(metadata).find(|key| !known.contains_key(key.as_str())) {
        Some(key) => Err(format!("shard {key} was not written")),
        None => Ok(()),
    }
}

/// The keys of all shards a pyramid has.
pub(super) fn shard_keys(metadata: &Metadata) -> impl Iterator<Item = String> {
    let arrays = |name: &'static str, levels: u8, inner| {
        (0..levels).flat_map(move |level| {
            let [rows, columns] = shard_count(metadata.grid.tiles(level));
            (0..rows).flat_map(move |row| {
                (0..columns).map(move |column| {
                    zarr::shard_key(&format!("{name}/{level}"), [row, column], inner)
                })
            })
        })
    };
    let color_levels = metadata.color.as_ref().map_or(0, |color| color.levels);
    arrays("tile", metadata.grid.level_count(), 1).chain(arrays("color", color_levels, 3))
}

/// Size and BLAKE3 of a file.
pub(super) fn file_hash(path: &Path) -> std::io::Result<(u64, String)> {
    let mut hasher = blake3::Hasher::new();
    let bytes = std::io::copy(&mut File::open(path)?, &mut hasher)?;
    Ok((bytes, hasher.finalize().to_hex().to_string()))
}

fn remove_if_there(path: &Path) -> Result<(), PyramidError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        other => other.map_err(PyramidError::io("removing", path)),
    }
}

#[cfg(test)]
mod tests;
