//! True errors: how far a tile's triangles lie from the finest samples as stored.
//!
//! ```text
//! a cell of a coarser grid over finest samples     wedges of a fan: one edge, split or not
//!   NW · · · NE                                      NW───────NE        NW───N───NE
//!    · \ · · ·                                         \     /            \  │  /
//!    · · \ · ·   value inside: linear on NW-SW-SE       \   /              \ │ /
//!    · · · \ ·   and NW-SE-NE                             C                  C
//!   SW · · · SE
//! ```
//!
//! Sides are powers of two and heights integers, so every value inside a triangle is exact in f64, and so are the
//! errors. Every edge of a fan is cut for itself: the worst of all fans is the worst of all wedges.

use rayon::prelude::*;

use super::samples::{BitGrid, LevelSamples};
use crate::geo::{PATCH_COUNT, QUAD_SAMPLES, TILE_QUADS, TILE_SAMPLES};

/// The finest samples as stored, as far as they are data.
#[derive(Clone, Copy)]
pub(super) struct Finest<'a> {
    values: &'a [i32],
    width: usize,
    rows: usize,
    columns: usize,
    voids: Option<&'a BitGrid>,
}

impl<'a> Finest<'a> {
    /// The first rows and columns of the finest level.
    pub(super) fn new(level: &'a LevelSamples, [rows, columns]: [usize; 2]) -> Self {
        Self {
            values: &level.values,
            width: level.columns,
            rows,
            columns,
            voids: level.voids.as_ref(),
        }
    }

