//! Checks a pyramid: every file, and if asked every chunk, every tile and every border between tiles.
//!
//! Knows the format; repairs nothing.

mod deep;

use std::{
    collections::HashMap,
    fmt,
    fs::{self, File},
    io::{BufRead, BufReader, Read},
    path::Path,
};

use serde::Serialize;
use serde_json::Value;

use self::deep::Deep;
use super::{
    Metadata, Pyramid, PyramidError, RecordLayout, ShardInfo,
    writer::{MANIFEST, file_hash, shard_keys},
    zarr,
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

/// Checks the pyramid in a folder: metadata, presence and size of every shard, and if `deep` all contents.
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
    check_nodes(path, metadata, &mut report);
    check_shards(path, metadata, &mut report, &mut |done| {
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
fn check_nodes(path: &Path, metadata: &Metadata, report: &mut Report) {
    let mut check = |name: String, want: Vec<u8>| {
        let path = path.join(name).join(zarr::NODE);
        let parse = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).ok();
        match fs::read(&path) {
            Err(error) => report.add(format!("{}: reading failed: {error}", path.display())),
            Ok(bytes) if parse(&bytes) != parse(&want) => {
                report.add(format!(
                    "{}: is not what the root's metadata ask for",
                    path.display()
                ));
            }
            Ok(_) => {}
        }
    };
    check("tile".into(), zarr::group_json());
    for (index, level) in metadata.levels.iter().enumerate() {
        check(
            format!("tile/{index}"),
            zarr::tile_array_json(level.tiles, &RecordLayout::new(level)),
        );
    }
    if let Some(features) = &metadata.features {
        check("feature".into(), zarr::group_json());
        check(
            format!("feature/{}", features.level),
            zarr::feature_array_json(metadata.grid.tiles(features.level), features),
        );
    }
    let Some(color) = &metadata.color else { return };
    for (name, text) in zarr::color_nodes(metadata, color) {
        check(name, text);
    }
}

/// Compares shards with the manifest: presence and size, and if deep BLAKE3.
fn check_shards(
    path: &Path,
    metadata: &Metadata,
    report: &mut Report,
    progress: &mut dyn FnMut(u64),
) {
    let mut manifest = match read_manifest(&path.join(MANIFEST)) {
        Ok(manifest) => manifest,
        Err(what) => return report.add(format!("{}: {what}", path.join(MANIFEST).display())),
    };
    for (done, key) in (0..).zip(shard_keys(metadata)) {
        progress(done);
        let shard = path.join(&key);
        report.shard_count += 1;
        match (manifest.remove(&key), fs::metadata(&shard)) {
            (_, Err(error)) => report.add(format!("{}: is missing ({error})", shard.display())),
            (None, Ok(_)) => report.add(format!("{}: is not in the manifest", shard.display())),
            (Some(info), Ok(file)) => {
                report.shard_bytes += file.len();
                if let Err(what) = check_shard(&shard, &info, file.len(), report.deep) {
                    report.add(format!("{}: {what}", shard.display()));
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

fn check_shard(path: &Path, info: &ShardInfo, bytes: u64, deep: bool) -> Result<(), String> {
    if bytes != info.bytes {
        return Err(format!(
            "has {bytes} bytes; the manifest says {}",
            info.bytes
        ));
    }
    match deep.then(|| file_hash(path)) {
        Some(Err(error)) => Err(format!("reading failed: {error}")),
        Some(Ok((_, hash))) if hash != info.blake3 => {
            Err("does not match the manifest's BLAKE3".into())
        }
        _ => Ok(()),
    }
}

fn read_manifest(path: &Path) -> Result<HashMap<String, ShardInfo>, String> {
    const LINE_LIMIT: u64 = 4096;
    let mut file =
        BufReader::new(File::open(path).map_err(|error| format!("reading failed: {error}"))?);
    let mut manifest = HashMap::new();
    for number in 1.. {
        let mut line = Vec::new();
        let read = file.by_ref().take(LINE_LIMIT).read_until(b'\n', &mut line);
        if read.map_err(|error| format!("reading failed: {error}"))? == 0 {
            break;
        }
        let info: ShardInfo =
            serde_json::from_slice(&line).map_err(|error| format!("line {number}: {error}"))?;
        if let Some(twice) = manifest.insert(info.key.clone(), info) {
            return Err(format!(
                "line {number}: {:?} for the second time",
                twice.key
            ));
        }
    }
    Ok(manifest)
}

#[cfg(test)]
mod tests;
