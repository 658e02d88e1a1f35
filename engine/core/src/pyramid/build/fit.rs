//! Least squares along rows and columns: hat functions for coarser samples, bicubic B-splines for cages.
//!
//! Both bases are products of one function a row and one a column, so a whole level is fitted by solving the normal
//! equations of its rows, then those of the resulting columns: banded, positive definite, factored once.
//!
//! Based on: C. de Boor, "A practical guide to splines", 1978 (banded normal equations of a spline fit).

use rayon::prelude::*;

use super::samples::LevelSamples;
use crate::geo::{QUAD_SAMPLES, TILE_QUADS};
use crate::pyramid::surface::LIMIT_WEIGHTS;

/// Rows or columns solved side by side.
const LANES: usize = 16;
/// Quads of data made up past the border before a cage is fitted, so that its ring is as steady as the rest.
const BORDER_QUADS: usize = 4;

/// How much a cage's bends weigh against its distance from the samples: enough to keep noise out of controls, which
/// saves 4 % of a smooth pyramid's bytes and 0.5 % of a rough one's; three times as much costs more than it saves.
const SMOOTHING: f64 = 0.01;

/// Weights of two hats at a coarse sample and half-way to the next.
const HAT: [[f64; 2]; 2] = [[1.0, 0.0], [0.5, 0.5]];

/// Fits a coarser level's samples to the next finer ones; writes them to the north-west of `coarse`'s array and
/// returns how many rows and columns that are.
pub(super) fn coarsen(fine: &LevelSamples, coarse: &mut LevelSamples) -> [usize; 2] {
    let axes = [fine.rows, fine.columns].map(|samples| Axis {
        samples,
        border: 0,
        first: 0,
        count: samples / 2 + 1,
        fit: Fit::new(HAT, samples, 0.0),
    });
    let fitted = fit_plane(&fine.values, fine.columns, &axes);
    let width = coarse.columns;
    for (out, line) in coarse
        .values
        .chunks_exact_mut(width)
        .zip(fitted.chunks_exact(axes[1].count))
    {
        out[..line.len()].copy_from_slice(line);
    }
    [axes[0].count, axes[1].count]
}

/// Fits a level's cage to its samples: controls of lattice points −1 … 32 t + 1 each way, for t tiles.
pub(super) fn cage(level: &LevelSamples, tiles: [u32; 2]) -> Vec<i32> {
    let weights = LIMIT_WEIGHTS.map(|row| row.map(|weight| f64::from(weight) / 384.0));
    let border = BORDER_QUADS * QUAD_SAMPLES;
    let axis = |samples: usize, tiles: u32| Axis {
        samples,
        border,
        first: BORDER_QUADS,
        count: tiles as usize * TILE_QUADS + 3,
        fit: Fit::new(weights, samples + 2 * border, SMOOTHING),
    };
    let axes = [axis(level.rows, tiles[0]), axis(level.columns, tiles[1])];
    fit_plane(&level.values, level.columns, &axes)
}

/// One direction of a fit: its samples, how many are made up past each end, and which coefficients are wanted.
struct Axis<const B: usize, const P: usize> {
    samples: usize,
    border: usize,
    first: usize,
    count: usize,
    fit: Fit<B, P>,
}

impl<const B: usize, const P: usize> Axis<B, P> {
    /// The wanted coefficients of several lines at once; `load` gives the lines' samples at a place.
    fn solve(&self, width: usize, load: impl Fn(usize, &mut [f64])) -> Vec<f64> {
        let mut mirror = vec![0.0; width];
        let all = self.fit.solve(width, |place, out| {
            // Past an end the data runs on turned by half a circle: same slope, no bend.
            let last = self.samples - 1;
            let (end, inner) = match place.checked_sub(self.border) {
                None => (0, self.border - place),
                Some(at) if at > last => (last, 2 * last - at),
                Some(at) => return load(at, out),
            };
            load(inner, &mut mirror);
            load(end, out);
            out.iter_mut()
                .zip(&mirror)
                .for_each(|(out, inner)| *out = 2.0 * *out - inner);
        });
        all[self.first * width..(self.first + self.count) * width].to_vec()
    }
}

