//! A made-up piece of ground as a frame plan, for tests of the stages: a hill in tiles of two levels.
//!
//! The list of drawn tiles is put together here on its own, plainly and slowly, and so checks the planner's.

use std::{collections::HashMap, sync::Arc, time::Duration};

use drumlin_core::{
    geo::{
        CAGE_CONTROL_COUNT, CAGE_CONTROLS, Crs, Grid, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS,
        TILE_SAMPLE_COUNT, TILE_SAMPLES, TileId,
    },
    pyramid::{
        Level, Metadata, PyramidError, Summary, Tile, VerticalReference, feature::FeatureGroup,
    },
    reference::shared::{
        DrawnTile, Frame, NONE, SIDE_COARSER, SIDE_FINER, SIDE_SAME, TILE_VISIBLE,
    },
    stream::TileSource,
    terrain::{FramePlan, Upload, feature_mesh::synthetic},
};

/// Metres a height unit of the scene.
pub const UNIT: f32 = 0.125;
/// Metres a sample at level 0.
const ROOT_STEP: f64 = 16.0;
/// Units a code step.
const QUANTUM: i32 = 2;

/// Height of the ground in metres, at metres east and south of the north-west corner.
#[must_use]
pub fn ground(east: f64, south: f64) -> f64 {
    let side = ROOT_STEP * TILE_CELLS as f64;
    let (x, y) = (east / side - 0.5, south / side - 0.5);
    let hill = 420.0 * (-(x * x + y * y) * 9.0).exp();
    let ridges = 35.0 * (x * 31.0).sin() * (y * 23.0 + x * 5.0).cos();
    hill + ridges * (0.3 + x + 0.5)
}

/// Tiles of a cut, in the order of the list: level 1 but for its last tile, which is drawn by its children.
#[must_use]
pub fn mixed_cut() -> Vec<TileId> {
    let mut cut = TileId::ROOT.children().to_vec();
    let split = cut.pop().expect("four children");
    cut.extend(split.children());
    cut
}

/// Tiles that are in the pool: the cut and all ancestors, each in the slot of its place.
#[must_use]
pub fn resident(cut: &[TileId]) -> Vec<TileId> {
    let mut all: Vec<_> = cut
        .iter()
        .flat_map(|tile| (0..=tile.level).map(|level| tile.ancestor(level)))
        .collect();
    all.sort_by_key(|tile| (tile.level, tile.row, tile.column));
    all.dedup();
    all
}

fn step(level: u8) -> f64 {
    ROOT_STEP / f64::from(1_u32 << level)
}

/// A number of 0..1 that only depends on a place.
fn noise(a: i64, b: i64) -> f64 {
    let mixed = (a.wrapping_mul(0x9e37_79b9) ^ b.wrapping_mul(0x85eb_ca6b)).cast_unsigned();
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    f64::from(u32::try_from(mixed >> 40).unwrap_or(0)) / 16_777_216.0
}

/// A tile of the scene: the hill as its cage, a little noise as its residual.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    reason = "heights and codes of the scene are small"
)]
pub fn tile(id: TileId) -> Tile {
    let spacing = step(id.level);
    let first = [id.row, id.column].map(|at| i64::from(at) * TILE_CELLS as i64);
    let control = |index: usize| {
        let at = [index / CAGE_CONTROLS, index % CAGE_CONTROLS];
        let sample = |axis: usize| first[axis] + (at[axis] as i64 - 1) * QUAD_SAMPLES as i64;
        let height = ground(sample(1) as f64 * spacing, sample(0) as f64 * spacing);
        (height / f64::from(UNIT)).round() as i32
    };
    let code = |index: usize| {
        let sample = [index / TILE_SAMPLES, index % TILE_SAMPLES].map(|at| at as i64);
        let value = noise(
            first[0] + sample[0],
            first[1] + sample[1] + 977 * i64::from(id.level),
        );
        (value * 3.0) as i32 - 1
    };
    let nibbles = |index: usize| {
        let coarse = (noise(index as i64, i64::from(id.row)) * 12.0) as u8;
        (coarse / 2) << 4 | coarse
    };
    Tile {
        id,
        summary: Summary {
            min: -2000,
            max: 4000,
            error: 0.8,
            flags: Summary::PRESENT,
        },
        children: [Summary::default(); 4],
        step: QUANTUM,
        controls: (0..CAGE_CONTROL_COUNT).map(control).collect(),
        detail: (0..TILE_SAMPLE_COUNT).map(code).collect(),
        patch_codes: (0..PATCH_COUNT).map(nibbles).collect(),
        voids: None,
    }
}

