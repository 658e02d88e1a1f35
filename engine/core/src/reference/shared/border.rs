//! What lies across an edge: of a patch (its neighbours) and of a tile (who owns a border vertex).
//!
//! ```text
//!            N = 1
//!          +-------+          A patch's edges are bits. Neighbours may lie in the same tile,
//!  W = 8   | patch |   E = 2  or across a tile border in a tile of the same level, of one
//!          +-------+          level less (one patch faces two of ours) or more (two face one).
//!            S = 4
//! ```
//!
//! Twin: `shaders/shared/border.wgsl`.

use super::{DrawnTile, NONE, SAMPLE_BITS, SIDE_COARSER, SIDE_FINER, SIDE_INDEX_MASK, SIDE_SAME};

/// Patches a side.
pub const TILE_QUADS: u32 = 32;
/// Samples from one corner of a patch to the next.
pub const QUAD_SAMPLES: u32 = 4;
/// Cells a side.
pub const TILE_CELLS: u32 = 128;
/// Samples a side.
pub const TILE_SAMPLES: u32 = 129;
/// Patches of a tile.
pub const PATCH_COUNT: u32 = 1_024;

/// The north edge's bit.
pub const EDGE_NORTH: u32 = 1;
/// The east edge's bit.
pub const EDGE_EAST: u32 = 2;
/// The south edge's bit.
pub const EDGE_SOUTH: u32 = 4;
/// The west edge's bit.
pub const EDGE_WEST: u32 = 8;
/// The edges, in the order in which stages visit them.
pub const EDGES: [u32; 4] = [EDGE_NORTH, EDGE_EAST, EDGE_SOUTH, EDGE_WEST];
/// The relation of a side where the data ends.
pub const SIDE_NONE: u32 = 3;

/// What a patch faces across an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// `SIDE_SAME`, `SIDE_COARSER`, `SIDE_FINER` or [`SIDE_NONE`].
    pub relation: u32,
    /// Drawn tile.
    pub tile: u32,
    /// Patch.
    pub first: u32,
    /// The other patch where the relation is finer, else equal to `first`.
    pub second: u32,
}

/// The words of a side.
#[must_use]
pub fn side_words(tile: &DrawnTile, edge: u32) -> [u32; 2] {
    match edge {
        EDGE_NORTH => tile.side_north,
        EDGE_EAST => tile.side_east,
        EDGE_SOUTH => tile.side_south,
        _ => tile.side_west,
    }
}

/// True for the edges along which columns are counted.
#[must_use]
pub const fn is_horizontal(edge: u32) -> bool {
    edge & (EDGE_NORTH | EDGE_SOUTH) != 0
}

/// The relation in a side's word.
#[must_use]
pub const fn relation_of(word: u32) -> u32 {
    if word == NONE { SIDE_NONE } else { word >> 30 }
}

/// Which half of a coarser neighbour's side a tile lies at.
#[must_use]
pub const fn half_of(quadrant: u32, edge: u32) -> u32 {
    if is_horizontal(edge) {
        quadrant & 1
    } else {
        quadrant >> 1
    }
}

/// Edges of a cell that lie on the border of its square of count × count cells.
#[must_use]
pub const fn outer_edges(row: u32, column: u32, count: u32) -> u32 {
    (if row == 0 { EDGE_NORTH } else { 0 })
        | (if column == count - 1 { EDGE_EAST } else { 0 })
        | (if row == count - 1 { EDGE_SOUTH } else { 0 })
        | (if column == 0 { EDGE_WEST } else { 0 })
}

fn patch_inside(tile: u32, patch: u32, edge: u32) -> Facing {
    let at = match edge {
        EDGE_NORTH => patch - TILE_QUADS,
        EDGE_EAST => patch + 1,
        EDGE_SOUTH => patch + TILE_QUADS,
        _ => patch - 1,
    };
    Facing {
        relation: SIDE_SAME,
        tile,
        first: at,
        second: at,
    }
}

