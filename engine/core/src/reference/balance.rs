//! balance: depths of neighbours come to differ by at most one, and every patch learns which of its edges are split.
//!
//! Reads frame, tiles and depths, writes raised, then patches. Steps in order: [`raise`], [`edges`].
//! Across a level border depths are counted in the coarser tile's samples: a finer tile's depth d counts as
//! min(d + 1, 2), and a coarser patch faces two finer ones, which share its edge and so split it alike.
//! One pass of `raise` is enough: only a depth 0 beside a 2 is raised, to 1, which raises no other but, across a level
//! border, one of a coarser tile: `settled` looks there.
//!
//! Twin: `shaders/stages/balance.wgsl`.
//! Based on: transition patches of Nießner, Loop, Meyer, DeRose, *Feature-adaptive GPU rendering of Catmull-Clark
//! subdivision surfaces*, 2012.

use super::shared::{
    DrawnTile, Frame, SIDE_COARSER, SIDE_FINER, SIDE_SAME,
    border::{
        EDGES, PATCH_COUNT, SIDE_NONE, TILE_QUADS, facing, outer_edges, relation_of, sibling,
        side_words,
    },
    patch_word::{DEPTH_CUT, FINEST_DEPTH, PATCH_CUT, SHIFT_COUNT},
};

/// In packed depths: the patch is cut out for a feature.
const PACKED_CUT: u32 = 1 << (2 * SHIFT_COUNT);

/// A depth at a shift; that of a cut patch stays, for its border is the feature's.
fn lessened(depth: u32, shift: u32) -> u32 {
    if depth & DEPTH_CUT != 0 {
        return FINEST_DEPTH;
    }
    depth.saturating_sub(shift)
}

/// Three depths of 2 bits, one a shift.
const fn shifted_depth(packed: u32, shift: u32) -> u32 {
    packed >> (2 * shift) & 3
}

/// A depth of a finer tile, counted in the samples of the coarser one beside it.
fn count_across(depth: u32) -> u32 {
    (depth + 1).min(FINEST_DEPTH)
}

const fn place(tile: u32, patch: u32) -> usize {
    (tile * PATCH_COUNT + patch) as usize
}

/// Raised depths of a patch among the tiles of its own level, for every shift.
fn raised_depths(tiles: &[DrawnTile], depths: &[u32], tile: u32, patch: u32) -> u32 {
    let own = depths[place(tile, patch)];
    let mut neighbours = [0; SHIFT_COUNT as usize];
    for edge in EDGES {
        let across = facing(tiles, tile, patch, edge);
        if across.relation == SIDE_SAME {
            let depth = depths[place(across.tile, across.first)];
            for (shift, deepest) in (0..).zip(&mut neighbours) {
                *deepest = lessened(depth, shift).max(*deepest);
            }
        }
    }
    let cut = if own & DEPTH_CUT == 0 { 0 } else { PACKED_CUT };
    (0..)
        .zip(neighbours)
        .map(|(shift, deepest)| lessened(own, shift).max(deepest.saturating_sub(1)) << (2 * shift))
        .fold(cut, |packed, depth| packed | depth)
}

/// Raised depths of all patches.
pub fn raise(frame: &Frame, tiles: &[DrawnTile], depths: &[u32], raised: &mut [u32]) {
    for tile in 0..frame.drawn_count {
        for patch in 0..PATCH_COUNT {
            raised[place(tile, patch)] = raised_depths(tiles, depths, tile, patch);
        }
    }
}

/// Final depths of a patch: raised where finer tiles ask for it.
fn settled(tiles: &[DrawnTile], raised: &[u32], tile: u32, patch: u32) -> u32 {
    let mut packed = raised[place(tile, patch)];
    let outer = outer_edges(patch / TILE_QUADS, patch % TILE_QUADS, TILE_QUADS);
    for edge in EDGES {
        if outer & edge == 0 {
            continue;
        }
        let across = facing(tiles, tile, patch, edge);
        if across.relation == SIDE_FINER {
            packed = raise_to_finer(packed, raised[place(across.tile, across.first)]);
            packed = raise_to_finer(packed, raised[place(across.tile, across.second)]);
        }
    }
    packed
}

fn raise_to_finer(packed: u32, finer: u32) -> u32 {
    let mut result = packed & PACKED_CUT;
    for shift in 0..SHIFT_COUNT {
        let wanted = count_across(shifted_depth(finer, shift)) - 1;
        result |= shifted_depth(packed, shift).max(wanted) << (2 * shift);
    }
    result
}

/// The shifts (bits) at which an edge is split: where what lies across it, or beside it at the same coarser patch,
/// counts more.
fn split_shifts(tiles: &[DrawnTile], raised: &[u32], at: [u32; 2], edge: u32, own: u32) -> u32 {
    let [tile, patch] = at;
    let across = facing(tiles, tile, patch, edge);
    if across.relation == SIDE_NONE {
        return 0;
    }
    let first = settled(tiles, raised, across.tile, across.first);
    let second = match across.relation {
        SIDE_FINER => settled(tiles, raised, across.tile, across.second),
        SIDE_COARSER => settled(tiles, raised, tile, sibling(patch, edge)),
        _ => first,
    };
    let mut shifts = 0;
    for shift in 0..SHIFT_COUNT {
        let mut mine = shifted_depth(own, shift);
        let mut theirs = shifted_depth(first, shift).max(shifted_depth(second, shift));
        if across.relation == SIDE_FINER {
            theirs = count_across(theirs);
        } else if across.relation == SIDE_COARSER {
            mine = count_across(mine);
            theirs = shifted_depth(first, shift).max(count_across(shifted_depth(second, shift)));
        }
        shifts |= u32::from(mine < theirs) << shift;
    }
    shifts
}

/// Edges of a patch that face a coarser tile.
fn coarser_edges(drawn: &DrawnTile, patch: u32) -> u32 {
    let mut edges = outer_edges(patch / TILE_QUADS, patch % TILE_QUADS, TILE_QUADS);
    for edge in EDGES {
        if edges & edge != 0 && relation_of(side_words(drawn, edge)[0]) != SIDE_COARSER {
            edges ^= edge;
        }
    }
    edges
}

fn patch_word(tiles: &[DrawnTile], raised: &[u32], tile: u32, patch: u32) -> u32 {
    let own = settled(tiles, raised, tile, patch);
    let mut word = coarser_edges(&tiles[tile as usize], patch);
    if own & PACKED_CUT != 0 {
        word |= PATCH_CUT;
    }
    for shift in 0..SHIFT_COUNT {
        word |= shifted_depth(own, shift) << (4 + 6 * shift);
    }
    for edge in EDGES {
        let shifts = split_shifts(tiles, raised, [tile, patch], edge, own);
        for shift in 0..SHIFT_COUNT {
            if shifts >> shift & 1 != 0 {
                word |= edge << (6 + 6 * shift);
            }
        }
    }
    word
}

/// Words of all patches.
pub fn edges(frame: &Frame, tiles: &[DrawnTile], raised: &[u32], patches: &mut [u32]) {
    for tile in 0..frame.drawn_count {
        for patch in 0..PATCH_COUNT {
            patches[place(tile, patch)] = patch_word(tiles, raised, tile, patch);
        }
    }
}

/// Both steps.
pub fn balance(
    frame: &Frame,
    tiles: &[DrawnTile],
    depths: &[u32],
    raised: &mut [u32],
    patches: &mut [u32],
) {
    raise(frame, tiles, depths, raised);
    edges(frame, tiles, raised, patches);
}
