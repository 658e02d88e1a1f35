// A tile on its way into the pool.
// Twin: core/reference/shared.rs

struct UploadHeader {
    slot: u32,                      // its slot within the page
    quantum: i32,                   // units a code step: q
    unit: f32,                      // metres a height unit
    reserved: u32,
    step: vec2f,                    // metres a column (east, positive) and a row (north, negative)
    reserved_2: vec2f,
}

// Words of a tile in the staging buffer, one after the other.
const UPLOAD_CONTROLS_WORD: u32 = 0u;   // 1225 i32, units
const UPLOAD_DETAIL_WORD: u32 = 1225u;  // 16641 i32, codes
const UPLOAD_VOIDS_WORD: u32 = 17866u;  // 521 words of bits, lowest first
const UPLOAD_CODES_WORD: u32 = 18387u;  // 256 words, four patch codes a word, lowest byte first
const UPLOAD_CUT_WORD: u32 = 18643u;    // 32 words of bits, lowest first
const UPLOAD_WORDS: u32 = 18675u;