/// Least squares in one direction: coefficients c with Σ over samples of (Σ w c − sample)² least. Sample P j + s has
/// weights `w[s]` for coefficients j … j + B − 1.
struct Fit<const B: usize, const P: usize> {
    weights: [[f64; B]; P],
    samples: usize,
    /// Cholesky factor by rows: entry d of row k is L(k, k − d); the diagonal is stored inverted.
    factor: Vec<[f64; B]>,
}

impl<const B: usize, const P: usize> Fit<B, P> {
    /// `smoothing` weighs the squared second differences of coefficients, for bases of three weights and more.
    fn new(weights: [[f64; B]; P], samples: usize, smoothing: f64) -> Self {
        // The last sample's last weight is 0, and so is its coefficient's: it is left out.
        let count = (samples - 1) / P + B - 1;
        let mut factor = vec![[0.0; B]; count];
        for sample in 0..samples {
            let (first, row) = (sample / P, weights[sample % P]);
            for a in 0..B.min(count - first) {
                for d in 0..=a {
                    factor[first + a][d] += row[a] * row[a - d];
                }
            }
        }
        let bend = [1.0, -2.0, 1.0];
        for first in 0..if smoothing > 0.0 { count - 2 } else { 0 } {
            for a in 0..3 {
                for d in 0..=a {
                    factor[first + a][d] += smoothing * bend[a] * bend[a - d];
                }
            }
        }
        for k in 0..count {
            for d in (0..B.min(k + 1)).rev() {
                let shared: f64 = (d + 1..B.min(k + 1))
                    .map(|e| factor[k][e] * factor[k - d][e - d])
                    .sum();
                let rest = factor[k][d] - shared;
                factor[k][d] = if d == 0 {
                    rest.sqrt().recip()
                } else {
                    rest * factor[k - d][0]
                };
            }
        }
        Self {
            weights,
            samples,
            factor,
        }
    }

