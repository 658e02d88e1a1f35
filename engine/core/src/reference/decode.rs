//! decode: a tile that arrived becomes heights, slopes and stride errors in its slot of the pool. Once per arrival.
//!
//! Reads headers and staging, writes one slot a tile of a page. Steps in order: [`heights`], [`slopes`], [`strides`].
//! Heights are exact; slopes are half floats; stride errors are exact up to their conversion to floats.
//!
//! Twin: `shaders/stages/decode.wgsl`.
//! Based on: `FORMAT.md`, the rule of the regular tile; cubic B-splines.

use super::shared::{
    CODES_WORD, CONTROLS_WORD, CUT_WORD, HEIGHTS_WORD, SLOPES_WORD, SLOT_WORDS, STRIDE_ERRORS_WORD,
    UPLOAD_CODES_WORD, UPLOAD_CONTROLS_WORD, UPLOAD_CUT_WORD, UPLOAD_DETAIL_WORD,
    UPLOAD_VOIDS_WORD, UPLOAD_WORDS, UploadHeader, VOIDS_WORD, pool::pack_2x16_float,
};
use crate::{
    geo::{
        CAGE_CONTROL_COUNT, CAGE_CONTROLS, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS, TILE_QUADS,
        TILE_SAMPLE_COUNT, TILE_SAMPLES,
    },
    pyramid::Tile,
};

/// Cubic B-spline at 0, 1/4, 1/2, 3/4 of a quad; each row sums to 384.
const LIMIT_WEIGHTS: [[i32; 4]; 4] = [
    [64, 256, 64, 0],
    [27, 235, 121, 1],
    [8, 184, 184, 8],
    [1, 121, 235, 27],
];

/// A tile as it lies in the staging buffer: `UPLOAD_WORDS` words.
///
/// # Panics
///
/// When `words` is shorter, or the tile's parts are not of their fixed sizes.
pub fn stage_tile(tile: &Tile, words: &mut [u32]) {
    let words = &mut words[..UPLOAD_WORDS];
    // What lies before is overwritten whole; from here on bytes and bits are put into zeros.
    words[UPLOAD_VOIDS_WORD..].fill(0);
    for (word, &control) in words[UPLOAD_CONTROLS_WORD..]
        .iter_mut()
        .zip(&tile.controls[..CAGE_CONTROL_COUNT])
    {
        *word = control.cast_unsigned();
    }
    for (word, &code) in words[UPLOAD_DETAIL_WORD..]
        .iter_mut()
        .zip(&tile.detail[..TILE_SAMPLE_COUNT])
    {
        *word = code.cast_unsigned();
    }
    if let Some(voids) = &tile.voids {
        put_bytes(&mut words[UPLOAD_VOIDS_WORD..UPLOAD_CODES_WORD], voids);
    }
    put_bytes(
        &mut words[UPLOAD_CODES_WORD..UPLOAD_CUT_WORD],
        &tile.patch_codes,
    );
}

fn put_bytes(words: &mut [u32], bytes: &[u8]) {
    for (i, &byte) in bytes.iter().enumerate() {
        words[i / 4] |= u32::from(byte) << (i % 4 * 8);
    }
}

/// All steps for all uploads.
pub fn decode(page: &mut [u32], headers: &[UploadHeader], staging: &[u32]) {
    heights(page, headers, staging);
    slopes(page, headers, staging);
    strides(page, headers, staging);
}

fn upload_words(staging: &[u32], upload: usize) -> &[u32] {
    &staging[upload * UPLOAD_WORDS..(upload + 1) * UPLOAD_WORDS]
}

fn slot_words<'a>(page: &'a mut [u32], header: &UploadHeader) -> &'a mut [u32] {
    let start = header.slot as usize * SLOT_WORDS;
    &mut page[start..start + SLOT_WORDS]
}

fn control(upload: &[u32], at: usize) -> i32 {
    upload[UPLOAD_CONTROLS_WORD + at].cast_signed()
}

fn code(upload: &[u32], row: usize, column: usize) -> i32 {
    upload[UPLOAD_DETAIL_WORD + row * TILE_SAMPLES + column].cast_signed()
}

/// The limit surface in units, rounded half up: (Σ w K + 73,728) / 147,456, in 32 bits by halves of K.
pub(super) fn base_height(upload: &[u32], row: usize, column: usize) -> i32 {
    let row_weights = LIMIT_WEIGHTS[row % QUAD_SAMPLES];
    let column_weights = LIMIT_WEIGHTS[column % QUAD_SAMPLES];
    let (mut high, mut low) = (0, 0);
    #[expect(clippy::needless_range_loop, reason = "index loops, as in the kernel")]
    for i in 0..4 {
        for j in 0..4 {
            let weight = row_weights[i] * column_weights[j];
            if weight != 0 {
                let at = (row / QUAD_SAMPLES + i) * CAGE_CONTROLS + column / QUAD_SAMPLES + j;
                let k = control(upload, at);
                high += weight * (k >> 12);
                low += weight * (k & 4_095);
            }
        }
    }
    let a = high.div_euclid(36);
    let b = high - 36 * a;
    a + (4_096 * b + low + 73_728) / 147_456
}

