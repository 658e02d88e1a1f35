//! Writes a pyramid so that it is whole or not there.
//!
//! ```text
//! OUT.building/   unfinished    what is being built, locked by who builds it
//!                 manifest/journal.jsonl    a line a finished shard
//!                 tile/…, color/…           shards, each written whole
//!                 scratch/…                 what passes of the build leave for each other
//!                 journal/…                 and what each of them has done
//! publish:        array metadata, manifest, the root zarr.json, then the folder becomes OUT
//! ```
//!
//! Until then nothing is called OUT (or the old pyramid still is), so a build that is killed leaves nothing that looks
//! finished; a second run takes over what is there. Knows files and bytes; knows no heights.

mod block;
mod copy;
mod place;

use std::{
    collections::HashMap,
    fs::{self, File},
    io::{BufRead, BufReader, ErrorKind, Write},
    ops::Range,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize};

use self::{
    block::{Block, Packing},
    place::{claim, remove_if_there, settle_replacement, start_over},
};
use super::{
    COLOR_TEXELS, ColorCodec, Metadata, PyramidError, RecordLayout,
    files::{remove_folder, sibling, sync_folder, unique, write_whole, write_whole_as},
    shard::shard_count,
    zarr,
};
use crate::geo::TileId;

pub use block::Contents;
pub(super) use place::check_target;

