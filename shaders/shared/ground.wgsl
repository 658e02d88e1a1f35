// The ground at a place of a drawn tile: which tile, and how it slopes there.
// Twin: core/reference/shared/ground.rs

#import constants
#import pool
#import border

const BLEND_SAMPLES: f32 = 2.0;     // one cell of a coarser neighbour: where slopes become its own

struct Place {
    tile: u32,
    at: vec2f,                      // samples: column, row
}

fn place_in(tile: u32, position: vec2f) -> vec2f {
    return (position - tiles[tile].origin.xy) / tiles[tile].step;
}

// The side a place lies beyond by more than half a sample, the farther one where it is two; 0 for none.
fn beyond(at: vec2f) -> u32 {
    let last = f32(TILE_CELLS);
    let outside = max(-at, at - last);
    if max(outside.x, outside.y) <= 0.5 {
        return 0u;
    }
    if outside.x > outside.y {
        return select(EDGE_EAST, EDGE_WEST, at.x < 0.0);
    }
    return select(EDGE_SOUTH, EDGE_NORTH, at.y < 0.0);
}

// The tile under a position, from one beside it: a triangle knows a tile by its first vertex alone, and on a border
// that may be a neighbour's.
fn locate(tile: u32, position: vec2f) -> Place {
    var here = Place(tile, place_in(tile, position));
    for (var hop = 0u; hop < 2u; hop++) {
        let edge = beyond(here.at);
        if edge == 0u {
            break;
        }
        let along = select(here.at.y, here.at.x, is_horizontal(edge));
        let word = side_words(here.tile, edge)[select(0u, 1u, along > f32(TILE_CELLS / 2u))];
        if word == NONE {
            break;
        }
        here.tile = word & SIDE_INDEX_MASK;
        here.at = place_in(here.tile, position);
    }
    here.at = clamp(here.at, vec2f(0.0), vec2f(f32(TILE_CELLS)));
    return here;
}

// Slopes of a slot between its samples.
fn slope_between(slot: u32, at: vec2f) -> vec2f {
    let cell = min(vec2u(at), vec2u(TILE_CELLS - 1u));
    let f = at - vec2f(cell);
    let sample = cell.y * TILE_SAMPLES + cell.x;
    let north = mix(pool_slope(slot, sample), pool_slope(slot, sample + 1u), f.x);
    let south = mix(pool_slope(slot, sample + TILE_SAMPLES), pool_slope(slot, sample + TILE_SAMPLES + 1u), f.x);
    return mix(north, south, f.y);
}

fn is_coarser_side(tile: u32, edge: u32) -> bool {
    return relation_of(side_words(tile, edge).x) == SIDE_COARSER;
}

fn is_coarser_corner(tile: u32, corner: u32) -> bool {
    return tiles[tiles[tile].corner_tile[corner]].level < tiles[tile].level;
}

// How much a place takes its parent's slopes: 1 on a border or corner shared with a coarser tile.
fn parent_weight(tile: u32, at: vec2f) -> f32 {
    let middle = f32(TILE_CELLS / 2u);
    let is_far = vec2<bool>(at.x > middle, at.y > middle);
    let inside = select(at, f32(TILE_CELLS) - at, is_far);
    if min(inside.x, inside.y) >= BLEND_SAMPLES {
        return 0.0;
    }
    var nearest = BLEND_SAMPLES;
    if inside.x < nearest && is_coarser_side(tile, select(EDGE_WEST, EDGE_EAST, is_far.x)) {
        nearest = inside.x;
    }
    if inside.y < nearest && is_coarser_side(tile, select(EDGE_NORTH, EDGE_SOUTH, is_far.y)) {
        nearest = inside.y;
    }
    let corner = select(0u, 1u, is_far.x) + select(0u, 2u, is_far.y);
    if max(inside.x, inside.y) < nearest && is_coarser_corner(tile, corner) {
        nearest = max(inside.x, inside.y);
    }
    return 1.0 - nearest / BLEND_SAMPLES;
}

// Metres a metre (east, north) at a place, the same from both sides of every border.
fn ground_slope(tile: u32, at: vec2f) -> vec2f {
    let own = slope_between(tiles[tile].slot, at);
    let weight = parent_weight(tile, at);
    if weight == 0.0 || tiles[tile].parent_slot == NONE {
        return own;
    }
    let quadrant = vec2f(f32(tiles[tile].quadrant & 1u), f32(tiles[tile].quadrant >> 1u));
    let parent = slope_between(tiles[tile].parent_slot, quadrant * f32(TILE_CELLS / 2u) + at * 0.5);
    return mix(own, parent, weight);
}
