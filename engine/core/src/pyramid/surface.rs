//! The tile rule: how cage and residual codes become heights, and back.
//!
//! All numbers are integers in height units, so that neighbours agree to the last bit and the error bound is exact.
//! Knows one tile and its parent's cage; knows no file.
//!
//! ```text
//! parent's controls ─subdivide─▶ prediction ─+ q r─▶ controls ─limit surface─▶ B ─+ R─▶ heights
//! ```
//!
//! Based on: E. Catmull, J. Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", 1978
//! (on a lattice, where their rules are those of the bicubic B-spline).

use crate::geo::{
    CAGE_CONTROL_COUNT, CAGE_CONTROLS, QUAD_SAMPLES, TILE_QUADS, TILE_SAMPLE_COUNT, TILE_SAMPLES,
};

/// Controls of a pyramid are smaller than this, in units: up to here the 32-bit rule of shaders is exact.
pub const CONTROL_LIMIT: i32 = 1 << 25;

/// The cubic B-spline at 0, ¼, ½ and ¾ of a quad, in 384ths.
pub const LIMIT_WEIGHTS: [[i32; 4]; QUAD_SAMPLES] = [
    [64, 256, 64, 0],
    [27, 235, 121, 1],
    [8, 184, 184, 8],
    [1, 121, 235, 27],
];

/// The weights of a sample sum to this: 384².
const WEIGHT_SUM: i32 = 147_456;

/// Subdivides a lattice of `side`² controls once: (k + 3)² controls become (2k + 3)², rounded half up.
///
/// # Panics
///
/// Where `controls` is not `side`² long or `side` is under 3.
#[must_use]
pub fn subdivide(controls: &[i32], side: usize) -> Vec<i32> {
    assert!(
        side >= 3 && controls.len() == side * side,
        "a lattice of {side} x {side} controls"
    );
    let fine = 2 * side - 3;
    subdivide_window(controls, side, [0, 0], [fine, fine])
}

/// What a parent's 35 × 35 controls predict for the child in a quadrant: 35 × 35 controls.
///
/// # Panics
///
/// Where `parent` is not 35 × 35 long or there is no such quadrant.
#[must_use]
pub fn child_window(parent: &[i32], quadrant: u32) -> Vec<i32> {
    assert!(
        parent.len() == CAGE_CONTROL_COUNT && quadrant < 4,
        "a cage and a quadrant"
    );
    let first = [quadrant / 2, quadrant % 2].map(|half| half as usize * TILE_QUADS);
    subdivide_window(parent, CAGE_CONTROLS, first, [CAGE_CONTROLS, CAGE_CONTROLS])
}

/// The controls of a tile from its stored codes: prediction + q r.
///
/// Wraps where numbers are absurd; whoever reads files checks against [`CONTROL_LIMIT`].
///
/// # Panics
///
/// Where `parent` or `codes` are not 35 × 35 long.
#[must_use]
pub fn decode_controls(parent: &[i32], quadrant: u32, codes: &[i32], step: i32) -> Vec<i32> {
    assert_eq!(codes.len(), CAGE_CONTROL_COUNT, "a cage");
    let mut controls = child_window(parent, quadrant);
    for (control, code) in controls.iter_mut().zip(codes) {
        *control = control.wrapping_add(code.wrapping_mul(step));
    }
    controls
}

/// The codes whose controls come nearest to the wanted ones; [`decode_controls`] turns them back.
///
/// Neighbours that want equal controls and have parents with equal controls get equal codes.
///
/// # Panics
///
/// Where `wanted` or `parent` are not 35 × 35 long.
#[must_use]
pub fn encode_controls(wanted: &[i32], parent: &[i32], quadrant: u32, step: i32) -> Vec<i32> {
    assert_eq!(wanted.len(), CAGE_CONTROL_COUNT, "a cage");
    let prediction = child_window(parent, quadrant);
    wanted
        .iter()
        .zip(&prediction)
        .map(|(wanted, predicted)| nearest_code(wanted - predicted, step))
        .collect()
}

