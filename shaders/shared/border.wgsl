// What lies across an edge: of a patch (its neighbours) and of a tile (who owns a border vertex).
// Twin: core/reference/shared/border.rs
//
//            N = 1
//          +-------+        A patch's edges are bits. Neighbours may lie in the same tile,
//  W = 8   | patch |   E = 2   or across a tile border in a tile of the same level, of one
//          +-------+        level less (one patch faces two of ours) or more (two face one).
//            S = 4

#import constants
#import pool

const EDGE_NORTH: u32 = 1u;
const EDGE_EAST: u32 = 2u;
const EDGE_SOUTH: u32 = 4u;
const EDGE_WEST: u32 = 8u;
const SIDE_NONE: u32 = 3u;          // relation: the data ends here

struct Facing {
    relation: u32,                  // SIDE_*
    tile: u32,
    first: u32,                     // patch
    second: u32,                    // patch; where the relation is finer, else equal to first
}

fn side_words(tile: u32, edge: u32) -> vec2u {
    switch edge {
        case EDGE_NORTH: { return tiles[tile].side_north; }
        case EDGE_EAST: { return tiles[tile].side_east; }
        case EDGE_SOUTH: { return tiles[tile].side_south; }
        default: { return tiles[tile].side_west; }
    }
}

// True for the edges along which columns are counted.
fn is_horizontal(edge: u32) -> bool {
    return (edge & (EDGE_NORTH | EDGE_SOUTH)) != 0u;
}

fn relation_of(word: u32) -> u32 {
    return select(word >> 30u, SIDE_NONE, word == NONE);
}

// Which half of a coarser neighbour's side a tile lies at.
fn half_of(quadrant: u32, edge: u32) -> u32 {
    return select(quadrant >> 1u, quadrant & 1u, is_horizontal(edge));
}

// Edges of a cell that lie on the border of its square of count × count cells.
fn outer_edges(row: u32, column: u32, count: u32) -> u32 {
    return select(0u, EDGE_NORTH, row == 0u) | select(0u, EDGE_EAST, column == count - 1u)
        | select(0u, EDGE_SOUTH, row == count - 1u) | select(0u, EDGE_WEST, column == 0u);
}

fn patch_inside(tile: u32, patch_index: u32, edge: u32) -> Facing {
    var at = patch_index;
    switch edge {
        case EDGE_NORTH: { at -= TILE_QUADS; }
        case EDGE_EAST: { at += 1u; }
        case EDGE_SOUTH: { at += TILE_QUADS; }
        default: { at -= 1u; }
    }
    return Facing(SIDE_SAME, tile, at, at);
}

// The patch, or the two patches, across an edge.
fn facing(tile: u32, patch_index: u32, edge: u32) -> Facing {
    let row = patch_index / TILE_QUADS;
    let column = patch_index % TILE_QUADS;
    if (outer_edges(row, column, TILE_QUADS) & edge) == 0u {
        return patch_inside(tile, patch_index, edge);
    }
    var along = select(row, column, is_horizontal(edge));
    let word = side_words(tile, edge)[along / (TILE_QUADS / 2u)];
    let relation = relation_of(word);
    if relation == SIDE_NONE {
        return Facing(SIDE_NONE, tile, patch_index, patch_index);
    }
    if relation == SIDE_COARSER {
        along = half_of(tiles[tile].quadrant, edge) * (TILE_QUADS / 2u) + along / 2u;
    } else if relation == SIDE_FINER {
        along = along % (TILE_QUADS / 2u) * 2u;
    }
    var first = along;
    switch edge {
        case EDGE_NORTH: { first += (TILE_QUADS - 1u) * TILE_QUADS; }
        case EDGE_EAST: { first *= TILE_QUADS; }
        case EDGE_SOUTH: {}
        default: { first = first * TILE_QUADS + TILE_QUADS - 1u; }
    }
    let stride = select(TILE_QUADS, 1u, is_horizontal(edge));
    let second = select(first, first + stride, relation == SIDE_FINER);
    return Facing(relation, word & SIDE_INDEX_MASK, first, second);
}

// The other patch of the same tile that faces the same coarser patch across an edge.
fn sibling(patch_index: u32, edge: u32) -> u32 {
    return patch_index ^ select(TILE_QUADS, 1u, is_horizontal(edge));
}

// The vertex index of a sample: that of the tile that owns it. Corners are in the tile's words; a side is its
// own towards finer tiles and the data's end, the coarser tile's otherwise, the north or west one's at equal level.
fn owned_vertex(tile: u32, row: u32, column: u32) -> u32 {
    let edges = outer_edges(row, column, TILE_SAMPLES);
    if edges == 0u {
        return (tile << SAMPLE_BITS) | (row * TILE_SAMPLES + column);
    }
    if countOneBits(edges) == 2u {
        let corner = select(0u, 2u, row != 0u) + select(0u, 1u, column != 0u);
        return (tiles[tile].corner_tile[corner] << SAMPLE_BITS) | tiles[tile].corner_sample[corner];
    }
    var along = select(row, column, is_horizontal(edges));
    let word = side_words(tile, edges)[along / (TILE_CELLS / 2u)];
    let relation = relation_of(word);
    let is_theirs = relation == SIDE_COARSER
        || (relation == SIDE_SAME && (edges & (EDGE_NORTH | EDGE_WEST)) != 0u);
    if !is_theirs {
        return (tile << SAMPLE_BITS) | (row * TILE_SAMPLES + column);
    }
    if relation == SIDE_COARSER {
        along = half_of(tiles[tile].quadrant, edges) * (TILE_CELLS / 2u) + along / 2u;
    }
    // The same place is on the opposite border of the neighbour.
    let across = select(0u, TILE_CELLS, (edges & (EDGE_NORTH | EDGE_WEST)) != 0u);
    let sample = select(along * TILE_SAMPLES + across, across * TILE_SAMPLES + along, is_horizontal(edges));
    return ((word & SIDE_INDEX_MASK) << SAMPLE_BITS) | sample;
}

// Place of a skirt vertex (row, column), counted clockwise from the north-west corner.
fn skirt_sample(place: u32) -> vec2u {
    let along = place % TILE_CELLS;
    switch place / TILE_CELLS {
        case 0u: { return vec2u(0u, along); }
        case 1u: { return vec2u(along, TILE_CELLS); }
        case 2u: { return vec2u(TILE_CELLS, TILE_CELLS - along); }
        default: { return vec2u(TILE_CELLS - along, 0u); }
    }
}
