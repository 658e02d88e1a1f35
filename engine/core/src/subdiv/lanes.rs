//! Weighted sums of one list of controls at many places at once.
//!
//! What is summed differs from place to place only in its weights. So places lie side by side in lanes, a control is
//! read once for all lanes of a group, and compilers turn a group's arithmetic into vector instructions:
//!
//! ```text
//!               place  0   1   2   3   4   5   6   7     8   9  …
//!   control 0         w00 w01 w02 w03 w04 w05 w06 w07   w08 w09     group 0: all controls of places 0 to 7,
//!   control 1         w10 w11 …                                     group 1: of places 8 to 15, the last
//!   …                                                               filled up with zeros
//! ```

use super::Real;

/// Places side by side: two vectors of f32, four of f64, on every 64-bit machine.
const LANES: usize = 8;

type Lanes<T> = [T; LANES];

/// Weights of a list of controls at a number of places.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneWeights<T> {
    place_count: usize,
    control_count: usize,
    /// Group by group, control by control.
    weights: Vec<Lanes<T>>,
}

impl<T: Real> LaneWeights<T> {
    /// Of `weight(place, control)`; at least one control.
    #[must_use]
    pub fn new(
        place_count: usize,
        control_count: usize,
        weight: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let control_count = control_count.max(1);
        let groups = place_count.div_ceil(LANES);
        let row = |index: usize| {
            let (group, control) = (index / control_count, index % control_count);
            std::array::from_fn(|lane| {
                let place = group * LANES + lane;
                T::of(if place < place_count {
                    weight(place, control)
                } else {
                    0.0
                })
            })
        };
        Self {
            place_count,
            control_count,
            weights: (0..groups * control_count).map(row).collect(),
        }
    }

    /// Places.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.place_count
    }

    /// Controls each place is a sum of.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.control_count
    }

    /// The sums of `controls` at all places.
    ///
    /// # Panics
    /// When there are fewer controls than weights, or `out` is not one a place.
    #[inline]
    pub fn sum_into(&self, controls: &[[T; 3]], out: &mut [[T; 3]]) {
        let controls = &controls[..self.control_count];
        assert_eq!(out.len(), self.place_count, "one sum a place");
        let groups = self.weights.chunks_exact(self.control_count);
        for (weights, out) in groups.zip(out.chunks_mut(LANES)) {
            let [x, y, z] = group_sums(weights, controls);
            for (lane, out) in out.iter_mut().enumerate() {
                *out = [x[lane], y[lane], z[lane]];
            }
        }
    }
}

#[inline]
fn group_sums<T: Real>(weights: &[Lanes<T>], controls: &[[T; 3]]) -> [Lanes<T>; 3] {
    let [mut x, mut y, mut z] = [[T::default(); LANES]; 3];
    for (weights, control) in weights.iter().zip(controls) {
        for lane in 0..LANES {
            x[lane] = x[lane] + weights[lane] * control[0];
            y[lane] = y[lane] + weights[lane] * control[1];
            z[lane] = z[lane] + weights[lane] * control[2];
        }
    }
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_one_place_after_the_other() {
        let weight = |place: usize, control: usize| (1 + place) as f64 * 0.5 - control as f64;
        let controls: Vec<[f64; 3]> = (0..5).map(|at| [f64::from(at), 1.0, -2.0]).collect();
        for place_count in [1, 7, 8, 9, 16] {
            let weights = LaneWeights::new(place_count, controls.len(), weight);
            let mut sums = vec![[0.0; 3]; place_count];
            weights.sum_into(&controls, &mut sums);
            for (place, sum) in sums.into_iter().enumerate() {
                let terms = controls.iter().enumerate();
                // Small halves: every product and sum is exact.
                let wanted = terms.fold([0.0; 3], |sum, (control, point)| {
                    [0, 1, 2].map(|axis| sum[axis] + weight(place, control) * point[axis])
                });
                assert_eq!(sum, wanted);
            }
        }
    }
}
