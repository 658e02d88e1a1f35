//! A picture of a cage's tables: triangles over a depth buffer, on the processor, lit from where the camera is.
//!
//! Every face of the cage is drawn in the same grid of steps whatever its patches are, so that pictures of two ways of
//! refining differ by their surfaces and not by their triangles.

use anyhow::{Context as _, Result};
use drumlin_core::{
    cage::Cage,
    fas::{PatchPattern, Positions},
};
use glam::{DVec2, DVec3};
use image::{Rgb, RgbImage};

use crate::errors::blocks_at;

const FOV: f64 = 45.0 / 180.0 * std::f64::consts::PI;
/// Levels a face's grid of steps is halved by: 16 steps a side.
const GRID_LEVEL: u8 = 4;
/// Where there is nothing; what is drawn is grey.
const BACKGROUND: Rgb<u8> = Rgb([40, 44, 52]);
/// Pixels a degree that the difference of pictures is told for: FLIP's own choice (a 4K screen 0.7 m wide at 0.7 m).
const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// Looks at a whole cage.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Pixels a side.
    size: u32,
    eye: DVec3,
    /// Right, up and ahead.
    axes: [DVec3; 3],
}

impl Camera {
    /// Pixels a radian at the picture's middle.
    #[must_use]
    pub fn pixels_per_radian(&self) -> f64 {
        f64::from(self.size) / (2.0 * (0.5 * FOV).tan())
    }

    /// Just so far that the ball around the cage's middle that holds the cage fills a picture of `size` pixels a side.
    #[must_use]
    pub fn before(cage: &Cage, size: u32) -> Self {
        let points = || cage.positions().iter().map(|&point| DVec3::from(point));
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let middle = 0.5 * (low + high);
        let radius = points().map(|point| point.distance(middle));
        let distance = radius.fold(0.0, f64::max) / (0.5 * FOV).sin();
        let ahead = DVec3::new(-0.6, 0.7, -0.4).normalize();
        let right = ahead.cross(DVec3::Z).normalize();
        Self {
            size,
            eye: middle - distance * ahead,
            axes: [right, right.cross(ahead), ahead],
        }
    }

    /// Where the camera is.
    #[must_use]
    pub fn eye(&self) -> [f64; 3] {
        self.eye.to_array()
    }

    /// Column, row and distance ahead.
    fn project(&self, point: DVec3) -> DVec3 {
        let seen = point - self.eye;
        let [right, up, ahead] = self.axes.map(|axis| axis.dot(seen));
        let half = 0.5 * f64::from(self.size);
        let scale = self.pixels_per_radian() / ahead;
        DVec3::new(half + scale * right, half - scale * up, ahead)
    }
}

/// Draws a cage refined to these depths, one a vertex.
///
/// # Errors
/// When the depths do not fit the cage.
pub fn draw(cage: &Cage, depths: &[u8], camera: &Camera) -> Result<RgbImage> {
    let blocks = blocks_at(cage, depths)?;
    let positions = Positions::new(&blocks, cage.positions());
    let patterns: Vec<_> = (0..=GRID_LEVEL).map(Grid::new).collect();
    let mut canvas = Canvas::new(camera.size);
    for part in 0..blocks.part_count() {
        positions.visit_part(&blocks, part, &mut |piece| {
            let steps = GRID_LEVEL - piece.place.level.min(GRID_LEVEL);
            let grid = &patterns[usize::from(steps)];
            let [mut at, mut du, mut dv] =
                [0, 1, 2].map(|_| vec![[0.0; 3]; grid.pattern.place_count()]);
            grid.pattern.jets_into(piece, [&mut at, &mut du, &mut dv]);
            let corners = at.iter().zip(du.iter().zip(&dv)).map(|(&at, (&du, &dv))| {
                let at = DVec3::from(at);
                Corner {
                    seen: camera.project(at),
                    light: light(camera, at, DVec3::from(du).cross(DVec3::from(dv))),
                }
            });
            grid.triangles(&corners.collect::<Vec<_>>(), &mut canvas);
        });
    }
    Ok(canvas.picture)
}

/// The mean of FLIP over the pixels that either picture has something in, 0 where they are equal and 1 at most.
///
/// Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (2020).
///
/// # Errors
/// When they are not of one size.
pub fn mean_difference(one: &RgbImage, other: &RgbImage) -> Result<f64> {
    let background = |pixels: (&Rgb<u8>, &Rgb<u8>)| pixels == (&BACKGROUND, &BACKGROUND);
    let empty = one.pixels().zip(other.pixels()).map(background);
    let empty: Vec<_> = empty.collect();
    let [one, other] = [one, other].map(|picture| {
        nv_flip::FlipImageRgb8::with_data(picture.width(), picture.height(), picture)
    });
    anyhow::ensure!(
        [one.width(), one.height()] == [other.width(), other.height()],
        "pictures of two sizes cannot be compared"
    );
    let map = nv_flip::flip(one, other, PIXELS_PER_DEGREE);
    let shown = map.to_vec().into_iter().zip(empty);
    let shown = shown.filter_map(|(difference, empty)| (!empty).then_some(difference));
    let shown: Vec<_> = shown.map(f64::from).collect();
    Ok(shown.iter().sum::<f64>() / shown.len().max(1) as f64)
}

