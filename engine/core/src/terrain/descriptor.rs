//! How a planner works: what its caller may choose, and what follows from the budgets.

use super::PoolSizes;
use crate::{
    pyramid::PyramidError,
    stream::{COLOR_BYTES, CutLimit, Retry, TILE_BYTES},
};

/// How a planner works.
#[derive(Clone, Copy, Debug)]
pub struct PlannerDescriptor {
    /// Bytes of tiles and pictures in RAM, those in use and those under way included.
    pub ram_budget_bytes: u64,
    /// Bytes of GPU memory; see [`PoolSizes::within`].
    pub vram_budget_bytes: u64,
    /// Threads that read.
    pub loader_threads: usize,
    /// Requests under way at once.
    pub in_flight: u32,
    /// Largest screen-space error, pixels.
    pub error_px: f64,
    /// Largest texel of imagery on the screen, pixels.
    pub texel_px: f64,
    /// How much larger errors and texels may be outside the view, as a factor.
    pub outside: f64,
    /// Bytes of tiles and pictures that a plan uploads at most; tables of features go up beside them, one feature's a plan.
    pub upload_budget_bytes: u64,
    /// A plan waits until nothing is missing, and then uploads all that is new whatever the upload budget; for pictures
    /// and tests.
    pub wait_for_tiles: bool,
    /// Every patch takes this depth.
    pub uniform_depth: Option<u32>,
    /// How far ahead of the camera tiles are read while nothing else is, seconds; 0 for never.
    pub prefetch_seconds: f64,
    /// When to try again after a failure.
    pub retry: Retry,
}

impl Default for PlannerDescriptor {
    fn default() -> Self {
        Self {
            ram_budget_bytes: 512 << 20,
            vram_budget_bytes: 512 << 20,
            loader_threads: 2,
            in_flight: 16,
            error_px: 1.0,
            texel_px: 2.0,
            outside: 4.0,
            upload_budget_bytes: 4 << 20,
            wait_for_tiles: false,
            uniform_depth: None,
            prefetch_seconds: 1.0,
            retry: Retry {
                first_millis: 250,
                longest_millis: 30_000,
            },
        }
    }
}

impl PlannerDescriptor {
    /// The least RAM budget, in tiles, beside what is set aside for reads under way.
    pub const MIN_RAM_TILES: u64 = 64;

    /// What of either budget is for features, where the data set has any: an eighth.
    #[must_use]
    pub const fn feature_share(budget_bytes: u64) -> u64 {
        budget_bytes / 8
    }

    /// Pictures that may be under way or wait for a layer: a quarter of RAM at most.
    pub(super) fn color_limit(&self, pool: &PoolSizes) -> usize {
        let most = (self.ram_budget_bytes / 4 / COLOR_BYTES).max(1);
        let wanted = if self.wait_for_tiles {
            pool.color_layers
        } else {
            self.in_flight
        };
        usize::try_from(most)
            .unwrap_or(usize::MAX)
            .min(wanted.min(pool.color_layers) as usize)
    }

    /// How many tiles a cut may take, so that RAM holds them beside all that may be under way, and the pool holds them.
    pub(super) fn cut_limit(
        &self,
        pool: &PoolSizes,
        color_limit: usize,
    ) -> Result<CutLimit, PyramidError> {
        let aside = u64::from(self.in_flight) * TILE_BYTES + color_limit as u64 * COLOR_BYTES;
        let tiles = self.ram_budget_bytes.saturating_sub(aside) / TILE_BYTES;
        let refused = |what: String| Err(PyramidError::Refused(what));
        if tiles < Self::MIN_RAM_TILES {
            let (budget, least) = (
                self.ram_budget_bytes,
                aside + Self::MIN_RAM_TILES * TILE_BYTES,
            );
            return refused(format!(
                "a RAM budget of {budget} bytes is too small: at least {least} are needed"
            ));
        }
        if self.upload_budget_bytes < TILE_BYTES + COLOR_BYTES {
            let (budget, least) = (self.upload_budget_bytes, TILE_BYTES + COLOR_BYTES);
            return refused(format!(
                "an upload budget of {budget} bytes is too small: at least {least} are needed"
            ));
        }
        if self.in_flight < 2 || !is_positive(self.error_px) || !is_positive(self.texel_px) {
            return refused(
                "at least two requests in flight and positive pixel targets are needed".into(),
            );
        }
        let nodes = usize::try_from(tiles)
            .unwrap_or(usize::MAX)
            .min(pool.slots as usize);
        Ok(CutLimit {
            nodes,
            leaves: pool.max_drawn as usize,
        })
    }
}

fn is_positive(number: f64) -> bool {
    number > 0.0
}
