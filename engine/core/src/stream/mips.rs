//! Imagery as it is drawn: a tile's texels with premultiplied alpha, and all mip levels.
//!
//! Made by a loader thread from what the source hands out, so that neither planning nor drawing spends time on it. Knows
//! texels; knows neither where they lie nor who draws them.
//!
//! Seen aslant a tile's texels lie closer than pixels, far more so in one direction than in the other, which no choice of
//! level can mend: hence the mip levels. Every texel of one is the mean of four, so that texel i of a level of n
//! covers the share i / n to (i + 1) / n of the texels. Tiles share their outermost texels, and where a level's
//! texel is about a pixel wide its outermost ones differ from the neighbour's as two pixels side by side do: no seam.
//!
//! Alpha is premultiplied, in linear light, for then a filter may mix texels with ground that has no picture.

use std::sync::Arc;

use crate::pyramid::{
    COLOR_TEXELS,
    light::{LINEAR, encode},
};

/// Texels of all mip levels: 256², 128², … 1.
const TEXEL_COUNT: usize = 87_381;

/// Bytes of all mip levels, four a texel.
pub const COLOR_BYTES: u64 = 4 * TEXEL_COUNT as u64;

/// Red, green and blue as linear light times alpha, and alpha, 0 to 1.
type Light = [f32; 4];

/// Red, green, blue (sRGB of premultiplied light) and alpha of every mip level, the largest first, row by row; none unless
/// there are 256 × 256 texels (of straight alpha).
#[must_use]
pub fn mip_chain(straight: &[u8]) -> Option<Arc<[u8]>> {
    let (texels, rest) = straight.as_chunks::<4>();
    if texels.len() != COLOR_TEXELS * COLOR_TEXELS || !rest.is_empty() {
        return None;
    }
    let mut bytes = Vec::with_capacity(4 * TEXEL_COUNT);
    bytes.extend(texels.iter().flat_map(premultiplied));
    let mut lights: Vec<Light> = texels.iter().map(light).collect();
    let mut side = COLOR_TEXELS;
    while side > 1 {
        lights = halved(&lights, side);
        side /= 2;
        bytes.extend(lights.iter().flat_map(stored));
    }
    Some(bytes.into())
}

fn light(&[r, g, b, alpha]: &[u8; 4]) -> Light {
    let share = f32::from(alpha) / 255.0;
    let [r, g, b] = [r, g, b].map(|value| LINEAR[usize::from(value)] * share);
    [r, g, b, share]
}

/// The texel with premultiplied alpha; nearly all are opaque and stay as they are.
fn premultiplied(texel: &[u8; 4]) -> [u8; 4] {
    if texel[3] == u8::MAX {
        *texel
    } else {
        stored(&light(texel))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of 255"
)]
fn stored(&[r, g, b, alpha]: &Light) -> [u8; 4] {
    let [r, g, b] = [r, g, b].map(encode);
    [r, g, b, (alpha * 255.0).round() as u8]
}

/// Half the side: each texel the mean of four.
fn halved(lights: &[Light], side: usize) -> Vec<Light> {
    let half = side / 2;
    let mean = |at: usize| {
        let first = at / half * 2 * side + at % half * 2;
        let four = [first, first + 1, first + side, first + side + 1].map(|at| lights[at]);
        std::array::from_fn(|channel| four.iter().map(|light| light[channel]).sum::<f32>() / 4.0)
    };
    (0..half * half).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(color: impl Fn(usize, usize) -> [u8; 4]) -> Vec<[u8; 4]> {
        let side = COLOR_TEXELS;
        let texels: Vec<u8> = (0..side * side)
            .flat_map(|at| color(at / side, at % side))
            .collect();
        mip_chain(&texels).unwrap().as_chunks().0.to_vec()
    }

    #[test]
    fn one_colour_is_that_colour_at_all_levels() {
        let texels = of(|_, _| [10, 100, 250, 255]);
        assert_eq!(texels.len(), TEXEL_COUNT);
        assert!(texels.iter().all(|texel| *texel == [10, 100, 250, 255]));
    }

    #[test]
    fn black_and_white_mix_to_half_the_light() {
        let texels = of(|row, column| {
            let value = if (row + column) % 2 == 0 { 255 } else { 0 };
            [value, value, value, 255]
        });
        // Half the light is stored as 188 (IEC 61966-2-1).
        let smaller = &texels[COLOR_TEXELS * COLOR_TEXELS..];
        assert!(smaller.iter().all(|texel| *texel == [188, 188, 188, 255]));
    }

    #[test]
    fn what_is_clear_weighs_nothing() {
        let texels = of(|_, column| {
            if column < 128 {
                [200, 40, 90, 255]
            } else {
                [255, 255, 255, 0]
            }
        });
        assert_eq!(texels[255], [0; 4]);
        // The last level: half of it is clear, so half the light is left and none of the clear texels' white.
        let last = texels[TEXEL_COUNT - 1];
        let half = [200, 40, 90].map(|value: usize| encode(LINEAR[value] / 2.0));
        assert_eq!(last, [half[0], half[1], half[2], 128]);
    }

    #[test]
    fn anything_but_a_whole_tile_is_no_picture() {
        assert!(mip_chain(&[0; 4 * 255 * 256]).is_none());
        assert!(mip_chain(&[0; 4 * 256 * 256 + 1]).is_none());
    }
}
