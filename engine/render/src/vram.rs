//! How a VRAM budget is kept: what the planner's sizes come to on the device, everything counted.
//!
//! Everything is sized once, from the budget alone, so that no frame makes a buffer larger. Pure arithmetic.

use drumlin_core::{
    pyramid::PyramidError,
    reference::shared::{DrawnTile, Frame, SLOT_WORDS},
    stream::COLOR_BYTES,
    terrain::PoolSizes,
};

/// Bytes of a slot: one decoded tile.
pub(crate) const SLOT_BYTES: u64 = SLOT_WORDS as u64 * 4;
/// Tiles decoded at once; more in one frame are decoded in submissions of their own.
pub(crate) const UPLOADS_AT_ONCE: u32 = 16;
/// Bytes of a tile on its way up: header, controls, codes, voids and patch errors in words, rounded up.
const UPLOAD_BYTES: u64 = 76 << 10;
/// Uniforms, arguments, counters and their way back.
const FIXED_BYTES: u64 = 16 << 10;
/// Bytes a drawn tile takes in the lists beside its indices: itself, and three words for each of its 1,024 patches.
const DRAWN_BYTES: u64 = size_of::<DrawnTile>() as u64 + 3 * 4096;

/// Bytes on the device of a terrain of these sizes, all pages made.
pub(crate) fn byte_count(sizes: &PoolSizes) -> u64 {
    u64::from(sizes.slots) * SLOT_BYTES
        + u64::from(sizes.color_layers.max(1)) * COLOR_BYTES
        + u64::from(sizes.max_drawn) * DRAWN_BYTES
        + u64::from(sizes.index_capacity) * 4
        + 2 * u64::from(UPLOADS_AT_ONCE) * UPLOAD_BYTES
        + size_of::<Frame>() as u64
        + FIXED_BYTES
}

/// What a planner may be told to divide so that all of it stays within a budget.
///
/// # Errors
///
/// When the budget holds less than the least a terrain can be drawn with.
pub(crate) fn planner_budget(budget_bytes: u64, imagery: bool) -> Result<u64, PyramidError> {
    let mut share = budget_bytes;
    loop {
        let excess = byte_count(&PoolSizes::within(share, imagery)?).saturating_sub(budget_bytes);
        if excess == 0 {
            return Ok(share);
        }
        share = share.saturating_sub(excess);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terrain_never_passes_its_budget_and_uses_most_of_it() {
        for megabytes in [32_u64, 64, 100, 128, 256, 400, 512] {
            for imagery in [false, true] {
                let budget = megabytes << 20;
                let share = planner_budget(budget, imagery).expect("enough");
                let sizes = PoolSizes::within(share, imagery).expect("enough");
                let used = byte_count(&sizes);
                assert!(used <= budget, "{sizes:?} of {megabytes} MiB");
                assert!(used * 10 >= budget * 7, "{used} of {megabytes} MiB");
            }
        }
    }

    #[test]
    fn a_budget_that_is_too_small_is_refused() {
        assert!(planner_budget(8 << 20, false).is_err());
    }
}