/// The controls of a key tile from its codes: K = q k, where k is the code plus the median of west, north and
/// west + north − north-west, all 0 past the edge.
///
/// No parent is needed. Wraps where numbers are absurd.
///
/// Based on: M. Weinberger, G. Seroussi, G. Sapiro, "The LOCO-I lossless image compression algorithm", 2000.
///
/// # Panics
///
/// Where `codes` is not 35 × 35 long.
#[must_use]
pub fn decode_key_controls(codes: &[i32], step: i32) -> Vec<i32> {
    assert_eq!(codes.len(), CAGE_CONTROL_COUNT, "a cage");
    let mut whole = vec![0_i32; CAGE_CONTROL_COUNT];
    for (at, code) in codes.iter().enumerate() {
        whole[at] = code.wrapping_add(predict_key(&whole, at));
    }
    whole.iter_mut().for_each(|k| *k = k.wrapping_mul(step));
    whole
}

/// The codes whose controls come nearest to the wanted ones; [`decode_key_controls`] turns them back.
///
/// # Panics
///
/// Where `wanted` is not 35 × 35 long.
#[must_use]
pub fn encode_key_controls(wanted: &[i32], step: i32) -> Vec<i32> {
    assert_eq!(wanted.len(), CAGE_CONTROL_COUNT, "a cage");
    let whole: Vec<i32> = wanted
        .iter()
        .map(|control| nearest_code(*control, step))
        .collect();
    whole
        .iter()
        .enumerate()
        .map(|(at, k)| k - predict_key(&whole, at))
        .collect()
}

/// What a key tile's controls before place `at` say of the one there.
fn predict_key(whole: &[i32], at: usize) -> i32 {
    let (row, column) = (at / CAGE_CONTROLS, at % CAGE_CONTROLS);
    let west = if column > 0 { whole[at - 1] } else { 0 };
    let north = if row > 0 {
        whole[at - CAGE_CONTROLS]
    } else {
        0
    };
    let corner = if row > 0 && column > 0 {
        whole[at - CAGE_CONTROLS - 1]
    } else {
        0
    };
    west.wrapping_add(north)
        .wrapping_sub(corner)
        .clamp(west.min(north), west.max(north))
}

/// The limit surface at a tile's samples: 129 × 129 heights B, rounded half up.
///
/// # Panics
///
/// Where `controls` is not 35 × 35 long.
#[must_use]
pub fn base_heights(controls: &[i32]) -> Vec<i32> {
    assert_eq!(controls.len(), CAGE_CONTROL_COUNT, "a cage");
    // A row of zeros past the end, for the last samples' fourth control, which has no weight.
    let mut lattice = [0.0; (CAGE_CONTROLS + 1) * CAGE_CONTROLS];
    for (place, &control) in lattice.iter_mut().zip(controls) {
        *place = f64::from(control);
    }
    let mut heights = vec![0; TILE_SAMPLE_COUNT];
    let mut across = [0.0; CAGE_CONTROLS + 1];
    for (row, out) in heights.chunks_exact_mut(TILE_SAMPLES).enumerate() {
        let weights = LIMIT_WEIGHTS[row % QUAD_SAMPLES].map(f64::from);
        let rows = &lattice[row / QUAD_SAMPLES * CAGE_CONTROLS..][..4 * CAGE_CONTROLS];
        let (rows, _) = rows.as_chunks::<CAGE_CONTROLS>();
        for (column, sum) in across[..CAGE_CONTROLS].iter_mut().enumerate() {
            *sum = weights[0] * rows[0][column]
                + weights[1] * rows[1][column]
                + weights[2] * rows[2][column]
                + weights[3] * rows[3][column];
        }
        base_row(&across, out);
    }
    heights
}

/// The heights of a tile from its controls and residual codes: 129 × 129, in units.
///
/// Wraps where codes are absurd.
///
/// # Panics
///
/// Where `controls` is not 35 × 35 or `detail` not 129 × 129 long.
#[must_use]
pub fn decode_heights(controls: &[i32], detail: &[i32], step: i32) -> Vec<i32> {
    let mut heights = base_heights(controls);
    for (height, residual) in heights.iter_mut().zip(decode_residual(detail, step)) {
        *height = height.wrapping_add(residual);
    }
    heights
}

