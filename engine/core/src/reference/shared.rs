//! The structs and constants that WGSL and Rust share, by hand on both sides and checked by a test.
//!
//! Twins: `shaders/shared/{constants,frame,tile,upload,draw_list}.wgsl`; the modules below have twins of their own.

use bytemuck::{Pod, Zeroable};

pub mod border;
pub mod colors;
pub mod ground;
pub mod patch_word;
pub mod pool;
pub mod refine;
pub mod synthetic;

/// No tile, no slot, no fixed depth.
pub const NONE: u32 = u32::MAX;
/// Low bits of a vertex index: the sample. The high bits are the drawn tile.
pub const SAMPLE_BITS: u32 = 15;
/// Samples from here are skirt vertices, 512 around the tile.
pub const SKIRT_FIRST: u32 = 16_641;

/// First word of a slot's heights: 16,641 i32, units.
pub const HEIGHTS_WORD: usize = 0;
/// First word of a slot's slopes: 16,641 packed pairs of f16, metres a metre: east, north.
pub const SLOPES_WORD: usize = 16_641;
/// First word of a slot's void bits: 521 words.
pub const VOIDS_WORD: usize = 33_282;
/// First word of a slot's stride errors: 1,024 pairs of f32, metres: stride 4 and stride 2 against stride 1.
pub const STRIDE_ERRORS_WORD: usize = 33_803;
/// First word of a slot's patch codes: 256 words, four codes a word, lowest byte first.
pub const CODES_WORD: usize = 35_851;
/// First word of a slot's controls: 1,225 i32, units.
pub const CONTROLS_WORD: usize = 36_107;
/// First word of a slot's cut bits: 32 words, a bit a patch, lowest first.
pub const CUT_WORD: usize = 37_332;
/// Words of a slot.
pub const SLOT_WORDS: usize = 37_376;
/// Slots of a pool page of at most 128 MiB.
pub const SLOTS_PER_PAGE: u32 = 897;

/// First word of an upload's controls: 1,225 i32, units.
pub const UPLOAD_CONTROLS_WORD: usize = 0;
/// First word of an upload's detail: 16,641 i32, codes.
pub const UPLOAD_DETAIL_WORD: usize = 1_225;
/// First word of an upload's void bits: 521 words.
pub const UPLOAD_VOIDS_WORD: usize = 17_866;
/// First word of an upload's patch codes: 256 words, four codes a word, lowest byte first.
pub const UPLOAD_CODES_WORD: usize = 18_387;
/// First word of an upload's cut bits: 32 words, a bit a patch, lowest first.
pub const UPLOAD_CUT_WORD: usize = 18_643;
/// Words of an upload in the staging buffer: 74,700 bytes.
pub const UPLOAD_WORDS: usize = 18_675;

/// First of the five words of the draw's arguments: the index count.
pub const INDEX_COUNT_WORD: usize = 0;
/// The draw's instance count: 1 as soon as anything is drawn.
pub const INSTANCE_COUNT_WORD: usize = 1;
/// First of three words: indices at shift 0, 1, 2.
pub const SHIFT_COUNTS_WORD: usize = 5;
/// Indices reserved so far.
pub const CURSOR_WORD: usize = 8;
/// First of six words: patches by depth, regular ones first, then transition ones.
pub const CLASS_COUNTS_WORD: usize = 9;
/// Words of the head of the emitted list.
pub const DRAW_LIST_WORDS: usize = 16;

/// Void triangles are drawn with their filled heights.
pub const FLAG_DRAW_VOIDS: u32 = 1;
/// Colour by patch depth and tile level.
pub const FLAG_DEPTH_COLORS: u32 = 2;
/// Encode the colour: the target is not an sRGB format.
pub const FLAG_SRGB_OUT: u32 = 4;
/// Draw the edges of the triangles.
pub const FLAG_WIREFRAME: u32 = 8;

/// The tile is in the view; others are listed for their borders alone.
pub const TILE_VISIBLE: u32 = 1;
/// The tile has void bits.
pub const TILE_VOIDS: u32 = 2;

/// A feature is drawn in place of the tile's cut patches.
pub const TILE_CUT: u32 = 4;

/// In the index list of a feature's mesh: the vertex is a sample of one of its tiles; the rest is the tile's place in the
/// feature's list `<< 15 |` the sample.
pub const FEATURE_BORDER: u32 = 1 << 31;

