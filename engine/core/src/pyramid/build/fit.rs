//! Least squares along columns and rows: hat functions for coarser samples, bicubic B-splines for cages.
//!
//! Both bases are the same few weights at every place, so the normal equations of a plane without ends are one band
//! repeated, and solving them is a convolution with the band's inverse. That fades by a factor a coefficient (0.17 for
//! hats, 0.53 for splines) and is cut off where it is a few hundred-thousandths; what a coefficient is depends on the
//! samples around it and on nothing else, so any rectangle of a plane of any size can be fitted on its own, and equals
//! the same rectangle of any other. Past a plane's ends the samples are mirrored ([`super::border::mirrored`]).
//!
//! Columns come first: there the inner loops run along rows, many coefficients side by side.
//!
//! Based on: C. de Boor, "A practical guide to splines", 1978 (banded normal equations of a spline fit); M. Unser,
//! A. Aldroubi, M. Eden, "B-spline signal processing", 1993 (their solution as a filter).

use std::sync::LazyLock;

use super::area::Area;
use super::samples::Samples;
use crate::geo::QUAD_SAMPLES;
use crate::pyramid::surface::LIMIT_WEIGHTS;

/// How much a cage's bends weigh against its distance from the samples: enough to keep noise out of controls, which
/// saves 4 % of a smooth pyramid's bytes and 0.5 % of a rough one's; three times as much costs more than it saves.
const SMOOTHING: f64 = 0.01;

/// Coefficients each way that the inverse of the hats' band reaches: 0.1716⁸ is under 10⁻⁶.
const HAT_REACH: usize = 8;
/// The same for splines: 0.535¹⁶ is under 5 · 10⁻⁵, and what is left of it is noise, coded with the residual.
const SPLINE_REACH: usize = 16;

/// Coarser samples are half as many.
const HAT_PERIOD: usize = 2;

/// A least-squares fit in one direction.
pub(super) struct Fit {
    /// Samples a coefficient.
    period: usize,
    /// The basis function at samples 0, 1, … from its middle; it is the same both ways.
    basis: Vec<f32>,
    /// The inverse of the normal equations' band: at distance 0, 1, … coefficients.
    inverse: Vec<f32>,
}

/// The fit of coarser samples.
pub(super) static HATS: LazyLock<Fit> =
    LazyLock::new(|| Fit::new(HAT_PERIOD, &[1.0, 0.5], 0.0, HAT_REACH));

/// The fit of cages.
pub(super) static SPLINES: LazyLock<Fit> = LazyLock::new(|| {
    // Samples at 0, ¼, ½ … of a quad from a control: its weight there.
    let weight = |distance: usize| {
        let [quad, part] = [distance / QUAD_SAMPLES, distance % QUAD_SAMPLES];
        f64::from(LIMIT_WEIGHTS[part][1 - quad.min(1)]) / 384.0
    };
    let basis: Vec<f64> = (0..2 * QUAD_SAMPLES).map(weight).collect();
    Fit::new(QUAD_SAMPLES, &basis, SMOOTHING, SPLINE_REACH)
});

impl Fit {
    /// `smoothing` weighs the squared second differences of coefficients.
    fn new(period: usize, basis: &[f64], smoothing: f64, reach: usize) -> Self {
        let at = |place: i64| {
            let distance = usize::try_from(place.unsigned_abs()).unwrap_or(usize::MAX);
            basis.get(distance).copied().unwrap_or(0.0)
        };
        let signed = |place: usize| i64::try_from(place).unwrap_or(0);
        let width = signed(basis.len());
        let bend = [6.0, -4.0, 1.0];
        let band: Vec<f64> = (0..2 * basis.len() / period)
            .map(|distance| {
                let shift = signed(distance * period);
                let product: f64 = (-width..=width)
                    .map(|place| at(place) * at(place - shift))
                    .sum();
                product + smoothing * bend.get(distance).copied().unwrap_or(0.0)
            })
            .collect();
        let mut inverse = invert(&band, reach);
        // A constant is to come back as it is, however short the inverse is cut.
        let weights: f64 = (-width..=width).map(at).sum();
        let sum: f64 = inverse[0] + 2.0 * inverse[1..].iter().sum::<f64>();
        inverse.iter_mut().for_each(|value| *value /= sum * weights);
        Self {
            period,
            basis: basis.iter().copied().map(to_f32).collect(),
            inverse: inverse.into_iter().map(to_f32).collect(),
        }
    }

