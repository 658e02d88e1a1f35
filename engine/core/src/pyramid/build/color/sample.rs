//! Texels as images show them: pixels shrunk by whole factors where texels are wider, and light mixed between them.

use std::ops::Range;

use super::Texel;
use super::block::Area;
use super::layers::{Layer, samples_per_texel};
use super::reduce::Whole;
use crate::dem::{Pixel, Window};
use crate::geo::Grid;
use crate::pyramid::PyramidError;
use crate::pyramid::light::{LINEAR, encode};

/// Pixels of a window that is read at once to be shrunk, or a few more.
pub(super) const WINDOW_PIXELS: u64 = 1 << 20;
/// Images are shrunk by no more than this; of finer ones some pixels are passed over.
const MOST_SHRINK: f64 = 512.0;
/// From here on a texel hides what is under it: alpha's arithmetic is good to a few parts in 10⁷.
const OPAQUE: f32 = 1.0 - 1e-6;

/// Red, green and blue as linear light times alpha, and alpha, 0 to 1.
type Light = [f32; 4];

/// Puts the images, the uppermost first, under the texels of a block that are not whole.
pub(super) fn sample_under(
    area: &Area,
    grid: &Grid,
    layers: &[&Layer<'_>],
    whole: &Whole,
    texels: &mut [Texel],
) -> Result<(), PyramidError> {
    let mut lights: Vec<Light> = Vec::new();
    for layer in layers {
        let Some(sampler) = Sampler::new(area, grid, layer) else {
            continue;
        };
        if lights.is_empty() {
            lights.extend(texels.iter().map(light));
        }
        sampler.put_under(&mut lights)?;
        if lights.iter().all(|light| light[3] >= OPAQUE) {
            break;
        }
    }
    for (index, light) in lights.iter().enumerate() {
        if !whole.is_at(index) {
            texels[index] = stored(light);
        }
    }
    Ok(())
}

/// Linear light times alpha, and alpha.
fn light(&[r, g, b, alpha]: &[u8; 4]) -> Light {
    if alpha == u8::MAX {
        let [r, g, b] = [r, g, b].map(|value| LINEAR[usize::from(value)]);
        return [r, g, b, 1.0];
    }
    let share = f32::from(alpha) / 255.0;
    let [r, g, b] = [r, g, b].map(|value| LINEAR[usize::from(value)] * share);
    [r, g, b, share]
}

/// The texel of some light.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of 255"
)]
fn stored(&[r, g, b, share]: &Light) -> Texel {
    if share >= OPAQUE {
        let [r, g, b] = [r, g, b].map(encode);
        return [r, g, b, u8::MAX];
    }
    let alpha = (share * 255.0).round() as u8;
    if alpha == 0 {
        return [0; 4];
    }
    let [r, g, b] = [r, g, b].map(|light| encode(light / share));
    [r, g, b, alpha]
}

/// An image over a block.
struct Sampler<'a> {
    layer: &'a Layer<'a>,
    /// Pixels of the image that become one, down and across.
    factors: [u32; 2],
    rows: Vec<Mix>,
    columns: Vec<Mix>,
    /// Texels from the block's first in a row to the first that the image has, and texels in a row.
    first: [usize; 2],
    width: usize,
}

/// Two neighbouring pixels, shrunk, and the share of the second.
#[derive(Clone, Copy)]
struct Mix {
    places: [usize; 2],
    share: f32,
}

