//! What a finished pyramid says of its build, so that the same build again has nothing to do.
//!
//! `manifest/build.json` is no part of what readers need: a pyramid without it is as good.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::options::BuildReport;
use crate::pyramid::manifest::read_manifest;
use crate::pyramid::{FileStore, PyramidError, ShardInfo, write_whole};

/// Where it is, from the root.
const FILE: &str = "manifest/build.json";

#[derive(Serialize, Deserialize)]
struct Finished {
    /// BLAKE3 of the fingerprint, in hexadecimal.
    key: String,
    /// What was made, but for what depends on the run.
    report: BuildReport,
}

/// Writes it to a folder that is not published yet.
pub(super) fn note(
    folder: &Path,
    fingerprint: &str,
    report: &BuildReport,
) -> Result<(), PyramidError> {
    let path = folder.join(FILE);
    let report = BuildReport {
        memory_bytes: 0,
        kept_tasks: 0,
        seconds: 0.0,
        ..report.clone()
    };
    let finished = Finished {
        key: key(fingerprint),
        report,
    };
    let text = serde_json::to_vec(&finished)
        .map_err(|error| PyramidError::io("writing", &path)(error.into()))?;
    write_whole(&path, &text)
}

/// The report of a pyramid that was built of the same, where all its shards are there.
pub(super) fn report(pyramid: &Path, fingerprint: &str) -> Option<BuildReport> {
    if fingerprint.is_empty() {
        return None;
    }
    let text = fs::read(pyramid.join(FILE)).ok()?;
    let finished: Finished = serde_json::from_slice(&text).ok()?;
    let there = |info: &ShardInfo| {
        fs::metadata(pyramid.join(&info.key)).is_ok_and(|about| about.len() == info.bytes)
    };
    let manifest = || read_manifest(&FileStore::new(pyramid));
    let whole = || manifest().is_ok_and(|shards| shards.values().all(there));
    (finished.key == key(fingerprint) && whole()).then_some(BuildReport {
        unchanged: true,
        ..finished.report
    })
}

fn key(fingerprint: &str) -> String {
    blake3::hash(fingerprint.as_bytes()).to_hex().to_string()
}
