//! The surface of one tile on the CPU: the planes of its triangles, its boxes, its mesh.
//!
//! Beside `surface`, which finds the tile of a place and keeps tiles, and `raycast`, which walks over their blocks. Knows
//! one tile and which of its cells features stand in; knows neither other tiles nor what those features look like.

use std::sync::OnceLock;

use super::features::cut_bits;
use crate::{
    geo::{QUAD_SAMPLES, TILE_CELLS, TILE_QUADS, TILE_SAMPLES, TileId},
    pyramid::{Tile, feature::FeatureGroup, surface},
};

/// Cells a side of a block: the least part of a tile that has its own box.
pub(super) const BLOCK_CELLS: usize = 8;
/// Blocks a side of a tile.
pub(super) const BLOCKS: usize = TILE_CELLS / BLOCK_CELLS;

/// A triangle mesh of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collider {
    /// World metres that positions are relative to.
    pub origin: [f64; 3],
    /// Metres east, north and up of the origin.
    pub positions: Vec<[f32; 3]>,
    /// Three a triangle, counter-clockwise seen from above.
    pub indices: Vec<u32>,
}

/// A tile, what stands in it, and its heights once they are asked for.
pub(super) struct TileSurface {
    pub(super) tile: Tile,
    /// Features that stand in the place of some of its patches, and a bit for every such patch.
    pub(super) features: Vec<FeatureGroup>,
    cut: Option<Box<[u32; 32]>>,
    heights: OnceLock<Heights>,
}

/// Heights of a tile, and the least and greatest of every block.
pub(super) struct Heights {
    pub(super) samples: Vec<i32>,
    pub(super) blocks: Vec<[i32; 2]>,
}

/// A place among the finest samples.
pub(super) struct Spot {
    pub(super) tile: TileId,
    /// Row and column of its cell in the tile.
    pub(super) cell: [usize; 2],
    /// Where in the cell: x east, y south, 0 to 1.
    pub(super) part: [f64; 2],
}

/// Where the samples of a tile are in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct TileFrame {
    /// World x and y of sample (0, 0).
    pub(super) corner: [f64; 2],
    /// Metres a column and a row.
    pub(super) step: [f64; 2],
    /// Metres a unit.
    pub(super) unit: f64,
    /// Rows and columns of cells that lie in the data set.
    pub(super) cells: [usize; 2],
}

/// A place on a triangle: its height, and the slopes there.
pub(super) struct Plane {
    /// Metres.
    pub(super) height: f64,
    /// Metres up a metre east and a metre north.
    pub(super) slope: [f64; 2],
}

impl Plane {
    /// The upward unit normal.
    pub(super) fn normal(&self) -> [f64; 3] {
        let [east, north] = self.slope;
        let length = (east * east + north * north + 1.0).sqrt();
        [-east / length, -north / length, 1.0 / length]
    }
}

impl TileSurface {
    pub(super) fn new(id: TileId, tile: Tile, features: Vec<FeatureGroup>) -> Self {
        Self {
            cut: cut_bits(id, &features),
            features,
            tile,
            heights: OnceLock::new(),
        }
    }

    pub(super) fn heights(&self) -> &Heights {
        self.heights.get_or_init(|| {
            let samples =
                surface::decode_heights(&self.tile.controls, &self.tile.detail, self.tile.step);
            let blocks = (0..BLOCKS * BLOCKS)
                .map(|block| range(&samples, block))
                .collect();
            Heights { samples, blocks }
        })
    }

    /// True for a cell that a feature stands in the place of.
    fn is_cut(&self, row: usize, column: usize) -> bool {
        let [row, column] = [row, column].map(|cell| cell / QUAD_SAMPLES);
        self.cut
            .as_ref()
            .is_some_and(|bits| bits[row] >> column & 1 != 0)
    }

    /// The feature that stands in the place of a place's cell.
    pub(super) fn feature_at(&self, spot: &Spot) -> Option<&FeatureGroup> {
        let tile = [spot.tile.row, spot.tile.column];
        let [row, column] =
            [0, 1].map(|axis| tile[axis] as usize * TILE_QUADS + spot.cell[axis] / QUAD_SAMPLES);
        self.features.iter().find(|group| {
            let [row0, column0, row1, column1] = group.cut.map(|patch| patch as usize);
            (row0..row1).contains(&row) && (column0..column1).contains(&column)
        })
    }

