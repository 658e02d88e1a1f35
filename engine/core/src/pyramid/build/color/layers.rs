//! The images, where each lies, and which tiles they give a picture.

use std::f64::consts::SQRT_2;

use super::super::options::Imagery;
use super::STEPS;
use crate::dem::Image;
use crate::geo::{Extent, Grid, TILE_CELLS, TileId};

/// All images, the later ones over the earlier ones.
pub(super) struct Layers<'a> {
    pub(super) grid: &'a Grid,
    layers: Vec<Layer<'a>>,
}

/// An image and where it lies.
pub(super) struct Layer<'a> {
    pub(super) image: &'a Image,
    pub(super) extent: Extent,
    /// Levels that it deserves.
    pub(super) levels: u8,
}

/// Levels of imagery that pictures make.
pub(in super::super) fn level_count(imagery: &Imagery<'_>, grid: &Grid) -> u8 {
    Layers::new(imagery, grid).levels()
}

impl<'a> Layers<'a> {
    pub(super) fn new(imagery: &Imagery<'a>, grid: &'a Grid) -> Self {
        let layers = imagery.images.iter().map(|image| Layer::new(image, grid));
        Self {
            grid,
            layers: layers.collect(),
        }
    }

    /// As many levels as the finest image deserves.
    pub(super) fn levels(&self) -> u8 {
        self.layers
            .iter()
            .map(|layer| layer.levels)
            .max()
            .unwrap_or(0)
    }

    /// True when a tile has texels of its own: where an image lies that deserves its level. Elsewhere its parent's show
    /// all there is.
    pub(super) fn has(&self, tile: TileId) -> bool {
        let side = f64::from(self.grid.stride(tile.level)) * TILE_CELLS as f64;
        let corner = |row: u32, column: u32| {
            self.grid
                .position(f64::from(row) * side, f64::from(column) * side)
        };
        let [west, north] = corner(tile.row, tile.column);
        let [east, south] = corner(tile.row + 1, tile.column + 1);
        let touches = |layer: &&Layer<'_>| {
            let Extent { min, max } = layer.extent;
            min[0] < east && max[0] > west && min[1] < north && max[1] > south
        };
        let mut finer = self.layers.iter().filter(|layer| layer.levels > tile.level);
        self.grid.has(tile) && finer.any(|layer| touches(&layer))
    }

    /// The images that a level shows where no finer level does: those that deserve no finer one, the uppermost first.
    pub(super) fn shown_at(&self, level: u8) -> impl Iterator<Item = &Layer<'a>> {
        let coarse = move |layer: &&Layer<'_>| layer.levels <= level + 1;
        self.layers.iter().rev().filter(coarse)
    }
}

impl<'a> Layer<'a> {
    /// An image that does not say where it lies covers the samples' own squares.
    fn new(image: &'a Image, grid: &Grid) -> Self {
        let all = grid.extent();
        let half = grid.step.map(|step| 0.5 * step.abs());
        let squares = Extent {
            min: [all.min[0] - half[0], all.min[1] - half[1]],
            max: [all.max[0] + half[0], all.max[1] + half[1]],
        };
        let mut layer = Self {
            image,
            extent: image.extent.unwrap_or(squares),
            levels: 0,
        };
        layer.levels = layer.level_count(grid);
        layer
    }

    /// Pixels a finest sample, down and across.
    pub(super) fn pixels_per_sample(&self, grid: &Grid) -> [f64; 2] {
        let span = [
            self.extent.max[1] - self.extent.min[1],
            self.extent.max[0] - self.extent.min[0],
        ];
        [
            f64::from(self.image.height) / span[0] * grid.step[1].abs(),
            f64::from(self.image.width) / span[1] * grid.step[0].abs(),
        ]
    }

    /// As many levels as the image's resolution deserves: texels no wider than 1.4 pixels.
    fn level_count(&self, grid: &Grid) -> u8 {
        let [down, across] = self.pixels_per_sample(grid);
        let finest_pixel = down.max(across);
        let enough = |level: &u8| samples_per_texel(grid, *level) * finest_pixel <= SQRT_2;
        (0..grid.level_count())
            .find(enough)
            .map_or(grid.level_count(), |level| level + 1)
    }
}

/// Finest samples from a texel of a level to the next.
pub(super) fn samples_per_texel(grid: &Grid, level: u8) -> f64 {
    f64::from(grid.stride(level)) * TILE_CELLS as f64 / STEPS as f64
}
