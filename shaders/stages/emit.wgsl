// emit: patches become one list of indices and the arguments of its draw.
// Reads: frame, tiles, pool (voids), patches. Writes: the head of the list (zero before), indices.
// Entry points in order: `count` (indices at every shift), `write` (at the least shift that fits; when none does, nothing is
// drawn). One thread a patch; the y of the workgroup is the drawn tile.
// Triangles wind counter-clockwise seen from above. Every vertex is that of the tile that owns its sample.
// Source: render table of Niessner et al. 2012; cells cut along NW-SE, split ones fanned about their centre:
//
//   NW---NE    NW---NE    +-+-+ W and N      A row of depth 2 beside a coarser tile: its odd border
//   | \   |    | \ / |    |\|/|  split       vertices do not exist over there, so its cells are drawn
//   |  \  |    +--C  |    +-C |              in fours, fanned, split on all edges but that one.
//   |   \ |    | / \ |    |/ \|
//   SW---SE    SW---SE    +---+
//
// Twin: core/reference/emit.rs

#import constants
#import frame
#import pool
#import border
#import patch_word
#import draw_list

@group(0) @binding(0) var<uniform> frame: Frame;
@group(2) @binding(0) var<storage, read> patches: array<u32>;
@group(2) @binding(1) var<storage, read_write> draw_list: array<atomic<u32>, DRAW_LIST_WORDS>;
@group(2) @binding(2) var<storage, read_write> indices: array<u32>;

const SKIRT_VERTICES: u32 = 512u;   // around a tile
const GROUP: u32 = 64u;

var<workgroup> group_counts: array<atomic<u32>, SHIFT_COUNT>;
var<workgroup> patch_counts: array<u32, GROUP>;
var<workgroup> group_start: u32;
var<private> at: u32;               // where the next index goes
var<private> tile: u32;             // drawn tile of the patch being written

// Edges of a patch where a skirt hangs: all where no tile of the same level lies.
fn skirt_edges(patch_index: u32) -> u32 {
    var edges = outer_edges(patch_index / TILE_QUADS, patch_index % TILE_QUADS, TILE_QUADS);
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        if (edges & edge) != 0u && facing(tile, patch_index, edge).relation == SIDE_SAME {
            edges ^= edge;
        }
    }
    return edges;
}

// Samples from one vertex of an edge to the next.
fn edge_stride(word: u32, shift: u32, edge: u32) -> u32 {
    let depth = word_depth(word, shift);
    if depth == FINEST_DEPTH {
        return select(1u, 2u, (word_coarser(word) & edge) != 0u);
    }
    return (QUAD_SAMPLES >> depth) >> select(0u, 1u, (word_split(word, shift) & edge) != 0u);
}

fn surface_triangles(word: u32, shift: u32) -> u32 {
    let depth = word_depth(word, shift);
    if depth == FINEST_DEPTH {
        return 32u - 2u * countOneBits(word_coarser(word));
    }
    let count = 1u << depth;
    var triangles = 0u;
    for (var cell = 0u; cell < count * count; cell++) {
        let split = outer_edges(cell / count, cell % count, count) & word_split(word, shift);
        triangles += select(4u + countOneBits(split), 2u, split == 0u);
    }
    return triangles;
}

fn patch_index_count(patch_index: u32, word: u32, shift: u32) -> u32 {
    if (word & PATCH_CUT) != 0u {
        return 0u;
    }
    var triangles = surface_triangles(word, shift);
    let skirts = skirt_edges(patch_index);
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        if (skirts & edge) != 0u {
            triangles += 2u * (QUAD_SAMPLES / edge_stride(word, shift, edge));
        }
    }
    return 3u * triangles;
}

fn is_drawn(drawn: u32) -> bool {
    return drawn < frame.drawn_count && (tiles[drawn].flags & TILE_VISIBLE) != 0u;
}

@compute @workgroup_size(GROUP)
fn count(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    tile = id.y;
    if is_drawn(tile) {
        let word = patches[tile * PATCH_COUNT + id.x];
        for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
            atomicAdd(&group_counts[shift], patch_index_count(id.x, word, shift));
        }
    }
    workgroupBarrier();
    if local < SHIFT_COUNT {
        atomicAdd(&draw_list[SHIFT_COUNTS_WORD + local], atomicLoad(&group_counts[local]));
    }
}

// The least shift whose indices fit; SHIFT_COUNT when none does.
fn chosen_shift() -> u32 {
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        if atomicLoad(&draw_list[SHIFT_COUNTS_WORD + shift]) <= frame.index_capacity {
            return shift;
        }
    }
    return SHIFT_COUNT;
}

fn is_void(sample: vec2u) -> bool {
    return (tiles[tile].flags & TILE_VOIDS) != 0u && (frame.flags & FLAG_DRAW_VOIDS) == 0u
        && pool_void(tiles[tile].slot, sample.x * TILE_SAMPLES + sample.y);
}

fn put(a: u32, b: u32, c: u32, is_hidden: bool) {
    indices[at] = a;
    indices[at + 1u] = select(b, a, is_hidden);
    indices[at + 2u] = select(c, a, is_hidden);
    at += 3u;
}

// A vertex of a triangle.
struct Corner {
    vertex: u32,
    is_void: bool,
}

fn corner(sample: vec2u) -> Corner {
    return Corner(owned_vertex(tile, sample.x, sample.y), is_void(sample));
}

