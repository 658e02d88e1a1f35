//! The nibble that stores a patch's error at a depth.
//!
//! Nibble n says the error is at most max(δ, u) · 2^(n/2), in half octaves above the tile's own error; 15 says that
//! depth is never fine enough. Low nibble of a byte: depth 0; high nibble: depth 1.

/// The nibble of a depth that never suffices.
pub const NEVER: u8 = 15;

/// 2^(n/2), the odd ones rounded to the nearest f32; kernels and references multiply by the same numbers.
pub const HALF_OCTAVES: [f32; 15] = [
    1.0,
    1.414_213_5,
    2.0,
    2.828_427,
    4.0,
    5.656_854,
    8.0,
    11.313_708,
    16.0,
    22.627_417,
    32.0,
    45.254_833,
    64.0,
    90.509_67,
    128.0,
];

/// The error bound in metres that a nibble states, given max(δ, u) of its tile; infinite for [`NEVER`].
#[must_use]
pub fn patch_error(nibble: u8, base: f32) -> f32 {
    HALF_OCTAVES
        .get(usize::from(nibble))
        .map_or(f32::INFINITY, |factor| base * factor)
}

/// The least nibble whose bound is no less than an error in metres, given max(δ, u) of its tile.
#[must_use]
pub fn patch_nibble(error: f64, base: f32) -> u8 {
    (0..NEVER)
        .find(|nibble| f64::from(patch_error(*nibble, base)) >= error)
        .unwrap_or(NEVER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stated_bound_is_never_below_the_error_and_within_half_an_octave() {
        for base in [0.0625_f32, 1.0, 3.7, 812.5] {
            for step in 1..2000 {
                let error = f64::from(base) * f64::from(step) * 0.05;
                let bound = f64::from(patch_error(patch_nibble(error, base), base));
                assert!(
                    bound >= error && (bound <= error * 1.4143 || bound <= f64::from(base)),
                    "{error} {bound}"
                );
            }
        }
        assert_eq!(patch_nibble(0.0, 1.0), 0);
        assert_eq!(patch_nibble(128.5, 1.0), NEVER);
    }

    #[test]
    fn factors_are_half_octaves() {
        for (n, factor) in (0..15).zip(HALF_OCTAVES) {
            let exact = (f64::from(n) / 2.0).exp2();
            assert!((f64::from(factor) / exact - 1.0).abs() < 6.0e-8, "{n}");
        }
    }
}
