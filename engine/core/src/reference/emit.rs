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

    fn vertex(&self, sample: [u32; 2]) -> u32 {
        owned_vertex(self.tiles, self.tile, sample[0], sample[1])
    }

    fn put(&mut self, [a, b, c]: [u32; 3], is_hidden: bool) {
        let corners = if is_hidden { [a, a, a] } else { [a, b, c] };
        self.indices[self.at..self.at + 3].copy_from_slice(&corners);
        self.at += 3;
    }

    /// A triangle of samples (row, column), in one point when a corner is void.
    fn triangle(&mut self, corners: [[u32; 2]; 3]) {
        let is_hidden = corners.iter().any(|&sample| self.is_void(sample));
        self.put(corners.map(|sample| self.vertex(sample)), is_hidden);
    }

    /// A cell from its north-west sample, with its split edges.
    fn cell(&mut self, nw: [u32; 2], stride: u32, split: u32) {
        let sw = [nw[0] + stride, nw[1]];
        let se = [nw[0] + stride, nw[1] + stride];
        let ne = [nw[0], nw[1] + stride];
        if split == 0 {
            self.triangle([nw, sw, se]);
            self.triangle([nw, se, ne]);
            return;
        }
        let centre = [nw[0] + stride / 2, nw[1] + stride / 2];
        self.fan_side(centre, nw, sw, split & EDGE_WEST != 0);
        self.fan_side(centre, sw, se, split & EDGE_SOUTH != 0);
        self.fan_side(centre, se, ne, split & EDGE_EAST != 0);
        self.fan_side(centre, ne, nw, split & EDGE_NORTH != 0);
    }

    fn fan_side(&mut self, centre: [u32; 2], a: [u32; 2], b: [u32; 2], is_split: bool) {
        if is_split {
            let middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
            self.triangle([centre, a, middle]);
            self.triangle([centre, middle, b]);
        } else {
            self.triangle([centre, a, b]);
        }
    }

    fn surface(&mut self, patch: u32, word: u32, shift: u32) {
        let nw = [
            patch / TILE_QUADS * QUAD_SAMPLES,
            patch % TILE_QUADS * QUAD_SAMPLES,
        ];
        let depth = word_depth(word, shift);
        if depth == FINEST_DEPTH && word_coarser(word) != 0 {
            for block in 0..4 {
                let whole = outer_edges(block / 2, block % 2, 2) & word_coarser(word);
                self.block_of_four([nw[0] + block / 2 * 2, nw[1] + block % 2 * 2], whole);
            }
            return;
        }
        let count = 1 << depth;
        let stride = QUAD_SAMPLES >> depth;
        for i in 0..count * count {
            let place = [i / count, i % count];
            let split = outer_edges(place[0], place[1], count) & word_split(word, shift);
            self.cell(
                [nw[0] + place[0] * stride, nw[1] + place[1] * stride],
                stride,
                split,
            );
        }
    }

    /// 2 × 2 cells of depth 2; `whole` edges, towards a coarser tile, keep no middle.
    fn block_of_four(&mut self, nw: [u32; 2], whole: u32) {
        if whole != 0 {
            self.cell(nw, 2, 15 ^ whole);
            return;
        }
        for i in 0..4 {
            self.cell([nw[0] + i / 2, nw[1] + i % 2], 1, 0);
        }
    }

    fn skirt(&mut self, patch: u32, edge: u32, stride: u32) {
        let start = skirt_start(patch, edge);
        for place in (start..start + QUAD_SAMPLES).step_by(stride as usize) {
            let next = (place + stride) % SKIRT_VERTICES;
            let (a, b) = (skirt_sample(place), skirt_sample(next));
            let (top_a, top_b) = (self.vertex(a), self.vertex(b));
            let low_a = self.tile << SAMPLE_BITS | (SKIRT_FIRST + place);
            let low_b = self.tile << SAMPLE_BITS | (SKIRT_FIRST + next);
            let is_hidden = self.is_void(a) || self.is_void(b);
            self.put([top_b, low_b, low_a], is_hidden);
            self.put([top_b, low_a, top_a], is_hidden);
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

/// True where a patch has triangles of a template: split edges, or fours beside a coarser tile.
fn is_transition(word: u32, shift: u32) -> bool {
    let is_beside_coarser = word_depth(word, shift) == FINEST_DEPTH && word_coarser(word) != 0;
    word_split(word, shift) != 0 || is_beside_coarser
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
