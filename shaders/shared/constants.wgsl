// Sizes every stage agrees on; checked against the Rust side by a test.

const TILE_QUADS: u32 = 32u;        // patches a side of a tile
const QUAD_SAMPLES: u32 = 4u;       // samples from one corner of a patch to the next
const TILE_CELLS: u32 = 128u;       // cells a side
const TILE_SAMPLES: u32 = 129u;     // samples a side
const CAGE_CONTROLS: u32 = 35u;     // controls a side
const PATCH_COUNT: u32 = 1024u;     // patches of a tile
const TILE_SAMPLE_COUNT: u32 = 16641u;
const CAGE_CONTROL_COUNT: u32 = 1225u;
const SAMPLE_BITS: u32 = 15u;       // low bits of a vertex index: the sample; high bits: the drawn tile
const SKIRT_FIRST: u32 = 16641u;    // samples from here are skirt vertices, 512 around the tile
const NONE: u32 = 0xffffffffu;

// Words of a slot of the pool, one after the other.
const HEIGHTS_WORD: u32 = 0u;       // 16641 i32, units
const SLOPES_WORD: u32 = 16641u;    // 16641 pack2x16float(dz/d(east), dz/d(north))
const VOIDS_WORD: u32 = 33282u;     // 521 words of bits
const STRIDE_ERRORS_WORD: u32 = 33803u; // 1024 × 2 f32, metres: stride 4, stride 2 against stride 1
const CODES_WORD: u32 = 35851u;     // 256 words, four patch codes a word, lowest byte first
const CONTROLS_WORD: u32 = 36107u;  // 1225 i32, units
const CUT_WORD: u32 = 37332u;       // 32 words, a bit a patch that a feature stands in for, lowest first
const SLOT_WORDS: u32 = 37376u;     // rounded up: 149,504 bytes
const SLOTS_PER_PAGE: u32 = 897u;   // what fits 128 MiB