/// The patch, or the two patches, across an edge.
#[must_use]
pub fn facing(tiles: &[DrawnTile], tile: u32, patch: u32, edge: u32) -> Facing {
    let (row, column) = (patch / TILE_QUADS, patch % TILE_QUADS);
    if outer_edges(row, column, TILE_QUADS) & edge == 0 {
        return patch_inside(tile, patch, edge);
    }
    let mut along = if is_horizontal(edge) { column } else { row };
    let word = side_words(&tiles[tile as usize], edge)[(along / (TILE_QUADS / 2)) as usize];
    let relation = relation_of(word);
    match relation {
        SIDE_NONE => {
            return Facing {
                relation,
                tile,
                first: patch,
                second: patch,
            };
        }
        SIDE_COARSER => {
            along = half_of(tiles[tile as usize].quadrant, edge) * (TILE_QUADS / 2) + along / 2;
        }
        SIDE_FINER => along = along % (TILE_QUADS / 2) * 2,
        _ => {}
    }
    let first = match edge {
        EDGE_NORTH => along + (TILE_QUADS - 1) * TILE_QUADS,
        EDGE_EAST => along * TILE_QUADS,
        EDGE_SOUTH => along,
        _ => along * TILE_QUADS + TILE_QUADS - 1,
    };
    let stride = if is_horizontal(edge) { 1 } else { TILE_QUADS };
    let second = if relation == SIDE_FINER {
        first + stride
    } else {
        first
    };
    Facing {
        relation,
        tile: word & SIDE_INDEX_MASK,
        first,
        second,
    }
}

/// The other patch of the same tile that faces the same coarser patch across an edge.
#[must_use]
pub const fn sibling(patch: u32, edge: u32) -> u32 {
    patch ^ if is_horizontal(edge) { 1 } else { TILE_QUADS }
}

/// The vertex index of a sample: that of the tile that owns it.
///
/// Corners are in the tile's words; a side is its own towards finer tiles and the data's end, the coarser tile's
/// otherwise, the north or west one's at equal level.
#[must_use]
pub fn owned_vertex(tiles: &[DrawnTile], tile: u32, row: u32, column: u32) -> u32 {
    let own = tile << SAMPLE_BITS | (row * TILE_SAMPLES + column);
    let edges = outer_edges(row, column, TILE_SAMPLES);
    if edges == 0 {
        return own;
    }
    let drawn = &tiles[tile as usize];
    if edges.count_ones() == 2 {
        let corner = usize::from(row != 0) * 2 + usize::from(column != 0);
        return drawn.corner_tile[corner] << SAMPLE_BITS | drawn.corner_sample[corner];
    }
    let mut along = if is_horizontal(edges) { column } else { row };
    let word = side_words(drawn, edges)[(along / (TILE_CELLS / 2)) as usize];
    let relation = relation_of(word);
    let is_north_or_west = edges & (EDGE_NORTH | EDGE_WEST) != 0;
    let is_theirs = relation == SIDE_COARSER || relation == SIDE_SAME && is_north_or_west;
    if !is_theirs {
        return own;
    }
    if relation == SIDE_COARSER {
        along = half_of(drawn.quadrant, edges) * (TILE_CELLS / 2) + along / 2;
    }
    // The same place is on the opposite border of the neighbour.
    let across = if is_north_or_west { TILE_CELLS } else { 0 };
    let sample = if is_horizontal(edges) {
        across * TILE_SAMPLES + along
    } else {
        along * TILE_SAMPLES + across
    };
    (word & SIDE_INDEX_MASK) << SAMPLE_BITS | sample
}

/// Place of a skirt vertex (row, column), counted clockwise from the north-west corner.
#[must_use]
pub fn skirt_sample(place: u32) -> [u32; 2] {
    let along = place % TILE_CELLS;
    match place / TILE_CELLS {
        0 => [0, along],
        1 => [along, TILE_CELLS],
        2 => [TILE_CELLS, TILE_CELLS - along],
        _ => [TILE_CELLS - along, 0],
    }
}
