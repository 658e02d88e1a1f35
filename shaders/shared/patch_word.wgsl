// What `balance` says of a patch, one word. A shift is how many depths the whole frame gives up to fit its list.
// Twin: core/reference/shared/patch_word.rs
//
//   bit 0–3    edges towards a coarser tile
//   bit 4–9    shift 0: depth (2 bits), split edges (4 bits)
//   bit 10–15  shift 1
//   bit 16–21  shift 2
//   bit 22     cut: a feature is drawn in its place

const SHIFT_COUNT: u32 = 3u;
const FINEST_DEPTH: u32 = 2u;
const DEPTH_CUT: u32 = 4u;          // in a depth: cut out for a feature, at the finest depth whatever the shift
const PATCH_CUT: u32 = 0x400000u;   // in a word: cut out for a feature

fn word_coarser(word: u32) -> u32 {
    return word & 15u;
}

fn word_depth(word: u32, shift: u32) -> u32 {
    return (word >> (4u + 6u * shift)) & 3u;
}

fn word_split(word: u32, shift: u32) -> u32 {
    return (word >> (6u + 6u * shift)) & 15u;
}
