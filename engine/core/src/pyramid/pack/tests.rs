//! There and back again gives the same bytes; what is damaged is neither packed nor unpacked.

use std::{fs, path::PathBuf};

use super::*;
use crate::pyramid::{files::write_whole_with, sample, validate};

fn files(folder: &Path, under: &Path, found: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in fs::read_dir(under).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(folder, &path, found);
        } else {
            let name = path.strip_prefix(folder).unwrap().to_owned();
            found.push((name, fs::read(&path).unwrap()));
        }
    }
    found.sort();
}

fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    files(folder, folder, &mut found);
    found
}

fn packed(pyramid: &Path, zip: &Path) -> Result<(), PyramidError> {
    let pyramid = Pyramid::open(pyramid)?;
    let mut told = Vec::new();
    write_whole_with(zip, |file| {
        pack(&pyramid, file, zip, &mut |done, total| {
            told.push([done, total]);
        })
    })?;
    assert_eq!(told.first().map(|told| told[0]), Some(0));
    assert!(told.last().is_some_and(|told| told[0] == told[1]));
    Ok(())
}

fn unpacked(zip: &Path, output: &Path) -> Result<(), PyramidError> {
    unpack(&Pyramid::open(zip)?, output, false, &mut |_, _| {})
}

fn sample() -> (tempfile::TempDir, [PathBuf; 3]) {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.zarr", "a.zip", "b.zarr"].map(|name| folder.path().join(name));
    sample::write(&paths[0], 700, 300);
    (folder, paths)
}

#[test]
fn a_pyramid_comes_back_to_the_byte() {
    let (folder, [pyramid, zip, back]) = sample();
    packed(&pyramid, &zip).unwrap();
    unpacked(&zip, &back).unwrap();
    assert!(contents(&pyramid) == contents(&back));
    // From the archive itself: the same archive.
    let again = folder.path().join("again.zip");
    packed(&zip, &again).unwrap();
    assert!(fs::read(&zip).unwrap() == fs::read(&again).unwrap());
}

#[test]
fn an_archive_reads_like_its_folder_and_is_valid() {
    let (_folder, [folder, zip, _]) = sample();
    packed(&folder, &zip).unwrap();
    let [a, b] = [&folder, &zip].map(|path| Pyramid::open(path).unwrap());
    for id in sample::tiles(a.metadata()) {
        assert_eq!(
            a.read_tile_chain(id).unwrap(),
            b.read_tile_chain(id).unwrap()
        );
    }
    let [a, b] = [&folder, &zip].map(|path| validate(path, true, &mut |_, _| {}).unwrap());
    assert!(b.is_valid(), "{:?}", b.findings);
    assert_eq!(a, b);
}

#[test]
fn shards_begin_at_pages() {
    let (_folder, [folder, path, _]) = sample();
    packed(&folder, &path).unwrap();
    let mut zip = zip::ZipArchive::new(File::open(&path).unwrap()).unwrap();
    for index in 0..zip.len() {
        let member = zip.by_index_raw(index).unwrap();
        let alignment = if member.name().contains("/c/") {
            4096
        } else {
            64
        };
        assert_eq!(member.data_start() % alignment, 0, "{}", member.name());
        assert_eq!(member.compression(), CompressionMethod::Stored);
    }
}

#[test]
fn a_damaged_pyramid_is_not_packed_and_the_error_names_the_file() {
    let (_folder, [folder, zip, _]) = sample();
    let key = "tile/2/c/0/0/0";
    let good = fs::read(folder.join(key)).unwrap();
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 1;
    for bad in [Some(&flipped[..]), Some(&good[..100]), None] {
        fs::remove_file(folder.join(key)).unwrap();
        if let Some(bad) = bad {
            fs::write(folder.join(key), bad).unwrap();
        }
        let error = packed(&folder, &zip).unwrap_err();
        assert!(matches!(error, PyramidError::Invalid { .. }));
        assert!(error.to_string().contains(key), "{error}");
        assert!(!zip.exists());
        fs::write(folder.join(key), &good).unwrap();
    }
}

#[test]
fn a_damaged_archive_is_not_unpacked_and_leaves_nothing() {
    let (folder, [pyramid, zip, back]) = sample();
    packed(&pyramid, &zip).unwrap();
    let good = fs::read(&zip).unwrap();
    let member = ZipStoreRange::of(&zip, "tile/2/c/0/0/0");
    let mut bad = good.clone();
    bad[member.middle()] ^= 4;
    fs::write(&zip, &bad).unwrap();
    let error = unpacked(&zip, &back).unwrap_err().to_string();
    assert!(error.contains("a.zip/tile/2/c/0/0/0"), "{error}");
    let report = validate(&zip, true, &mut |_, _| {}).unwrap();
    assert!(!report.is_valid());
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

/// Where a member's bytes lie.
struct ZipStoreRange(usize, usize);

impl ZipStoreRange {
    fn of(path: &Path, name: &str) -> Self {
        let mut zip = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
        let member = zip.by_name(name).unwrap();
        let [start, size] = [member.data_start(), member.size()];
        Self(
            usize::try_from(start).unwrap(),
            usize::try_from(size).unwrap(),
        )
    }

    fn middle(&self) -> usize {
        self.0 + self.1 / 2
    }
}

#[test]
fn what_is_there_is_replaced_only_where_asked() {
    let (_folder, [pyramid, zip, back]) = sample();
    packed(&pyramid, &zip).unwrap();
    unpacked(&zip, &back).unwrap();
    assert!(matches!(
        unpacked(&zip, &back),
        Err(PyramidError::Refused(_))
    ));
    let opened = Pyramid::open(&zip).unwrap();
    unpack(&opened, &back, true, &mut |_, _| {}).unwrap();
    assert!(contents(&pyramid) == contents(&back));
}
