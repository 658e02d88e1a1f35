// balance: depths of neighbours come to differ by at most one, and every patch learns which of its edges are split.
// Reads: frame, tiles, depths. Writes: raised, then patches. Entry points in order: `raise`, `edges`.
// One thread a patch; the y of the workgroup is the drawn tile.
// Across a level border depths are counted in the coarser tile's samples: a finer tile's depth d counts as
// min(d + 1, 2), and a coarser patch faces two finer ones, which share its edge and so split it alike.
// Source: transition patches of Niessner, Loop, Meyer, DeRose 2012 (Feature-adaptive GPU rendering of Catmull-Clark
// subdivision surfaces). One pass of `raise` is enough: only a depth 0 beside a 2 is raised, to 1, which raises no other
// but, across a level border, one of a coarser tile: `settled` looks there.
// Twin: core/reference/balance.rs

#import constants
#import frame
#import pool
#import border
#import patch_word

@group(0) @binding(0) var<uniform> frame: Frame;
@group(2) @binding(0) var<storage, read> depths: array<u32>;
@group(2) @binding(1) var<storage, read_write> raised: array<u32>;
@group(2) @binding(2) var<storage, read_write> patches: array<u32>;

const PACKED_CUT: u32 = 64u;         // in packed depths: the patch is cut out for a feature

// Three depths of 2 bits, one a shift.
fn shifted_depth(packed: u32, shift: u32) -> u32 {
    return (packed >> (2u * shift)) & 3u;
}

// A depth of a finer tile, counted in the samples of the coarser one beside it.
fn count_across(depth: u32) -> u32 {
    return min(depth + 1u, FINEST_DEPTH);
}

// a - b, at least 0.
fn lessen(a: u32, b: u32) -> u32 {
    return a - min(a, b);
}

// A depth at a shift; that of a cut patch stays, for its border is the feature's.
fn lessened(depth: u32, shift: u32) -> u32 {
    if (depth & DEPTH_CUT) != 0u {
        return FINEST_DEPTH;
    }
    return lessen(depth, shift);
}

// Raised depths of a patch among the tiles of its own level, for every shift.
fn raised_depths(tile: u32, patch_index: u32) -> u32 {
    let own = depths[tile * PATCH_COUNT + patch_index];
    var neighbours = vec3u(0u); // the deepest, for every shift
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        let across = facing(tile, patch_index, edge);
        if across.relation == SIDE_SAME {
            let depth = depths[across.tile * PATCH_COUNT + across.first];
            neighbours = max(neighbours, vec3u(lessened(depth, 0u), lessened(depth, 1u), lessened(depth, 2u)));
        }
    }
    var packed = select(0u, PACKED_CUT, (own & DEPTH_CUT) != 0u);
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        packed |= max(lessened(own, shift), lessen(neighbours[shift], 1u)) << (2u * shift);
    }
    return packed;
}

@compute @workgroup_size(64)
fn raise(@builtin(global_invocation_id) id: vec3u) {
    let patch_index = id.x;
    let tile = id.y;
    if patch_index >= PATCH_COUNT || tile >= frame.drawn_count {
        return;
    }
    raised[tile * PATCH_COUNT + patch_index] = raised_depths(tile, patch_index);
}

// Final depths of a patch: raised where finer tiles ask for it.
fn settled(tile: u32, patch_index: u32) -> u32 {
    var packed = raised[tile * PATCH_COUNT + patch_index];
    let outer = outer_edges(patch_index / TILE_QUADS, patch_index % TILE_QUADS, TILE_QUADS);
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        if (outer & edge) == 0u {
            continue;
        }
        let across = facing(tile, patch_index, edge);
        if across.relation == SIDE_FINER {
            packed = raise_to_finer(packed, raised[across.tile * PATCH_COUNT + across.first]);
            packed = raise_to_finer(packed, raised[across.tile * PATCH_COUNT + across.second]);
        }
    }
    return packed;
}

fn raise_to_finer(packed: u32, finer: u32) -> u32 {
    var result = packed & PACKED_CUT;
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        let wanted = count_across(shifted_depth(finer, shift)) - 1u;
        result |= max(shifted_depth(packed, shift), wanted) << (2u * shift);
    }
    return result;
}

// The shifts (bits) at which an edge is split: where what lies across it, or beside it at the same coarser patch, counts more.
fn split_shifts(tile: u32, patch_index: u32, edge: u32, own: u32) -> u32 {
    let across = facing(tile, patch_index, edge);
    if across.relation == SIDE_NONE {
        return 0u;
    }
    let first = settled(across.tile, across.first);
    var second = first;
    if across.relation == SIDE_FINER {
        second = settled(across.tile, across.second);
    } else if across.relation == SIDE_COARSER {
        second = settled(tile, sibling(patch_index, edge));
    }
    var shifts = 0u;
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        var mine = shifted_depth(own, shift);
        var theirs = max(shifted_depth(first, shift), shifted_depth(second, shift));
        if across.relation == SIDE_FINER {
            theirs = count_across(theirs);
        } else if across.relation == SIDE_COARSER {
            mine = count_across(mine);
            theirs = max(shifted_depth(first, shift), count_across(shifted_depth(second, shift)));
        }
        shifts |= select(0u, 1u << shift, mine < theirs);
    }
    return shifts;
}

// Edges of a patch that face a coarser tile.
fn coarser_edges(tile: u32, patch_index: u32) -> u32 {
    var edges = outer_edges(patch_index / TILE_QUADS, patch_index % TILE_QUADS, TILE_QUADS);
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        if (edges & edge) != 0u && relation_of(side_words(tile, edge).x) != SIDE_COARSER {
            edges ^= edge;
        }
    }
    return edges;
}

@compute @workgroup_size(64)
fn edges(@builtin(global_invocation_id) id: vec3u) {
    let patch_index = id.x;
    let tile = id.y;
    if patch_index >= PATCH_COUNT || tile >= frame.drawn_count {
        return;
    }
    let own = settled(tile, patch_index);
    var word = coarser_edges(tile, patch_index) | select(0u, PATCH_CUT, (own & PACKED_CUT) != 0u);
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        word |= shifted_depth(own, shift) << (4u + 6u * shift);
    }
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        let shifts = split_shifts(tile, patch_index, edge, own);
        for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
            word |= select(0u, edge << (6u + 6u * shift), (shifts & (1u << shift)) != 0u);
        }
    }
    patches[tile * PATCH_COUNT + patch_index] = word;
}
