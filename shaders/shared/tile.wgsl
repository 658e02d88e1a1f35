// A drawn tile, and how its neighbours lie.

struct DrawnTile {
    origin: vec3f,                  // camera-relative metres of sample (0, 0) at height `base`
    slot: u32,                      // its slot in the pool
    step: vec2f,                    // metres a column (east, positive) and a row (north, negative)
    error: f32,                     // metres: max(δ, u)
    level: u32,
    base: i32,                      // units: the height that origin.z stands for
    z_min: f32,                     // camera-relative metres of the tile's box
    z_max: f32,
    flags: u32,                     // see TILE_*
    parent_slot: u32,               // slot of its parent; NONE for level 0
    quadrant: u32,                  // row % 2 * 2 + column % 2
    color_slot: u32,                // layer of its imagery (its own or an ancestor's); NONE
    color_scale: f32,               // tile fraction to imagery-tile fraction
    color_offset: vec2f,            // imagery-tile fraction of the tile's north-west corner (east, south)
    skirt: f32,                     // metres the skirt hangs
    geometric_error: f32,           // metres: δ alone, 0 at the finest level
    corner_tile: vec4u,             // drawn tile that owns each corner sample: NW, NE, SW, SE (itself where nothing else does)
    corner_sample: vec4u,           // that tile's sample
    side_north: vec2u,              // neighbours: west or north half first; see SIDE_*
    side_east: vec2u,
    side_south: vec2u,
    side_west: vec2u,
}

const TILE_VISIBLE: u32 = 1u;       // in the view; others are listed for their borders alone
const TILE_VOIDS: u32 = 2u;         // it has void bits
const TILE_CUT: u32 = 4u;           // a feature is drawn in place of its cut patches

// A side's neighbour: drawn tile | relation << 30; NONE where there is none.
// Same level and coarser: both words are equal. Finer: two tiles, the west or north one first.
const SIDE_INDEX_MASK: u32 = 0x3fffffffu;
const SIDE_SAME: u32 = 0u;
const SIDE_COARSER: u32 = 1u;
const SIDE_FINER: u32 = 2u;