    /// Least and greatest height that is not void.
    pub(super) fn range(&self) -> [i32; 2] {
        let row_range = |row: usize| {
            let line = &self.values[row * self.width..][..self.columns];
            let data = line
                .iter()
                .enumerate()
                .filter(|(column, _)| self.voids.is_none_or(|voids| !voids.get(row, *column)));
            data.fold([i32::MAX, i32::MIN], |[min, max], (_, value)| {
                [min.min(*value), max.max(*value)]
            })
        };
        let join = |a: [i32; 2], b: [i32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        (0..self.rows)
            .into_par_iter()
            .map(row_range)
            .reduce(|| [i32::MAX, i32::MIN], join)
    }

    /// The greatest distance of samples `first` … `last` of a row from the line that is `value` at `first`.
    fn span(&self, row: usize, first: usize, last: usize, value: f64, slope: f64) -> f64 {
        let last = last.min(self.columns - 1);
        if first > last {
            return 0.0;
        }
        let line = &self.values[row * self.width + first..=row * self.width + last];
        match self.voids {
            Some(voids) if voids.any_in(row, first, last) => {
                let data = line
                    .iter()
                    .enumerate()
                    .filter(|(place, _)| !voids.get(row, first + place));
                data.fold(0.0, |worst: f64, (place, height)| {
                    worst.max(off(place, *height, value, slope))
                })
            }
            _ => worst_of(line, value, slope),
        }
    }

    /// The greatest error of a cell cut from north-west to south-east.
    fn plain(&self, cell: &Cell) -> f64 {
        let [nw, ne, sw, se] = cell.corners;
        let side = cell.side as f64;
        let mut worst = 0.0_f64;
        for (y, row) in cell.rows(self.rows) {
            let down = y as f64 / side;
            let west = nw + (sw - nw) * down;
            let middle = nw + (se - nw) * down;
            let [x0, x1, x2] = [cell.column, cell.column + y, cell.column + cell.side];
            worst = worst.max(self.span(row, x0, x1, west, (se - sw) / side));
            worst = worst.max(self.span(row, x1, x2, middle, (ne - nw) / side));
        }
        worst
    }

    /// The greatest errors of the wedges of a cell's fan: of its north, east, south and west edge, whole and split.
    fn wedges(&self, cell: &Cell, centre: f64, middles: [f64; 4]) -> [[f64; 2]; 4] {
        let [nw, ne, sw, se] = cell.corners;
        let half = cell.side / 2;
        let h = half as f64;
        let mut worst = [[0.0_f64; 2]; 4];
        // North and south wedges: two lines a row when split.
        let ends = [(0, nw, ne), (2, sw, se)];
        // East and west wedges: the row is on one side of the middle or the other.
        for (y, row) in cell.rows(self.rows) {
            let (edge, a, b) = ends[usize::from(y > half)];
            let inset = y.min(cell.side - y);
            let up = inset as f64 / h;
            let [x0, x1, x2, x3] =
                [0, inset, cell.side - inset, cell.side].map(|x| cell.column + x);
            let middle_x = cell.column + half;
            // Along the row, from the diagonal to the diagonal.
            let mean = 0.5 * (a + b);
            let whole = mean + (centre - mean) * up;
            let slope = (b - a) / (2.0 * h);
            let reach = (half - inset) as f64;
            worst[edge][0] =
                worst[edge][0].max(self.span(row, x1, x2, whole - slope * reach, slope));
            let middle = middles[edge] + (centre - middles[edge]) * up;
            let [left, right] = [(middles[edge] - a) / h, (b - middles[edge]) / h];
            let split = self.span(row, x1, middle_x, middle - left * reach, left);
            worst[edge][1] = worst[edge][1]
                .max(split)
                .max(self.span(row, middle_x, x2, middle, right));
            // From the west edge to the diagonal, and from the diagonal to the east edge.
            for (edge, north, south, first, last) in [(3, nw, sw, x0, x1), (1, ne, se, x2, x3)] {
                let down = y as f64 / (2.0 * h);
                let whole = north + (south - north) * down;
                let split = if y <= half {
                    north + (middles[edge] - north) * (y as f64 / h)
                } else {
                    middles[edge] + (south - middles[edge]) * ((y - half) as f64 / h)
                };
                for (kind, value, rest) in
                    [(0, whole, 0.5 * (north + south)), (1, split, middles[edge])]
                {
                    let slope = (centre - rest) / h;
                    let off = if edge == 3 {
                        self.span(row, first, last, value, slope)
                    } else {
                        self.span(row, first, last, value + slope * inset as f64, -slope)
                    };
                    worst[edge][kind] = worst[edge][kind].max(off);
                }
            }
        }
        worst
    }
}

/// Heights of a row against a line: the greatest distance, on four accumulators so that it vectorises.
fn worst_of(line: &[i32], value: f64, slope: f64) -> f64 {
    let mut worst = [0.0_f64; 4];
    let chunks = line.chunks_exact(4);
    let rest = chunks.remainder();
    let tail = line.len() - rest.len();
    for (index, chunk) in chunks.enumerate() {
        for lane in 0..4 {
            let distance = off(4 * index + lane, chunk[lane], value, slope);
            worst[lane] = if distance > worst[lane] {
                distance
            } else {
                worst[lane]
            };
        }
    }
    for (place, height) in rest.iter().enumerate() {
        worst[place] = worst[place].max(off(tail + place, *height, value, slope));
    }
    worst[0].max(worst[1]).max(worst[2]).max(worst[3])
}

fn off(place: usize, height: i32, value: f64, slope: f64) -> f64 {
    (value + slope * place as f64 - f64::from(height)).abs()
}

/// A square of finest samples with heights at its corners: north-west, north-east, south-west, south-east.
struct Cell {
    row: usize,
    column: usize,
    side: usize,
    corners: [f64; 4],
}

impl Cell {
    /// Rows of the cell that are data, counted from its north edge and absolutely.
    fn rows(&self, row_count: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..=self.side)
            .map(|y| (y, self.row + y))
            .take_while(move |(_, row)| *row < row_count)
    }
}

/// The errors of a tile, in units.
pub(super) struct TileErrors {
    /// Greatest error of the tile's triangles at stride 1.
    pub(super) whole: f64,
    /// Greatest errors of each patch at depths 0 and 1, plain or with any template.
    pub(super) patches: Vec<[f64; 2]>,
}

/// Measures a tile: its 129 × 129 heights against the finest samples under it, which are `stride` to one of its own.
pub(super) fn measure(
    heights: &[i32],
    first: [usize; 2],
    stride: usize,
    finest: &Finest<'_>,
) -> TileErrors {
    let grid = TileGrid {
        heights,
        first,
        stride,
    };
    let measured: Vec<[f64; 3]> = (0..PATCH_COUNT)
        .into_par_iter()
        .with_min_len(TILE_QUADS)
        .map(|patch| grid.measure_patch([patch / TILE_QUADS, patch % TILE_QUADS], finest))
        .collect();
    TileErrors {
        whole: measured
            .iter()
            .fold(0.0, |worst, [whole, ..]| worst.max(*whole)),
        patches: measured
            .iter()
            .map(|[_, coarse, middle]| [*coarse, *middle])
            .collect(),
    }
}

