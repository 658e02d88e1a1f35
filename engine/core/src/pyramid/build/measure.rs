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

use super::samples::Samples;
use crate::geo::QUAD_SAMPLES;

/// Finest samples as stored, as far as they are data: what errors are measured against. Of what reaches past them, the
/// part that lies in them is measured.
#[derive(Clone, Copy)]
pub(super) struct Finest<'a> {
    samples: &'a Samples,
    /// First row, first column, row past the last, column past the last.
    ends: [usize; 4],
}

impl<'a> Finest<'a> {
    /// A rectangle of finest samples.
    pub(super) fn new(samples: &'a Samples) -> Self {
        let area = &samples.area;
        let ends = [
            area.rows.start,
            area.columns.start,
            area.rows.end,
            area.columns.end,
        ];
        Self {
            samples,
            ends: ends.map(|end| usize::try_from(end).unwrap_or(0)),
        }
    }

    /// Least and greatest height that is not void.
    pub(super) fn range(&self) -> [i32; 2] {
        let columns = self.samples.columns;
        let values = self.samples.values.iter().enumerate();
        values
            .filter(|(at, _)| !self.samples.is_void(at / columns, at % columns))
            .fold([i32::MAX, i32::MIN], |[min, max], (_, value)| {
                [min.min(*value), max.max(*value)]
            })
    }

