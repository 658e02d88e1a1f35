//! What a finished pyramid tells of its build, so that the same build again has nothing to do.

use std::path::Path;

use super::options::BuildReport;
use crate::pyramid::manifest::read_manifest;
use crate::pyramid::{BuildMetadata, Metadata, Pyramid, ShardInfo};

/// The report of a pyramid that was built of the same, where all its shards are there.
pub(super) fn report(pyramid: &Path, fingerprint: &str) -> Option<BuildReport> {
    if fingerprint.is_empty() || !pyramid.is_dir() {
        return None;
    }
    let pyramid = Pyramid::open(pyramid).ok()?;
    let metadata = pyramid.metadata();
    let build = metadata.build.as_ref()?;
    if build.key != key(fingerprint) {
        return None;
    }
    let shards: Vec<ShardInfo> = read_manifest(pyramid.store()).ok()?.into_values().collect();
    let there = |info: &ShardInfo| {
        let size = pyramid.store().size(&info.key);
        size.is_ok_and(|size| size == info.bytes)
    };
    shards.iter().all(there).then(|| BuildReport {
        unchanged: true,
        ..of(metadata, build, &shards)
    })
}

/// What a build made, but for what depends on the run.
pub(super) fn of(metadata: &Metadata, build: &BuildMetadata, shards: &[ShardInfo]) -> BuildReport {
    let bytes = |prefix: &str| -> u64 {
        let under = shards.iter().filter(|info| info.key.starts_with(prefix));
        under.map(|info| info.bytes).sum()
    };
    let tiles = shards.iter().filter(|info| info.key.starts_with("tile/"));
    let grid = &metadata.grid;
    BuildReport {
        samples: [grid.rows, grid.columns],
        void_samples: build.void_samples,
        source_bytes: metadata.sources.iter().map(|source| source.bytes).sum(),
        levels: grid.level_count(),
        tiles: tiles.map(|info| u64::from(info.chunks)).sum(),
        eps: metadata.eps,
        unit: metadata.unit(),
        root_error: build.root_error,
        level_bytes: (0..grid.level_count())
            .map(|level| bytes(&format!("tile/{level}/")))
            .collect(),
        height_bytes: bytes("tile/"),
        features: metadata
            .features
            .as_ref()
            .map_or(0, |features| features.groups),
        feature_bytes: bytes("feature/"),
        color_levels: metadata.color.as_ref().map_or(0, |color| color.levels),
        color_bytes: bytes("color/") + bytes("alpha/"),
        ..BuildReport::default()
    }
}

/// BLAKE3 of a build's fingerprint, in hexadecimal.
pub(super) fn key(fingerprint: &str) -> String {
    blake3::hash(fingerprint.as_bytes()).to_hex().to_string()
}