    fn solve(&self, width: usize, mut load: impl FnMut(usize, &mut [f64])) -> Vec<f64> {
        let count = self.factor.len();
        let mut solution = vec![0.0; count * width];
        let mut line = vec![0.0; width];
        for sample in 0..self.samples {
            load(sample, &mut line);
            let (first, weights) = (sample / P, self.weights[sample % P]);
            for a in (0..B.min(count - first)).filter(|a| weights[*a] != 0.0) {
                add_scaled(
                    &mut solution[(first + a) * width..][..width],
                    weights[a],
                    &line,
                );
            }
        }
        for k in 0..count {
            let (done, rest) = solution.split_at_mut(k * width);
            for d in 1..B.min(k + 1) {
                add_scaled(
                    &mut rest[..width],
                    -self.factor[k][d],
                    &done[(k - d) * width..][..width],
                );
            }
            rest[..width]
                .iter_mut()
                .for_each(|value| *value *= self.factor[k][0]);
        }
        for k in (0..count).rev() {
            let (rest, done) = solution.split_at_mut((k + 1) * width);
            for d in 1..B.min(count - k) {
                add_scaled(
                    &mut rest[k * width..],
                    -self.factor[k + d][d],
                    &done[(d - 1) * width..][..width],
                );
            }
            rest[k * width..]
                .iter_mut()
                .for_each(|value| *value *= self.factor[k][0]);
        }
        solution
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Fits rows, then columns; rounds to units.
fn fit_plane<const B: usize, const P: usize>(
    values: &[i32],
    columns: usize,
    axes: &[Axis<B, P>; 2],
) -> Vec<i32> {
    let [down, across] = axes;
    // f32 keeps 24 bits, a unit at the limit of heights; steps are many units.
    let mut half = vec![0.0_f32; down.samples * across.count];
    half.par_chunks_mut(LANES * across.count)
        .enumerate()
        .for_each(|(block, out)| {
            let width = out.len() / across.count;
            let rows = &values[block * LANES * columns..];
            let fitted = across.solve(width, |place, lanes| {
                for (lane, value) in lanes.iter_mut().enumerate() {
                    *value = f64::from(rows[lane * columns + place]);
                }
            });
            for (place, lanes) in fitted.chunks_exact(width).enumerate() {
                for (lane, value) in lanes.iter().enumerate() {
                    out[lane * across.count + place] = to_f32(*value);
                }
            }
        });
    let blocks: Vec<Vec<i32>> = (0..across.count.div_ceil(LANES))
        .into_par_iter()
        .map(|block| {
            let width = LANES.min(across.count - block * LANES);
            let fitted = down.solve(width, |place, lanes| {
                let line = &half[place * across.count + block * LANES..];
                lanes
                    .iter_mut()
                    .zip(line)
                    .for_each(|(lane, value)| *lane = f64::from(*value));
            });
            fitted.into_iter().map(round).collect()
        })
        .collect();
    drop(half);
    let mut fitted = vec![0; down.count * across.count];
    fitted
        .par_chunks_exact_mut(across.count)
        .enumerate()
        .for_each(|(row, out)| {
            for (block, out) in blocks.iter().zip(out.chunks_mut(LANES)) {
                out.copy_from_slice(&block[row * out.len()..][..out.len()]);
            }
        });
    fitted
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the nearest is meant"
)]
fn to_f32(value: f64) -> f32 {
    value as f32
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "heights are under 2^25 units; what is absurd saturates"
)]
fn round(value: f64) -> i32 {
    value.round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Grid;
    use crate::pyramid::surface::base_heights;

    fn level(side: u32, level: u8, height: impl Fn(i32, i32) -> i32) -> LevelSamples {
        let mut samples = LevelSamples::new(
            &Grid {
                columns: side,
                rows: side,
                origin: [0.0; 2],
                step: [1.0, -1.0],
            },
            level,
        );
        let columns = samples.columns;
        for (index, value) in samples.values.iter_mut().enumerate() {
            let [row, column] =
                [index / columns, index % columns].map(|place| i32::try_from(place).unwrap());
            *value = height(row, column);
        }
        samples
    }

    #[test]
    fn piecewise_linear_data_comes_back_exactly() {
        let roof = |row: i32, column: i32| 40 * (row - 100).abs() - 24 * (column / 2);
        let fine = level(257, 1, |row, column| roof(row, column - column % 2));
        let smooth = level(257, 1, |row, column| 40 * (row - 100).abs() - 12 * column);
        let mut coarse = level(129, 0, |_, _| 0);
        assert_eq!(coarsen(&smooth, &mut coarse), [129, 129]);
        for (index, value) in coarse.values.iter().enumerate() {
            let [row, column] =
                [index / 129, index % 129].map(|place| i32::try_from(place).unwrap());
            assert_eq!(*value, 40 * (2 * row - 100).abs() - 24 * column);
        }
        assert_eq!(fine.values.len(), smooth.values.len());
    }

    #[test]
    fn a_fit_is_no_worse_than_every_second_sample() {
        let rough = |row: i32, column: i32| (row * 37 + column * 91) % 101 * 16;
        let fine = level(257, 1, rough);
        let mut coarse = level(129, 0, |_, _| 0);
        coarsen(&fine, &mut coarse);
        let energy = |at: &dyn Fn(usize, usize) -> f64| -> f64 {
            let line = |row: usize, column: usize| at(row.div_euclid(2), column.div_euclid(2));
            (0..256)
                .flat_map(|row| (0..256).map(move |column| (row, column)))
                .map(|(row, column)| {
                    let [r, c] = [row % 2, column % 2];
                    let mean = (line(row, column)
                        + line(row + r, column)
                        + line(row, column + c)
                        + line(row + r, column + c))
                        / 4.0;
                    (mean - f64::from(fine.values[row * 257 + column])).powi(2)
                })
                .sum()
        };
        let fitted = energy(&|row, column| f64::from(coarse.values[row * 129 + column]));
        let picked = energy(&|row, column| f64::from(fine.values[2 * row * 257 + 2 * column]));
        assert!(fitted < 0.8 * picked, "{fitted} {picked}");
    }

    #[test]
    fn a_cage_reproduces_its_own_surface() {
        // A bowl and a saddle: bends everywhere, so smoothing shows, by a few units.
        let bowl =
            |row: i32, column: i32| 192 * (row - 17) * (row - 17) + 64 * row * column - 5 * column;
        let controls: Vec<i32> = (0..35 * 35).map(|at: i32| bowl(at / 35, at % 35)).collect();
        let mut samples = level(129, 0, |_, _| 0);
        samples.values = base_heights(&controls);
        let fitted = cage(&samples, [1, 1]);
        let again = base_heights(&fitted);
        // Away from the border, where the data is made up, the surface is the same but for rounding.
        for row in 40..89 {
            for column in 40..89 {
                assert!(
                    (again[row * 129 + column] - samples.values[row * 129 + column]).abs() <= 40
                );
            }
        }
    }
}
