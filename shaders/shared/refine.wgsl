// The tables of a feature as words, and the tasks they are executed by.
// Twin: core/reference/shared/refine.rs
//
//   means        4 points a row                          their mean: face points, edge points
//   rings        where each row starts, one more at the end; then rows: the vertex, then
//                nothing (it stays), a b (along a crease), or E0 F0 E1 F1 ... (smooth)
//   weighted     the point, where its terms start, how many a row; a term: point, weight
//   patches      16 points a patch, row by row
//   stencils     how many terms, then terms: point, weights in position, du, dv
//   offsets      rise, its slopes by u and by v
//   vertices     source, u, v, offset, position_of a vertex
//
// Words are numbers or the bits of floats; where a word says where something starts, it counts from the first of all.

struct RefineHeader {
    step: vec2f,                    // metres a sample of the feature's cut: east, north (negative)
    size: vec2f,                    // samples of the cut: columns, rows
    first: vec2u,                   // column and row of the cut's corner in its first tile
    tiles: vec2u,                   // tiles under the cut: columns, rows
    patches_word: u32,
    vertices_word: u32,
    vertex_count: u32,
    reserved: u32,
}

struct RefineTask {
    kind: u32,                      // REFINE_MEANS, REFINE_RINGS, REFINE_WEIGHTED
    count: u32,                     // rows
    rows_word: u32,                 // where they start
    first_point: u32,               // the first row's point; each row of REFINE_WEIGHTED names its own
}

const REFINE_MEANS: u32 = 0u;
const REFINE_RINGS: u32 = 1u;
const REFINE_WEIGHTED: u32 = 2u;

const REFINE_WEIGHTED_WORDS: u32 = 3u;
const REFINE_VERTEX_WORDS: u32 = 5u;

// In a vertex's source: the rest is where its stencil starts. Otherwise its patch.
const REFINE_STENCIL: u32 = 0x80000000u;
