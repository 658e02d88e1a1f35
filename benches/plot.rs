//! A plot of a few lines as a PNG: axes, ticks, a legend, in a font of its own.
//!
//! Knows nothing of what is plotted.

mod font;

use std::path::Path;

use anyhow::{Context as _, Result};
use image::{Rgb, RgbImage};

/// A line of the plot.
#[derive(Clone, Debug)]
pub struct Line {
    /// What the legend calls it.
    pub name: String,
    /// Its points from left to right.
    pub points: Vec<[f64; 2]>,
}

/// A plot of lines over one axis, from 0 upwards.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Above the plot.
    pub title: String,
    /// Below the horizontal axis.
    pub x_name: String,
    /// Above the vertical axis.
    pub y_name: String,
    /// The lines, in the order of the legend.
    pub lines: Vec<Line>,
}

const SIZE: [u32; 2] = [800, 480];
/// Of the axes' rectangle: left, top, right, bottom.
const FRAME: [f64; 4] = [80.0, 60.0, 780.0, 420.0];
const COLORS: [[u8; 3]; 4] = [[190, 60, 40], [40, 110, 180], [50, 140, 80], [120, 90, 150]];
const INK: [u8; 3] = [40, 40, 40];
const GRID: [u8; 3] = [225, 225, 225];
/// Pixels a dot of a letter.
const LETTER: i64 = 2;

impl Plot {
    /// Draws it and writes the PNG.
    ///
    /// # Errors
    /// When the file cannot be written, with its name.
    pub fn write_png(&self, file: &Path) -> Result<()> {
        let picture = self.draw();
        picture
            .save_with_format(file, image::ImageFormat::Png)
            .with_context(|| format!("{}: writing failed", file.display()))
    }

    fn draw(&self) -> RgbImage {
        let mut picture = RgbImage::from_pixel(SIZE[0], SIZE[1], Rgb([255; 3]));
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let most = |axis: usize| points().map(|at| at[axis]).fold(0.0, f64::max);
        let steps = [most(0), most(1)].map(tick_step);
        let ends = [
            most(0).max(steps[0]),
            (most(1) / steps[1]).ceil().max(1.0) * steps[1],
        ];
        let [left, top, right, bottom] = FRAME;
        let place = |[x, y]: [f64; 2]| {
            [
                left + (right - left) * x / ends[0],
                bottom - (bottom - top) * y / ends[1],
            ]
        };
        for axis in 0..2 {
            let mut tick = 0.0;
            while tick <= ends[axis] * (1.0 + 1e-9) {
                let name = tick_name(tick, steps[axis]);
                if axis == 0 {
                    let [x, _] = place([tick, 0.0]);
                    stroke(&mut picture, [[x, top], [x, bottom]], GRID, 0);
                    let x = x as i64 - font::width(&name, LETTER) / 2;
                    font::write(&mut picture, &name, [x, bottom as i64 + 8], (LETTER, INK));
                } else {
                    let [_, y] = place([0.0, tick]);
                    stroke(&mut picture, [[left, y], [right, y]], GRID, 0);
                    let x = left as i64 - 8 - font::width(&name, LETTER);
                    font::write(&mut picture, &name, [x, y as i64 - 7], (LETTER, INK));
                }
                tick += steps[axis];
            }
        }
        stroke(&mut picture, [[left, top], [left, bottom]], INK, 0);
        stroke(&mut picture, [[left, bottom], [right, bottom]], INK, 0);
        for (line, color) in self.lines.iter().zip(COLORS.iter().cycle()) {
            for pair in line.points.windows(2) {
                stroke(&mut picture, [place(pair[0]), place(pair[1])], *color, 1);
            }
        }
        self.write_names(&mut picture);
        picture
    }

    fn write_names(&self, picture: &mut RgbImage) {
        let [left, top, right, bottom] = FRAME.map(|at| at as i64);
        let x = (left + right - font::width(&self.x_name, LETTER)) / 2;
        font::write(picture, &self.title, [left, 8], (LETTER, INK));
        font::write(picture, &self.y_name, [8, top - 30], (LETTER, INK));
        font::write(picture, &self.x_name, [x, bottom + 32], (LETTER, INK));
        let mut x = right;
        for (index, line) in self.lines.iter().enumerate().rev() {
            let color = COLORS[index % COLORS.len()];
            x -= font::width(&line.name, LETTER) + 18;
            font::write(picture, &line.name, [x, top - 30], (LETTER, color));
        }
    }
}

/// A step of 1, 2 or 5 times a power of ten with about six steps up to `most`.
fn tick_step(most: f64) -> f64 {
    let rough = (most / 6.0).max(f64::MIN_POSITIVE);
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|step| step * power >= rough);
    step.unwrap_or(10.0) * power
}

fn tick_name(tick: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{tick:.decimals$}")
}

/// A line of dots, each a square that reaches `half` to all sides.
fn stroke(picture: &mut RgbImage, [from, to]: [[f64; 2]; 2], color: [u8; 3], half: i64) {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let count = dx.abs().max(dy.abs()).ceil().max(1.0);
    for index in 0..=count as i64 {
        let along = index as f64 / count;
        let [x, y] = [from[0] + along * dx, from[1] + along * dy].map(|at| at.round() as i64);
        for row in -half..=half {
            for column in -half..=half {
                dot(picture, [x + column, y + row], color);
            }
        }
    }
}

/// Colours a pixel, if it is one of the picture.
fn dot(picture: &mut RgbImage, at: [i64; 2], color: [u8; 3]) {
    let [Ok(x), Ok(y)] = at.map(u32::try_from) else {
        return;
    };
    if let Some(pixel) = picture.get_pixel_mut_checked(x, y) {
        *pixel = Rgb(color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_about_six() {
        for (most, step) in [(6.0, 1.0), (100.0, 20.0), (0.3, 0.05), (4300.0, 1000.0)] {
            assert!((tick_step(most) - step).abs() < 1e-9 * step, "{most}");
        }
        assert_eq!(tick_name(0.15, 0.05), "0.15");
        assert_eq!(tick_name(3000.0, 1000.0), "3000");
    }

    #[test]
    fn a_line_is_drawn_from_its_first_point_to_its_last() {
        let plot = Plot {
            title: "A test".into(),
            x_name: "x".into(),
            y_name: "y".into(),
            lines: vec![Line {
                name: "level".into(),
                points: vec![[0.0, 5.0], [10.0, 5.0]],
            }],
        };
        let picture = plot.draw();
        let row = |y: u32| {
            (0..SIZE[0])
                .filter(move |&x| picture.get_pixel(x, y).0 == COLORS[0])
                .count()
        };
        // The line ends at the frame's right side, and the vertical axis ends at 5.
        assert!(row(FRAME[1] as u32) >= 700);
    }
}