    /// The greatest distance of samples `first` … `last` of a row from the line that is `value` at `first`.
    fn span(&self, row: usize, first: usize, last: usize, value: f64, slope: f64) -> f64 {
        let [first_row, first_column, _, end] = self.ends;
        let [from, last] = [first.max(first_column), last.min(end - 1)];
        if from > last {
            return 0.0;
        }
        let value = value + slope * (from - first) as f64;
        let [row, from, last] = [row - first_row, from - first_column, last - first_column];
        let start = row * self.samples.columns;
        let line = &self.samples.values[start + from..=start + last];
        match &self.samples.voids {
            Some(voids) if voids.any_in(row, from, last) => {
                let data = line
                    .iter()
                    .enumerate()
                    .filter(|(place, _)| !voids.get(row, from + place));
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
        for (y, row) in cell.rows(self.ends) {
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
        for (y, row) in cell.rows(self.ends) {
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
    /// Rows of the cell that are measured, counted from its north edge and absolutely.
    fn rows(&self, [first, _, end, _]: [usize; 4]) -> impl Iterator<Item = (usize, usize)> {
        let rows = self.row.max(first)..(self.row + self.side + 1).min(end);
        rows.map(|row| (row - self.row, row))
    }
}

/// The greatest errors of a patch, in units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PatchErrors {
    /// Of its triangles at stride 1.
    pub(super) whole: f64,
    /// At depth 0, plain or with any template.
    pub(super) coarse: f64,
    /// At depth 1, likewise.
    pub(super) middle: f64,
}

/// Samples of a level over finest samples, which are `stride` to one of its own.
pub(super) struct Drawn<'a> {
    /// The level's own samples.
    pub(super) samples: &'a Samples,
    /// Finest samples from one to the next.
    pub(super) stride: usize,
}

impl Drawn<'_> {
    /// Measures a patch, counted over the whole level.
    pub(super) fn patch(&self, patch: [usize; 2], finest: &Finest<'_>) -> PatchErrors {
        let [row, column] = patch.map(|index| index * QUAD_SAMPLES);
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
        PatchErrors {
            whole,
            coarse,
            middle: middle.fold(0.0, f64::max),
        }
    }

    /// The height of an own sample, by row and column of the whole level.
    fn at(&self, row: usize, column: usize) -> f64 {
        let area = &self.samples.area;
        let offset = |place: usize, first: i64| place - usize::try_from(first).unwrap_or(0);
        let [row, column] = [
            offset(row, area.rows.start),
            offset(column, area.columns.start),
        ];
        f64::from(self.samples.values[row * self.samples.columns + column])
    }

    /// The cell whose north-west corner is an own sample, `side` own samples wide.
    fn cell(&self, row: usize, column: usize, side: usize) -> Cell {
        Cell {
            row: row * self.stride,
            column: column * self.stride,
            side: side * self.stride,
            corners: [
                self.at(row, column),
                self.at(row, column + side),
                self.at(row + side, column),
                self.at(row + side, column + side),
            ],
        }
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
    use crate::geo::{TILE_SAMPLE_COUNT, TILE_SAMPLES};
    use crate::pyramid::build::area::Area;
    use crate::pyramid::templates::{cell_triangles, quarter_split};

    /// Finest samples of rough ground, as far as they are data, and a coarser tile of noise over them.
    fn ground(side: usize, hole: bool) -> (Samples, Samples) {
        let mix =
            |index: usize| i32::try_from(index.wrapping_mul(2_654_435_761) >> 9 & 1023).unwrap();
        let mut finest = Samples::new(Area::whole([side; 2]), (0..side * side).map(mix).collect());
        if hole {
            (5..60).for_each(|row| (3..40).for_each(|column| finest.set_void(row, column)));
        }
        let heights = (0..TILE_SAMPLE_COUNT).map(|index| mix(index * 31 + 7) / 2);
        let tile = Samples::new(Area::whole([TILE_SAMPLES; 2]), heights.collect());
        (finest, tile)
    }

    /// The greatest error of a cell's triangles, sample by sample with barycentric coordinates.
    fn brute_cell(
        grid: &Drawn<'_>,
        at: [usize; 2],
        side: usize,
        split: u8,
        level: &Samples,
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
                let place = [row * grid.stride, column * grid.stride].map(signed);
                (place, grid.at(row, column))
            });
            let cross = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| {
                (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
            };
            let area = cross(corners[0].0, corners[1].0, corners[2].0);
            for y in 0..=side * grid.stride {
                for x in 0..=side * grid.stride {
                    let (row, column) = (at[0] * grid.stride + y, at[1] * grid.stride + x);
                    let point = [row, column].map(signed);
                    let parts =
                        [1, 2, 0].map(|k| cross(point, corners[k].0, corners[(k + 1) % 3].0));
                    let outside = parts.iter().any(|part| part * area.signum() < 0);
                    if outside
                        || row >= level.rows
                        || column >= level.columns
                        || level.is_void(row, column)
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

    fn check(side: usize, hole: bool, stride: usize, patches: &[[usize; 2]]) {
        let (level, samples) = ground(side, hole);
        let drawn = Drawn {
            samples: &samples,
            stride,
        };
        for patch in patches {
            let [row, column] = patch.map(|index| index * 4);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            let coarse = (0..16)
                .map(|split| brute_cell(&drawn, [row, column], 4, split, &level))
                .fold(0.0, f64::max);
            let middle = (0..16 * 4).map(|index| {
                let (split, down, across) = (
                    index / 4,
                    usize::from(index / 2 % 2),
                    usize::from(index % 2),
                );
                let at = [row + 2 * down, column + 2 * across];
                brute_cell(&drawn, at, 2, quarter_split(split, down, across), &level)
            });
            let middle = middle.fold(0.0, f64::max);
            let errors = drawn.patch(*patch, &Finest::new(&level));
            assert!(
                near(errors.coarse, coarse) && near(errors.middle, middle),
                "{patch:?} {errors:?} {coarse} {middle}"
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
    fn a_patch_s_error_is_the_greatest_of_its_parts() {
        let (level, samples) = ground(257, true);
        let drawn = Drawn {
            samples: &samples,
            stride: 8,
        };
        for patch in [[0, 0], [3, 7], [5, 1]] {
            let whole = drawn.patch(patch, &Finest::new(&level));
            let mut joined = PatchErrors::default();
            for quarter in 0..4 {
                let range = |half: usize| if half == 0 { 0..118 } else { 117..257 };
                let area = Area::new(range(quarter / 2), range(quarter % 2));
                let part = drawn.patch(patch, &Finest::new(&level.crop(&area)));
                joined.whole = joined.whole.max(part.whole);
                joined.coarse = joined.coarse.max(part.coarse);
                joined.middle = joined.middle.max(part.middle);
            }
            assert_eq!(joined, whole);
        }
    }

    #[test]
    fn a_tile_at_stride_1_is_without_error() {
        let (level, _) = ground(129, false);
        let drawn = Drawn {
            samples: &level,
            stride: 1,
        };
        assert_eq!(drawn.patch([3, 9], &Finest::new(&level)).whole, 0.0);
    }
}
