//! emit: patches become one list of indices and the arguments of its draw.
//!
//! Reads frame, tiles, pool (voids) and patches; writes the head of the list (zero before) and indices. Steps in order:
//! [`count`] (indices at every shift), [`write()`] (at the least shift that fits; when none does, nothing is drawn).
//! Triangles wind counter-clockwise seen from above. Every vertex is that of the tile that owns its sample.
//! A GPU reserves the list in any order, 64 patches at a time; here they are in order.
//!
//! ```text
//! NW---NE    NW---NE    +-+-+ W and N     A row of depth 2 beside a coarser tile: its odd border
//! | \   |    | \ / |    |\|/|  split      vertices do not exist over there, so its cells are drawn
//! |  \  |    +--C  |    +-C |             in fours, fanned, split on all edges but that one.
//! |   \ |    | / \ |    |/ \|
//! SW---SE    SW---SE    +---+
//! ```
//!
//! Twin: `shaders/stages/emit.wgsl`.
//! Based on: the render table of Nießner, Loop, Meyer, DeRose, *Feature-adaptive GPU rendering of Catmull-Clark
//! subdivision surfaces*, 2012.

use super::shared::{
    CLASS_COUNTS_WORD, CURSOR_WORD, DrawnTile, FLAG_DRAW_VOIDS, Frame, INDEX_COUNT_WORD,
    INSTANCE_COUNT_WORD, SAMPLE_BITS, SHIFT_COUNTS_WORD, SIDE_SAME, SKIRT_FIRST, TILE_VISIBLE,
    TILE_VOIDS,
    border::{
        EDGE_EAST, EDGE_NORTH, EDGE_SOUTH, EDGE_WEST, EDGES, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS,
        TILE_QUADS, TILE_SAMPLES, facing, outer_edges, owned_vertex, skirt_sample,
    },
    patch_word::{FINEST_DEPTH, PATCH_CUT, SHIFT_COUNT, word_coarser, word_depth, word_split},
    pool::{Pages, pool_void},
};

/// Skirt vertices around a tile.
const SKIRT_VERTICES: u32 = 512;

/// Edges of a patch where a skirt hangs: all where no tile of the same level lies.
fn skirt_edges(tiles: &[DrawnTile], tile: u32, patch: u32) -> u32 {
    let mut edges = outer_edges(patch / TILE_QUADS, patch % TILE_QUADS, TILE_QUADS);
    for edge in EDGES {
        if edges & edge != 0 && facing(tiles, tile, patch, edge).relation == SIDE_SAME {
            edges ^= edge;
        }
    }
    edges
}

/// Samples from one vertex of an edge to the next.
fn edge_stride(word: u32, shift: u32, edge: u32) -> u32 {
    let depth = word_depth(word, shift);
    if depth == FINEST_DEPTH {
        return if word_coarser(word) & edge != 0 { 2 } else { 1 };
    }
    QUAD_SAMPLES >> depth >> u32::from(word_split(word, shift) & edge != 0)
}

fn surface_triangles(word: u32, shift: u32) -> u32 {
    let depth = word_depth(word, shift);
    if depth == FINEST_DEPTH {
        return 32 - 2 * word_coarser(word).count_ones();
    }
    let count = 1 << depth;
    let mut triangles = 0;
    for cell in 0..count * count {
        let split = outer_edges(cell / count, cell % count, count) & word_split(word, shift);
        triangles += if split == 0 {
            2
        } else {
            4 + split.count_ones()
        };
    }
    triangles
}

fn patch_index_count(tiles: &[DrawnTile], tile: u32, patch: u32, word: u32, shift: u32) -> u32 {
    if word & PATCH_CUT != 0 {
        return 0;
    }
    let mut triangles = surface_triangles(word, shift);
    let skirts = skirt_edges(tiles, tile, patch);
    for edge in EDGES {
        if skirts & edge != 0 {
            triangles += 2 * (QUAD_SAMPLES / edge_stride(word, shift, edge));
        }
    }
    3 * triangles
}

fn is_drawn(tile: &DrawnTile) -> bool {
    tile.flags & TILE_VISIBLE != 0
}

