//! Tiles come back as they were written, and nothing damaged comes back at all.

use std::fs;

use super::*;
use crate::{
    geo::TILE_SAMPLES,
    pyramid::{FaultStore, Faults, FileStore, sample},
};

struct Written {
    folder: tempfile::TempDir,
    metadata: Metadata,
}

impl Written {
    fn new(rows: u32, columns: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let metadata = sample::write(&folder.path().join("out.zarr"), rows, columns);
        Self { folder, metadata }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("out.zarr")
    }

    fn shard(&self, tile: TileId) -> PathBuf {
        self.path().join(Array::Tile.shard_key(tile))
    }

    fn read_all(&self) -> Result<(), PyramidError> {
        let pyramid = Pyramid::open(&self.path())?;
        sample::tiles(&self.metadata)
            .into_iter()
            .try_for_each(|tile| pyramid.read_tile_chain(tile).map(drop))
    }
}

#[test]
fn tiles_come_back_within_half_a_step() {
    let written = Written::new(300, 200);
    let pyramid = Pyramid::open(&written.path()).unwrap();
    assert_eq!(pyramid.metadata(), &written.metadata);
    for id in sample::tiles(&written.metadata) {
        let tile = pyramid.read_tile_chain(id).unwrap();
        let stride = i64::from(written.metadata.grid.stride(id.level));
        let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
        for (at, height) in heights.iter().enumerate() {
            let [row, column] = [at / TILE_SAMPLES, at % TILE_SAMPLES];
            let place = |tile: u32, sample: usize| {
                (i64::from(tile) * 128 + i64::try_from(sample).unwrap()) * stride
            };
            let [r, c] = [place(id.row, row), place(id.column, column)];
            assert!(
                (height - sample::height(r, c)).abs() <= tile.step / 2,
                "{id} {row} {column}"
            );
            assert_eq!(tile.is_void(row, column), sample::is_void(r, c));
        }
    }
}

#[test]
fn imagery_comes_back_and_is_none_where_there_is_none() {
    let written = Written::new(300, 200);
    let pyramid = Pyramid::open(&written.path()).unwrap();
    assert_eq!(
        pyramid.read_color(TileId::ROOT).unwrap(),
        Some(vec![9; 256 * 256 * 4])
    );
    assert_eq!(pyramid.read_color(TileId::new(1, 0, 0)).unwrap(), None);
}

#[test]
fn a_tile_needs_its_parents_controls_and_a_place_in_the_pyramid() {
    let written = Written::new(300, 200);
    let pyramid = Pyramid::open(&written.path()).unwrap();
    assert!(pyramid.read_tile(TileId::ROOT, None).is_ok());
    assert!(pyramid.read_tile(TileId::new(1, 0, 0), None).is_err());
    assert!(
        pyramid
            .read_tile(TileId::new(1, 0, 0), Some(&[0; 7]))
            .is_err()
    );
    for outside in [
        TileId::new(0, 1, 0),
        TileId::new(2, 3, 0),
        TileId::new(9, 0, 0),
        TileId::new(255, 0, 0),
    ] {
        assert!(!pyramid.has(outside));
        assert!(pyramid.read_tile_chain(outside).is_err());
    }
}

#[test]
fn a_folder_without_a_root_is_not_a_finished_pyramid() {
    let written = Written::new(100, 100);
    fs::remove_file(written.path().join("zarr.json")).unwrap();
    let error = Pyramid::open(&written.path()).unwrap_err().to_string();
    assert!(error.contains("not a finished pyramid"), "{error}");
    assert!(matches!(
        Pyramid::open(&written.path().join("nowhere")),
        Err(PyramidError::Io { .. })
    ));
    fs::write(written.path().join("zarr.json"), "{}").unwrap();
    assert!(matches!(
        Pyramid::open(&written.path()),
        Err(PyramidError::Invalid { .. })
    ));
}