impl<'a> Sampler<'a> {
    /// None where the image does not lie over the block.
    fn new(area: &Area, grid: &Grid, layer: &'a Layer<'a>) -> Option<Self> {
        let step = samples_per_texel(grid, area.level);
        let factors = layer
            .pixels_per_sample(grid)
            .map(|pixels| (pixels * step).round().clamp(1.0, MOST_SHRINK));
        let [height, width] = [layer.image.height, layer.image.width];
        let (min, max) = (layer.extent.min, layer.extent.max);
        let down = |row: usize| {
            let [_, y] = grid.position(row as f64 * step, 0.0);
            (max[1] - y) / (max[1] - min[1]) * f64::from(height)
        };
        let across = |column: usize| {
            let [x, _] = grid.position(0.0, column as f64 * step);
            (x - min[0]) / (max[0] - min[0]) * f64::from(width)
        };
        let (first_row, rows) = mixes(area.lattice_rows(), down, height, factors[0])?;
        let (first_column, columns) = mixes(area.lattice_columns(), across, width, factors[1])?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers from 1 to 512"
        )]
        let factors = factors.map(|factor| factor as u32);
        Some(Self {
            layer,
            factors,
            rows,
            columns,
            first: [first_row, first_column],
            width: area.lattice_columns().len(),
        })
    }

    /// Adds what shows of the image under what is there.
    fn put_under(&self, lights: &mut [Light]) -> Result<(), PyramidError> {
        let range = |mixes: &[Mix]| mixes[0].places[0]..mixes[mixes.len() - 1].places[1] + 1;
        let (rows, columns) = (range(&self.rows), range(&self.columns));
        let pixels = self.shrunk(&rows, &columns)?;
        let mut pixel_line = Vec::with_capacity(columns.len());
        let mut line = |row: usize, line: &mut (usize, Vec<Light>)| {
            pixel_line.clear();
            let first = (row - rows.start) * columns.len();
            pixel_line.extend(pixels[first..first + columns.len()].iter().map(light));
            line.0 = row;
            line.1.clear();
            line.1.extend(self.columns.iter().map(|mix| {
                let [west, east] = mix.places.map(|place| pixel_line[place - columns.start]);
                mixed(&west, &east, mix.share)
            }));
        };
        // The lines between pixels of the north and of the south; most texels' north is the last one's south.
        let mut lines = [(usize::MAX, Vec::new()), (usize::MAX, Vec::new())];
        for (mix, lights) in self
            .rows
            .iter()
            .zip(lights.chunks_exact_mut(self.width).skip(self.first[0]))
        {
            if lines[0].0 != mix.places[0] {
                lines.swap(0, 1);
            }
            for (place, kept) in mix.places.into_iter().zip(&mut lines) {
                if kept.0 != place {
                    line(place, kept);
                }
            }
            let lights = lights[self.first[1]..].iter_mut();
            for ((light, north), south) in lights.zip(&lines[0].1).zip(&lines[1].1) {
                let mixed = mixed(north, south, mix.share);
                let left = 1.0 - light[3];
                for (light, mixed) in light.iter_mut().zip(mixed) {
                    *light += left * mixed;
                }
            }
        }
        Ok(())
    }

    /// Some rows and columns of the image, shrunk.
    fn shrunk(
        &self,
        rows: &Range<usize>,
        columns: &Range<usize>,
    ) -> Result<Vec<Pixel>, PyramidError> {
        let image = self.layer.image;
        let [down, across] = self.factors;
        let window = |rows: &Range<usize>, columns: &Range<usize>| {
            let clip = |range: &Range<usize>, factor: u32, size: u32| {
                let at = |place: usize| {
                    u32::try_from(place)
                        .unwrap_or(u32::MAX)
                        .saturating_mul(factor)
                        .min(size)
                };
                (at(range.start), at(range.end) - at(range.start))
            };
            let (row, rows) = clip(rows, down, image.height);
            let (column, columns) = clip(columns, across, image.width);
            Window {
                row,
                column,
                rows,
                columns,
            }
        };
        let read = |window: Window| {
            let mut pixels = vec![[0; 4]; window.rows as usize * window.columns as usize];
            image.read(window, &mut pixels).map(|()| pixels)
        };
        if self.factors == [1, 1] {
            return Ok(read(window(rows, columns))?);
        }
        let mut out = vec![[0; 4]; rows.len() * columns.len()];
        let cell = u64::from(down) * u64::from(across);
        let most = usize::try_from(WINDOW_PIXELS / cell).unwrap_or(1).max(1);
        for row in rows.clone() {
            for start in columns.clone().step_by(most) {
                let part = start..(start + most).min(columns.end);
                let window = window(&(row..row + 1), &part);
                let pixels = read(window)?;
                let first = (row - rows.start) * columns.len() + start - columns.start;
                for (index, out) in out[first..first + part.len()].iter_mut().enumerate() {
                    *out = mean(&pixels, window.columns as usize, index, across as usize);
                }
            }
        }
        Ok(out)
    }
}

/// The mean of so many columns of all rows.
fn mean(pixels: &[Pixel], width: usize, index: usize, columns: usize) -> Pixel {
    let (mut sum, mut count) = ([0.0_f32; 4], 0.0);
    for line in pixels.chunks_exact(width) {
        for pixel in &line[index * columns..((index + 1) * columns).min(width)] {
            for (sum, value) in sum.iter_mut().zip(light(pixel)) {
                *sum += value;
            }
            count += 1.0;
        }
    }
    let share = sum[3] / count;
    if share >= OPAQUE {
        let [r, g, b] = [sum[0], sum[1], sum[2]].map(|sum| encode(sum / count));
        return [r, g, b, u8::MAX];
    }
    stored(&sum.map(|sum| sum / count))
}

/// So much of the second as its share says.
fn mixed(first: &Light, second: &Light, share: f32) -> Light {
    std::array::from_fn(|channel| first[channel] * (1.0 - share) + second[channel] * share)
}

/// Between which pixels, shrunk by a factor, the texels lie that are not outside the image, and which is the first of
/// them; none where all are outside. `place` says where a texel lies, in pixels from the image's edge.
fn mixes(
    texels: Range<usize>,
    place: impl Fn(usize) -> f64,
    size: u32,
    factor: f64,
) -> Option<(usize, Vec<Mix>)> {
    let all = 0.0..=f64::from(size);
    let last = (f64::from(size) / factor).ceil() - 1.0;
    let inside = |texel: &usize| all.contains(&place(*texel));
    let first = texels.clone().find(inside)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the image"
    )]
    let mix = |texel: usize| {
        let place = (place(texel) / factor - 0.5).clamp(0.0, last);
        let second = (place.floor() + 1.0).min(last);
        Mix {
            places: [place.floor() as usize, second as usize],
            share: (place - place.floor()) as f32,
        }
    };
    let mixes = (first..texels.end).take_while(inside).map(mix);
    Some((first - texels.start, mixes.collect()))
}