    /// True when a triangle of a cell is there: no feature is in its place, and it has no void corner.
    pub(super) fn has_triangle(&self, row: usize, column: usize, lower: bool) -> bool {
        !self.is_cut(row, column)
            && corners(row, column, lower)
                .iter()
                .all(|&[row, column]| !self.tile.is_void(row, column))
    }

    /// The plane of the samples at a place. Corners without weight have no say, so that edges and samples belong to
    /// whichever triangle is there.
    pub(super) fn plane(&self, spot: &Spot, frame: &TileFrame) -> Option<Plane> {
        let ([row, column], [x, y]) = (spot.cell, spot.part);
        let lower = y >= x;
        let weights = if lower {
            [1.0 - y, y - x, x]
        } else {
            [1.0 - x, y, x - y]
        };
        let mut corners = corners(row, column, lower).into_iter().zip(weights);
        if corners.any(|([row, column], weight)| weight > 0.0 && self.tile.is_void(row, column)) {
            return None;
        }
        let (height, slope) = self.units(row, column, lower, [x, y]);
        let slope = [
            slope[0] * frame.unit / frame.step[0],
            slope[1] * frame.unit / frame.step[1],
        ];
        Some(Plane {
            height: height * frame.unit,
            slope,
        })
    }

    /// Height and slopes a column and a row of a triangle's plane, in units.
    pub(super) fn units(
        &self,
        row: usize,
        column: usize,
        lower: bool,
        [x, y]: [f64; 2],
    ) -> (f64, [f64; 2]) {
        let samples = &self.heights().samples;
        let at = |down: usize, right: usize| {
            f64::from(samples[(row + down) * TILE_SAMPLES + column + right])
        };
        let (nw, se) = (at(0, 0), at(1, 1));
        let slope = if lower {
            [se - at(1, 0), at(1, 0) - nw]
        } else {
            [at(0, 1) - nw, se - at(0, 1)]
        };
        (nw + x * slope[0] + y * slope[1], slope)
    }

    /// The mesh of every `stride`th sample where the data set has data; at stride 1 without the cells of features.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "positions in a tile are f32"
    )]
    pub(super) fn collider(&self, frame: &TileFrame, stride: usize) -> Collider {
        let heights = self.heights();
        let side = TILE_CELLS / stride + 1;
        let base = f64::from(self.tile.summary.min) * frame.unit;
        let position = |at: usize| {
            let (row, column) = (at / side * stride, at % side * stride);
            let height =
                f64::from(heights.samples[row * TILE_SAMPLES + column]) * frame.unit - base;
            [
                (column as f64 * frame.step[0]) as f32,
                (row as f64 * frame.step[1]) as f32,
                height as f32,
            ]
        };
        let mut indices = Vec::new();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "at most 129 × 129 vertices"
        )]
        let vertex = |[row, column]: [usize; 2]| (row * side + column) as u32;
        for (row, column) in
            (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| (row, column)))
        {
            let is_outside =
                (row + 1) * stride > frame.cells[0] || (column + 1) * stride > frame.cells[1];
            if is_outside || stride == 1 && self.is_cut(row, column) {
                continue;
            }
            for triangle in [true, false].map(|lower| corners(row, column, lower)) {
                if triangle
                    .iter()
                    .all(|&[row, column]| !self.tile.is_void(row * stride, column * stride))
                {
                    indices.extend(triangle.map(vertex));
                }
            }
        }
        let origin = [frame.corner[0], frame.corner[1], base];
        Collider {
            origin,
            positions: (0..side * side).map(position).collect(),
            indices,
        }
    }
}

/// The corners of a triangle of a cell, as row, column: the lower one is NW, SW, SE, the upper one NW, SE, NE.
fn corners(row: usize, column: usize, lower: bool) -> [[usize; 2]; 3] {
    let third = if lower {
        [row + 1, column]
    } else {
        [row, column + 1]
    };
    let (first, diagonal) = ([row, column], [row + 1, column + 1]);
    if lower {
        [first, third, diagonal]
    } else {
        [first, diagonal, third]
    }
}

/// Least and greatest sample of a block.
fn range(samples: &[i32], block: usize) -> [i32; 2] {
    let (row, column) = (block / BLOCKS * BLOCK_CELLS, block % BLOCKS * BLOCK_CELLS);
    let rows = samples
        .chunks_exact(TILE_SAMPLES)
        .skip(row)
        .take(BLOCK_CELLS + 1);
    let within = rows.flat_map(|row| &row[column..=column + BLOCK_CELLS]);
    within.fold([i32::MAX, i32::MIN], |[low, high], &height| {
        [low.min(height), high.max(height)]
    })
}