// A place on the border of a cell, in half cells from its north-west sample:
//
//   0 7 6      Place 8 is 0 again. Odd places are the middles of the edges,
//   1   5      west, south, east, north.
//   2 3 4
fn cell_place(place: u32) -> vec2u {
    return vec2u(clamp(3 - abs(i32(place) - vec2i(3, 5)), vec2i(0), vec2i(2)));
}

// A cell from its north-west sample, with its split edges: a fan over its border, about its centre where an edge is split,
// else about its north-west sample. In one loop, for a driver compiles as many copies of a function as there are calls.
fn cell(nw: vec2u, stride: u32, split: u32) {
    let is_split = split != 0u;
    let first = select(2u, 0u, is_split);
    let last = select(6u, 8u, is_split);
    let pivot = corner(nw + select(0u, stride / 2u, is_split));
    var before = pivot;
    for (var place = first; place <= last; place++) {
        if place % 2u == 0u || (split & (EDGE_WEST >> (place / 2u))) != 0u {
            let next = corner(nw + cell_place(place) * stride / 2u);
            if place > first {
                put(pivot.vertex, before.vertex, next.vertex, pivot.is_void || before.is_void || next.is_void);
            }
            before = next;
        }
    }
}

// True when cells are drawn in fours: at the finest depth, beside a coarser tile.
fn is_in_fours(word: u32, shift: u32) -> bool {
    return word_depth(word, shift) == FINEST_DEPTH && word_coarser(word) != 0u;
}

// Squares of one cell, or in fours: as one split cell where an edge faces a coarser tile, which keeps no middle there,
// else as four.
fn surface(patch_index: u32, word: u32, shift: u32) {
    let nw = vec2u(patch_index / TILE_QUADS, patch_index % TILE_QUADS) * QUAD_SAMPLES;
    let in_fours = is_in_fours(word, shift);
    let count = select(1u << word_depth(word, shift), 2u, in_fours);
    let stride = QUAD_SAMPLES / count;
    for (var i = 0u; i < count * count; i++) {
        let place = vec2u(i / count, i % count);
        let outer = outer_edges(place.x, place.y, count);
        var split = outer & word_split(word, shift);
        var parts = 1u;
        if in_fours {
            let whole = outer & word_coarser(word);
            split = select(15u ^ whole, 0u, whole == 0u);
            parts = select(1u, 2u, whole == 0u);
        }
        for (var j = 0u; j < parts * parts; j++) {
            cell(nw + place * stride + vec2u(j / parts, j % parts), stride / parts, split);
        }
    }
}

// The first place, clockwise, of a patch's part of a side.
fn skirt_start(patch_index: u32, edge: u32) -> u32 {
    let row = patch_index / TILE_QUADS * QUAD_SAMPLES;
    let column = patch_index % TILE_QUADS * QUAD_SAMPLES;
    switch edge {
        case EDGE_NORTH: { return column; }
        case EDGE_EAST: { return TILE_CELLS + row; }
        case EDGE_SOUTH: { return 3u * TILE_CELLS - QUAD_SAMPLES - column; }
        default: { return 4u * TILE_CELLS - QUAD_SAMPLES - row; }
    }
}

fn skirt(patch_index: u32, edge: u32, stride: u32) {
    let start = skirt_start(patch_index, edge);
    var before = corner(skirt_sample(start));
    for (var place = start; place < start + QUAD_SAMPLES; place += stride) {
        let next_place = (place + stride) % SKIRT_VERTICES;
        let next = corner(skirt_sample(next_place));
        let low_before = (tile << SAMPLE_BITS) | (SKIRT_FIRST + place);
        let low_next = (tile << SAMPLE_BITS) | (SKIRT_FIRST + next_place);
        let is_hidden = before.is_void || next.is_void;
        put(next.vertex, low_next, low_before, is_hidden);
        put(next.vertex, low_before, before.vertex, is_hidden);
        before = next;
    }
}

// Triangles of a template: split edges, or fours beside a coarser tile.
fn is_transition(word: u32, shift: u32) -> bool {
    return word_split(word, shift) != 0u || is_in_fours(word, shift);
}

fn write_patch(patch_index: u32, word: u32, shift: u32) {
    surface(patch_index, word, shift);
    let skirts = skirt_edges(patch_index);
    for (var edge = EDGE_NORTH; edge <= EDGE_WEST; edge <<= 1u) {
        if (skirts & edge) != 0u {
            skirt(patch_index, edge, edge_stride(word, shift, edge));
        }
    }
    let kind = word_depth(word, shift) + select(0u, 3u, is_transition(word, shift));
    atomicAdd(&draw_list[CLASS_COUNTS_WORD + kind], 1u);
}

@compute @workgroup_size(GROUP)
fn write(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    tile = id.y;
    let shift = chosen_shift();
    let is_written = shift < SHIFT_COUNT && is_drawn(tile);
    var word = 0u;
    if is_written {
        word = patches[tile * PATCH_COUNT + id.x];
        patch_counts[local] = patch_index_count(id.x, word, shift);
    }
    workgroupBarrier();
    if local == 0u {
        var sum = 0u;
        for (var i = 0u; i < GROUP; i++) {
            let before = sum;
            sum += patch_counts[i];
            patch_counts[i] = before;
        }
        group_start = atomicAdd(&draw_list[CURSOR_WORD], sum);
        atomicAdd(&draw_list[INDEX_COUNT_WORD], sum);
        atomicMax(&draw_list[INSTANCE_COUNT_WORD], 1u);
    }
    workgroupBarrier();
    if is_written && (word & PATCH_CUT) == 0u {
        at = group_start + patch_counts[local];
        write_patch(id.x, word, shift);
    }
}