/// The residual of an even column: rows between two others continue them.
fn even_column_residual(upload: &[u32], quantum: i32, row: usize, column: usize) -> i32 {
    let own = quantum * code(upload, row, column);
    if row.is_multiple_of(2) {
        return own;
    }
    ((quantum * (code(upload, row - 1, column) + code(upload, row + 1, column))) >> 1) + own
}

fn residual(upload: &[u32], quantum: i32, row: usize, column: usize) -> i32 {
    if column.is_multiple_of(2) {
        return even_column_residual(upload, quantum, row, column);
    }
    let left = even_column_residual(upload, quantum, row, column - 1);
    let right = even_column_residual(upload, quantum, row, column + 1);
    ((left + right) >> 1) + quantum * code(upload, row, column)
}

/// A sample's residual without its own code, for those who make codes.
pub(super) fn code_prediction(upload: &[u32], quantum: i32, row: usize, column: usize) -> i32 {
    residual(upload, quantum, row, column) - quantum * code(upload, row, column)
}

/// What goes into the slot as it came: voids, patch codes, controls.
fn copy_rest(slot: &mut [u32], upload: &[u32]) {
    slot[VOIDS_WORD..STRIDE_ERRORS_WORD]
        .copy_from_slice(&upload[UPLOAD_VOIDS_WORD..UPLOAD_CODES_WORD]);
    slot[CODES_WORD..CONTROLS_WORD].copy_from_slice(&upload[UPLOAD_CODES_WORD..UPLOAD_CUT_WORD]);
    slot[CONTROLS_WORD..CONTROLS_WORD + CAGE_CONTROL_COUNT]
        .copy_from_slice(&upload[UPLOAD_CONTROLS_WORD..UPLOAD_DETAIL_WORD]);
    let cut = &upload[UPLOAD_CUT_WORD..UPLOAD_WORDS];
    slot[CUT_WORD..CUT_WORD + cut.len()].copy_from_slice(cut);
}

/// Heights of every sample, and what is copied.
pub fn heights(page: &mut [u32], headers: &[UploadHeader], staging: &[u32]) {
    for (i, header) in headers.iter().enumerate() {
        let upload = upload_words(staging, i);
        let slot = slot_words(page, header);
        for sample in 0..TILE_SAMPLE_COUNT {
            let (row, column) = (sample / TILE_SAMPLES, sample % TILE_SAMPLES);
            let height =
                base_height(upload, row, column) + residual(upload, header.quantum, row, column);
            slot[HEIGHTS_WORD + sample] = height.cast_unsigned();
        }
        copy_rest(slot, upload);
    }
}

fn height(slot: &[u32], row: usize, column: usize) -> i32 {
    slot[HEIGHTS_WORD + row * TILE_SAMPLES + column].cast_signed()
}

/// Units a sample along a row of samples (south) or a column (east): `toward` is one of the two.
fn central_difference(slot: &[u32], row: usize, column: usize, toward: [usize; 2]) -> f32 {
    let before = height(slot, row - toward[0], column - toward[1]);
    let after = height(slot, row + toward[0], column + toward[1]);
    (after - before) as f32 * 0.5
}

/// The same across a border, where the samples beyond are not ours: from the cage's limit surface, whose controls on
/// both sides of a border are the neighbour's too. Both tiles get the same number.
fn cage_difference(upload: &[u32], row: usize, column: usize, toward: [usize; 2]) -> f32 {
    let at = [row / QUAD_SAMPLES, column / QUAD_SAMPLES];
    let lateral = [toward[1], toward[0]];
    let weights = LIMIT_WEIGHTS[(row * lateral[0] + column * lateral[1]) % QUAD_SAMPLES];
    let mut sum = 0.0;
    for (i, &weight) in weights.iter().enumerate() {
        if weight != 0 {
            let before = [at[0] + lateral[0] * i, at[1] + lateral[1] * i];
            let after = [before[0] + toward[0] * 2, before[1] + toward[1] * 2];
            let difference = control(upload, after[0] * CAGE_CONTROLS + after[1])
                - control(upload, before[0] * CAGE_CONTROLS + before[1]);
            sum += weight as f32 * difference as f32;
        }
    }
    sum / (384.0 * 2.0 * QUAD_SAMPLES as f32)
}

/// Slopes of every sample.
pub fn slopes(page: &mut [u32], headers: &[UploadHeader], staging: &[u32]) {
    for (i, header) in headers.iter().enumerate() {
        let upload = upload_words(staging, i);
        let slot = slot_words(page, header);
        for sample in 0..TILE_SAMPLE_COUNT {
            let (row, column) = (sample / TILE_SAMPLES, sample % TILE_SAMPLES);
            let difference = |is_border: bool, toward: [usize; 2]| {
                if is_border {
                    cage_difference(upload, row, column, toward)
                } else {
                    central_difference(slot, row, column, toward)
                }
            };
            let east = difference(column % TILE_CELLS == 0, [0, 1]) * header.unit / header.step[0];
            let north = difference(row % TILE_CELLS == 0, [1, 0]) * header.unit / header.step[1];
            slot[SLOPES_WORD + sample] = pack_2x16_float([east, north]);
        }
    }
}