/// Where a camera of the scene stands and looks, metres: east and south of the corner become east and north of it.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Where it is.
    pub eye: [f64; 3],
    /// What is in the middle of its picture.
    pub target: [f64; 3],
    /// Angle from bottom to top.
    pub fov_y: f64,
    /// Pixels.
    pub size: [u32; 2],
}

impl Camera {
    /// One above the south-west corner that sees the hill and the horizon.
    #[must_use]
    pub fn over_the_hill(size: [u32; 2]) -> Self {
        Self {
            eye: [250.0, -1950.0, 420.0],
            target: [1100.0, -900.0, 150.0],
            fov_y: 0.9,
            size,
        }
    }

    /// One straight above the middle, so that the ground fills the picture.
    #[must_use]
    pub fn from_above(size: [u32; 2]) -> Self {
        Self {
            eye: [1024.0, -1025.0, 1050.0],
            target: [1024.0, -1024.0, 0.0],
            fov_y: 0.9,
            size,
        }
    }
}

/// The frame of a camera.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "the device works in f32")]
pub fn frame(camera: &Camera, drawn: usize) -> Frame {
    let [eye, target] = [camera.eye, camera.target].map(glam::DVec3::from);
    let forward = (target - eye).normalize();
    let right = forward.cross(glam::DVec3::Z).normalize();
    let up = right.cross(forward);
    let focal = 1.0 / (0.5 * camera.fov_y).tan();
    let [width, height] = camera.size.map(f64::from);
    let column = |axis: usize| {
        let scaled = [
            right[axis] * focal * height / width,
            up[axis] * focal,
            0.0,
            forward[axis],
        ];
        scaled.map(|value| value as f32)
    };
    Frame {
        clip_from_view_world: [column(0), column(1), column(2), [0.0, 0.0, 0.5, 0.0]],
        viewport: [width as f32, height as f32],
        pixels_per_radian: (0.5 * height * focal) as f32,
        tolerance: 1.0,
        unit: UNIT,
        drawn_count: u32::try_from(drawn).expect("a short list"),
        index_capacity: 0,
        uniform_depth: NONE,
        sun: glam::Vec3::new(-0.5, 0.3, 0.7).normalize().into(),
        haze: 4.0e-5,
        sky: [0.45, 0.6, 0.8],
        flags: 0,
        height_range: [-50.0, 430.0],
        camera_height: eye.z as f32,
        reserved: 0.0,
        ground_min: [f32::MIN; 2],
        ground_max: [f32::MAX; 2],
    }
}

/// The whole plan: all resident tiles go up, the cut is drawn.
#[must_use]
pub fn plan(camera: &Camera, cut: &[TileId]) -> FramePlan {
    let resident = resident(cut);
    let upload = |(slot, &id): (usize, &TileId)| Upload {
        slot: u32::try_from(slot).expect("few slots"),
        tile: Arc::new(tile(id)),
        step: metric_step(id.level),
        cut: None,
    };
    FramePlan {
        uploads: resident.iter().enumerate().map(upload).collect(),
        color_uploads: Vec::new(),
        frame: Some(frame(camera, cut.len())),
        drawn: drawn_tiles(camera, cut, &resident),
        ground: [[f64::MIN; 2], [f64::MAX; 2]],
        ..FramePlan::default()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "steps are powers of two")]
fn metric_step(level: u8) -> [f32; 2] {
    [step(level) as f32, -step(level) as f32]
}

