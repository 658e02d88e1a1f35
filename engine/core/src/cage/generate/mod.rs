//! Cages of landforms that no height map can hold: a cliff that leans over its foot, an arch, a road cut.
//!
//! Each is a pure function of a [`Path`] in plan, a few lengths and the ground's height. What comes out is one sheet
//! with one open rim that lies on the ground, faces counter-clockwise seen from above, creases where edges are to stay
//! edges. Metres east, north and up. Knows no terrain beyond a function that answers for heights.

#![expect(
    clippy::cast_possible_truncation,
    reason = "a path has at most 20,000 stations, a section a few vertices"
)]

mod arch;
mod cliff;
mod path;
mod road;

pub use arch::{Arch, arch};
pub use cliff::{Cliff, cliff};
pub use path::Path;
pub use road::{Road, road};

use super::error::CageError;

/// The ground's height in metres at a place in metres east and north.
pub type GroundHeight<'a> = &'a dyn Fn([f64; 2]) -> f64;

/// A flat ground at height 0.
#[must_use]
pub fn flat(_: [f64; 2]) -> f64 {
    0.0
}

/// Faces of a strip of `rows` by `columns` vertices, row by row: rows run along the path, columns from right to left.
fn strip(rows: u32, columns: u32) -> Vec<[u32; 4]> {
    let at = move |row, column| row * columns + column;
    (0..rows - 1)
        .flat_map(|row| (0..columns - 1).map(move |column| (row, column)))
        .map(|(row, column)| {
            [
                at(row, column),
                at(row + 1, column),
                at(row + 1, column + 1),
                at(row, column + 1),
            ]
        })
        .collect()
}

/// From 0 to 1 without a kink at either end.
fn ease(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Refuses lengths that are not greater than 0.
fn check_lengths(lengths: &[(&'static str, f64)]) -> Result<(), CageError> {
    match lengths
        .iter()
        .find(|(_, length)| !(length.is_finite() && *length > 0.0))
    {
        Some((name, length)) => Err(CageError::Shape(format!(
            "a {name} of {length} m; it must be greater than 0"
        ))),
        None => Ok(()),
    }
}
