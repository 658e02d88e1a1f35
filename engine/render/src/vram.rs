//! How a VRAM budget is shared out: pages of tiles, imagery, lists, and what goes up in a frame.
//!
//! Everything is sized once, from the budget alone, so that no frame makes a buffer larger. Pure arithmetic.

use drumlin_core::reference::shared::{DrawnTile, Frame, SLOT_WORDS, SLOTS_PER_PAGE};

use crate::RenderError;

/// Pages a terrain may have; all are bound at once.
pub(crate) const PAGE_COUNT: u32 = 4;
/// Bytes of a slot: one decoded tile.
pub(crate) const SLOT_BYTES: u64 = SLOT_WORDS as u64 * 4;
/// Bytes of a layer of imagery: 256 × 256 RGBA.
pub(crate) const LAYER_BYTES: u64 = 256 * 256 * 4;
/// Layers of the imagery array, at most: WebGPU's default limit.
pub(crate) const LAYERS_MAX: u32 = 256;
/// Indices a tile takes at most when every patch is at depth 0: 1,024 patches of 2 triangles, 124 of them on borders
/// with up to 8, and 128 skirt quads; rounded up. A list of this many a tile can never overflow.
pub(crate) const INDICES_PER_TILE: u64 = 10_240;
/// Longest index list: one storage binding of WebGPU's default limits.
const INDEX_BYTES_MAX: u64 = 128 << 20;
/// Tiles put up in one frame.
pub(crate) const UPLOADS_PER_FRAME: u32 = 16;
/// Bytes of a tile on its way up: header, controls, codes, voids and patch errors in words, rounded up.
pub(crate) const UPLOAD_BYTES: u64 = 76 << 10;
/// Uniforms, arguments, counters and their way back.
const FIXED_BYTES: u64 = 16 << 10;
/// Bytes a drawn tile takes in the lists beside its indices: itself, and three words
/// for each of its 1,024 patches.
const DRAWN_BYTES: u64 = size_of::<DrawnTile>() as u64 + 3 * 4096;
/// Least tiles a view can be drawn with: a root and a cut a few levels deep.
const SLOTS_MIN: u64 = 64;

/// What a budget buys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VramPlan {
    /// Slots of the pool.
    pub(crate) slots: u32,
    /// Layers of the imagery array; 0 without imagery.
    pub(crate) layers: u32,
    /// Tiles the drawn list holds.
    pub(crate) drawn: u32,
    /// Indices the emitted list holds.
    pub(crate) indices: u32,
}

impl VramPlan {
    /// Shares out a budget: an eighth for indices, an eighth for imagery where there is any, the rest for tiles.
    pub(crate) fn new(budget_bytes: u64, imagery: bool) -> Result<Self, RenderError> {
        let least = Self::least(imagery);
        if budget_bytes < least.byte_count() {
            return Err(RenderError::BudgetTooSmall {
                budget_bytes,
                needed_bytes: least.byte_count(),
            });
        }
        let eighth = budget_bytes / 8;
        let indices = (eighth.min(INDEX_BYTES_MAX) / 4).max(u64::from(least.indices));
        let layers = if imagery {
            (eighth / LAYER_BYTES).clamp(least.layers.into(), LAYERS_MAX.into())
        } else {
            0
        };
        let drawn = indices / INDICES_PER_TILE;
        let plan = Self {
            slots: 0,
            layers: small(layers),
            drawn: small(drawn),
            indices: small(indices),
        };
        let rest = budget_bytes - plan.byte_count();
        let slots = (rest / SLOT_BYTES).min(u64::from(PAGE_COUNT * SLOTS_PER_PAGE));
        Ok(Self {
            slots: small(slots),
            drawn: small(drawn.min(slots)),
            ..plan
        })
    }

    /// Bytes of all that the plan names, and of what every terrain needs besides.
    pub(crate) fn byte_count(&self) -> u64 {
        u64::from(self.slots) * SLOT_BYTES
            + u64::from(self.layers.max(1)) * LAYER_BYTES
            + u64::from(self.drawn) * DRAWN_BYTES
            + u64::from(self.indices) * 4
            + 2 * u64::from(UPLOADS_PER_FRAME) * UPLOAD_BYTES
            + size_of::<Frame>() as u64
            + FIXED_BYTES
    }

    fn least(imagery: bool) -> Self {
        let indices = SLOTS_MIN * INDICES_PER_TILE;
        let drawn = small(SLOTS_MIN);
        Self {
            slots: drawn,
            layers: if imagery { 16 } else { 0 },
            drawn,
            indices: small(indices),
        }
    }
}

/// Every count here is limited far below 2³² by its caller.
fn small(count: u64) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_never_passes_its_budget_and_wastes_less_than_a_slot_of_a_small_one() {
        for megabytes in [20_u64, 32, 64, 100, 128, 256, 400, 512, 1024, 4096] {
            for imagery in [false, true] {
                let budget = megabytes << 20;
                let plan = VramPlan::new(budget, imagery).expect("enough");
                assert!(plan.byte_count() <= budget, "{plan:?} of {megabytes} MiB");
                let full = plan.slots == PAGE_COUNT * SLOTS_PER_PAGE;
                let spare = budget - plan.byte_count();
                let returned = u64::from(plan.indices / 10_240 - plan.drawn) * DRAWN_BYTES;
                assert!(
                    full || spare < SLOT_BYTES + returned,
                    "{spare} spare of {megabytes} MiB"
                );
            }
        }
    }

    #[test]
    fn the_index_list_holds_every_drawn_tile_at_depth_0() {
        for megabytes in [20_u64, 64, 256, 4096] {
            let plan = VramPlan::new(megabytes << 20, true).expect("enough");
            assert!(u64::from(plan.indices) >= u64::from(plan.drawn) * INDICES_PER_TILE);
            assert!(plan.drawn <= plan.slots);
            assert!(u64::from(plan.indices) * 4 <= INDEX_BYTES_MAX);
        }
    }

    #[test]
    fn a_budget_below_the_least_says_what_the_least_is() {
        let error = VramPlan::new(1 << 20, false).expect_err("too small");
        let RenderError::BudgetTooSmall { needed_bytes, .. } = error else {
            panic!("{error}")
        };
        assert!(VramPlan::new(needed_bytes, false).is_ok());
        assert!(VramPlan::new(needed_bytes - 1, false).is_err());
    }
}