/// The residual R of a tile from its codes: 129 × 129, in units.
///
/// # Panics
///
/// Where `detail` is not 129 × 129 long.
#[must_use]
pub fn decode_residual(detail: &[i32], step: i32) -> Vec<i32> {
    assert_eq!(detail.len(), TILE_SAMPLE_COUNT, "a tile's codes");
    let mut residual: Vec<i32> = detail.iter().map(|code| code.wrapping_mul(step)).collect();
    for row in (1..TILE_SAMPLES).step_by(2) {
        let (above, rest) = residual[(row - 1) * TILE_SAMPLES..].split_at_mut(TILE_SAMPLES);
        let (here, below) = rest.split_at_mut(TILE_SAMPLES);
        for column in (0..TILE_SAMPLES).step_by(2) {
            here[column] = here[column].wrapping_add(half_sum(above[column], below[column]));
        }
    }
    for row in residual.chunks_exact_mut(TILE_SAMPLES) {
        for column in (1..TILE_SAMPLES).step_by(2) {
            row[column] = row[column].wrapping_add(half_sum(row[column - 1], row[column + 1]));
        }
    }
    residual
}

/// The codes whose heights come nearest to the wanted ones: within q / 2 at every sample.
///
/// Rounds against what the decoder will see, so errors do not add up. Ties go to the smaller code.
///
/// # Panics
///
/// Where `wanted` is not 129 × 129 or `controls` not 35 × 35 long.
#[must_use]
pub fn encode_detail(wanted: &[i32], controls: &[i32], step: i32) -> Vec<i32> {
    assert_eq!(wanted.len(), TILE_SAMPLE_COUNT, "a tile's heights");
    let mut residual: Vec<i32> = base_heights(controls)
        .iter()
        .zip(wanted)
        .map(|(base, want)| want - base)
        .collect();
    let mut codes = vec![0; TILE_SAMPLE_COUNT];
    // Every sample is replaced by what the decoder will have there before another is predicted from it.
    let mut settle = |residual: &mut [i32], at: usize, predicted: i32| {
        codes[at] = nearest_code(residual[at] - predicted, step);
        residual[at] = predicted + step * codes[at];
    };
    for row in (0..TILE_SAMPLES).step_by(2) {
        for column in (0..TILE_SAMPLES).step_by(2) {
            settle(&mut residual, row * TILE_SAMPLES + column, 0);
        }
    }
    for row in (1..TILE_SAMPLES).step_by(2) {
        for column in (0..TILE_SAMPLES).step_by(2) {
            let at = row * TILE_SAMPLES + column;
            let predicted = half_sum(residual[at - TILE_SAMPLES], residual[at + TILE_SAMPLES]);
            settle(&mut residual, at, predicted);
        }
    }
    for row in 0..TILE_SAMPLES {
        for column in (1..TILE_SAMPLES).step_by(2) {
            let at = row * TILE_SAMPLES + column;
            let predicted = half_sum(residual[at - 1], residual[at + 1]);
            settle(&mut residual, at, predicted);
        }
    }
    codes
}

/// The limit surface at one sample in 32-bit arithmetic, as a shader computes it; equal to [`base_heights`] while
/// controls stay under [`CONTROL_LIMIT`].
///
/// # Panics
///
/// Where `controls` is not 35 × 35 long or the sample is outside the tile.
#[must_use]
pub fn base_height_32(controls: &[i32], row: usize, column: usize) -> i32 {
    let row_weights = LIMIT_WEIGHTS[row % QUAD_SAMPLES];
    let column_weights = LIMIT_WEIGHTS[column % QUAD_SAMPLES];
    let mut high = 0;
    let mut low = 0;
    for (a, row_weight) in row_weights.into_iter().enumerate() {
        for (b, column_weight) in column_weights.into_iter().enumerate() {
            // The last row and column have weight 0 for the control that would lie outside.
            let i = (row / QUAD_SAMPLES + a).min(CAGE_CONTROLS - 1);
            let j = (column / QUAD_SAMPLES + b).min(CAGE_CONTROLS - 1);
            let control = controls[i * CAGE_CONTROLS + j];
            let weight = row_weight * column_weight;
            high += weight * (control >> 12);
            low += weight * (control & 4095);
        }
    }
    let whole = floor_div(high, 36);
    let rest = high - 36 * whole;
    whole + (4096 * rest + low + WEIGHT_SUM / 2) / WEIGHT_SUM
}

