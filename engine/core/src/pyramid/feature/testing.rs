//! A ground from a formula, for tests.

use super::{FeatureInput, Ground, Site};
use crate::cage::{Cage, Faces, Placement, Tags};
use crate::geo::{Crs, Grid};

/// A slope with waves, in units; controls a little above it, so that they are told from heights.
pub(super) struct Waves;

impl Ground for Waves {
    fn control(&self, row: i64, column: i64) -> i32 {
        wave(4 * row, 4 * column) + 1
    }

    fn sample(&self, row: u32, column: u32) -> i32 {
        wave(i64::from(row), i64::from(column))
    }

    /// One far from all others.
    fn is_void(&self, row: u32, column: u32) -> bool {
        [row, column] == VOID
    }
}

/// The void sample of [`Waves`]: row and column.
pub(super) const VOID: [u32; 2] = [350, 500];

fn wave(row: i64, column: i64) -> i32 {
    let height = 3.0 * column as f64 + 40.0 * (row as f64 / 17.0).sin();
    #[expect(clippy::cast_possible_truncation, reason = "small numbers")]
    let height = height.round() as i32;
    height
}

/// 400 × 600 samples of ten metres.
pub(super) const GRID: Grid = Grid {
    columns: 600,
    rows: 400,
    origin: [1000.0, 9000.0],
    step: [10.0, -10.0],
};

/// Runs with the site of [`Waves`]: half a metre a unit.
pub(super) fn with_site<T>(run: impl FnOnce(&Site<'_>) -> T) -> T {
    let crs = Crs::unknown();
    run(&Site {
        grid: &GRID,
        crs: &crs,
        unit: 0.5,
        ground: &Waves,
    })
}

/// A cage on the ground at a row and column of samples.
pub(super) fn at(cage: Cage, row: f64, column: f64) -> FeatureInput {
    FeatureInput {
        name: format!("cage at {row}, {column}"),
        cage,
        placement: Placement::on_ground(GRID.position(row, column)),
    }
}

/// A square sheet of quads, `side` metres long, `steps` a side, its middle raised.
pub(super) fn sheet(side: f64, steps: u32) -> Cage {
    let step = side / f64::from(steps);
    let half = 0.5 * side;
    let positions = (0..=steps).flat_map(|row| {
        (0..=steps).map(move |column| {
            let inner = (1..steps).contains(&row) && (1..steps).contains(&column);
            let [x, y] = [column, row].map(|i| f64::from(i) * step - half);
            [x, y, if inner { 30.0 } else { 0.0 }]
        })
    });
    let vertex = |row, column| row * (steps + 1) + column;
    let faces: Faces = (0..steps)
        .flat_map(|row| (0..steps).map(move |column| (row, column)))
        .map(|(r, c)| {
            [
                vertex(r, c),
                vertex(r, c + 1),
                vertex(r + 1, c + 1),
                vertex(r + 1, c),
            ]
        })
        .collect();
    Cage::new(positions.collect(), faces, &Tags::default()).unwrap()
}
