//! A cliff: a back that rises to a creased brink, and a face that leans out over its own foot.
//!
//! ```text
//!                ______brink        a section, seen along the path; the face looks to the path's right
//!          _____╱     ╱
//!     ____╱    face ╱
//!  __╱              ╲__foot____
//!  rim                        rim
//! ```
//!
//! Towards both ends of the path height and overhang fade, so that the rim is one loop on the ground.

use super::super::error::CageError;
use super::super::faces::{Crease, Faces, Tags};
use super::super::topology::Cage;
use super::{GroundHeight, Path, check_lengths, ease, strip};

/// Lengths of a cliff, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cliff {
    /// From foot to brink.
    pub height: f64,
    /// How far the brink stands out over the foot.
    pub overhang: f64,
    /// From the rim behind to the foot.
    pub width: f64,
}

const BRINK_SHARPNESS: f64 = 3.0;
/// The column of the brink.
const BRINK: usize = 4;
/// A section from right to left: way to the left of the foot in overhangs, in widths, and height in heights.
const SECTION: [[f64; 3]; 8] = [
    [-2.0, -0.15, 0.0],
    [-1.2, -0.05, 0.0],
    [0.0, 0.0, 0.02],
    [-0.25, 0.0, 0.5],
    [-1.0, 0.0, 1.0],
    [0.0, 0.25, 0.97],
    [0.0, 0.65, 0.5],
    [0.0, 1.0, 0.0],
];

/// A cliff along a path.
///
/// # Errors
/// [`CageError::Shape`] for lengths that are not greater than 0 and paths with too many steps.
pub fn cliff(path: &Path, lengths: &Cliff, ground: GroundHeight<'_>) -> Result<Cage, CageError> {
    let Cliff {
        height,
        overhang,
        width,
    } = *lengths;
    check_lengths(&[("height", height), ("overhang", overhang), ("width", width)])?;
    let stations = path.stations(0.5 * height.max(0.25 * width), 9)?;
    let columns = SECTION.len();
    let span = |[overhangs, widths, _]: [f64; 3]| overhangs * overhang + widths * width;
    let (right, left) = (span(SECTION[0]), span(SECTION[columns - 1]));
    let mut positions = Vec::with_capacity(stations.len() * columns);
    for &way in &stations {
        let part = way / path.length();
        let there = ease(3.0 * part.min(1.0 - part));
        for (column, section) in SECTION.into_iter().enumerate() {
            let even = right + (left - right) * column as f64 / (columns - 1) as f64;
            let [x, y] = path.place(way, even + (span(section) - even) * there);
            positions.push([x, y, ground([x, y]) + section[2] * height * there]);
        }
    }
    let (rows, columns) = (stations.len() as u32, columns as u32);
    let creases = (1..rows - 2).map(|row| Crease {
        vertices: [row, row + 1].map(|row| row * columns + BRINK as u32),
        sharpness: BRINK_SHARPNESS,
    });
    let tags = Tags {
        creases: creases.collect(),
        ..Tags::default()
    };
    Cage::new(positions, Faces::quads(&strip(rows, columns)), &tags)
}

#[cfg(test)]
mod tests {
    use super::super::super::{LimitSurface, boundary_loops};
    use super::super::flat;
    use super::*;

    #[test]
    fn the_brink_stands_out_over_the_foot() {
        let path = Path::new(vec![[0.0, 0.0], [0.0, 400.0]]).unwrap();
        let lengths = Cliff {
            height: 80.0,
            overhang: 20.0,
            width: 120.0,
        };
        let cage = cliff(&path, &lengths, &flat).unwrap();
        assert_eq!(boundary_loops(cage.topology()).len(), 1);
        // The face between foot and brink looks down: its normal's z is negative.
        let surface = LimitSurface::new(&cage).unwrap();
        let middle = cage.topology().face_count() / 7 / 2;
        let normal = surface.evaluate(middle * 7 + 3, 0.5, 0.5).unwrap().normal;
        assert!(normal[2] < -0.1 && normal[0] > 0.5, "{normal:?}");
    }
}