/// A tile's own samples over the finest ones.
struct TileGrid<'a> {
    heights: &'a [i32],
    first: [usize; 2],
    stride: usize,
}

impl TileGrid<'_> {
    fn at(&self, row: usize, column: usize) -> f64 {
        f64::from(self.heights[row * TILE_SAMPLES + column])
    }

    /// The cell whose north-west corner is an own sample, `side` own samples wide.
    fn cell(&self, row: usize, column: usize, side: usize) -> Cell {
        Cell {
            row: self.first[0] + row * self.stride,
            column: self.first[1] + column * self.stride,
            side: side * self.stride,
            corners: [
                self.at(row, column),
                self.at(row, column + side),
                self.at(row + side, column),
                self.at(row + side, column + side),
            ],
        }
    }

    /// Errors at stride 1, of depth 0 and of depth 1.
    fn measure_patch(&self, patch: [usize; 2], finest: &Finest<'_>) -> [f64; 3] {
        let [row, column] = patch.map(|index| index * QUAD_SAMPLES);
        if self.first[0] + row * self.stride >= finest.rows
            || self.first[1] + column * self.stride >= finest.columns
        {
            return [0.0; 3];
        }
        let mut whole = 0.0_f64;
        if self.stride > 1 {
            for index in 0..QUAD_SAMPLES * QUAD_SAMPLES {
                let cell = self.cell(row + index / QUAD_SAMPLES, column + index % QUAD_SAMPLES, 1);
                whole = whole.max(finest.plain(&cell));
            }
        }
        let coarse = self.cell_error(row, column, 4, [true; 4], finest);
        let middle = (0..4).map(|quarter| {
            let [down, across] = [quarter / 2, quarter % 2];
            let outer = [down == 0, across == 1, down == 1, across == 0];
            self.cell_error(row + 2 * down, column + 2 * across, 2, outer, finest)
        });
        [whole, coarse, middle.fold(0.0, f64::max)]
    }

    /// The error of a cell, plain or as a fan whose edges (north, east, south, west) may be split where `outer`.
    fn cell_error(
        &self,
        row: usize,
        column: usize,
        side: usize,
        outer: [bool; 4],
        finest: &Finest<'_>,
    ) -> f64 {
        let cell = self.cell(row, column, side);
        let half = side / 2;
        let [south, east] = [row + side, column + side];
        let middles = [
            self.at(row, column + half),
            self.at(row + half, east),
            self.at(south, column + half),
            self.at(row + half, column),
        ];
        let wedges = finest.wedges(&cell, self.at(row + half, column + half), middles);
        let fan = wedges
            .iter()
            .zip(outer)
            .map(|([whole, split], outer)| if outer { whole.max(*split) } else { *whole });
        fan.fold(finest.plain(&cell), f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::{Grid, TILE_CELLS};
    use crate::pyramid::templates::{cell_triangles, quarter_split};

    /// A finest level of two tiles a side with rough ground, and a coarser tile of noise over it.
    fn ground(side: u32, hole: bool) -> (LevelSamples, Vec<i32>) {
        let grid = Grid {
            columns: side,
            rows: side,
            origin: [0.0; 2],
            step: [1.0, -1.0],
        };
        let mut level = LevelSamples::new(&grid, grid.level_count() - 1);
        let mix =
            |index: usize| i32::try_from(index.wrapping_mul(2_654_435_761) >> 9 & 1023).unwrap();
        level
            .values
            .iter_mut()
            .enumerate()
            .for_each(|(index, value)| *value = mix(index));
        if hole {
            let width = level.columns;
            (5..60).for_each(|row| level.values[row * width + 3..row * width + 40].fill(i32::MIN));
            level.take_voids(i32::MIN);
        }
        let heights = (0..TILE_SAMPLES * TILE_SAMPLES)
            .map(|index| mix(index * 31 + 7) / 2)
            .collect();
        (level, heights)
    }

    /// The greatest error of a cell's triangles, sample by sample with barycentric coordinates.
    fn brute_cell(
        grid: &TileGrid<'_>,
        at: [usize; 2],
        side: usize,
        split: u8,
        level: &LevelSamples,
        data: usize,
    ) -> f64 {
        let half = side / 2;
        let own = |point: u8| {
            [
                at[0] + usize::from(point / 3) * half,
                at[1] + usize::from(point % 3) * half,
            ]
        };
        let signed = |value: usize| i64::try_from(value).unwrap();
        let mut worst = 0.0_f64;
        for triangle in cell_triangles(split) {
            let corners = triangle.map(own).map(|[row, column]| {
                let place = [
                    grid.first[0] + row * grid.stride,
                    grid.first[1] + column * grid.stride,
                ]
                .map(signed);
                (place, grid.at(row, column))
            });
            let cross = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| {
                (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
            };
            let area = cross(corners[0].0, corners[1].0, corners[2].0);
            for y in 0..=side * grid.stride {
                for x in 0..=side * grid.stride {
                    let (row, column) = (
                        grid.first[0] + at[0] * grid.stride + y,
                        grid.first[1] + at[1] * grid.stride + x,
                    );
                    let point = [row, column].map(signed);
                    let parts =
                        [1, 2, 0].map(|k| cross(point, corners[k].0, corners[(k + 1) % 3].0));
                    let outside = parts.iter().any(|part| part * area.signum() < 0);
                    if outside
                        || row >= data
                        || column >= data
                        || level.voids.as_ref().is_some_and(|v| v.get(row, column))
                    {
                        continue;
                    }
                    let height: f64 =
                        (0..3).map(|k| corners[k].1 * parts[k] as f64).sum::<f64>() / area as f64;
                    worst = worst.max(
                        (height - f64::from(level.values[row * level.columns + column])).abs(),
                    );
                }
            }
        }
        worst
    }

    fn check(side: u32, hole: bool, stride: usize, patches: &[[usize; 2]]) {
        let (level, heights) = ground(side, hole);
        let data = side as usize;
        let finest = Finest::new(&level, [data; 2]);
        let grid = TileGrid {
            heights: &heights,
            first: [0, 0],
            stride,
        };
        let measured = measure(&heights, [0, 0], stride, &finest);
        for patch in patches {
            let [row, column] = patch.map(|index| index * 4);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            let coarse = (0..16)
                .map(|split| brute_cell(&grid, [row, column], 4, split, &level, data))
                .fold(0.0, f64::max);
            let middle = (0..16 * 4).map(|index| {
                let (split, down, across) = (
                    index / 4,
                    usize::from(index / 2 % 2),
                    usize::from(index % 2),
                );
                brute_cell(
                    &grid,
                    [row + 2 * down, column + 2 * across],
                    2,
                    quarter_split(split, down, across),
                    &level,
                    data,
                )
            });
            let [depth0, depth1] = measured.patches[patch[0] * 32 + patch[1]];
            let middle = middle.fold(0.0, f64::max);
            assert!(
                near(depth0, coarse) && near(depth1, middle),
                "{patch:?} {depth0} {coarse} {depth1} {middle}"
            );
        }
    }

    #[test]
    fn patch_errors_are_those_of_the_worst_template() {
        check(257, false, 2, &[[0, 0], [7, 19], [31, 31]]);
        check(129, false, 1, &[[3, 3], [31, 0]]);
    }

    #[test]
    fn voids_and_what_lies_past_the_data_count_in_no_error() {
        check(250, true, 2, &[[0, 0], [2, 4], [7, 5], [31, 31]]);
    }

    #[test]
    fn the_whole_tile_s_error_is_that_of_its_cells() {
        let (level, heights) = ground(257, false);
        let finest = Finest::new(&level, [257; 2]);
        let grid = TileGrid {
            heights: &heights,
            first: [0, 0],
            stride: 2,
        };
        let mut worst = 0.0_f64;
        for row in 0..TILE_CELLS {
            for column in 0..TILE_CELLS {
                worst = worst.max(finest.plain(&grid.cell(row, column, 1)));
            }
        }
        assert_eq!(measure(&heights, [0, 0], 2, &finest).whole, worst);
        assert_eq!(measure(&heights, [0, 0], 1, &finest).whole, 0.0);
    }
}