/// Says that a folder is a build, and of what.
const MARKER: &str = "unfinished";
/// One line a finished shard, while building.
const JOURNAL: &str = "manifest/journal.jsonl";
/// What passes of the build leave for each other.
const SCRATCH: &str = "scratch";
/// What passes of the build have done.
const PASSES: &str = "journal";
/// One line a shard, when done.
pub(super) const MANIFEST: &str = "manifest/shards.jsonl";

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
    /// What an earlier run of another build wrote is thrown away.
    started_over: bool,
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
        settle_replacement(path)?;
        check_target(path, overwrite)?;
        let folder = sibling(path, ".building");
        let mut marker = claim(&folder)?;
        let found = std::io::read_to_string(&marker)
            .map_err(PyramidError::io("reading", folder.join(MARKER)))?;
        let other = fingerprint.is_empty() || found != fingerprint;
        if other {
            start_over(&folder, &mut marker, fingerprint)?;
        }
        Ok(Self {
            started_over: other && !found.is_empty(),
            ..Self::open(path, overwrite, marker)?
        })
    }

    /// Takes part in a build of a `fingerprint` that [`Self::resume`] has begun, beside others, or `alone` when they are
    /// done.
    ///
    /// # Errors
    ///
    /// As [`Self::create`]; refused where no such build is there, or others are at work.
    pub fn join(
        path: &Path,
        overwrite: bool,
        fingerprint: &str,
        alone: bool,
    ) -> Result<Self, PyramidError> {
        check_target(path, overwrite)?;
        let folder = sibling(path, ".building");
        let marker = place::join(&folder, alone)?;
        let found = std::io::read_to_string(&marker)
            .map_err(PyramidError::io("reading", folder.join(MARKER)))?;
        if found != fingerprint {
            return Err(PyramidError::Refused(format!(
                "{}: is of other inputs or options, or by another version; plan it again",
                folder.display()
            )));
        }
        Self::open(path, overwrite, marker)
    }

    fn open(path: &Path, overwrite: bool, marker: File) -> Result<Self, PyramidError> {
        let folder = sibling(path, ".building");
        let kept = read_journal(&folder)?;
        let journal_path = folder.join(JOURNAL);
        let journal = File::options()
            .append(true)
            .create(true)
            .open(&journal_path)
            .map_err(PyramidError::io("opening", journal_path))?;
        Ok(Self {
            target: path.into(),
            folder,
            overwrite,
            _marker: marker,
            journal: Mutex::new(journal),
            kept,
            started_over: false,
        })
    }

    /// True where what an earlier run of another build had left was thrown away.
    #[must_use]
    pub const fn started_over(&self) -> bool {
        self.started_over
    }

    /// Writes the records of one level's 32 × 32 block of tiles: row and column `shard` of its shards.
    ///
    /// `records` is asked for every tile of the level in the block, from several threads; tiles it has none for are
    /// absent. Where an interrupted run has written this shard, nothing is asked.
    ///
    /// # Errors
    ///
    /// Where the disk is full or a file cannot be written; what `records` says.
    pub fn write_shard(
        &self,
        level: u8,
        layout: &RecordLayout,
        tiles: [u32; 2],
        shard: [u32; 2],
        records: Contents<'_>,
    ) -> Result<ShardInfo, PyramidError> {
        let key = zarr::shard_key(&format!("tile/{level}"), shard, 1);
        let block = Block {
            level,
            tiles,
            shard,
            chunk_bytes: layout.byte_count(),
            packing: Packing::Record(layout.sections()),
        };
        self.write_block(key, &block, records)
    }

    /// Writes one block of a level's imagery: RGBA texels, 256 × 256 a tile, row by row from the north-west. There are
    /// two shards where the codec stores alpha apart; `texels` is then asked twice.
    ///
    /// # Errors
    ///
    /// As [`Self::write_shard`].
    pub fn write_color_shard(
        &self,
        codec: ColorCodec,
        level: u8,
        tiles: [u32; 2],
        shard: [u32; 2],
        texels: Contents<'_>,
    ) -> Result<Vec<ShardInfo>, PyramidError> {
        let block = |chunk_bytes, packing| Block {
            level,
            tiles,
            shard,
            chunk_bytes,
            packing,
        };
        let key = zarr::shard_key(&format!("color/{level}"), shard, 3);
        let count = COLOR_TEXELS * COLOR_TEXELS;
        let ColorCodec::Jpeg { quality } = codec else {
            let written = self.write_block(key, &block(4 * count, Packing::Whole), texels)?;
            return Ok(vec![written]);
        };
        let alpha = |tile: TileId| {
            let alpha = texels(tile)?.map(|texels| {
                let alpha = texels.as_chunks::<4>().0.iter().map(|texel| texel[3]);
                alpha.collect::<Vec<u8>>()
            });
            Ok(alpha.filter(|alpha| alpha.iter().any(|alpha| *alpha < u8::MAX)))
        };
        let alpha_key = zarr::shard_key(&format!("alpha/{level}"), shard, 2);
        Ok(vec![
            self.write_block(key, &block(4 * count, Packing::Jpeg(quality)), texels)?,
            self.write_block(alpha_key, &block(count, Packing::Whole), &alpha)?,
        ])
    }

    /// Writes one block of the features' records, each of `record_bytes`; tiles without a feature have none.
    ///
    /// # Errors
    ///
    /// As [`Self::write_shard`].
    pub fn write_feature_shard(
        &self,
        level: u8,
        record_bytes: u32,
        tiles: [u32; 2],
        shard: [u32; 2],
        records: Contents<'_>,
    ) -> Result<ShardInfo, PyramidError> {
        let key = zarr::shard_key(&format!("feature/{level}"), shard, 1);
        let block = Block {
            level,
            tiles,
            shard,
            chunk_bytes: record_bytes as usize,
            packing: Packing::Whole,
        };
        self.write_block(key, &block, records)
    }

    /// The folder for what passes of the build leave for each other; it goes with what is started over, and when the
    /// pyramid is published.
    #[must_use]
    pub fn scratch(&self) -> PathBuf {
        self.folder.join(SCRATCH)
    }

    /// The folder for what passes of the build have done, kept and removed with [`Self::scratch`].
    #[must_use]
    pub fn journal(&self) -> PathBuf {
        self.folder.join(PASSES)
    }

    /// The folder of what is being built.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
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
        let root = zarr::root_json(metadata).map_err(|error| invalid(error.to_string()))?;
        write_whole(&self.folder.join(zarr::NODE), &root)?;
        remove_if_there(&self.folder.join(JOURNAL))?;
        remove_folder(&self.scratch())?;
        remove_folder(&self.journal())?;
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
        contents: Contents<'_>,
    ) -> Result<ShardInfo, PyramidError> {
        let path = self.folder.join(&key);
        if let Some(kept) = self.kept.get(&key)
            && holds(&self.folder, kept)
        {
            return Ok(kept.clone());
        }
        let mut chunks = 0;
        // Under a name of its own, and not beside it: another process may write the same, and what a killed one leaves
        // goes with the scratch.
        let partial = self.scratch().join(format!("shard-{}", unique()));
        write_whole_as(&path, &partial, |file| {
            chunks = block.write(file, &path, contents)?;
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
        zarr::nodes(metadata)
            .iter()
            .try_for_each(|(key, text)| write_whole(&self.folder.join(key), text))
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
    let arrays = |name: &'static str, levels: Range<u8>, inner| {
        levels.flat_map(move |level| {
            let [rows, columns] = shard_count(metadata.grid.tiles(level));
            (0..rows).flat_map(move |row| {
                (0..columns).map(move |column| {
                    zarr::shard_key(&format!("{name}/{level}"), [row, column], inner)
                })
            })
        })
    };
    let color = metadata.color.as_ref();
    let color_levels = color.map_or(0, |color| color.levels);
    let alpha_levels = color
        .filter(|color| color.codec != ColorCodec::Zstd)
        .map_or(0, |color| color.levels);
    let features = metadata
        .features
        .map_or(0..0, |features| features.level..features.level + 1);
    arrays("tile", 0..metadata.grid.level_count(), 1)
        .chain(arrays("feature", features, 1))
        .chain(arrays("color", 0..color_levels, 3))
        .chain(arrays("alpha", 0..alpha_levels, 2))
}

/// True for a shard that is there as it was written.
pub(super) fn holds(folder: &Path, info: &ShardInfo) -> bool {
    file_hash(&folder.join(&info.key))
        .is_ok_and(|(bytes, hash)| bytes == info.bytes && hash == info.blake3)
}

/// Size and BLAKE3 of a file.
pub(super) fn file_hash(path: &Path) -> std::io::Result<(u64, String)> {
    let mut hasher = blake3::Hasher::new();
    let bytes = std::io::copy(&mut File::open(path)?, &mut hasher)?;
    Ok((bytes, hasher.finalize().to_hex().to_string()))
}

#[cfg(test)]
mod tests;