fn is_void(upload: &[u32], row: usize, column: usize) -> bool {
    let sample = row * TILE_SAMPLES + column;
    upload[UPLOAD_VOIDS_WORD + sample / 32] >> (sample % 32) & 1 != 0
}

/// A tile's heights beside its void bits.
struct Samples<'a> {
    slot: &'a [u32],
    upload: &'a [u32],
}

impl Samples<'_> {
    /// A height at signed coordinates that lie in the tile.
    fn at(&self, place: [i32; 2]) -> i32 {
        height(
            self.slot,
            place[0].unsigned_abs() as usize,
            place[1].unsigned_abs() as usize,
        )
    }

    /// A sample's distance from a plane through three corners, in units / stride; 0 for a void one.
    fn deviation(&self, place: [i32; 2], stride: i32, plane: i32) -> u32 {
        if is_void(
            self.upload,
            place[0].unsigned_abs() as usize,
            place[1].unsigned_abs() as usize,
        ) {
            return 0;
        }
        (stride * self.at(place) - plane).unsigned_abs()
    }

    /// Both triangles of a plain cell: (NW, SW, SE) and (NW, SE, NE).
    fn plain_deviation(&self, nw: [i32; 2], stride: i32) -> u32 {
        let corner = |i: i32, j: i32| self.at([nw[0] + i, nw[1] + j]);
        let (a, b, c, d) = (
            corner(0, 0),
            corner(stride, 0),
            corner(stride, stride),
            corner(0, stride),
        );
        let mut worst = 0;
        for i in 0..=stride {
            for j in 0..=stride {
                let lower = i * (b - a) + j * (c - b);
                let upper = j * (d - a) + i * (c - d);
                let plane = stride * a + if i >= j { lower } else { upper };
                worst = worst.max(self.deviation([nw[0] + i, nw[1] + j], stride, plane));
            }
        }
        worst
    }

    /// A quarter of a fan, towards one edge: as one triangle, and as two where the edge is split. All fans are made of
    /// these.
    fn quarter_deviation(&self, centre: [i32; 2], outward: [i32; 2], half: i32) -> u32 {
        let lateral = [-outward[1], outward[0]];
        let place = |u: i32, v: i32| {
            [
                centre[0] + u * outward[0] + v * lateral[0],
                centre[1] + u * outward[1] + v * lateral[1],
            ]
        };
        let c = self.at(centre);
        let (a, b, m) = (
            self.at(place(half, -half)),
            self.at(place(half, half)),
            self.at(place(half, 0)),
        );
        let mut worst = 0;
        for u in 1..=half {
            for v in -u..=u {
                let whole = 2 * half * c + u * (a + b - 2 * c) + v * (b - a);
                let corner = if v >= 0 { b } else { a };
                let split = 2 * half * c + 2 * u * (m - c) + 2 * v.abs() * (corner - m);
                worst = worst.max(self.deviation(place(u, v), 2 * half, whole));
                worst = worst.max(self.deviation(place(u, v), 2 * half, split));
            }
        }
        worst
    }

    fn cell_deviation(&self, nw: [i32; 2], stride: i32) -> u32 {
        let half = stride / 2;
        let centre = [nw[0] + half, nw[1] + half];
        [[-1, 0], [0, 1], [1, 0], [0, -1]]
            .into_iter()
            .map(|outward| self.quarter_deviation(centre, outward, half))
            .fold(self.plain_deviation(nw, stride), u32::max)
    }
}

/// Stride errors of every patch: the largest vertical distance of stride 4 and stride 2, plain and in every template,
/// from the tile's own samples, in metres.
pub fn strides(page: &mut [u32], headers: &[UploadHeader], staging: &[u32]) {
    for (i, header) in headers.iter().enumerate() {
        let upload = upload_words(staging, i);
        let slot = slot_words(page, header);
        for patch in 0..PATCH_COUNT {
            let errors = patch_strides(&Samples { slot, upload }, patch);
            let at = STRIDE_ERRORS_WORD + patch * 2;
            slot[at] = (errors[0] as f32 * 0.25 * header.unit).to_bits();
            slot[at + 1] = (errors[1] as f32 * 0.5 * header.unit).to_bits();
        }
    }
}

/// In quarter units at stride 4, in half units at stride 2.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "samples count to 129"
)]
fn patch_strides(samples: &Samples<'_>, patch: usize) -> [u32; 2] {
    let row = (patch / TILE_QUADS * QUAD_SAMPLES) as i32;
    let column = (patch % TILE_QUADS * QUAD_SAMPLES) as i32;
    let worst = (0..4)
        .map(|cell| samples.cell_deviation([row + cell / 2 * 2, column + cell % 2 * 2], 2))
        .fold(0, u32::max);
    [samples.cell_deviation([row, column], 4), worst]
}

#[cfg(test)]
mod tests;
