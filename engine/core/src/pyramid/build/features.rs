//! Features of a build: laid once the finest level is settled, felt by the summaries above, written beside the tiles.

use std::collections::BTreeMap;

use super::errors::ceil_f32;
use super::ground::StoredGround;
use super::journal::Made;
use super::levels::Levels;
use super::tasks::{Job, Tasks};
use crate::cage::write_obj;
use crate::dem::RasterHeader;
use crate::geo::{Grid, TileId};
use crate::pyramid::feature::{
    FeatureGroup, FeatureInput, FeatureMetadata, Site, encode, lay_all, tiles_of,
};
use crate::pyramid::zarr::FEATURE_BYTES_LIMIT;
use crate::pyramid::{PyramidError, PyramidWriter, ShardInfo, Summary, shard_count};

/// What a tile knows of the features in it.
#[derive(Clone, Copy)]
struct Touch {
    /// Their greatest distance from the ground, metres.
    error: f32,
    /// Least and greatest height of them, units.
    range: [i32; 2],
}

/// All features of a build.
pub(super) struct Features {
    finest: u8,
    groups: Vec<FeatureGroup>,
    /// By tile of the finest level.
    touched: BTreeMap<TileId, Touch>,
    /// By tile of the finest level, padded to one length.
    records: BTreeMap<TileId, Vec<u8>>,
}

impl Features {
    /// Lays all features into the settled finest level.
    pub(super) fn new(
        inputs: &[FeatureInput],
        levels: &Levels,
        header: &RasterHeader,
        unit: f64,
    ) -> Result<Self, PyramidError> {
        let finest = header.grid.level_count() - 1;
        let ground = StoredGround::new(
            &levels.samples[usize::from(finest)],
            &levels.cages[usize::from(finest)],
        );
        let site = Site {
            grid: &header.grid,
            crs: &header.crs,
            unit,
            ground: &ground,
        };
        let mut features = Self {
            finest,
            groups: Vec::new(),
            touched: BTreeMap::new(),
            records: BTreeMap::new(),
        };
        let laid = lay_all(inputs, &site);
        ground.check()?;
        for (id, laid) in (0..).zip(laid?) {
            let tiles = tiles_of(finest, laid.cut);
            let touch = Touch {
                error: ceil_f32(laid.error),
                range: [laid.range[0].floor(), laid.range[1].ceil()].map(to_units),
            };
            tiles.iter().for_each(|tile| features.touch(*tile, touch));
            features.groups.push(FeatureGroup {
                id,
                home: tiles[0],
                tiles,
                cut: laid.cut,
                cage: Some(laid.cage),
            });
        }
        features.records = records(&features.groups)?;
        Ok(features)
    }

    fn touch(&mut self, tile: TileId, touch: Touch) {
        let all = self.touched.entry(tile).or_insert(touch);
        all.error = all.error.max(touch.error);
        all.range = [
            all.range[0].min(touch.range[0]),
            all.range[1].max(touch.range[1]),
        ];
    }

    /// Lets a tile's summary know: the finest tile's of its flag and range, its parent's of the error. Farther up they
    /// are known from the children.
    pub(super) fn add_to(&self, summary: &mut Summary, tile: TileId) {
        if tile.level == self.finest
            && let Some(touch) = self.touched.get(&tile)
        {
            summary.flags |= Summary::FEATURE;
            summary.min = summary.min.min(touch.range[0]);
            summary.max = summary.max.max(touch.range[1]);
        }
        if tile.level + 1 == self.finest {
            for touch in tile
                .children()
                .iter()
                .filter_map(|child| self.touched.get(child))
            {
                summary.error = summary.error.max(touch.error);
            }
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> u32 {
        u32::try_from(self.groups.len()).unwrap_or(u32::MAX)
    }

    /// What the metadata say of them.
    pub(super) fn metadata(&self) -> Option<FeatureMetadata> {
        let record_bytes = self.records.values().next()?.len();
        Some(FeatureMetadata {
            level: self.finest,
            record_bytes: u32::try_from(record_bytes).unwrap_or(u32::MAX),
            groups: self.count(),
        })
    }

    /// Writes their shards: one task.
    pub(super) fn write(
        &self,
        grid: &Grid,
        writer: &PyramidWriter,
        tasks: &Tasks<'_>,
    ) -> Result<Vec<ShardInfo>, PyramidError> {
        let Some(metadata) = self.metadata() else {
            return Ok(Vec::new());
        };
        let job = Job {
            pass: "features",
            planes: &[],
            in_turn: true,
            advance: &|_| Ok(()),
        };
        let work = |()| {
            Ok(Made {
                shards: self.write_shards(metadata, grid, writer)?,
                ..Made::default()
            })
        };
        Ok(tasks.run(&job, |_| vec![()], work, |(), ()| ())?.shards)
    }

    fn write_shards(
        &self,
        metadata: FeatureMetadata,
        grid: &Grid,
        writer: &PyramidWriter,
    ) -> Result<Vec<ShardInfo>, PyramidError> {
        let tiles = grid.tiles(self.finest);
        let [rows, columns] = shard_count(tiles);
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| [row, column]))
            .map(|shard| {
                let record = |tile: TileId| Ok(self.records.get(&tile).cloned());
                let bytes = metadata.record_bytes;
                writer.write_feature_shard(self.finest, bytes, tiles, shard, &record)
            })
            .collect()
    }
}