/// The cut as the stages want it.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    reason = "camera-relative metres are f32 on the device"
)]
pub fn drawn_tiles(camera: &Camera, cut: &[TileId], resident: &[TileId]) -> Vec<DrawnTile> {
    let index = |id: TileId, all: &[TileId]| {
        all.iter()
            .position(|&other| other == id)
            .map_or(NONE, |at| u32::try_from(at).expect("few"))
    };
    let places: HashMap<TileId, u32> = cut.iter().map(|&id| (id, index(id, cut))).collect();
    let describe = |&id: &TileId| {
        let side = step(id.level) * TILE_CELLS as f64;
        let corner = |quadrant: u32| corner_owner(&places, id, quadrant);
        let corners: [(u32, u32); 4] = std::array::from_fn(|quadrant| corner(quadrant as u32));
        DrawnTile {
            origin: [
                (f64::from(id.column) * side - camera.eye[0]) as f32,
                (-f64::from(id.row) * side - camera.eye[1]) as f32,
                (-camera.eye[2]) as f32,
            ],
            slot: index(id, resident),
            step: metric_step(id.level),
            error: 0.8,
            level: id.level.into(),
            base: 0,
            z_min: (-80.0 - camera.eye[2]) as f32,
            z_max: (440.0 - camera.eye[2]) as f32,
            flags: TILE_VISIBLE,
            parent_slot: id.parent().map_or(NONE, |parent| index(parent, resident)),
            quadrant: id.quadrant(),
            color_slot: NONE,
            color_scale: 1.0,
            color_offset: [0.0; 2],
            skirt: 3.0,
            geometric_error: 0.8,
            corner_tile: corners.map(|corner| corner.0),
            corner_sample: corners.map(|corner| corner.1),
            side_north: side_words(&places, id, [-1, 0]),
            side_east: side_words(&places, id, [0, 1]),
            side_south: side_words(&places, id, [1, 0]),
            side_west: side_words(&places, id, [0, -1]),
        }
    };
    cut.iter().map(describe).collect()
}

fn moved(id: TileId, [rows, columns]: [i64; 2]) -> Option<TileId> {
    let side = 1_i64 << id.level;
    let (row, column) = (i64::from(id.row) + rows, i64::from(id.column) + columns);
    let is_inside = (0..side).contains(&row) && (0..side).contains(&column);
    is_inside.then(|| TileId {
        level: id.level,
        row: u32::try_from(row).expect("inside"),
        column: u32::try_from(column).expect("inside"),
    })
}

fn side_words(places: &HashMap<TileId, u32>, id: TileId, toward: [i64; 2]) -> [u32; 2] {
    let Some(beside) = moved(id, toward) else {
        return [NONE; 2];
    };
    if let Some(place) = places.get(&beside) {
        return [place | SIDE_SAME << 30; 2];
    }
    if let Some(place) = beside.parent().and_then(|parent| places.get(&parent)) {
        return [place | SIDE_COARSER << 30; 2];
    }
    // The two children on the side that faces us, the west or north one first.
    let quadrants = match toward {
        [-1, 0] => [2, 3],
        [1, 0] => [0, 1],
        [0, 1] => [0, 2],
        _ => [1, 3],
    };
    quadrants.map(|quadrant| {
        places
            .get(&beside.child(quadrant))
            .map_or(NONE, |at| at | SIDE_FINER << 30)
    })
}

