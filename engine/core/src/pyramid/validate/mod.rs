//! Checks a pyramid: every file, and if asked every chunk, every tile and every border between tiles.
//!
//! Knows the format; repairs nothing.

mod deep;

use std::{fmt, path::Path};

use serde::Serialize;
use serde_json::Value;

use self::deep::Deep;
use super::{
    Metadata, Pyramid, PyramidError, ShardInfo, Store, manifest::read_manifest, store::StoreReader,
    writer::shard_keys, zarr,
};

/// Findings beyond which only a count is kept.
const FINDING_LIMIT: usize = 1000;

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What is wrong, and where.
    pub what: String,
    /// Level, row and column, where it is a tile's.
    pub tile: Option<[u32; 3]>,
    /// CRS coordinates of the tile's middle.
    pub place: Option<[f64; 2]>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        self.place
            .map_or(Ok(()), |[x, y]| write!(f, " (around {x}, {y})"))
    }
}

/// What a check came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// True when contents were checked, and not only files.
    pub deep: bool,
    /// Shards looked at.
    pub shard_count: u64,
    /// Bytes of all shards.
    pub shard_bytes: u64,
    /// Tiles checked.
    pub tile_count: u64,
    /// What is wrong; the first thousand.
    pub findings: Vec<Finding>,
    /// Number of things that are wrong.
    pub finding_count: u64,
}

impl Report {
    /// True when nothing is wrong.
    #[must_use]
    pub const fn is_valid(&self) -> bool {
        self.finding_count == 0
    }

    fn add(&mut self, what: impl ToString) {
        self.push(Finding {
            what: what.to_string(),
            tile: None,
            place: None,
        });
    }

    fn push(&mut self, finding: Finding) {
        self.finding_count += 1;
        if self.findings.len() < FINDING_LIMIT {
            self.findings.push(finding);
        }
    }
}

/// Checks the pyramid in a folder or archive: metadata, presence and size of every shard, and if `deep` all contents.
///
/// `progress` is told how many steps of how many are done: shards, and if `deep` tiles.
///
/// # Errors
///
/// Where there is no pyramid to check; whatever is wrong with one that opens is a finding.
pub fn validate(
    path: &Path,
    deep: bool,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Report, PyramidError> {
    let pyramid = Pyramid::open(path)?;
    let metadata = pyramid.metadata();
    let mut report = Report {
        deep,
        ..Report::default()
    };
    let shards = shard_keys(metadata).count() as u64;
    let total = shards + if deep { tile_count(metadata) } else { 0 };
    check_nodes(pyramid.store(), metadata, &mut report);
    check_shards(pyramid.store(), metadata, &mut report, &mut |done| {
        progress(done, total);
    });
    if deep {
        let progress = &mut |done| progress(shards + done, total);
        Deep::new(&pyramid, &mut report, progress).check();
    }
    progress(total, total);
    Ok(report)
}

fn tile_count(metadata: &Metadata) -> u64 {
    metadata
        .levels
        .iter()
        .map(|level| u64::from(level.tiles[0]) * u64::from(level.tiles[1]))
        .sum()
}

/// Compares the nodes of groups and arrays with what the metadata say they are.
fn check_nodes(store: &dyn Store, metadata: &Metadata, report: &mut Report) {
    let parse = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).ok();
    for (key, want) in zarr::nodes(metadata) {
        let limit = zarr::ROOT_LIMIT_BYTES;
        let read = store
            .size(&key)
            .and_then(|bytes| store.read(&key, 0..bytes.min(limit)));
        match read {
            Err(error) => report.add(error),
            Ok(bytes) if parse(&bytes) != parse(&want) => {
                report.add(format!(
                    "{}: is not what the root's metadata ask for",
                    store.name(&key)
                ));
            }
            Ok(_) => {}
        }
    }
}

/// Compares shards with the manifest: presence and size, and if deep BLAKE3.
fn check_shards(
    store: &dyn Store,
    metadata: &Metadata,
    report: &mut Report,
    progress: &mut dyn FnMut(u64),
) {
    let mut manifest = match read_manifest(store) {
        Ok(manifest) => manifest,
        Err(what) => return report.add(what),
    };
    for (done, key) in (0..).zip(shard_keys(metadata)) {
        progress(done);
        report.shard_count += 1;
        match (manifest.remove(&key), store.size(&key)) {
            (_, Err(error)) => report.add(error),
            (None, Ok(_)) => report.add(format!("{}: is not in the manifest", store.name(&key))),
            (Some(info), Ok(bytes)) => {
                report.shard_bytes += bytes;
                if let Err(what) = check_shard(store, &info, bytes, report.deep) {
                    report.add(format!("{}: {what}", store.name(&key)));
                }
            }
        }
    }
    let mut rest: Vec<_> = manifest.into_keys().collect();
    rest.sort();
    rest.iter().for_each(|key| {
        report.add(format!(
            "the manifest lists {key:?}, which this pyramid does not have"
        ));
    });
}

fn check_shard(store: &dyn Store, info: &ShardInfo, bytes: u64, deep: bool) -> Result<(), String> {
    if bytes != info.bytes {
        return Err(format!(
            "has {bytes} bytes; the manifest says {}",
            info.bytes
        ));
    }
    if !deep {
        return Ok(());
    }
    let mut reader = StoreReader::open(store, &info.key).map_err(|error| error.to_string())?;
    let mut hasher = blake3::Hasher::new();
    hasher
        .update_reader(&mut reader)
        .map_err(|error| format!("reading failed: {error}"))?;
    if hasher.finalize().to_hex().as_str() != info.blake3 {
        return Err("does not match the manifest's BLAKE3".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests;