/// Adds up the indices of every shift.
pub fn count(frame: &Frame, tiles: &[DrawnTile], patches: &[u32], draw_list: &mut [u32]) {
    for tile in (0..frame.drawn_count).filter(|&tile| is_drawn(&tiles[tile as usize])) {
        for patch in 0..PATCH_COUNT {
            let word = patches[(tile * PATCH_COUNT + patch) as usize];
            for shift in 0..SHIFT_COUNT {
                draw_list[SHIFT_COUNTS_WORD + shift as usize] +=
                    patch_index_count(tiles, tile, patch, word, shift);
            }
        }
    }
}

/// The least shift whose indices fit; [`SHIFT_COUNT`] when none does.
#[must_use]
pub fn chosen_shift(frame: &Frame, draw_list: &[u32]) -> u32 {
    (0..SHIFT_COUNT)
        .find(|&shift| draw_list[SHIFT_COUNTS_WORD + shift as usize] <= frame.index_capacity)
        .unwrap_or(SHIFT_COUNT)
}

/// A vertex of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    is_void: bool,
}

/// A patch being written.
struct Writer<'a> {
    frame: &'a Frame,
    tiles: &'a [DrawnTile],
    pages: &'a Pages<'a>,
    indices: &'a mut [u32],
    /// Where the next index goes.
    at: usize,
    /// Drawn tile of the patch.
    tile: u32,
}

impl Writer<'_> {
    fn is_void(&self, sample: [u32; 2]) -> bool {
        let drawn = &self.tiles[self.tile as usize];
        drawn.flags & TILE_VOIDS != 0
            && self.frame.flags & FLAG_DRAW_VOIDS == 0
            && pool_void(self.pages, drawn.slot, sample[0] * TILE_SAMPLES + sample[1])
    }

    fn corner(&self, sample: [u32; 2]) -> Corner {
        Corner {
            vertex: owned_vertex(self.tiles, self.tile, sample[0], sample[1]),
            is_void: self.is_void(sample),
        }
    }

    fn put(&mut self, [a, b, c]: [u32; 3], is_hidden: bool) {
        let corners = if is_hidden { [a, a, a] } else { [a, b, c] };
        self.indices[self.at..self.at + 3].copy_from_slice(&corners);
        self.at += 3;
    }

    /// A cell from its north-west sample, with its split edges: a fan over its border, about its centre where an edge is
    /// split, else about its north-west sample.
    fn cell(&mut self, nw: [u32; 2], stride: u32, split: u32) {
        let (first, last, middle) = if split == 0 {
            (2, 6, 0)
        } else {
            (0, 8, stride / 2)
        };
        let pivot = self.corner(nw.map(|at| at + middle));
        let mut before = pivot;
        for place in first..=last {
            if place % 2 == 0 || split & (EDGE_WEST >> (place / 2)) != 0 {
                let [row, column] = cell_place(place);
                let next = self.corner([nw[0] + row * stride / 2, nw[1] + column * stride / 2]);
                if place > first {
                    let corners = [pivot, before, next];
                    let is_hidden = corners.iter().any(|corner| corner.is_void);
                    self.put(corners.map(|corner| corner.vertex), is_hidden);
                }
                before = next;
            }
        }
    }

    /// Squares of one cell, or in fours: as one split cell where an edge faces a coarser tile, which keeps no middle
    /// there, else as four.
    fn surface(&mut self, patch: u32, word: u32, shift: u32) {
        let nw = [patch / TILE_QUADS, patch % TILE_QUADS].map(|at| at * QUAD_SAMPLES);
        let in_fours = is_in_fours(word, shift);
        let count = if in_fours {
            2
        } else {
            1 << word_depth(word, shift)
        };
        let stride = QUAD_SAMPLES / count;
        for i in 0..count * count {
            let place = [i / count, i % count];
            let outer = outer_edges(place[0], place[1], count);
            let (mut split, mut parts) = (outer & word_split(word, shift), 1);
            if in_fours {
                let whole = outer & word_coarser(word);
                (split, parts) = if whole == 0 { (0, 2) } else { (15 ^ whole, 1) };
            }
            for j in 0..parts * parts {
                let part = [j / parts, j % parts];
                let corner = [0, 1].map(|axis| nw[axis] + place[axis] * stride + part[axis]);
                self.cell(corner, stride / parts, split);
            }
        }
    }

    fn skirt(&mut self, patch: u32, edge: u32, stride: u32) {
        let start = skirt_start(patch, edge);
        let mut before = self.corner(skirt_sample(start));
        for place in (start..start + QUAD_SAMPLES).step_by(stride as usize) {
            let next_place = (place + stride) % SKIRT_VERTICES;
            let next = self.corner(skirt_sample(next_place));
            let low_before = self.tile << SAMPLE_BITS | (SKIRT_FIRST + place);
            let low_next = self.tile << SAMPLE_BITS | (SKIRT_FIRST + next_place);
            let is_hidden = before.is_void || next.is_void;
            self.put([next.vertex, low_next, low_before], is_hidden);
            self.put([next.vertex, low_before, before.vertex], is_hidden);
            before = next;
        }
    }

    fn patch(&mut self, patch: u32, word: u32, shift: u32) {
        self.surface(patch, word, shift);
        let skirts = skirt_edges(self.tiles, self.tile, patch);
        for edge in EDGES {
            if skirts & edge != 0 {
                self.skirt(patch, edge, edge_stride(word, shift, edge));
            }
        }
    }
}