    /// The samples that decide an area of coefficients; coefficient k is at sample `period` k.
    pub(super) fn support(&self, coefficients: &Area) -> Area {
        let margin = (self.inverse.len() - 1) * self.period + self.basis.len() - 1;
        let range = |range: &std::ops::Range<i64>| {
            let period = i64::try_from(self.period).unwrap_or(1);
            period * range.start..period * (range.end - 1) + 1
        };
        Area {
            rows: range(&coefficients.rows),
            columns: range(&coefficients.columns),
        }
        .grown([margin, margin])
    }

    /// The coefficients of an area, row by row and rounded to units, from the samples of its [`Self::support`].
    pub(super) fn fit(&self, coefficients: &Area, samples: &Samples) -> Vec<i32> {
        debug_assert_eq!(samples.area, self.support(coefficients));
        let [rows, columns] = coefficients.size();
        let half = self.fit_columns(rows, samples);
        let mut fitted = Vec::with_capacity(rows * columns);
        let mut line = vec![0.0; columns + 2 * (self.inverse.len() - 1)];
        let mut out = vec![0.0; columns];
        for row in half.chunks_exact(samples.columns) {
            self.project_line(row, &mut line);
            out.fill(0.0);
            let middle = self.inverse.len() - 1;
            for (distance, weight) in self.inverse.iter().enumerate() {
                let [before, after] = [middle - distance, middle + distance];
                add_pair(&mut out, *weight, &line[before..], &line[after..], distance);
            }
            fitted.extend(out.iter().copied().map(round));
        }
        fitted
    }

    /// Fits every column: `rows` rows of coefficients, each as wide as the samples.
    fn fit_columns(&self, rows: usize, samples: &Samples) -> Vec<f32> {
        let width = samples.columns;
        let middle = self.inverse.len() - 1;
        let mut projected = vec![0.0; (rows + 2 * middle) * width];
        for (index, out) in projected.chunks_exact_mut(width).enumerate() {
            let centre = index * self.period + self.basis.len() - 1;
            for (distance, weight) in self.basis.iter().enumerate() {
                let line = |row: usize| &samples.values[row * width..][..width];
                let (above, below) = (line(centre - distance), line(centre + distance));
                for ((out, above), below) in out.iter_mut().zip(above).zip(below) {
                    let pair = if distance == 0 {
                        units(*above)
                    } else {
                        units(*above) + units(*below)
                    };
                    *out += weight * pair;
                }
            }
        }
        let mut half = vec![0.0; rows * width];
        for (row, out) in half.chunks_exact_mut(width).enumerate() {
            for (distance, weight) in self.inverse.iter().enumerate() {
                let line = |index: usize| &projected[index * width..];
                let [before, after] = [row + middle - distance, row + middle + distance];
                add_pair(out, *weight, line(before), line(after), distance);
            }
        }
        half
    }

    /// The right side of the normal equations of one line.
    fn project_line(&self, samples: &[f32], out: &mut [f32]) {
        let margin = self.basis.len() - 1;
        for (index, out) in out.iter_mut().enumerate() {
            let around = &samples[index * self.period..][..2 * margin + 1];
            let mut sum = self.basis[0] * around[margin];
            for (distance, weight) in self.basis.iter().enumerate().skip(1) {
                sum += weight * (around[margin - distance] + around[margin + distance]);
            }
            *out = sum;
        }
    }
}

/// Adds a weight times what lies as far before as after; at distance 0 both are one.
fn add_pair(out: &mut [f32], weight: f32, before: &[f32], after: &[f32], distance: usize) {
    if distance == 0 {
        out.iter_mut()
            .zip(before)
            .for_each(|(out, value)| *out += weight * value);
        return;
    }
    for ((out, before), after) in out.iter_mut().zip(before).zip(after) {
        *out += weight * (before + after);
    }
}

/// The middle column of the inverse of a band repeated so often that its ends are not felt, as far as `reach`.
fn invert(band: &[f64], reach: usize) -> Vec<f64> {
    let (count, middle) = (8 * reach + 1, 4 * reach);
    let width = band.len();
    // Cholesky factor by rows: entry d of row k is L(k, k − d).
    let mut factor = vec![vec![0.0; width]; count];
    for k in 0..count {
        for d in (0..width.min(k + 1)).rev() {
            let shared: f64 = (d + 1..width.min(k + 1))
                .map(|e| factor[k][e] * factor[k - d][e - d])
                .sum();
            let rest = band[d] - shared;
            factor[k][d] = if d == 0 {
                rest.sqrt()
            } else {
                rest / factor[k - d][0]
            };
        }
    }
    let mut solution = vec![0.0; count];
    solution[middle] = 1.0;
    for k in 0..count {
        let known: f64 = (1..width.min(k + 1))
            .map(|d| factor[k][d] * solution[k - d])
            .sum();
        solution[k] = (solution[k] - known) / factor[k][0];
    }
    for k in (0..count).rev() {
        let known: f64 = (1..width.min(count - k))
            .map(|d| factor[k + d][d] * solution[k + d])
            .sum();
        solution[k] = (solution[k] - known) / factor[k][0];
    }
    solution[middle..=middle + reach].to_vec()
}

