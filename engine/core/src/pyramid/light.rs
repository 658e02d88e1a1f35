//! Stored colours as linear light and back: means and mixtures are taken of light, never of stored values.
//!
//! Beside the builder, which makes coarser imagery, and the loader, which makes mip levels of it. Knows one channel
//! of eight bits at a time.

use std::sync::LazyLock;

/// Linear light of each stored value, 0 to 1 (sRGB, IEC 61966-2-1).
pub(crate) static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    let mut table = [0.0; 256];
    for (value, light) in (0_u8..=255).zip(&mut table) {
        let value = f64::from(value) / 255.0;
        let linear = if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "eight bits are kept in the end"
        )]
        let linear = linear as f32;
        *light = linear;
    }
    table
});

/// Steps in which stored values are looked up: finer than any two of them are apart (1 / 3295 near black).
const STEPS: usize = 4096;

/// For every step of light the least stored value that is nearest to some light of it, and for every value the least
/// light to which the next one is nearer. So that within a step at most one value follows.
static NEAREST: LazyLock<([u8; STEPS], [f32; 256])> = LazyLock::new(|| {
    let mut limits = [f32::INFINITY; 256];
    for (below, limit) in limits[..255].iter_mut().enumerate() {
        // Floats of one sign are in the order of their bits.
        let (mut low, mut high) = (LINEAR[below].to_bits(), LINEAR[below + 1].to_bits());
        while high - low > 1 {
            let middle = low.midpoint(high);
            let light = f32::from_bits(middle);
            if light - LINEAR[below] < LINEAR[below + 1] - light {
                low = middle;
            } else {
                high = middle;
            }
        }
        *limit = f32::from_bits(high);
    }
    let mut values = [0; STEPS];
    for (step, value) in values.iter_mut().enumerate() {
        // The product that finds the step is rounded, by less than this.
        let light = step as f32 / (STEPS - 1) as f32 * (1.0 - 4.0 * f32::EPSILON);
        let nearest = limits.partition_point(|limit| *limit <= light);
        *value = u8::try_from(nearest).unwrap_or(u8::MAX);
    }
    (values, limits)
});

/// The stored value whose light is nearest.
pub(crate) fn encode(light: f32) -> u8 {
    let (values, limits) = &*NEAREST;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "less than 0 becomes 0"
    )]
    let step = (light * (STEPS - 1) as f32) as usize;
    let value = values[step.min(STEPS - 1)];
    value + u8::from(light >= limits[usize::from(value)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stored_value_survives_linear_light() {
        assert!((0..=255_u8).all(|value| encode(LINEAR[usize::from(value)]) == value));
    }

    #[test]
    fn every_light_becomes_the_value_it_is_nearest_to() {
        for step in 0..=300_000_u32 {
            let light = f64::from(step) / 300_000.0;
            #[expect(clippy::cast_possible_truncation, reason = "a test's light")]
            let value = encode(light as f32);
            let far = |value: u8| (f64::from(LINEAR[usize::from(value)]) - light).abs();
            for other in [value.saturating_sub(1), value.saturating_add(1)] {
                assert!(far(value) <= far(other) + 1e-7, "{light} is not {value}");
            }
        }
    }

    #[test]
    fn light_out_of_range_becomes_black_or_white() {
        assert_eq!([encode(-0.5), encode(1.5)], [0, 255]);
    }
}
