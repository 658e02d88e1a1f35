//! What `balance` says of a patch, one word.
//!
//! ```text
//! bit 0–3    edges towards a coarser tile
//! bit 4–9    shift 0: depth (2 bits), split edges (4 bits)
//! bit 10–15  shift 1
//! bit 16–21  shift 2
//! bit 22     cut: a feature is drawn in its place
//! ```
//!
//! A shift is how many depths the whole frame gives up to fit its list.
//! Twin: `shaders/shared/patch_word.wgsl`.

/// Shifts a word speaks of.
pub const SHIFT_COUNT: u32 = 3;
/// The depth of stride 1.
pub const FINEST_DEPTH: u32 = 2;

/// In a depth: the patch is cut out for a feature, and its border is at the finest depth whatever the shift.
pub const DEPTH_CUT: u32 = 4;
/// In a word: the patch is cut out for a feature.
pub const PATCH_CUT: u32 = 1 << 22;

/// Edges of a patch that face a coarser tile.
#[must_use]
pub const fn word_coarser(word: u32) -> u32 {
    word & 15
}

/// The depth of a patch at a shift.
#[must_use]
pub const fn word_depth(word: u32, shift: u32) -> u32 {
    word >> (4 + 6 * shift) & 3
}

/// The split edges of a patch at a shift.
#[must_use]
pub const fn word_split(word: u32, shift: u32) -> u32 {
    word >> (6 + 6 * shift) & 15
}
