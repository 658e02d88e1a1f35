//! A data set that a test makes up: levels, errors and heights from a hash; delays and failures when asked for.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use super::{TileSource, Tree};
use crate::{
    geo::{CAGE_CONTROL_COUNT, Crs, Grid, PATCH_COUNT, TILE_SAMPLE_COUNT, TileId},
    pyramid::{
        ColorMetadata, Level, Metadata, PyramidError, Summary, Tile, VerticalReference,
        feature::FeatureGroup,
    },
};

/// See the module.
pub(crate) struct Synthetic {
    metadata: Metadata,
    seed: u64,
    /// How long a read takes.
    pub(crate) delay: Duration,
    /// Of a hundred reads, how many fail.
    pub(crate) failures: u64,
    /// Finest samples differ, but for those on tile borders.
    pub(crate) rough: bool,
    /// Finest samples that are void, by tile, row and column.
    pub(crate) void: Option<fn(TileId, usize, usize) -> bool>,
    /// Reads so far.
    pub(crate) reads: AtomicU64,
    /// Features: their groups, with their cages.
    pub(crate) features: Vec<FeatureGroup>,
}

impl Synthetic {
    pub(crate) fn new(columns: u32, rows: u32, seed: u64) -> Self {
        let grid = Grid {
            columns,
            rows,
            origin: [0.0, 0.0],
            step: [1.0, -1.0],
        };
        let level = |level| Level {
            tiles: grid.tiles(level),
            step: 1,
            key: level % 4 == 0,
            cage_bytes: 4,
            detail_bytes: 1,
            voids: false,
        };
        let metadata = Metadata {
            version: Metadata::VERSION,
            build: None,
            grid,
            crs: Crs::unknown(),
            vertical: VerticalReference::Unknown,
            unit_exponent: -4,
            eps: 0.1,
            height_range: [0, 1600],
            levels: (0..grid.level_count()).map(level).collect(),
            color: None,
            features: None,
            sources: Vec::new(),
        };
        Self {
            metadata,
            seed,
            delay: Duration::ZERO,
            failures: 0,
            rough: false,
            void: None,
            reads: AtomicU64::new(0),
            features: Vec::new(),
        }
    }

    pub(crate) fn with_imagery(mut self, levels: u8) -> Self {
        self.metadata.color = Some(ColorMetadata {
            codec: crate::pyramid::ColorCodec::Zstd,
            levels,
            texels: 256,
            sources: Vec::new(),
        });
        self
    }

    /// With finest samples so many metres apart.
    pub(crate) fn with_step(mut self, metres: f64) -> Self {
        self.metadata.grid.step = [metres, -metres];
        self
    }

    /// Every tile in memory.
    pub(crate) fn whole_tree(&self) -> Tree {
        let mut tree = Tree::new(&self.metadata, Arc::new(self.tile(TileId::ROOT)));
        let mut stack = vec![Tree::ROOT];
        while let Some(place) = stack.pop() {
            let tile = self.tile(tree.node(place).id);
            tree.arrive(place, Arc::new(tile));
            stack.extend(
                tree.node(place)
                    .children
                    .iter()
                    .filter(|&&child| child != super::NO_NODE),
            );
        }
        tree
    }

    fn hash(&self, id: TileId, salt: u64) -> u64 {
        let address = u64::from(id.level) << 56 ^ u64::from(id.row) << 28 ^ u64::from(id.column);
        super::schedule::mix(address ^ super::schedule::mix(self.seed ^ salt << 7))
    }

    /// Errors double from level to level, times something from 1 to 2, so no child's is above its parent's.
    fn summary(&self, id: TileId) -> Summary {
        if !self.metadata.grid.has(id) {
            return Summary::default();
        }
        let up = self.metadata.finest() - id.level;
        let random = 1.0 + (self.hash(id, 1) % 1000) as f32 / 1000.0;
        let error = if up == 0 {
            0.0
        } else {
            0.1 * random * f32::from(up).exp2()
        };
        let slack = 100 * i32::from(up);
        let has_feature = self.features.iter().any(|group| group.tiles.contains(&id));
        Summary {
            min: 700 - slack,
            max: 900 + slack,
            error,
            flags: Summary::PRESENT | if has_feature { Summary::FEATURE } else { 0 },
        }
    }

    pub(crate) fn tile(&self, id: TileId) -> Tile {
        Tile {
            id,
            summary: self.summary(id),
            children: id.children().map(|child| self.summary(child)),
            step: 1,
            controls: vec![800; CAGE_CONTROL_COUNT].into(),
            detail: self.detail(id),
            patch_codes: vec![0; PATCH_COUNT].into(),
            voids: self
                .void
                .filter(|_| id.level == self.metadata.finest())
                .map(|void| bits(id, void)),
        }
    }

    fn detail(&self, id: TileId) -> Box<[i32]> {
        let mut detail = vec![0; TILE_SAMPLE_COUNT];
        if self.rough && id.level == self.metadata.finest() {
            for (row, column) in (1..128).flat_map(|row| (1..128).map(move |column| (row, column)))
            {
                detail[row * 129 + column] =
                    (self.hash(id, (row * 129 + column) as u64) % 61) as i32 - 30;
            }
        }
        detail.into()
    }

    fn read(&self, id: TileId) -> Result<(), PyramidError> {
        let read = self.reads.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(self.delay);
        if self.hash(id, read) % 100 < self.failures {
            return Err(PyramidError::Tile {
                tile: id,
                what: "the test says so".into(),
            });
        }
        Ok(())
    }
}

fn bits(id: TileId, void: fn(TileId, usize, usize) -> bool) -> Box<[u8]> {
    let mut bits = vec![0; TILE_SAMPLE_COUNT.div_ceil(8)];
    for at in (0..TILE_SAMPLE_COUNT).filter(|at| void(id, at / 129, at % 129)) {
        bits[at / 8] |= 1 << (at % 8);
    }
    bits.into()
}

impl TileSource for Synthetic {
    fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    fn load(&self, id: TileId, parent: Option<&Tile>) -> Result<Tile, PyramidError> {
        assert_eq!(
            id.parent(),
            parent.map(|parent| parent.id),
            "a tile is read with its own parent"
        );
        if id != TileId::ROOT {
            self.read(id)?;
        }
        Ok(self.tile(id))
    }

    fn load_color(&self, id: TileId) -> Result<Option<Arc<[u8]>>, PyramidError> {
        self.read(id)?;
        Ok(Some(
            [id.level, id.level, id.level, 255].repeat(256 * 256).into(),
        ))
    }

    fn has_features(&self) -> bool {
        !self.features.is_empty()
    }

    fn load_features(&self, id: TileId) -> Result<Vec<FeatureGroup>, PyramidError> {
        let groups = self.features.iter();
        let here = groups.filter(|group| group.tiles.contains(&id));
        Ok(here
            .map(|group| FeatureGroup {
                cage: group.cage.clone().filter(|_| group.home == id),
                ..group.clone()
            })
            .collect())
    }

    fn bytes_read(&self) -> u64 {
        1000 * self.reads.load(Ordering::Relaxed)
    }
}
