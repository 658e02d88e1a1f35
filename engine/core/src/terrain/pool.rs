//! How a budget of GPU memory is divided.

use crate::{
    geo::PATCH_COUNT,
    pyramid::PyramidError,
    reference::shared::{DrawnTile, SLOT_WORDS, SLOTS_PER_PAGE},
    stream::COLOR_BYTES,
};

/// What the GPU's buffers hold; whoever makes them makes them of these sizes, once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolSizes {
    /// Slots of the tile pool.
    pub slots: u32,
    /// Layers of the colour pool; 0 without imagery.
    pub color_layers: u32,
    /// Tiles of the drawn list.
    pub max_drawn: u32,
    /// Indices of the emitted list.
    pub index_capacity: u32,
}

impl PoolSizes {
    /// Pages bound at once.
    pub const PAGES: u32 = 4;
    /// Layers a texture array has under WebGPU's default limits.
    pub const MAX_COLOR_LAYERS: u32 = 256;
    /// Indices that a drawn tile never exceeds with all its patches at depth 0: two triangles a patch, one more for
    /// every half of a border cell that is split towards a finer neighbour, and the skirts.
    pub const INDICES_PER_TILE: u32 = 9_216;
    /// The least number of slots.
    pub const MIN_SLOTS: u32 = 64;
    const MAX_INDEX_BYTES: u64 = 128 << 20;
    const SLOT_BYTES: u64 = 4 * SLOT_WORDS as u64;
    /// Per drawn tile: its struct and three words a patch.
    const DRAWN_BYTES: u64 = size_of::<DrawnTile>() as u64 + 3 * 4 * PATCH_COUNT as u64;

    /// Divides a budget: a quarter for indices and, where there is imagery, a quarter for it, each up to its limit; the
    /// rest for tiles.
    ///
    /// # Errors
    ///
    /// When not even [`PoolSizes::MIN_SLOTS`] fit.
    pub fn within(vram_budget_bytes: u64, has_imagery: bool) -> Result<Self, PyramidError> {
        let quarter = vram_budget_bytes / 4;
        let index_bytes = quarter.min(Self::MAX_INDEX_BYTES);
        let layers = if has_imagery {
            (quarter / COLOR_BYTES).min(u64::from(Self::MAX_COLOR_LAYERS))
        } else {
            0
        };
        let rest = vram_budget_bytes - index_bytes - layers * COLOR_BYTES;
        let slots = rest / (Self::SLOT_BYTES + Self::DRAWN_BYTES);
        let slots = slots.min(u64::from(Self::PAGES * SLOTS_PER_PAGE));
        if slots < u64::from(Self::MIN_SLOTS) {
            let least = 2 * u64::from(Self::MIN_SLOTS) * (Self::SLOT_BYTES + Self::DRAWN_BYTES);
            return Err(PyramidError::Refused(format!(
                "a VRAM budget of {vram_budget_bytes} bytes is too small: at least {least} are needed"
            )));
        }
        let small = |number: u64| u32::try_from(number).unwrap_or(u32::MAX);
        let index_capacity = small(index_bytes / 4);
        Ok(Self {
            slots: small(slots),
            color_layers: small(layers),
            max_drawn: small(slots).min(index_capacity / Self::INDICES_PER_TILE),
            index_capacity,
        })
    }

    /// Bytes of GPU memory in all; what a renderer needs besides (staging, uniforms, targets) is its own to count.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        u64::from(self.slots) * (Self::SLOT_BYTES + Self::DRAWN_BYTES)
            + u64::from(self.color_layers) * COLOR_BYTES
            + 4 * u64::from(self.index_capacity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_division_stays_within_the_budget() {
        for megabytes in [32, 64, 200, 256, 512, 1000, 4000] {
            for has_imagery in [false, true] {
                let sizes = PoolSizes::within(megabytes << 20, has_imagery).unwrap();
                assert!(sizes.byte_count() <= megabytes << 20);
                assert!(sizes.max_drawn * PoolSizes::INDICES_PER_TILE <= sizes.index_capacity);
                assert_eq!(sizes.color_layers > 0, has_imagery);
            }
        }
        assert!(PoolSizes::within(8 << 20, false).is_err());
    }
}