/// f32 keeps 24 bits, a unit at the limit of heights; steps are many units.
const fn units(height: i32) -> f32 {
    height as f32
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the nearest is meant"
)]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "heights are under 2^25 units; what is absurd saturates"
)]
fn round(value: f32) -> i32 {
    value.round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::CAGE_CONTROLS;
    use crate::pyramid::surface::base_heights;

    fn level(area: Area, height: impl Fn(i64, i64) -> i64) -> Samples {
        let columns = area.columns.clone();
        let places = area
            .rows
            .clone()
            .flat_map(|row| columns.clone().map(move |column| (row, column)));
        let heights = places.map(|(row, column)| i32::try_from(height(row, column)).unwrap());
        Samples::new(area.clone(), heights.collect())
    }

    fn fitted(fit: &Fit, area: &Area, height: impl Fn(i64, i64) -> i64) -> Vec<i32> {
        fit.fit(area, &level(fit.support(area), height))
    }

    #[test]
    fn piecewise_linear_data_comes_back_exactly() {
        let area = Area::new(0..129, 0..129);
        let coarse = fitted(&HATS, &area, |row, column| {
            40 * (row - 100).abs() - 12 * column
        });
        for (index, value) in (0..).zip(coarse) {
            let [row, column] = [index / 129, index % 129];
            assert_eq!(value, 40 * (2 * row - 100_i32).abs() - 24 * column);
        }
    }

    #[test]
    fn a_fit_is_no_worse_than_every_second_sample() {
        let rough = |row: i64, column: i64| (row * 37 + column * 91).rem_euclid(101) * 16;
        let area = Area::new(0..129, 0..129);
        let coarse = fitted(&HATS, &area, rough);
        let energy = |at: &dyn Fn(i64, i64) -> f64| -> f64 {
            let line = |row: i64, column: i64| at(row.div_euclid(2), column.div_euclid(2));
            (0..256)
                .flat_map(|row| (0..256).map(move |column| (row, column)))
                .map(|(row, column)| {
                    let [r, c] = [row % 2, column % 2];
                    let mean = (line(row, column)
                        + line(row + r, column)
                        + line(row, column + c)
                        + line(row + r, column + c))
                        / 4.0;
                    (mean - rough(row, column) as f64).powi(2)
                })
                .sum()
        };
        let index = |row: i64, column: i64| usize::try_from((row.min(128)) * 129 + column.min(128));
        let best = energy(&|row, column| f64::from(coarse[index(row, column).unwrap()]));
        let picked = energy(&|row, column| rough(2 * row, 2 * column) as f64);
        assert!(best < 0.8 * picked, "{best} {picked}");
    }

    #[test]
    fn any_part_is_fitted_as_the_whole_is() {
        let rough = |row: i64, column: i64| (row * row * 37 + column * 9_091).rem_euclid(30_011);
        for fit in [&*HATS, &*SPLINES] {
            let whole = fitted(fit, &Area::new(0..40, 0..70), rough);
            let part = fitted(fit, &Area::new(13..27, 31..70), rough);
            for (row, line) in part.chunks_exact(39).enumerate() {
                assert_eq!(line, &whole[(row + 13) * 70 + 31..][..39]);
            }
        }
    }

    #[test]
    fn a_cage_reproduces_its_own_surface() {
        // A bowl and a saddle: bends everywhere, but by the same amount, so that smoothing, whose pull is the fourth
        // differences, does not show. Rounding does: of the controls by half a unit, of the surface by another half.
        let bowl = |row: i64, column: i64| 12 * row * row + 4 * row * column - column;
        let area = Area::new(0..CAGE_CONTROLS, 0..CAGE_CONTROLS);
        let heights = base_heights(&fitted(&SPLINES, &area, bowl));
        // The cage's first control is lattice point −1, its sample −4.
        for (index, height) in (0..).zip(heights) {
            let [row, column] = [index / 129 + 4, index % 129 + 4];
            assert!((i64::from(height) - bowl(row, column)).abs() <= 1);
        }
    }
}
