//! Small scenes made by hand, for tests of stages: tiles of a formula's ground, and how they lie beside each other.
//!
//! Plain and slow; a real drawn list comes from `terrain`.

use std::collections::HashMap;

use super::{
    DrawnTile, Frame, NONE, SIDE_COARSER, SIDE_FINER, SIDE_SAME, SLOT_WORDS, TILE_VISIBLE,
    UPLOAD_CONTROLS_WORD, UPLOAD_DETAIL_WORD, UPLOAD_WORDS, UploadHeader,
};
use crate::{
    geo::{CAGE_CONTROLS, QUAD_SAMPLES, TILE_CELLS, TILE_SAMPLES, TileId},
    reference::decode::{base_height, code_prediction},
};

/// Metres of a height unit of every scene.
pub const UNIT: f32 = 0.0625;

/// What a formula's ground and a set of tiles become.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The tiles, in the order in which they were given.
    pub ids: Vec<TileId>,
    /// The drawn list, relative to an eye at the world's origin.
    pub tiles: Vec<DrawnTile>,
    /// What is uploaded: the drawn tiles, then their parents, in slots 0 and on.
    pub headers: Vec<UploadHeader>,
    /// The upload's words.
    pub staging: Vec<u32>,
}

impl Scene {
    /// A page with room for the scene's slots, all zero.
    #[must_use]
    pub fn empty_page(&self) -> Vec<u32> {
        vec![0; self.headers.len() * SLOT_WORDS]
    }
}

/// A scene of tiles whose levels are `spacing` · 2^-level metres a sample; `relief` gives metres of height at metres
/// east and north of the north-west corner.
#[must_use]
pub fn scene(ids: &[TileId], spacing: f32, relief: &dyn Fn(f32, f32) -> f32) -> Scene {
    let places: HashMap<TileId, u32> = (0..).zip(ids).map(|(place, &id)| (id, place)).collect();
    let mut slots: Vec<TileId> = ids.to_vec();
    for parent in ids.iter().filter_map(|id| id.parent()) {
        if !slots.contains(&parent) {
            slots.push(parent);
        }
    }
    let mut staging = vec![0; slots.len() * UPLOAD_WORDS];
    let mut headers = Vec::new();
    for ((slot, &id), words) in (0..)
        .zip(&slots)
        .zip(staging.chunks_exact_mut(UPLOAD_WORDS))
    {
        stage_ground(id, spacing, relief, words);
        let step = step_of(id, spacing);
        headers.push(UploadHeader {
            slot,
            quantum: 1,
            unit: UNIT,
            reserved: 0,
            step,
            reserved_2: [0.0; 2],
        });
    }
    let slot_of = |id: TileId| {
        (0..)
            .zip(&slots)
            .find(|slot| *slot.1 == id)
            .map_or(NONE, |slot| slot.0)
    };
    let tiles = ids
        .iter()
        .map(|&id| drawn_tile(id, spacing, &places, &slot_of))
        .collect();
    Scene {
        ids: ids.to_vec(),
        tiles,
        headers,
        staging,
    }
}

/// A view that draws everything: no haze, no flags, no limit.
#[must_use]
pub fn frame(drawn_count: u32) -> Frame {
    Frame {
        clip_from_view_world: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ],
        viewport: [64.0, 64.0],
        pixels_per_radian: 64.0,
        tolerance: 1.0,
        unit: UNIT,
        drawn_count,
        index_capacity: u32::MAX,
        uniform_depth: NONE,
        sun: [0.0, 0.6, 0.8],
        haze: 0.0,
        sky: [0.5, 0.6, 0.7],
        flags: 0,
        height_range: [0.0, 1000.0],
        camera_height: 0.0,
        reserved: 0.0,
        ground_min: [f32::MIN; 2],
        ground_max: [f32::MAX; 2],
    }
}

fn step_of(id: TileId, spacing: f32) -> [f32; 2] {
    let step = spacing / (1_u32 << id.level) as f32;
    [step, -step]
}

/// Metres east and north of a tile's sample, counted in samples from its north-west corner.
fn place_of(id: TileId, spacing: f32, row: f32, column: f32) -> [f32; 2] {
    let step = step_of(id, spacing);
    let cells = TILE_CELLS as f32;
    [
        (id.column as f32 * cells + column) * step[0],
        (id.row as f32 * cells + row) * step[1],
    ]
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a test's ground is some kilometres high"
)]
fn units_at(
    id: TileId,
    spacing: f32,
    relief: &dyn Fn(f32, f32) -> f32,
    row: f32,
    column: f32,
) -> i32 {
    let [east, north] = place_of(id, spacing, row, column);
    (relief(east, north) / UNIT).round() as i32
}

