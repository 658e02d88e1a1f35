//! How a VRAM budget is kept: what the planner's sizes come to on the device, everything counted.
//!
//! Everything but features' meshes is sized once, from the budget alone; those come and go within a share of their own.
//! Pure arithmetic.

use drumlin_core::{
    pyramid::PyramidError,
    reference::shared::{DrawnTile, Frame, SLOT_WORDS},
    stream::COLOR_BYTES,
    terrain::{PlannerDescriptor, PoolSizes},
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
pub(crate) fn planner_budget(
    budget_bytes: u64,
    imagery: bool,
    has_features: bool,
) -> Result<u64, PyramidError> {
    let mut share = budget_bytes;
    loop {
        let features = if has_features {
            PlannerDescriptor::feature_share(share)
        } else {
            0
        };
        let sizes = PoolSizes::within(share - features, imagery)?;
        let excess = (byte_count(&sizes) + features).saturating_sub(budget_bytes);
        if excess == 0 {
            return Ok(share);
        }
        share = share.saturating_sub(excess);
    }
}

#[cfg(test)]
mod tests {
    use drumlin_core::reference::shared::SLOTS_PER_PAGE;

    use super::*;

    #[test]
    fn a_terrain_never_passes_its_budget_and_uses_most_of_it() {
        // Past 640 MiB slots come to their limit.
        for megabytes in [
            64_u64, 100, 128, 256, 400, 512, 640, 690, 740, 770, 820, 880, 1000,
        ] {
            for (imagery, has_features) in
                [(false, false), (true, false), (false, true), (true, true)]
            {
                let budget = megabytes << 20;
                let share = planner_budget(budget, imagery, has_features).expect("enough");
                let features = if has_features {
                    PlannerDescriptor::feature_share(share)
                } else {
                    0
                };
                let sizes = PoolSizes::within(share - features, imagery).expect("enough");
                let used = byte_count(&sizes) + features;
                assert!(used <= budget, "{sizes:?} of {megabytes} MiB");
                let is_full = sizes.slots == PoolSizes::PAGES * SLOTS_PER_PAGE;
                assert!(
                    is_full || used * 10 >= budget * 7,
                    "{used} of {megabytes} MiB"
                );
            }
        }
    }

    #[test]
    fn a_budget_that_is_too_small_is_refused() {
        assert!(planner_budget(8 << 20, false, false).is_err());
    }
}