/// True when cells are drawn in fours: at the finest depth, beside a coarser tile.
fn is_in_fours(word: u32, shift: u32) -> bool {
    word_depth(word, shift) == FINEST_DEPTH && word_coarser(word) != 0
}

/// True where a patch has triangles of a template: split edges, or fours beside a coarser tile.
fn is_transition(word: u32, shift: u32) -> bool {
    word_split(word, shift) != 0 || is_in_fours(word, shift)
}

/// A place on the border of a cell, in half cells from its north-west sample:
///
/// ```text
/// 0 7 6      Place 8 is 0 again. Odd places are the middles of the edges,
/// 1   5      west, south, east, north.
/// 2 3 4
/// ```
fn cell_place(place: u32) -> [u32; 2] {
    [3, 5].map(|far: u32| 3_u32.saturating_sub(place.abs_diff(far)).min(2))
}

/// The first place, clockwise, of a patch's part of a side.
fn skirt_start(patch: u32, edge: u32) -> u32 {
    let row = patch / TILE_QUADS * QUAD_SAMPLES;
    let column = patch % TILE_QUADS * QUAD_SAMPLES;
    match edge {
        EDGE_NORTH => column,
        EDGE_EAST => TILE_CELLS + row,
        EDGE_SOUTH => 3 * TILE_CELLS - QUAD_SAMPLES - column,
        _ => 4 * TILE_CELLS - QUAD_SAMPLES - row,
    }
}

/// Writes the list and what it says of itself.
pub fn write(
    frame: &Frame,
    tiles: &[DrawnTile],
    pages: &Pages<'_>,
    patches: &[u32],
    draw_list: &mut [u32],
    indices: &mut [u32],
) {
    let shift = chosen_shift(frame, draw_list);
    if shift == SHIFT_COUNT {
        draw_list[INSTANCE_COUNT_WORD] = 1;
        return;
    }
    let mut writer = Writer {
        frame,
        tiles,
        pages,
        indices,
        at: 0,
        tile: 0,
    };
    for tile in (0..frame.drawn_count).filter(|&tile| is_drawn(&tiles[tile as usize])) {
        writer.tile = tile;
        for patch in 0..PATCH_COUNT {
            let word = patches[(tile * PATCH_COUNT + patch) as usize];
            if word & PATCH_CUT != 0 {
                continue;
            }
            let count = patch_index_count(tiles, tile, patch, word, shift);
            draw_list[CURSOR_WORD] += count;
            draw_list[INDEX_COUNT_WORD] += count;
            writer.patch(patch, word, shift);
            debug_assert_eq!(
                writer.at, draw_list[CURSOR_WORD] as usize,
                "counted as written"
            );
            let is_transition = is_transition(word, shift);
            let class = word_depth(word, shift) as usize + if is_transition { 3 } else { 0 };
            draw_list[CLASS_COUNTS_WORD + class] += 1;
        }
    }
    draw_list[INSTANCE_COUNT_WORD] = 1;
}

#[cfg(test)]
mod tests;
