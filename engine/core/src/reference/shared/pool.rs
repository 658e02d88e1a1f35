//! The pool that holds decoded tiles: pages of slots, a slot a tile.
//!
//! Twin: `shaders/shared/pool.wgsl`.

use super::{
    CODES_WORD, CUT_WORD, HEIGHTS_WORD, SLOPES_WORD, SLOT_WORDS, SLOTS_PER_PAGE,
    STRIDE_ERRORS_WORD, VOIDS_WORD,
};

/// The pages, in binding order; unused ones are empty.
pub type Pages<'a> = [&'a [u32]; 4];

/// A word of a slot.
#[must_use]
pub fn pool(pages: &Pages<'_>, slot: u32, word: usize) -> u32 {
    let page = (slot / SLOTS_PER_PAGE) as usize;
    pages[page.min(3)][(slot % SLOTS_PER_PAGE) as usize * SLOT_WORDS + word]
}

/// A sample's height in units.
#[must_use]
pub fn pool_height(pages: &Pages<'_>, slot: u32, sample: u32) -> i32 {
    pool(pages, slot, HEIGHTS_WORD + sample as usize).cast_signed()
}

/// A sample's slopes in metres a metre: towards the east, towards the north.
#[must_use]
pub fn pool_slope(pages: &Pages<'_>, slot: u32, sample: u32) -> [f32; 2] {
    unpack_2x16_float(pool(pages, slot, SLOPES_WORD + sample as usize))
}

/// True when a sample is void.
#[must_use]
pub fn pool_void(pages: &Pages<'_>, slot: u32, sample: u32) -> bool {
    pool(pages, slot, VOIDS_WORD + sample as usize / 32) >> (sample % 32) & 1 != 0
}

/// Metres that stride 4 (depth 0) or stride 2 (depth 1) is off stride 1.
#[must_use]
pub fn pool_stride_error(pages: &Pages<'_>, slot: u32, patch: u32, depth: u32) -> f32 {
    f32::from_bits(pool(
        pages,
        slot,
        STRIDE_ERRORS_WORD + (patch * 2 + depth) as usize,
    ))
}

/// The error code of depth 0 or 1.
#[must_use]
pub fn pool_code(pages: &Pages<'_>, slot: u32, patch: u32, depth: u32) -> u32 {
    pool(pages, slot, CODES_WORD + patch as usize / 4) >> (patch % 4 * 8 + depth * 4) & 15
}

/// True when a feature stands in the place of a patch.
#[must_use]
pub fn pool_cut(pages: &Pages<'_>, slot: u32, patch: u32) -> bool {
    pool(pages, slot, CUT_WORD + patch as usize / 32) >> (patch % 32) & 1 != 0
}

/// WGSL's `pack2x16float`, rounded to nearest even.
#[must_use]
pub fn pack_2x16_float(pair: [f32; 2]) -> u32 {
    u32::from(half_from_float(pair[0])) | u32::from(half_from_float(pair[1])) << 16
}

/// WGSL's `unpack2x16float`.
#[must_use]
pub fn unpack_2x16_float(word: u32) -> [f32; 2] {
    [float_from_half(word & 0xffff), float_from_half(word >> 16)]
}

/// Half precision: 1 bit sign, 5 bits exponent biased by 15, 10 bits fraction.
#[expect(
    clippy::cast_possible_truncation,
    reason = "masked to 16 bits; adding integers below 2^11 is exact"
)]
fn half_from_float(value: f32) -> u16 {
    let sign = (value.to_bits() >> 16 & 0x8000) as u16;
    let size = value.abs();
    if size.is_nan() {
        return sign | 0x7e00;
    }
    if size >= 65_520.0 {
        return sign | 0x7c00;
    }
    if size < 6.103_515_6e-5 {
        // Below 2^-14 the step is 2^-24.
        return sign | (size * 16_777_216.0).round_ties_even() as u16;
    }
    let bits = size.to_bits() - (112 << 23);
    let odd = bits >> 13 & 1;
    sign | ((bits + 0xfff + odd) >> 13) as u16
}

fn float_from_half(bits: u32) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (bits >> 10 & 31, bits & 0x3ff);
    let size = match exponent {
        0 => f32::from_bits(0x3380_0000) * fraction as f32,
        31 if fraction == 0 => f32::INFINITY,
        31 => f32::NAN,
        _ => f32::from_bits((exponent + 112) << 23 | fraction << 13),
    };
    sign * size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_survives_the_way_through_float() {
        for bits in 0..=u16::MAX {
            let value = float_from_half(u32::from(bits));
            if !value.is_nan() {
                assert_eq!(half_from_float(value), bits, "{value}");
            }
        }
    }

    #[test]
    fn halves_round_to_the_nearest() {
        for value in [
            0.1_f32,
            -0.37,
            1.0e-6,
            3.0e-5,
            2.718_281_7,
            1234.5,
            65_519.0,
        ] {
            let back = float_from_half(u32::from(half_from_float(value)));
            assert!(
                (back - value).abs() <= value.abs() / 2048.0 + 3.0e-8,
                "{value} became {back}"
            );
        }
    }
}
