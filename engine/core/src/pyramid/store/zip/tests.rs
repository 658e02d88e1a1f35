//! Members come out as they went in; whatever is wrong with an archive is an error.

use std::{fs, io::Write};

use zip::{ZipWriter, write::SimpleFileOptions};

use super::*;

fn archive(method: CompressionMethod) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut zip = ZipWriter::new(&mut bytes);
    let options = SimpleFileOptions::default().compression_method(method);
    zip.add_directory("tile/", options).unwrap();
    for (name, content) in [("a", &[7; 60][..]), ("tile/0", &[8; 50]), ("tilers", &[9])] {
        zip.start_file(name, options.with_alignment(8)).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap();
    bytes.into_inner()
}

fn opened(bytes: &[u8]) -> Result<(tempfile::TempDir, ZipStore), PyramidError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zip");
    fs::write(&path, bytes).unwrap();
    ZipStore::open(&path).map(|store| (folder, store))
}

#[test]
fn ranges_of_members_are_read_and_others_are_errors() {
    let (_folder, store) = opened(&archive(CompressionMethod::Stored)).unwrap();
    assert_eq!(store.size("a").unwrap(), 60);
    assert_eq!(store.read("a", 58..60).unwrap(), [7; 2]);
    assert_eq!(store.read("tile/0", 0..50).unwrap(), [8; 50]);
    for range in [0..51, 50..51, 9..u64::MAX] {
        let error = store.read("tile/0", range).unwrap_err();
        assert!(
            matches!(error, StoreError::Short { bytes: 50, .. }),
            "{error}"
        );
    }
    let error = store.size("tile").unwrap_err();
    assert!(matches!(error, StoreError::Missing { .. }));
    assert!(error.to_string().contains("a.zip/tile"), "{error}");
}

#[test]
fn bytes_are_counted_by_folder() {
    let (_folder, store) = opened(&archive(CompressionMethod::Stored)).unwrap();
    for (folder, bytes) in [("", 111), ("tile", 50), ("til", 0), ("none", 0)] {
        assert_eq!(store.bytes_under(folder).unwrap(), bytes, "{folder:?}");
    }
}

#[test]
fn every_cut_is_an_error_or_leaves_a_whole_directory() {
    let bytes = archive(CompressionMethod::Stored);
    for length in 0..bytes.len() {
        assert!(opened(&bytes[..length]).is_err(), "{length} bytes");
    }
}

#[test]
fn flipped_bits_are_errors_or_give_members_inside_the_file() {
    let bytes = archive(CompressionMethod::Stored);
    // One bit of every byte, each time another.
    for bit in (0..bytes.len()).map(|byte| 8 * byte + byte * 5 % 8) {
        let mut broken = bytes.clone();
        broken[bit / 8] ^= 1 << (bit % 8);
        let Ok((_folder, store)) = opened(&broken) else {
            continue;
        };
        for (key, range) in &store.members {
            assert!(range.end <= bytes.len() as u64, "bit {bit}: {key}");
            store.read(key, 0..range.end - range.start).unwrap();
        }
    }
}

#[test]
fn an_archive_cut_short_after_it_was_opened_is_an_error() {
    let (folder, store) = opened(&archive(CompressionMethod::Stored)).unwrap();
    File::options()
        .write(true)
        .open(folder.path().join("a.zip"))
        .unwrap()
        .set_len(100)
        .unwrap();
    assert!(store.read("tile/0", 0..50).is_err());
}
