//! Noise on an endless lattice, of sums, products and square roots alone: the same bits on every machine.
//!
//! Based on: K. Perlin, "Improving noise", 2002 (the quintic fade); the gradients are hashed, not from a table.

/// A hash of a lattice point: every bit of the seed and of both numbers changes about half of its bits.
///
/// Based on: C. Wellons, "Prospecting for hash functions", 2018 (`lowbias32`).
pub(super) const fn hash(seed: u32, column: u32, row: u32) -> u32 {
    let point = column.wrapping_mul(0x9E37_79B1) ^ row.wrapping_mul(0x85EB_CA77).rotate_left(15);
    let mut bits = seed ^ point;
    bits ^= bits >> 16;
    bits = bits.wrapping_mul(0x7FEB_352D);
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x846C_A68B);
    bits ^ (bits >> 16)
}

/// A place in a cell of the lattice, with the weights of the cell's far column and row.
struct Cell {
    corner: [u32; 2],
    at: [f64; 2],
    fade: [f64; 2],
}

impl Cell {
    fn of(place: [f64; 2]) -> Self {
        let floor = place.map(f64::floor);
        let at = [place[0] - floor[0], place[1] - floor[1]];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the lattice repeats every 2^32 cells"
        )]
        let corner = floor.map(|cell| cell as i64 as u32);
        let fade = at.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
        Self { corner, at, fade }
    }

    /// A vector of numbers in -1 to 1 that belongs to a corner: 0 north-west, 1 north-east, 2 south-west, 3 south-east.
    fn vector(&self, seed: u32, corner: u32) -> [f64; 2] {
        let [column, row] = self.corner;
        let bits = hash(
            seed,
            column.wrapping_add(corner & 1),
            row.wrapping_add(corner >> 1),
        );
        [bits & 0xFFFF, bits >> 16].map(|half| f64::from(half) / 32_767.5 - 1.0)
    }

    /// The place as seen from a corner.
    fn seen_from(&self, corner: u32) -> [f64; 2] {
        [
            self.at[0] - f64::from(corner & 1),
            self.at[1] - f64::from(corner >> 1),
        ]
    }
}

/// Gradient noise and its slopes: values within about -1 to 1, features the size of a cell.
pub(super) fn gradient_noise(seed: u32, place: [f64; 2]) -> (f64, [f64; 2]) {
    let cell = Cell::of(place);
    let gradients = [0, 1, 2, 3].map(|corner| cell.vector(seed, corner));
    let ramp = |corner: u32| {
        let [x, y] = cell.seen_from(corner);
        let [gx, gy] = gradients[corner as usize];
        gx * x + gy * y
    };
    let [a, b, c, d] = [ramp(0), ramp(1), ramp(2), ramp(3)];
    let [u, v] = cell.fade;
    let [du, dv] = cell.at.map(|t| 30.0 * t * t * (t * (t - 2.0) + 1.0));
    let twist = a - b - c + d;
    let [nw, ne, sw, se] = gradients;
    let mixed = |axis: usize| {
        nw[axis]
            + u * (ne[axis] - nw[axis])
            + v * (sw[axis] - nw[axis])
            + u * v * (nw[axis] - ne[axis] - sw[axis] + se[axis])
    };
    (
        a + u * (b - a) + v * (c - a) + u * v * twist,
        [
            mixed(0) + du * (b - a + v * twist),
            mixed(1) + dv * (c - a + u * twist),
        ],
    )
}

/// Waves of one cell's length across the unit vector's direction, their phase from corner to corner at random: the
/// value, -1 to 1, and its slope in that direction.
///
/// The wave is a quartic that looks like a cosine: no library's cosine is the same everywhere.
pub(super) fn wave_noise(seed: u32, place: [f64; 2], across: [f64; 2]) -> (f64, f64) {
    let cell = Cell::of(place);
    let [u, v] = cell.fade;
    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let (mut value, mut slope) = (0.0, 0.0);
    for (corner, weight) in (0..).zip(weights) {
        let [x, y] = cell.seen_from(corner);
        let [jx, jy] = cell.vector(seed, corner);
        let phase = (x + 0.5 * jx) * across[0] + (y + 0.5 * jy) * across[1];
        let phase = phase - (phase + 0.5).floor();
        let hump = 1.0 - 4.0 * phase * phase;
        value += weight * (2.0 * hump * hump - 1.0);
        slope -= weight * 32.0 * phase * hump;
    }
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_continuous_over_cells_and_its_slopes_are_those_of_its_values() {
        let step = 1e-6;
        for (x, y) in [(0.3, 0.7), (-2.0, 5.5), (1e6 + 0.25, -3.0), (0.0, 0.0)] {
            let value = |x: f64, y: f64| gradient_noise(7, [x, y]).0;
            let (_, slopes) = gradient_noise(7, [x, y]);
            let differences = [
                (value(x + step, y) - value(x - step, y)) / (2.0 * step),
                (value(x, y + step) - value(x, y - step)) / (2.0 * step),
            ];
            for (slope, difference) in slopes.iter().zip(differences) {
                // Places near 10⁶ are known to 1e-10, which a step of 1e-6 makes 1e-4.
                assert!((slope - difference).abs() < 2e-4, "{slope} {difference}");
            }
        }
    }

    #[test]
    fn waves_stay_within_their_bounds_and_differ_from_seed_to_seed() {
        let places = (0..1000).map(|i| [f64::from(i) * 0.37, f64::from(i) * 0.11 - 40.0]);
        let mut differ = 0;
        for place in places {
            let (value, _) = wave_noise(1, place, [0.6, 0.8]);
            assert!((-1.0..=1.0).contains(&value), "{value}");
            differ += usize::from((value - wave_noise(2, place, [0.6, 0.8]).0).abs() > 0.01);
        }
        assert!(differ > 900, "{differ}");
    }
}