#[test]
fn a_missing_shard_is_an_error_that_names_tile_and_file() {
    let written = Written::new(300, 200);
    let tile = TileId::new(2, 1, 1);
    fs::remove_file(written.shard(tile)).unwrap();
    let pyramid = Pyramid::open(&written.path()).unwrap();
    let error = pyramid.read_tile_chain(tile).unwrap_err().to_string();
    assert!(
        error.contains("tile 2/1/1") && error.contains("tile/2/c/0/0/0"),
        "{error}"
    );
    assert!(pyramid.read_tile_chain(TileId::new(1, 0, 0)).is_ok());
}

#[test]
fn every_byte_of_a_shard_matters() {
    let written = Written::new(100, 100);
    let shard = written.shard(TileId::ROOT);
    let whole = fs::read(&shard).unwrap();
    written.read_all().unwrap();
    // All of index and frame header, then a sample of the frame, then all of the checksum.
    let end = whole.len() - 16;
    for at in (0..whole.len()).filter(|&at| at < 64 || at % 37 == 0 || at > end) {
        let mut broken = whole.clone();
        broken[at] ^= 1 << (at % 8);
        fs::write(&shard, broken).unwrap();
        assert!(written.read_all().is_err(), "byte {at}");
    }
}

#[test]
fn every_truncated_length_of_a_shard_is_an_error() {
    let written = Written::new(100, 100);
    let shard = written.shard(TileId::ROOT);
    let whole = fs::read(&shard).unwrap();
    for length in (0..whole.len())
        .filter(|length| *length < 64 || length % 41 == 0 || length + 8 > whole.len())
    {
        fs::write(&shard, &whole[..length]).unwrap();
        assert!(written.read_all().is_err(), "{length} bytes");
    }
}

#[test]
fn swapped_chunks_with_good_checksums_are_noticed() {
    let written = Written::new(300, 200);
    let shard = written.shard(TileId::new(2, 0, 0));
    let bytes = fs::read(&shard).unwrap();
    let shape = [3, 2];
    let (index, chunks) = bytes.split_at(ShardIndex::byte_count(shape));
    let index = ShardIndex::decode(index, shape).unwrap();
    let mut swapped = index.clone();
    swapped.set([0, 0], index.chunk([1, 1]).unwrap());
    swapped.set([1, 1], index.chunk([0, 0]).unwrap());
    fs::write(&shard, [&swapped.encode(), chunks].concat()).unwrap();
    let pyramid = Pyramid::open(&written.path()).unwrap();
    let error = pyramid
        .read_tile_chain(TileId::new(2, 1, 1))
        .unwrap_err()
        .to_string();
    assert!(error.contains("holds tile 2/0/0"), "{error}");
    assert!(pyramid.read_tile_chain(TileId::new(2, 0, 1)).is_ok());
}

#[test]
fn a_store_with_faults_gives_errors_and_never_wrong_tiles() {
    let written = Written::new(300, 200);
    let good = Pyramid::open(&written.path()).unwrap();
    let prefix = String::from("tile/");
    let kinds = [
        Faults {
            seed: 1,
            error_rate: 0.4,
            prefix: prefix.clone(),
            ..Faults::default()
        },
        Faults {
            seed: 2,
            truncate_rate: 0.4,
            prefix: prefix.clone(),
            ..Faults::default()
        },
        Faults {
            seed: 3,
            flip_rate: 0.4,
            prefix: prefix.clone(),
            ..Faults::default()
        },
        Faults {
            seed: 4,
            stale_rate: 0.4,
            prefix: prefix.clone(),
            ..Faults::default()
        },
        Faults {
            seed: 5,
            error_count: 3,
            prefix,
            ..Faults::default()
        },
    ];
    for faults in kinds {
        let store = FaultStore::new(FileStore::new(written.path()), faults.clone());
        let pyramid = Pyramid::with_store(Box::new(store)).unwrap();
        let (mut right, mut wrong) = (0, 0);
        for tile in sample::tiles(&written.metadata).repeat(4) {
            match pyramid.read_tile_chain(tile) {
                Ok(read) => {
                    assert_eq!(read, good.read_tile_chain(tile).unwrap());
                    right += 1;
                }
                Err(PyramidError::Tile { .. }) => wrong += 1,
                Err(other) => panic!("{other}"),
            }
        }
        assert!(
            right > 0 && wrong > 0,
            "{faults:?}: {right} right, {wrong} wrong"
        );
    }
}