/// Controls on the ground, and codes that lead every sample there exactly.
fn stage_ground(id: TileId, spacing: f32, relief: &dyn Fn(f32, f32) -> f32, words: &mut [u32]) {
    let quad = QUAD_SAMPLES as f32;
    for i in 0..CAGE_CONTROLS {
        for j in 0..CAGE_CONTROLS {
            let height = units_at(
                id,
                spacing,
                relief,
                (i as f32 - 1.0) * quad,
                (j as f32 - 1.0) * quad,
            );
            words[UPLOAD_CONTROLS_WORD + i * CAGE_CONTROLS + j] = height.cast_unsigned();
        }
    }
    // A code needs those it is predicted from: even ones first, then rows, then columns.
    for (first_row, first_column) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        for row in (first_row..TILE_SAMPLES).step_by(2) {
            for column in (first_column..TILE_SAMPLES).step_by(2) {
                let residual = units_at(id, spacing, relief, row as f32, column as f32)
                    - base_height(words, row, column);
                let code = residual - code_prediction(words, 1, row, column);
                words[UPLOAD_DETAIL_WORD + row * TILE_SAMPLES + column] = code.cast_unsigned();
            }
        }
    }
}

fn drawn_tile(
    id: TileId,
    spacing: f32,
    places: &HashMap<TileId, u32>,
    slot_of: &dyn Fn(TileId) -> u32,
) -> DrawnTile {
    let [east, north] = place_of(id, spacing, 0.0, 0.0);
    let corners = [0, 1, 2, 3].map(|corner| corner_owner(id, corner, places));
    DrawnTile {
        origin: [east, north, 0.0],
        slot: slot_of(id),
        step: step_of(id, spacing),
        error: 1.0,
        level: u32::from(id.level),
        base: 0,
        z_min: -100.0,
        z_max: 100.0,
        flags: TILE_VISIBLE,
        parent_slot: id.parent().map_or(NONE, slot_of),
        quadrant: id.quadrant(),
        color_slot: NONE,
        color_scale: 1.0,
        color_offset: [0.0; 2],
        skirt: 5.0,
        geometric_error: 1.0,
        corner_tile: corners.map(|corner| corner.0),
        corner_sample: corners.map(|corner| corner.1),
        side_north: side(id, [-1, 0], [2, 3], places),
        side_east: side(id, [0, 1], [0, 2], places),
        side_south: side(id, [1, 0], [0, 1], places),
        side_west: side(id, [0, -1], [1, 3], places),
    }
}

fn beside(id: TileId, toward: [i32; 2]) -> Option<TileId> {
    let row = id.row.checked_add_signed(toward[0])?;
    let column = id.column.checked_add_signed(toward[1])?;
    let is_inside = row < 1 << id.level && column < 1 << id.level;
    is_inside.then_some(TileId::new(id.level, row, column))
}

fn side(id: TileId, toward: [i32; 2], near: [u32; 2], places: &HashMap<TileId, u32>) -> [u32; 2] {
    let Some(other) = beside(id, toward) else {
        return [NONE; 2];
    };
    if let Some(&place) = places.get(&other) {
        return [place | SIDE_SAME << 30; 2];
    }
    if let Some(&place) = other.parent().and_then(|parent| places.get(&parent)) {
        return [place | SIDE_COARSER << 30; 2];
    }
    near.map(|quadrant| {
        places
            .get(&other.child(quadrant))
            .map_or(NONE, |&place| place | SIDE_FINER << 30)
    })
}

/// The owner of a corner: the coarsest that touches it, of these the first by row and column.
fn corner_owner(id: TileId, corner: u32, places: &HashMap<TileId, u32>) -> (u32, u32) {
    let (south, east) = (corner / 2, corner % 2);
    let (down, right) = (
        if south == 0 { -1 } else { 1 },
        if east == 0 { -1 } else { 1 },
    );
    let touching = [[0, 0], [down, 0], [0, right], [down, right]];
    let around = touching.into_iter().filter_map(|toward| beside(id, toward));
    let owner = around
        .flat_map(|near| [Some(near), near.parent()])
        .flatten()
        .filter(|near| places.contains_key(near))
        .min()
        .unwrap_or(id);
    let up = id.level - owner.level;
    let sample = |at: u32, first: u32| ((at * 128) >> up) - first * 128;
    let (row, column) = (
        sample(id.row + south, owner.row),
        sample(id.column + east, owner.column),
    );
    (
        places.get(&owner).copied().unwrap_or(NONE),
        row * 129 + column,
    )
}