/// The part of a side's word that is the neighbour's place in the drawn list.
pub const SIDE_INDEX_MASK: u32 = 0x3fff_ffff;
/// The neighbour is of the same level.
pub const SIDE_SAME: u32 = 0;
/// The neighbour is one level coarser.
pub const SIDE_COARSER: u32 = 1;
/// The neighbours are one level finer.
pub const SIDE_FINER: u32 = 2;

/// One view of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Frame {
    /// From camera-relative world metres to clip space, column by column; reversed depth, infinite far plane.
    pub clip_from_view_world: [[f32; 4]; 4],
    /// Width and height in pixels.
    pub viewport: [f32; 2],
    /// K = viewport height / (2 tan(fov_y / 2)), pixels.
    pub pixels_per_radian: f32,
    /// What the patches may err by, pixels.
    pub tolerance: f32,
    /// Metres of a height unit.
    pub unit: f32,
    /// Tiles in the list.
    pub drawn_count: u32,
    /// Indices the emitted list may hold.
    pub index_capacity: u32,
    /// Every patch takes this depth; [`NONE`]: each its own.
    pub uniform_depth: u32,
    /// Towards the sun, world, unit length.
    pub sun: [f32; 3],
    /// Haze, 1 / metres; 0 for none.
    pub haze: f32,
    /// Linear colour of the haze.
    pub sky: [f32; 3],
    /// The `FLAG_` bits.
    pub flags: u32,
    /// Least and greatest height of the data set, metres.
    pub height_range: [f32; 2],
    /// World z of the camera, metres.
    pub camera_height: f32,
    /// 0.
    pub reserved: f32,
    /// South-west corner of the data set, which tiles reach past, camera-relative metres.
    pub ground_min: [f32; 2],
    /// North-east corner of the data set, camera-relative metres.
    pub ground_max: [f32; 2],
}

/// A drawn tile, and how its neighbours lie.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DrawnTile {
    /// Camera-relative metres of sample (0, 0) at height `base`.
    pub origin: [f32; 3],
    /// Its slot in the pool.
    pub slot: u32,
    /// Metres a column (east, positive) and a row (north, negative).
    pub step: [f32; 2],
    /// max(δ, u), metres.
    pub error: f32,
    /// Pyramid level.
    pub level: u32,
    /// The height that `origin[2]` stands for, units.
    pub base: i32,
    /// Bottom of the tile's box, camera-relative metres.
    pub z_min: f32,
    /// Top of the tile's box, camera-relative metres.
    pub z_max: f32,
    /// The `TILE_` bits.
    pub flags: u32,
    /// Slot of its parent; [`NONE`] for level 0.
    pub parent_slot: u32,
    /// Which quadrant of its parent it is.
    pub quadrant: u32,
    /// Layer of its imagery (its own or an ancestor's); [`NONE`].
    pub color_slot: u32,
    /// Tile fraction to imagery-tile fraction.
    pub color_scale: f32,
    /// Imagery-tile fraction of the tile's north-west corner: east, south.
    pub color_offset: [f32; 2],
    /// Metres the skirt hangs.
    pub skirt: f32,
    /// δ alone, metres: 0 at the finest level.
    pub geometric_error: f32,
    /// Drawn tile that owns each corner sample: NW, NE, SW, SE.
    pub corner_tile: [u32; 4],
    /// That tile's sample.
    pub corner_sample: [u32; 4],
    /// Neighbours across the north side, west half first.
    pub side_north: [u32; 2],
    /// Neighbours across the east side, north half first.
    pub side_east: [u32; 2],
    /// Neighbours across the south side, west half first.
    pub side_south: [u32; 2],
    /// Neighbours across the west side, north half first.
    pub side_west: [u32; 2],
}

/// A tile on its way into the pool.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct UploadHeader {
    /// Its slot within the page.
    pub slot: u32,
    /// Units a code step: q.
    pub quantum: i32,
    /// Metres a height unit.
    pub unit: f32,
    /// 0.
    pub reserved: u32,
    /// Metres a column (east, positive) and a row (north, negative).
    pub step: [f32; 2],
    /// 0.
    pub reserved_2: [f32; 2],
}

/// A vertex of a feature's mesh.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FeatureVertex {
    /// Metres from the feature's origin.
    pub position: [f32; 3],
    /// The feature's tile under it: its place in the feature's list.
    pub tile: u32,
    /// Outward, unit length.
    pub normal: [f32; 3],
    /// The vertex whose position this one has; itself unless it only shades differently.
    pub position_of: u32,
}
