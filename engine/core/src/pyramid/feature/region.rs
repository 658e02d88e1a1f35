//! Which patches of a cut stay lattice quads, and which give way to the zipper and what is authored.
//!
//! ```text
//! · · · · · · · · · ·      · a lattice quad, kept
//! · · z z z z z · · ·      z a patch that gives way: the rim's own patches, those inside, and one around
//! · z z a a a z z · ·      a the same, where what is authored stands
//! · z a a a a a z · ·
//! · z z z z z z z · ·      The outline of all that gives way is one simple loop of lattice points.
//! · · · · · · · · · ·
//! ```

use super::plan::{PLAN_STEPS, Point};
use crate::geo::QUAD_SAMPLES;

/// The patches of a cut, row by row: true where a patch gives way.
pub(super) struct Region {
    rows: i64,
    columns: i64,
    gives_way: Vec<bool>,
}

impl Region {
    /// The patches that give way to a rim, given in plan from the cut's north-west lattice point. The rim keeps three
    /// patches' distance from the cut's border, so two rings of lattice quads stay.
    pub(super) fn new([rows, columns]: [i64; 2], rim: &[Point]) -> Self {
        let mut region = Self {
            rows,
            columns,
            gives_way: vec![false; usize::try_from(rows * columns).unwrap_or(0)],
        };
        for (i, &a) in rim.iter().enumerate() {
            region.mark_side(a, rim[(i + 1) % rim.len()]);
        }
        region.fill();
        region.grow();
        region.fill();
        while region.part_corners() {
            region.fill();
        }
        region
    }

    /// True for a patch of the cut that gives way.
    pub(super) fn gives_way(&self, row: i64, column: i64) -> bool {
        (0..self.rows).contains(&row)
            && (0..self.columns).contains(&column)
            && self.gives_way[self.index(row, column)]
    }

