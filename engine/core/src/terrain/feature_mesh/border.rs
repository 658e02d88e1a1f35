//! The border of a cut: its samples in order around it, and how far the stored ones are off the limit surface.
//!
//! ```text
//!    0 ──▶ W          samples are counted clockwise from the north-west corner;
//!    ▲     │          ring 1, one patch wide, takes the border's offset, less and less towards the inside
//!    └─────▼ W + H
//! ```

use crate::geo::QUAD_SAMPLES;

/// Samples over which the border's offset fades.
const FADE: f64 = QUAD_SAMPLES as f64;

/// The samples on the border of a cut, and their offsets from the limit surface in units.
#[derive(Clone, Debug)]
pub(super) struct Border {
    /// Samples from west to east and from north to south.
    size: [u32; 2],
    offsets: Vec<f64>,
}

impl Border {
    /// A border without offsets.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let count = 2 * (size[0] + size[1]) as usize;
        Self {
            size,
            offsets: vec![0.0; count],
        }
    }

    /// Sets the offset of a sample on the border.
    pub(super) fn set(&mut self, at: [u32; 2], offset: f64) {
        let place = self.place(at);
        self.offsets[place] = offset;
    }

    /// The place of a border sample (column, row) in the ring.
    pub(super) fn place(&self, [x, y]: [u32; 2]) -> usize {
        let [width, height] = self.size;
        let along = if y == 0 {
            x
        } else if x >= width {
            width + y
        } else if y >= height {
            2 * width + height - x
        } else {
            2 * (width + height) - y
        };
        along as usize % self.offsets.len()
    }

    /// The offset along one side, linear between samples: `at` gives the sample of a whole number.
    fn along(&self, place: f64, end: u32, at: impl Fn(u32) -> [u32; 2]) -> f64 {
        let place = place.clamp(0.0, f64::from(end));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to 0..end just before"
        )]
        let first = (place as u32).min(end - 1);
        let share = place - f64::from(first);
        let offset = |sample: u32| self.offsets[self.place(at(sample))];
        offset(first) * (1.0 - share) + offset(first + 1) * share
    }

    /// Units to add at a place of ring 1 (column, row): the border's own on it, nothing at ring 1's inner side, a
    /// bilinear blend of both sides at corners.
    pub(super) fn offset(&self, [x, y]: [f64; 2]) -> f64 {
        let [width, height] = self.size;
        let side = |at: f64, end: u32| {
            let far = f64::from(end) - at;
            let (near, line) = if at <= far { (at, 0) } else { (far, end) };
            (1.0 - near.max(0.0) / FADE, line)
        };
        let ((wx, column), (wy, row)) = (side(x, width), side(y, height));
        let mut sum = 0.0;
        if wx > 0.0 {
            sum += wx * self.along(y, height, |y| [column, y]);
        }
        if wy > 0.0 {
            sum += wy * self.along(x, width, |x| [x, row]);
        }
        if wx > 0.0 && wy > 0.0 {
            sum -= wx * wy * self.offsets[self.place([column, row])];
        }
        sum
    }

    /// Units a column and a row by which the offset slopes.
    pub(super) fn slope(&self, at: [f64; 2]) -> [f64; 2] {
        const STEP: f64 = 0.25;
        [0, 1].map(|axis| {
            let end = f64::from(self.size[axis]);
            let (mut low, mut high) = (at, at);
            low[axis] = (at[axis] - STEP).max(0.0);
            high[axis] = (at[axis] + STEP).min(end);
            (self.offset(high) - self.offset(low)) / (high[axis] - low[axis])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_is_the_borders_on_it_and_nothing_a_patch_inside() {
        let mut border = Border::new([24, 20]);
        let value = |x: u32, y: u32| f64::from(x * 7 % 5) - f64::from(y * 3 % 4);
        let on_border = |x: u32, y: u32| x == 0 || y == 0 || x == 24 || y == 20;
        for (x, y) in (0..=24).flat_map(|x| (0..=20).map(move |y| (x, y))) {
            if on_border(x, y) {
                border.set([x, y], value(x, y));
            }
        }
        for (x, y) in (0..=24).flat_map(|x| (0..=20).map(move |y| (x, y))) {
            let found = border.offset([f64::from(x), f64::from(y)]);
            if on_border(x, y) {
                assert!((found - value(x, y)).abs() < 1e-12, "{x} {y}");
            } else if (4..=20).contains(&x) && (4..=16).contains(&y) {
                assert!(found.abs() < 1e-12, "{x} {y}: {found}");
            }
        }
    }
}