/// Who owns a corner: the coarsest tile that touches it, then the first by row and column.
fn corner_owner(places: &HashMap<TileId, u32>, id: TileId, corner: u32) -> (u32, u32) {
    // The corner in samples of the level after this one, so that every tile's samples are whole numbers.
    let cells = TILE_CELLS as u64;
    let scale = |level: u8| 1_u64 << (8 - level);
    let at = [
        (u64::from(id.row) + u64::from(corner >> 1)) * cells * scale(id.level),
        (u64::from(id.column) + u64::from(corner & 1)) * cells * scale(id.level),
    ];
    let touches = |other: &TileId| {
        let first = [u64::from(other.row), u64::from(other.column)]
            .map(|place| place * cells * scale(other.level));
        (0..2).all(|axis| {
            (first[axis]..=first[axis] + cells * scale(other.level)).contains(&at[axis])
        })
    };
    let owner = places
        .keys()
        .filter(|other| touches(other))
        .min_by_key(|other| (other.level, other.row, other.column))
        .expect("a tile touches its own corner");
    let sample = |axis: usize, place: u32| at[axis] / scale(owner.level) - u64::from(place) * cells;
    let sample = sample(0, owner.row) * TILE_SAMPLES as u64 + sample(1, owner.column);
    (places[owner], u32::try_from(sample).expect("a sample"))
}

/// The hill as a data set of three levels that can be streamed.
pub struct HillSource {
    metadata: Metadata,
    delay: Duration,
    arch: Option<FeatureGroup>,
}

/// Geometric errors of the levels, metres: generous, and none at the finest.
const ERRORS: [f32; 3] = [12.0, 4.0, 0.0];

impl HillSource {
    /// The whole hill, each of whose reads takes so long.
    #[must_use]
    pub fn new(delay: Duration) -> Self {
        let grid = Grid {
            columns: 513,
            rows: 513,
            origin: [0.0, 0.0],
            step: [step(2), -step(2)],
        };
        let level = |level| Level {
            tiles: grid.tiles(level),
            step: QUANTUM,
            key: level == 0,
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
            unit_exponent: -3,
            eps: 0.1,
            height_range: [-400, 3440],
            levels: (0..grid.level_count()).map(level).collect(),
            color: None,
            features: None,
            sources: Vec::new(),
        };
        Self {
            metadata,
            delay,
            arch: None,
        }
    }

    /// The same hill with an arch of stone on its north-west side, across the border of two tiles.
    #[must_use]
    pub fn with_arch() -> Self {
        let [row, column, ..] = synthetic::arch_place(step(2), UNIT.into()).cut;
        let metres = |patch: u32, point: i32| {
            f64::from(patch.cast_signed() + point) * QUAD_SAMPLES as f64 * step(2)
        };
        let control = |down: i32, right: i32| {
            (ground(metres(column, right), metres(row, down)) / f64::from(UNIT)).round()
        };
        let tiles: Vec<_> = (0..2).map(|column| TileId::new(2, 0, column)).collect();
        let arch = FeatureGroup {
            id: 0,
            home: tiles[0],
            tiles,
            cut: synthetic::arch_place(step(2), UNIT.into()).cut,
            cage: Some(synthetic::arch_cage(560.0, control)),
        };
        Self {
            arch: Some(arch),
            ..Self::new(Duration::ZERO)
        }
    }

    fn arch_at(&self, id: TileId) -> Option<&FeatureGroup> {
        self.arch.as_ref().filter(|arch| arch.tiles.contains(&id))
    }

    fn summary(&self, id: TileId) -> Summary {
        if !self.metadata.grid.has(id) {
            return Summary::default();
        }
        let error = ERRORS[usize::from(id.level)];
        Summary {
            min: -800,
            max: 4000,
            error,
            flags: Summary::PRESENT
                | if self.arch_at(id).is_some() {
                    Summary::FEATURE
                } else {
                    0
                },
        }
    }
}

impl TileSource for HillSource {
    fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    fn load(&self, id: TileId, _: Option<&Tile>) -> Result<Tile, PyramidError> {
        std::thread::sleep(self.delay);
        let children = id.children().map(|child| self.summary(child));
        Ok(Tile {
            summary: self.summary(id),
            children,
            ..tile(id)
        })
    }

    fn has_features(&self) -> bool {
        self.arch.is_some()
    }

    fn load_features(&self, id: TileId) -> Result<Vec<FeatureGroup>, PyramidError> {
        let mut arch = self.arch_at(id).cloned();
        if let Some(arch) = arch.as_mut().filter(|arch| arch.home != id) {
            arch.cage = None;
        }
        Ok(arch.into_iter().collect())
    }
}