    /// The outline: lattice points (row, column), counter-clockwise seen from above.
    pub(super) fn outline(&self) -> Vec<[i64; 2]> {
        let starts =
            (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| [row, column]));
        let Some(start) = { starts }.find(|&[row, column]| self.gives_way(row, column)) else {
            return Vec::new();
        };
        // The first patch in row order is open to the west: walk down that side, keeping the region on the left.
        let (mut at, mut way) = (start, [1, 0]);
        let mut around = Vec::new();
        loop {
            around.push(at);
            at = [at[0] + way[0], at[1] + way[1]];
            if at == start {
                return around;
            }
            way = self.turn(at, way);
        }
    }

    /// The way on from a lattice point: left where the patch ahead on the left is not the region's, right where the one
    /// ahead on the right is.
    fn turn(&self, [row, column]: [i64; 2], way: [i64; 2]) -> [i64; 2] {
        let left = [-way[1], way[0]];
        // The patch that lies ahead and to one side of a lattice point.
        let ahead = |side: [i64; 2]| {
            let toward = |axis: usize| if way[axis] + side[axis] > 0 { 0 } else { -1 };
            self.gives_way(row + toward(0), column + toward(1))
        };
        match (ahead(left), ahead([-left[0], -left[1]])) {
            (_, true) => [-left[0], -left[1]],
            (true, false) => way,
            (false, false) => left,
        }
    }

    fn index(&self, row: i64, column: i64) -> usize {
        usize::try_from(row * self.columns + column).unwrap_or(usize::MAX)
    }

    fn mark(&mut self, row: i64, column: i64) {
        if (0..self.rows).contains(&row) && (0..self.columns).contains(&column) {
            let index = self.index(row, column);
            self.gives_way[index] = true;
        }
    }

    /// Marks the patches a side of the rim passes, row by row.
    fn mark_side(&mut self, a: Point, b: Point) {
        let side = PLAN_STEPS * QUAD_SAMPLES as f64;
        // Columns run east, rows south.
        let [a, b] = [a, b].map(|[x, y]| [x as f64 / side, -(y as f64) / side]);
        let [top, bottom] = if a[1] <= b[1] { [a, b] } else { [b, a] };
        for row in floor(top[1])..=floor(bottom[1]) {
            let across = |y: f64| {
                let part = (y - top[1]) / (bottom[1] - top[1]);
                if part.is_finite() {
                    // Rounding must not lead past an end that lies on a lattice line.
                    let [west, east] = [top[0].min(bottom[0]), top[0].max(bottom[0])];
                    (top[0] + (bottom[0] - top[0]) * part).clamp(west, east)
                } else {
                    top[0]
                }
            };
            let ends = if bottom[1] > top[1] {
                [
                    across(top[1].max(row as f64)),
                    across(bottom[1].min(row as f64 + 1.0)),
                ]
            } else {
                [top[0], bottom[0]]
            };
            for column in floor(ends[0].min(ends[1]))..=floor(ends[0].max(ends[1])) {
                self.mark(row, column);
            }
        }
    }

    /// Adds what the border cannot reach over sides of patches that do not give way.
    fn fill(&mut self) {
        let mut outside = vec![false; self.gives_way.len()];
        let mut open: Vec<[i64; 2]> = (0..self.rows)
            .flat_map(|row| [[row, 0], [row, self.columns - 1]])
            .chain((0..self.columns).flat_map(|column| [[0, column], [self.rows - 1, column]]))
            .collect();
        while let Some([row, column]) = open.pop() {
            let inside = (0..self.rows).contains(&row) && (0..self.columns).contains(&column);
            if !inside || self.gives_way(row, column) {
                continue;
            }
            let index = self.index(row, column);
            if !std::mem::replace(&mut outside[index], true) {
                open.extend([
                    [row - 1, column],
                    [row + 1, column],
                    [row, column - 1],
                    [row, column + 1],
                ]);
            }
        }
        self.gives_way = outside.into_iter().map(|outside| !outside).collect();
    }

    /// Adds the eight neighbours of every patch.
    fn grow(&mut self) {
        let before = self.gives_way.clone();
        for row in 0..self.rows {
            for column in 0..self.columns {
                if before[self.index(row, column)] {
                    for near in 0..9 {
                        self.mark(row + near / 3 - 1, column + near % 3 - 1);
                    }
                }
            }
        }
    }

    /// Fills one patch beside every two that meet at a corner only, so that the outline never meets itself; true where
    /// there were any.
    fn part_corners(&mut self) -> bool {
        let mut found = false;
        for row in 1..self.rows {
            for column in 1..self.columns {
                let [nw, ne, sw, se] = [(1, 1), (1, 0), (0, 1), (0, 0)]
                    .map(|(up, left)| self.gives_way(row - up, column - left));
                if nw == se && ne == sw && nw != ne {
                    self.mark(row - 1, if nw { column } else { column - 1 });
                    found = true;
                }
            }
        }
        found
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a place in a cut of at most 2^16 patches"
)]
fn floor(x: f64) -> i64 {
    x.floor() as i64
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers")]
mod tests {
    use super::*;

    /// A rim given by rows and columns of patches.
    fn rim(points: &[[f64; 2]]) -> Vec<Point> {
        let side = PLAN_STEPS * QUAD_SAMPLES as f64;
        let point = |&[row, column]: &[f64; 2]| [column * side, -row * side];
        points
            .iter()
            .map(|p| point(p).map(|x| x.round() as i64))
            .collect()
    }

    fn picture(region: &Region) -> Vec<String> {
        let sign = |row, column| {
            if region.gives_way(row, column) {
                'z'
            } else {
                '.'
            }
        };
        (0..region.rows)
            .map(|row| {
                (0..region.columns)
                    .map(|column| sign(row, column))
                    .collect()
            })
            .collect()
    }

    #[test]
    fn the_patches_of_a_rim_and_one_around_give_way() {
        let region = Region::new(
            [7, 8],
            &rim(&[[3.2, 3.2], [3.8, 3.2], [3.8, 4.8], [3.2, 4.8]]),
        );
        assert_eq!(
            picture(&region),
            [
                "........", "........", "..zzzz..", "..zzzz..", "..zzzz..", "........", "........"
            ]
        );
        let outline = region.outline();
        assert_eq!(
            (outline.len(), outline[0], outline[1]),
            (14, [2, 2], [3, 2])
        );
    }

    #[test]
    fn a_slanted_strip_keeps_lattice_quads_on_both_sides_and_has_one_outline() {
        let region = Region::new(
            [40, 40],
            &rim(&[[3.5, 3.5], [36.5, 35.5], [36.5, 36.5], [3.5, 4.5]]),
        );
        let kept = region
            .gives_way
            .iter()
            .filter(|gives_way| !**gives_way)
            .count();
        assert!(kept > 1200, "{kept}");
        let outline = region.outline();
        let mut seen = outline.clone();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), outline.len());
        let sides: i64 = (0..40)
            .flat_map(|row| (0..40).map(move |column| [row, column]))
            .filter(|&[row, column]| region.gives_way(row, column))
            .flat_map(|[r, c]| [[r - 1, c], [r + 1, c], [r, c - 1], [r, c + 1]])
            .map(|[row, column]| i64::from(!region.gives_way(row, column)))
            .sum();
        assert_eq!(sides as usize, outline.len());
    }

    #[test]
    fn a_pocket_is_filled() {
        let horseshoe = [
            [4.5, 4.5],
            [20.5, 4.5],
            [20.5, 20.5],
            [4.5, 20.5],
            [4.5, 8.5],
            [5.5, 8.5],
            [5.5, 19.5],
            [19.5, 19.5],
            [19.5, 5.5],
            [4.5, 5.5],
        ];
        let region = Region::new([25, 25], &rim(&horseshoe));
        assert!(region.gives_way(12, 12));
    }
}