/// Floor division by a positive number where `/` truncates.
const fn floor_div(a: i32, b: i32) -> i32 {
    let quotient = a / b;
    if a < quotient * b {
        quotient - 1
    } else {
        quotient
    }
}

/// The mean of two, rounded down; the sum wraps.
const fn half_sum(a: i32, b: i32) -> i32 {
    a.wrapping_add(b) >> 1
}

/// `difference / step` rounded to nearest, ties towards zero.
const fn nearest_code(difference: i32, step: i32) -> i32 {
    let size = (difference.unsigned_abs() + (step.unsigned_abs() - 1) / 2) / step.unsigned_abs();
    if difference < 0 {
        -size.cast_signed()
    } else {
        size.cast_signed()
    }
}

/// One row of the limit surface from its sums over rows of controls (one zero past the end).
fn base_row(across: &[f64; CAGE_CONTROLS + 1], out: &mut [i32]) {
    let weights = LIMIT_WEIGHTS.map(|weights| weights.map(f64::from));
    let sum = |w: &[f64; 4], c: &[f64]| w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
    let (quads, last) = out.as_chunks_mut::<QUAD_SAMPLES>();
    for (heights, controls) in quads.iter_mut().zip(across.windows(4)) {
        for (height, weights) in heights.iter_mut().zip(&weights) {
            *height = round_sum(sum(weights, controls));
        }
    }
    for height in last {
        *height = round_sum(sum(&weights[0], &across[TILE_QUADS..]));
    }
}

/// `sum / 147,456` rounded half up, for a whole number `sum`.
///
/// Doubles hold these integers exactly, and vectorise: |sum| < 147,456 · 2²⁵ < 2⁴³. Adding ½ to the numerator makes a
/// half a little more than a half, and keeps every quotient 2⁻¹⁹ away from one, far more than the product's rounding.
/// Adding 1.5 · 2⁵² then rounds to the nearest whole number and leaves it in the low bits. Absurd sums wrap.
#[inline]
fn round_sum(sum: f64) -> i32 {
    const MAGIC: f64 = 1.5 * (1_u64 << 52) as f64;
    let rounded = (sum + 0.5) * (1.0 / 147_456.0) + MAGIC;
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
    let low = rounded.to_bits() as u32;
    low.cast_signed()
}

/// A window of a lattice's subdivision, whose first row and column are even.
fn subdivide_window(
    controls: &[i32],
    side: usize,
    first: [usize; 2],
    size: [usize; 2],
) -> Vec<i32> {
    let mut sums = vec![0_i64; side];
    let mut out = Vec::with_capacity(size[0] * size[1]);
    for row in first[0]..first[0] + size[0] {
        let coarse = &controls[row / 2 * side..];
        for (column, sum) in sums.iter_mut().enumerate() {
            *sum = mask(row, |tap| i64::from(coarse[tap * side + column]));
        }
        for column in first[1]..first[1] + size[1] {
            let sum = mask(column, |tap| sums[column / 2 + tap]);
            #[expect(clippy::cast_possible_truncation, reason = "a mean of i32 is an i32")]
            out.push(((sum + 32) >> 6) as i32);
        }
    }
    out
}

/// The cubic B-spline's subdivision masks in eighths: edge points at even places, vertex points at odd ones.
fn mask(place: usize, control: impl Fn(usize) -> i64) -> i64 {
    if place.is_multiple_of(2) {
        4 * (control(0) + control(1))
    } else {
        control(0) + 6 * control(1) + control(2)
    }
}

#[cfg(test)]
mod tests;