/// The records of all tiles with features, padded to the longest.
fn records(groups: &[FeatureGroup]) -> Result<BTreeMap<TileId, Vec<u8>>, PyramidError> {
    let mut by_tile: BTreeMap<TileId, Vec<FeatureGroup>> = BTreeMap::new();
    for group in groups {
        for &tile in &group.tiles {
            let cage = group.cage.as_ref().filter(|_| group.home == tile).cloned();
            by_tile.entry(tile).or_default().push(FeatureGroup {
                cage,
                ..group.clone()
            });
        }
    }
    let mut records: BTreeMap<TileId, Vec<u8>> = by_tile
        .into_iter()
        .map(|(tile, groups)| (tile, encode(tile, &groups)))
        .collect();
    let longest = records.values().map(Vec::len).max().unwrap_or(0);
    if longest > FEATURE_BYTES_LIMIT as usize {
        return Err(PyramidError::Unfit(format!(
            "the features of one tile take {longest} bytes; the limit is {FEATURE_BYTES_LIMIT}"
        )));
    }
    records
        .values_mut()
        .for_each(|record| record.resize(longest, 0));
    Ok(records)
}

/// All that decides the features' bytes, in a few letters; nothing for none.
pub(super) fn fingerprint(inputs: &[FeatureInput]) -> String {
    let mut hasher = blake3::Hasher::new();
    for input in inputs {
        hasher.update(input.placement.to_string().as_bytes());
        hasher.update(write_obj(&input.cage).as_bytes());
    }
    if inputs.is_empty() {
        String::new()
    } else {
        hasher.finalize().to_hex().to_string()
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "whole; a float past i32 becomes the nearest i32"
)]
fn to_units(height: f64) -> i32 {
    height as i32
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path as File;
    use std::sync::atomic::AtomicBool;

    use super::super::testing::{Field, hills};
    use super::super::{BuildOptions, build};
    use super::*;
    use crate::cage::Placement;
    use crate::cage::generate::{Arch, Path, arch, flat};
    use crate::pyramid::{Pyramid, validate};

    /// An arch across the corner of four tiles of 300 × 300 samples.
    fn input() -> FeatureInput {
        let path = Path::new(vec![[-250.0, 0.0], [250.0, 50.0]]).unwrap();
        let lengths = Arch {
            height: 900.0,
            width: 100.0,
        };
        FeatureInput {
            name: "arch.obj".into(),
            cage: arch(&path, &lengths, &flat).unwrap(),
            placement: Placement::on_ground([1280.0, -1280.0]),
        }
    }

    fn make(
        output: &File,
        threads: usize,
        features: Vec<FeatureInput>,
    ) -> Result<(), PyramidError> {
        let options = BuildOptions {
            output: output.into(),
            threads: Some(threads),
            features,
            ..BuildOptions::default()
        };
        let raster = Field::new(300, 300, hills);
        build(&raster, None, &options, &|_| (), &AtomicBool::new(false)).map(|_| ())
    }

    fn bytes(folder: &File) -> BTreeMap<std::path::PathBuf, Vec<u8>> {
        let mut all = BTreeMap::new();
        let mut open = vec![folder.to_path_buf()];
        while let Some(path) = open.pop() {
            for entry in std::fs::read_dir(path).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else {
                    let name = path.strip_prefix(folder).unwrap().to_path_buf();
                    all.insert(name, std::fs::read(&path).unwrap());
                }
            }
        }
        all
    }

    #[test]
    fn a_feature_is_stored_once_felt_above_and_leaves_heights_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [plain, with, again] = ["plain", "with", "again"].map(|name| folder.path().join(name));
        make(&plain, 2, Vec::new()).unwrap();
        make(&with, 1, vec![input()]).unwrap();
        make(&again, 3, vec![input()]).unwrap();
        assert!(bytes(&with) == bytes(&again));
        let report = validate(&with, true, &mut |_, _| ()).unwrap();
        assert!(report.is_valid(), "{:?}", report.findings);
        let [plain, with] = [plain, with].map(|path| Pyramid::open(&path).unwrap());
        let about = with.metadata().features.unwrap();
        assert_eq!((about.level, about.groups), (2, 1));
        let home = TileId::new(2, 0, 0);
        let groups = with.read_features(home).unwrap();
        assert_eq!((groups[0].home, groups[0].tiles.len()), (home, 4));
        assert!(groups[0].cage.is_some());
        for &tile in &groups[0].tiles {
            let [before, after] = [&plain, &with].map(|from| from.read_tile_chain(tile).unwrap());
            assert_eq!(
                (before.controls, before.detail),
                (after.controls, after.detail)
            );
            assert!(after.summary.flags & Summary::FEATURE != 0);
            assert_eq!(after.summary.error, before.summary.error);
            assert!(f64::from(after.summary.max) * with.metadata().unit() > 500.0);
            assert_eq!(
                with.read_features(tile).unwrap()[0].cage.is_some(),
                tile == home
            );
        }
        assert!(with.read_features(TileId::new(2, 2, 2)).unwrap().is_empty());
        assert!(
            plain.metadata().features.is_none() && plain.read_features(home).unwrap().is_empty()
        );
        for level in 0..2 {
            let tile = with.read_tile_chain(home.ancestor(level)).unwrap();
            assert!(tile.summary.error > 300.0, "{}", tile.summary.error);
        }
    }

    #[test]
    fn a_feature_that_cannot_be_laid_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let mut outside = input();
        outside.placement.position = [1e7, 0.0];
        assert!(make(&folder.path().join("x"), 1, vec![outside]).is_err());
        assert!(make(&folder.path().join("x"), 1, vec![input(), input()]).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
