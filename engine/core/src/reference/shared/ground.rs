//! The ground at a place of a drawn tile: which tile, and how it slopes there.
//!
//! Twin: `shaders/shared/ground.wgsl`.

use glam::Vec2;

use super::{
    DrawnTile, NONE, SIDE_COARSER, SIDE_INDEX_MASK,
    border::{
        EDGE_EAST, EDGE_NORTH, EDGE_SOUTH, EDGE_WEST, TILE_CELLS, TILE_SAMPLES, is_horizontal,
        relation_of, side_words,
    },
    pool::{Pages, pool_slope},
};

/// One cell of a coarser neighbour, in samples: where slopes become its own.
pub const BLEND_SAMPLES: f32 = 2.0;

/// A place on a drawn tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Drawn tile.
    pub tile: u32,
    /// Samples: column, row.
    pub at: Vec2,
}

/// Column and row of a camera-relative position.
#[must_use]
pub fn place_in(tile: &DrawnTile, position: Vec2) -> Vec2 {
    (position - Vec2::new(tile.origin[0], tile.origin[1])) / Vec2::from(tile.step)
}

/// The side a place lies beyond by more than half a sample, the farther one where it is two; 0 for none.
fn beyond(at: Vec2) -> u32 {
    let outside = (-at).max(at - TILE_CELLS as f32);
    if outside.max_element() <= 0.5 {
        return 0;
    }
    if outside.x > outside.y {
        return if at.x < 0.0 { EDGE_WEST } else { EDGE_EAST };
    }
    if at.y < 0.0 { EDGE_NORTH } else { EDGE_SOUTH }
}

/// The tile under a position, from one beside it.
///
/// A triangle knows a tile by its first vertex alone, and on a border that may be a neighbour's.
#[must_use]
pub fn locate(tiles: &[DrawnTile], tile: u32, position: Vec2) -> Place {
    let mut here = Place {
        tile,
        at: place_in(&tiles[tile as usize], position),
    };
    for _ in 0..2 {
        let edge = beyond(here.at);
        if edge == 0 {
            break;
        }
        let along = if is_horizontal(edge) {
            here.at.x
        } else {
            here.at.y
        };
        let half = usize::from(along > (TILE_CELLS / 2) as f32);
        let word = side_words(&tiles[here.tile as usize], edge)[half];
        if word == NONE {
            break;
        }
        here.tile = word & SIDE_INDEX_MASK;
        here.at = place_in(&tiles[here.tile as usize], position);
    }
    here.at = here.at.clamp(Vec2::ZERO, Vec2::splat(TILE_CELLS as f32));
    here
}

/// Slopes of a slot between its samples.
#[expect(clippy::cast_possible_truncation, reason = "a place lies in 0..=128")]
#[expect(clippy::cast_sign_loss, reason = "a place lies in 0..=128")]
fn slope_between(pages: &Pages<'_>, slot: u32, at: Vec2) -> Vec2 {
    let cell = [
        (at.x as u32).min(TILE_CELLS - 1),
        (at.y as u32).min(TILE_CELLS - 1),
    ];
    let f = at - Vec2::new(cell[0] as f32, cell[1] as f32);
    let sample = cell[1] * TILE_SAMPLES + cell[0];
    let slope = |offset: u32| Vec2::from(pool_slope(pages, slot, sample + offset));
    let north = slope(0).lerp(slope(1), f.x);
    let south = slope(TILE_SAMPLES).lerp(slope(TILE_SAMPLES + 1), f.x);
    north.lerp(south, f.y)
}

fn is_coarser_side(tile: &DrawnTile, edge: u32) -> bool {
    relation_of(side_words(tile, edge)[0]) == SIDE_COARSER
}

fn is_coarser_corner(tiles: &[DrawnTile], tile: &DrawnTile, corner: usize) -> bool {
    tiles[tile.corner_tile[corner] as usize].level < tile.level
}

/// How much a place takes its parent's slopes: 1 on a border or corner shared with a coarser tile.
fn parent_weight(tiles: &[DrawnTile], tile: &DrawnTile, at: Vec2) -> f32 {
    let middle = (TILE_CELLS / 2) as f32;
    let is_far = [at.x > middle, at.y > middle];
    let from = |at: f32, is_far: bool| if is_far { TILE_CELLS as f32 - at } else { at };
    let inside = Vec2::new(from(at.x, is_far[0]), from(at.y, is_far[1]));
    if inside.min_element() >= BLEND_SAMPLES {
        return 0.0;
    }
    let mut nearest = BLEND_SAMPLES;
    if inside.x < nearest && is_coarser_side(tile, if is_far[0] { EDGE_EAST } else { EDGE_WEST }) {
        nearest = inside.x;
    }
    if inside.y < nearest && is_coarser_side(tile, if is_far[1] { EDGE_SOUTH } else { EDGE_NORTH })
    {
        nearest = inside.y;
    }
    let corner = usize::from(is_far[0]) + 2 * usize::from(is_far[1]);
    if inside.max_element() < nearest && is_coarser_corner(tiles, tile, corner) {
        nearest = inside.max_element();
    }
    1.0 - nearest / BLEND_SAMPLES
}

/// Metres a metre (east, north) at a place, the same from both sides of every border.
#[must_use]
pub fn ground_slope(tiles: &[DrawnTile], pages: &Pages<'_>, here: Place) -> Vec2 {
    let tile = &tiles[here.tile as usize];
    let own = slope_between(pages, tile.slot, here.at);
    let weight = parent_weight(tiles, tile, here.at);
    if weight == 0.0 || tile.parent_slot == NONE {
        return own;
    }
    let quadrant = Vec2::new((tile.quadrant & 1) as f32, (tile.quadrant >> 1) as f32);
    let at = quadrant * (TILE_CELLS / 2) as f32 + here.at * 0.5;
    own.lerp(slope_between(pages, tile.parent_slot, at), weight)
}
