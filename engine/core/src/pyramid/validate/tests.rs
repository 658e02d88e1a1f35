//! A good pyramid has no findings; every kind of damage has one that says where.

use std::{
    fs::{self, File},
    path::PathBuf,
};

use super::*;
use crate::{
    geo::TileId,
    pyramid::{PyramidWriter, Record, RecordLayout, RecordParts, sample, writer::MANIFEST},
};

fn written(rows: u32, columns: u32) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.zarr");
    sample::write(&path, rows, columns);
    (folder, path)
}

fn check(path: &Path, deep: bool) -> Report {
    let mut last = (0, 0);
    let report = validate(path, deep, &mut |done, total| {
        assert!(done >= last.0 && done <= total);
        last = (done, total);
    });
    assert_eq!(last.0, last.1);
    report.unwrap()
}

/// Writes the small pyramid with one level's records changed; checksums are right.
fn written_with(level: u8, change: impl Fn(&mut Bytes) + Sync) -> (tempfile::TempDir, PathBuf) {
    let (folder, good) = written(300, 200);
    let pyramid = Pyramid::open(&good).unwrap();
    let metadata = pyramid.metadata();
    let path = folder.path().join("changed.zarr");
    let writer = PyramidWriter::create(&path, false).unwrap();
    let mut shards = Vec::new();
    for (index, entry) in (0..).zip(&metadata.levels) {
        let layout = RecordLayout::new(entry);
        let record = |id: TileId| {
            let record = pyramid.read_record(id).unwrap();
            let mut bytes = Bytes {
                id,
                bytes: layout.encode(&parts(&record)),
            };
            if index == level {
                change(&mut bytes);
            }
            Ok(Some(bytes.bytes))
        };
        shards.push(
            writer
                .write_shard(index, &layout, entry.tiles, [0, 0], &record)
                .unwrap(),
        );
    }
    let texels = |id: TileId| pyramid.read_color(id);
    shards.extend(
        writer
            .write_color_shard(crate::pyramid::ColorCodec::Zstd, 0, [1, 1], [0, 0], &texels)
            .unwrap(),
    );
    writer.publish(metadata, &shards).unwrap();
    (folder, path)
}

struct Bytes {
    id: TileId,
    bytes: Vec<u8>,
}

fn parts(record: &Record) -> RecordParts<'_> {
    RecordParts {
        id: record.id,
        summary: record.summary,
        children: record.children,
        patch_codes: &record.patch_codes,
        voids: record.voids.as_deref(),
        cage: &record.cage,
        detail: &record.detail,
    }
}

fn finds(report: &Report, words: &str) -> bool {
    report
        .findings
        .iter()
        .any(|finding| finding.to_string().contains(words))
}

#[test]
fn a_good_pyramid_has_no_findings() {
    for (rows, columns) in [(300, 200), (1, 1), (1, 140), (600, 130)] {
        let (_folder, path) = written(rows, columns);
        for deep in [false, true] {
            let report = check(&path, deep);
            assert!(report.is_valid(), "{:?}", report.findings);
            assert!(report.shard_bytes > 0 && (report.tile_count > 0) == deep);
        }
    }
}

#[test]
fn missing_and_short_shards_are_found_without_reading_them() {
    let (_folder, path) = written(300, 200);
    fs::remove_file(path.join("tile/1/c/0/0/0")).unwrap();
    File::options()
        .write(true)
        .open(path.join("tile/2/c/0/0/0"))
        .unwrap()
        .set_len(200)
        .unwrap();
    let report = check(&path, false);
    assert!(finds(&report, "tile/1/c/0/0/0: is missing"));
    assert!(finds(&report, "tile/2/c/0/0/0: has 200 bytes"));
    assert_eq!(report.finding_count, 2);
    assert!(check(&path, true).finding_count > 2);
}

#[test]
fn a_flipped_bit_is_found_with_its_tile_and_place() {
    let (_folder, path) = written(300, 200);
    let shard = path.join("tile/2/c/0/0/0");
    let mut bytes = fs::read(&shard).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&shard, bytes).unwrap();
    assert!(check(&path, false).is_valid());
    let report = check(&path, true);
    assert!(finds(&report, "BLAKE3"));
    let finding = report
        .findings
        .iter()
        .find(|finding| finding.tile == Some([2, 2, 1]))
        .unwrap();
    assert!(finding.what.contains("checksum") && finding.place.is_some());
    assert_eq!(report.finding_count, 2);
}

#[test]
fn nodes_and_manifest_that_say_otherwise_are_found() {
    let (_folder, path) = written(300, 200);
    fs::remove_file(path.join("tile/0/zarr.json")).unwrap();
    fs::write(path.join("color/0/zarr.json"), "{}").unwrap();
    let manifest = path.join(MANIFEST);
    let text = fs::read_to_string(&manifest)
        .unwrap()
        .replace("tile/1/c/0/0/0", "../../etc/passwd");
    fs::write(&manifest, text).unwrap();
    let report = check(&path, false);
    for words in [
        "tile/0/zarr.json: is missing",
        "color/0/zarr.json: is not",
        "is not in the manifest",
        "etc/passwd",
    ] {
        assert!(finds(&report, words), "{words}: {:?}", report.findings);
    }
    fs::write(&manifest, "nonsense\n").unwrap();
    assert!(finds(&check(&path, false), "line 1"));
}

#[test]
fn borders_that_differ_are_found() {
    let (_folder, path) = written_with(2, |record| {
        if record.id == TileId::new(2, 1, 1) {
            // The first sample of the tile's west border.
            let at = record.bytes.len() - 2 * 129 * 129;
            record.bytes[at] ^= 1;
        }
    });
    let report = check(&path, true);
    assert!(
        finds(&report, "differ on their common border"),
        "{:?}",
        report.findings
    );
}

#[test]
fn void_borders_that_differ_are_found() {
    let (_folder, path) = written_with(2, |record| {
        if record.id == TileId::new(2, 2, 1) {
            record.bytes[12 + 80 + 1024] ^= 1;
        }
    });
    assert!(finds(&check(&path, true), "differ on their common border"));
}

#[test]
fn summaries_that_disagree_with_parents_children_and_heights_are_found() {
    let (_folder, path) = written_with(1, |record| {
        record.bytes[20..24].copy_from_slice(&0_f32.to_le_bytes());
    });
    let report = check(&path, true);
    assert!(
        finds(&report, "say different things") && finds(&report, "has an error of 0 m"),
        "{:?}",
        report.findings
    );
    let (_folder, path) = written_with(2, |record| {
        record.bytes[12..16].copy_from_slice(&1_i32.to_le_bytes());
    });
    assert!(finds(&check(&path, true), "outside its own range"));
}

#[test]
fn what_is_no_pyramid_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    assert!(validate(folder.path(), false, &mut |_, _| ()).is_err());
}
