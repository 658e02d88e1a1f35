//! Out of budget is a normal state: the pixel target rises until the cut fits, and comes back slowly.

use super::View;
use crate::geo::{CAGE_CONTROL_COUNT, PATCH_COUNT, TILE_SAMPLE_COUNT};
use crate::pyramid::Tile;

/// The most bytes a tile takes in RAM: what is set aside for one that is being read.
pub const TILE_BYTES: u64 = (size_of::<Tile>()
    + 4 * (CAGE_CONTROL_COUNT + TILE_SAMPLE_COUNT)
    + PATCH_COUNT
    + TILE_SAMPLE_COUNT.div_ceil(8)) as u64;

/// How far the pixel target is raised, as a factor of at least 1.
///
/// It rises at once, because budgets are hard, by steps of an eighth. It falls by a hundredth a plan, only while the
/// cut takes less than [`Relaxation::COMFORT`] of the limit, not soon after it rose, and never again for a view that
/// has already refused it: a camera at rest sees a picture at rest.
#[derive(Clone, Copy, Debug)]
pub struct Relaxation {
    factor: f64,
    rest: u32,
    refused: bool,
    last: Option<View>,
}

impl Default for Relaxation {
    fn default() -> Self {
        Self {
            factor: 1.0,
            rest: 0,
            refused: false,
            last: None,
        }
    }
}

impl Relaxation {
    /// The share of the limit under which the target may fall.
    pub const COMFORT: f64 = 0.85;
    /// Plans it waits after it rose.
    const REST: u32 = 30;

    /// The factor.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Once a plan, before the cut: `fill` is the share of the limit the last cut took.
    pub fn begin(&mut self, view: &View, fill: f64) {
        let still = self.last.is_some_and(|last| {
            View {
                time: view.time,
                ..last
            } == *view
        });
        self.last = Some(*view);
        self.refused &= still;
        self.rest = self.rest.saturating_sub(1);
        if self.factor > 1.0 && fill < Self::COMFORT && self.rest == 0 && !self.refused {
            self.factor = (self.factor * 0.99).max(1.0);
        }
    }

    /// The cut did not fit.
    pub fn rise(&mut self) {
        self.factor *= 1.125;
        self.rest = Self::REST;
        self.refused = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_back_slowly_and_a_still_camera_sees_no_change() {
        let mut view = View::looking_at([0.0; 3], [1.0, 0.0, 0.0], 1.0, [64, 64]);
        let mut relaxation = Relaxation::default();
        relaxation.begin(&view, 0.5);
        relaxation.rise();
        let raised = relaxation.factor();
        for _ in 0..100 {
            relaxation.begin(&view, 0.5);
        }
        assert_eq!(relaxation.factor(), raised);
        for step in 0..100 {
            view.eye[0] = f64::from(step);
            let before = relaxation.factor();
            relaxation.begin(&view, 0.5);
            assert!(relaxation.factor() > 0.98 * before);
        }
        assert_eq!(relaxation.factor(), 1.0);
    }

    #[test]
    fn a_tile_is_about_75_kilobytes() {
        assert!((70_000..80_000).contains(&TILE_BYTES));
    }
}
