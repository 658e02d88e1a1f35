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

/// The stored value whose light is nearest.
pub(crate) fn encode(light: f32) -> u8 {
    let above = LINEAR.partition_point(|linear| *linear < light).min(255);
    let below = above.saturating_sub(1);
    let nearest = if light - LINEAR[below] < LINEAR[above] - light {
        below
    } else {
        above
    };
    u8::try_from(nearest).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stored_value_survives_linear_light() {
        assert!((0..=255_u8).all(|value| encode(LINEAR[usize::from(value)]) == value));
    }

    #[test]
    fn light_out_of_range_becomes_black_or_white() {
        assert_eq!([encode(-0.5), encode(1.5)], [0, 255]);
    }
}