/// Steps of a patch.
struct Grid {
    steps: usize,
    pattern: PatchPattern<f64>,
}

impl Grid {
    fn new(level: u8) -> Self {
        let steps = 1_usize << level;
        let step = |index: usize| index as f64 / steps as f64;
        let row = |v: usize| (0..=steps).map(move |u| [step(u), step(v)]);
        let places: Vec<_> = (0..=steps).flat_map(row).collect();
        Self {
            steps,
            pattern: PatchPattern::new(&places),
        }
    }

    fn triangles(&self, corners: &[Corner], canvas: &mut Canvas) {
        let side = self.steps + 1;
        for first in (0..self.steps).flat_map(|v| (0..self.steps).map(move |u| v * side + u)) {
            let [a, b, c, d] = [0, 1, side + 1, side].map(|offset| corners[first + offset]);
            canvas.triangle([a, b, c]);
            canvas.triangle([a, c, d]);
        }
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    seen: DVec3,
    light: f64,
}

/// A lamp over the camera's shoulder on white plaster that shines a little, so that normals show.
fn light(camera: &Camera, at: DVec3, normal: DVec3) -> f64 {
    let [right, up, ahead] = camera.axes;
    let lamp = (0.5 * up - 0.4 * right - ahead).normalize();
    let to_eye = (camera.eye - at).normalize();
    let normal = normal.normalize_or_zero();
    let normal = normal * normal.dot(to_eye).signum();
    let half = (lamp + to_eye).normalize();
    let shine = normal.dot(half).max(0.0).powi(40);
    0.1 + 0.65 * normal.dot(lamp).max(0.0) + 0.25 * shine
}

struct Canvas {
    picture: RgbImage,
    distances: Vec<f64>,
}

impl Canvas {
    fn new(size: u32) -> Self {
        Self {
            picture: RgbImage::from_pixel(size, size, BACKGROUND),
            distances: vec![f64::INFINITY; (size * size) as usize],
        }
    }

    /// Fills the pixels whose middles are in a triangle, where nothing nearer is.
    fn triangle(&mut self, corners: [Corner; 3]) {
        let size = self.picture.width();
        let [a, b, c] = corners.map(|corner| corner.seen.truncate());
        let area = (b - a).perp_dot(c - a);
        let low = a.min(b).min(c).max(DVec2::ZERO);
        let high = a.max(b).max(c).min(DVec2::splat(f64::from(size)));
        if area == 0.0 || low.x >= high.x || low.y >= high.y {
            return;
        }
        // Both are within the picture.
        let pixels = |from: f64, to: f64| from as u32..(to.ceil() as u32).min(size);
        for row in pixels(low.y, high.y) {
            for column in pixels(low.x, high.x) {
                let at = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
                let weights = [(b, c), (c, a), (a, b)];
                let weights = weights.map(|(from, to)| (to - from).perp_dot(at - from) / area);
                if weights.iter().any(|&weight| weight < 0.0) {
                    continue;
                }
                let mix = |of: fn(&Corner) -> f64| -> f64 {
                    weights
                        .iter()
                        .zip(&corners)
                        .map(|(weight, corner)| weight * of(corner))
                        .sum()
                };
                // Small triangles: distance and light change as good as evenly over the picture.
                let distance = mix(|corner| corner.seen.z);
                let nearest = &mut self.distances[(row * size + column) as usize];
                if distance < *nearest {
                    *nearest = distance;
                    let grey = (255.0 * mix(|corner| corner.light)).round() as u8;
                    self.picture.put_pixel(column, row, Rgb([grey; 3]));
                }
            }
        }
    }
}

/// Writes a picture as PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn save(picture: &RgbImage, file: &std::path::Path) -> Result<()> {
    picture
        .save(file)
        .with_context(|| format!("{}: writing failed", file.display()))
}

#[cfg(test)]
mod tests {
    use drumlin_core::cage::{CageBudget, read_obj};

    use super::*;

    #[test]
    fn a_cube_is_seen_and_its_refinement_is_all_the_difference() -> Result<()> {
        let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
            f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
        let cage = read_obj(cube.as_bytes(), CageBudget::default())?;
        let camera = Camera::before(&cage, 120);
        let [coarse, fine] = [1, 6].map(|depth| draw(&cage, &[depth; 8], &camera));
        let (coarse, fine) = (coarse?, fine?);
        let shown = fine.pixels().filter(|&&pixel| pixel != BACKGROUND).count();
        let share = shown as f64 / f64::from(120 * 120);
        assert!((0.1..0.8).contains(&share), "{share} of the picture");
        assert!(mean_difference(&fine, &fine)? < 1e-9);
        let difference = mean_difference(&coarse, &fine)?;
        assert!((1e-6..0.02).contains(&difference), "{difference}");
        Ok(())
    }
}
