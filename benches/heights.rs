//! Heights of a whole raster in memory, as experiments look at them: by fractions of its sides.
//!
//! Knows files only through `drumlin_core::dem`.

use std::path::Path;

use anyhow::{Result, bail};
use drumlin_core::{
    dem::{self, OpenOptions, Window},
    geo::WorldFrame,
};

/// Samples of an elevation model without voids, and the size of its ground in metres.
#[derive(Clone, Debug)]
pub struct Heights {
    columns: usize,
    rows: usize,
    samples: Vec<f32>,
    size: [f64; 2],
}

impl Heights {
    /// Reads a whole elevation model; voids take the mean of what lies around them.
    ///
    /// # Errors
    /// What is wrong with the file; nothing but voids in it; fewer than two samples along a side.
    pub fn read(file: &Path) -> Result<Self> {
        let raster = dem::open(file, &OpenOptions::default())?;
        let header = raster.header();
        let grid = &header.grid;
        let step = WorldFrame::new(grid, &header.crs).step(grid);
        let (columns, rows) = (grid.columns as usize, grid.rows as usize);
        let mut samples = Vec::with_capacity(rows * columns);
        let mut strip = Vec::new();
        for row in (0..grid.rows).step_by(STRIP_ROWS) {
            let rows = (grid.rows - row).min(STRIP_ROWS as u32);
            let window = Window {
                row,
                column: 0,
                rows,
                columns: grid.columns,
            };
            strip.resize(rows as usize * columns, 0.0);
            raster.read(window, &mut strip)?;
            samples.extend(strip.iter().map(|&height| height as f32));
        }
        let size = [
            step[0].abs() * (columns as f64 - 1.0),
            step[1].abs() * (rows as f64 - 1.0),
        ];
        fill_voids(columns, &mut samples);
        Self::new(columns, samples, size)
    }

    /// Of samples row by row, north first, on ground of so many metres from west to east and north to south.
    ///
    /// # Errors
    /// A void; fewer than two samples along a side, or an incomplete row.
    pub fn new(columns: usize, samples: Vec<f32>, size: [f64; 2]) -> Result<Self> {
        let rows = samples.len() / columns.max(1);
        if columns < 2 || rows < 2 || rows * columns != samples.len() {
            bail!(
                "{} samples are no rows of {columns}, two at least",
                samples.len()
            );
        }
        if let Some(at) = samples.iter().position(|height| !height.is_finite()) {
            let (row, column) = (at / columns, at % columns);
            bail!(
                "the elevation model has a void at row {row}, column {column}: choose one without"
            );
        }
        Ok(Self {
            columns,
            rows,
            samples,
            size,
        })
    }

    /// Metres from west to east and from north to south.
    #[must_use]
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The height at a place, bilinear: `x` 0 west to 1 east, `y` 0 north to 1 south.
    #[must_use]
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let (column, u) = split(x, self.columns);
        let (row, v) = split(y, self.rows);
        let sample = |down: usize, right: usize| {
            f64::from(self.samples[(row + down) * self.columns + column + right])
        };
        let north = (1.0 - u) * sample(0, 0) + u * sample(0, 1);
        let south = (1.0 - u) * sample(1, 0) + u * sample(1, 1);
        (1.0 - v) * north + v * south
    }
}

/// Gives every NaN the mean of the smallest square of samples, 2^n a side, that has a number in it.
fn fill_voids(columns: usize, samples: &mut [f32]) {
    let is_whole = samples.iter().all(|height| height.is_finite());
    if is_whole || columns == 0 || samples.len() < 2 {
        return;
    }
    let (rows, half) = (samples.len() / columns, columns.div_ceil(2));
    let mut sums = vec![(0.0_f64, 0_u32); half * rows.div_ceil(2)];
    let place = |at: usize| at / columns / 2 * half + at % columns / 2;
    for (at, &height) in samples
        .iter()
        .enumerate()
        .filter(|(_, height)| height.is_finite())
    {
        let (sum, count) = &mut sums[place(at)];
        *sum += f64::from(height);
        *count += 1;
    }
    let mean = |&(sum, count): &(f64, u32)| (sum / f64::from(count)) as f32;
    let mut means: Vec<_> = sums.iter().map(mean).collect();
    fill_voids(half, &mut means);
    for (at, height) in samples.iter_mut().enumerate() {
        if !height.is_finite() {
            *height = means[place(at)];
        }
    }
}

/// Rows read at once.
const STRIP_ROWS: usize = 512;

/// The cell of a fraction of a side with `count` samples, and the fraction within the cell.
fn split(fraction: f64, count: usize) -> (usize, f64) {
    let at = fraction.clamp(0.0, 1.0) * (count - 1) as f64;
    let cell = (at as usize).min(count - 2);
    (cell, at - cell as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_the_samples_and_straight_between() {
        let heights =
            Heights::new(3, vec![0.0, 1.0, 2.0, 4.0, 5.0, 6.0], [20.0, 10.0]).expect("samples");
        assert_eq!(heights.at([0.0, 0.0]), 0.0);
        assert_eq!(heights.at([1.0, 1.0]), 6.0);
        assert_eq!(heights.at([0.25, 0.5]), 2.5);
    }

    #[test]
    fn voids_take_the_mean_around_them() {
        let mut samples = vec![1.0, f32::NAN, 5.0, 7.0, 3.0, 2.0, f32::NAN, f32::NAN];
        fill_voids(4, &mut samples);
        assert_eq!(samples, [1.0, 2.0, 5.0, 7.0, 3.0, 2.0, 6.0, 6.0]);
        // A square without a number takes that of the next larger one.
        let mut samples = vec![f32::NAN; 16];
        samples[15] = 4.0;
        fill_voids(4, &mut samples);
        assert_eq!(samples, [4.0; 16]);
    }

    #[test]
    fn voids_and_ragged_rows_are_errors() {
        assert!(Heights::new(2, vec![0.0, f32::NAN, 1.0, 2.0], [1.0; 2]).is_err());
        assert!(Heights::new(2, vec![0.0; 5], [1.0; 2]).is_err());
    }
}
