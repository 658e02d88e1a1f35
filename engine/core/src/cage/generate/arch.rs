//! A rock arch: a plate of ground with a handle, and daylight under it.
//!
//! ```text
//!        ____                 +--+--+--+--+--+     the plate from above: two of its quads are open, and a square
//!      ╱  __  ╲               |  |A |  |  |B |     tube of rings leads from one to the other
//!     ╱ ╱    ╲ ╲              +--+--+--+--+--+
//!  __╱_╱______╲_╲__
//! ```
//!
//! Seen by its topology it is a disk with one handle: one rim, genus 1. The four corners of each foot have valence 5.

use super::super::error::CageError;
use super::super::faces::{Faces, Tags};
use super::super::topology::Cage;
use super::{GroundHeight, Path, check_lengths};

/// Lengths of an arch, metres. Its span is the path's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arch {
    /// From the ground to the middle of the crown.
    pub height: f64,
    /// Side of the square cross-section at the feet; the crown is a little thinner.
    pub width: f64,
}

/// Rings of the tube between its feet.
const RINGS: u32 = 9;
/// How much thinner the crown is than the feet.
const SLIMMING: f64 = 0.3;
/// From a foot's middle to the rim, in widths.
const PLATE: f64 = 1.75;
/// Rows of plate vertices across the path, and the row on the right of the feet.
const ACROSS: u32 = 4;

/// An arch from one end of a path to the other.
///
/// # Errors
/// [`CageError::Shape`] for lengths that are not greater than 0 and a path too short for two feet.
pub fn arch(path: &Path, lengths: &Arch, ground: GroundHeight<'_>) -> Result<Cage, CageError> {
    let Arch { height, width } = *lengths;
    check_lengths(&[("height", height), ("width", width)])?;
    if path.length() < 2.0 * width || height < width {
        return Err(CageError::Shape(format!(
            "an arch {width} m thick needs a path of {} m and a height of {width} m; they are {} m and {height} m",
            2.0 * width,
            path.length()
        )));
    }
    let ways = plate_ways(path.length(), width);
    let mut positions = Vec::new();
    for &way in &ways {
        for left in [-PLATE, -0.5, 0.5, PLATE] {
            let [x, y] = path.place(way, left * width);
            positions.push([x, y, ground([x, y])]);
        }
    }
    // A foot's quad lies between the second and third line of its end.
    let feet = [1, ways.len() as u32 - 3];
    let mut faces: Faces = super::strip(ways.len() as u32, ACROSS)
        .into_iter()
        .enumerate()
        .filter(|(quad, _)| {
            !feet
                .iter()
                .any(|foot| *quad as u32 == foot * (ACROSS - 1) + 1)
        })
        .map(|(_, quad)| quad)
        .collect();
    let levels = feet.map(|foot| foot_level(&positions, foot));
    let mut below = outer_and_inner(feet[0], false);
    for ring in 1..=RINGS {
        let first = positions.len() as u32;
        positions.extend(tube_ring(path, lengths, levels, ring));
        let above = [0, 1, 2, 3].map(|corner| first + corner);
        join(&mut faces, below, above);
        below = above;
    }
    join(&mut faces, below, outer_and_inner(feet[1], true));
    Cage::new(positions, faces, &Tags::default())
}

/// Ways along the path of the plate's lines.
fn plate_ways(span: f64, width: f64) -> Vec<f64> {
    let gap = span - width;
    let steps = (gap / (1.5 * width)).round().max(1.0);
    let mut ways = vec![-PLATE * width, -0.5 * width];
    let mut step = 0.0;
    while step <= steps {
        ways.push(0.5 * width + gap * step / steps);
        step += 1.0;
    }
    ways.extend([span + 0.5 * width, span + PLATE * width]);
    ways
}

/// A foot's corners as a ring of the tube: outer right, outer left, inner left, inner right; outer is away from the
/// other foot.
fn outer_and_inner(line: u32, far: bool) -> [u32; 4] {
    let at = |line: u32, column: u32| line * ACROSS + column;
    let (outer, inner) = if far {
        (line + 1, line)
    } else {
        (line, line + 1)
    };
    [at(outer, 1), at(outer, 2), at(inner, 2), at(inner, 1)]
}

/// The mean height of a foot's corners.
fn foot_level(positions: &[[f64; 3]], line: u32) -> f64 {
    let corners = outer_and_inner(line, false);
    corners
        .iter()
        .map(|&corner| positions[corner as usize][2])
        .sum::<f64>()
        / 4.0
}

/// The corners of a ring, in the order of [`outer_and_inner`].
fn tube_ring(path: &Path, lengths: &Arch, levels: [f64; 2], ring: u32) -> [[f64; 3]; 4] {
    let part = f64::from(ring) / f64::from(RINGS + 1);
    let (sin, cos) = (std::f64::consts::PI * part).sin_cos();
    let (half_span, height) = (0.5 * path.length(), lengths.height);
    let half = 0.5 * lengths.width * (1.0 - SLIMMING * sin);
    // Outward across the tube: at right angles to the ellipse's tangent (half_span sin, height cos).
    let size = f64::hypot(height * cos, half_span * sin);
    let out = [-height * cos / size, half_span * sin / size];
    let base = levels[0] + (levels[1] - levels[0]) * 0.5 * (1.0 - cos);
    [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(outer, left)| {
        let way = half_span * (1.0 - cos) + outer * half * out[0];
        let [x, y] = path.place(way, left * half);
        [x, y, base + height * sin + outer * half * out[1]]
    })
}

/// The four quads between two rings.
fn join(faces: &mut Faces, below: [u32; 4], above: [u32; 4]) {
    for corner in 0..4 {
        let next = (corner + 1) % 4;
        faces.push(&[below[next], below[corner], above[corner], above[next]]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{LimitSurface, Place, boundary_loops};
    use super::super::flat;
    use super::*;

    fn sample() -> Cage {
        let path = Path::new(vec![[0.0, 0.0], [900.0, 0.0]]).unwrap();
        let lengths = Arch {
            height: 450.0,
            width: 160.0,
        };
        arch(&path, &lengths, &flat).unwrap()
    }

    #[test]
    fn an_arch_has_one_rim_on_the_ground_and_one_handle() {
        let cage = sample();
        let topology = cage.topology();
        let rims = boundary_loops(topology);
        assert_eq!(rims.len(), 1);
        assert!(
            rims[0]
                .iter()
                .all(|&v| cage.positions()[v as usize][2] == 0.0)
        );
        // A disk with one handle: V − E + F = 1 − 2.
        let euler = i64::from(topology.vertex_count()) - i64::from(topology.edge_count())
            + i64::from(topology.face_count());
        assert_eq!(euler, -1);
    }

    #[test]
    fn there_is_daylight_under_it_and_rock_above() {
        let cage = sample();
        let surface = LimitSurface::new(&cage).unwrap();
        let faces = 0..cage.topology().face_count();
        let heights: Vec<f64> = faces
            .flat_map(|face| {
                (0..81).map(move |i| (face, f64::from(i / 9) / 8.0, f64::from(i % 9) / 8.0))
            })
            .map(|(face, u, v)| surface.evaluate(face, u, v).unwrap().position)
            .filter(|[x, y, _]| (x - 450.0).abs() < 30.0 && y.abs() < 60.0)
            .map(|[_, _, z]| z)
            .collect();
        assert!(
            heights.iter().all(|z| !(30.0..=330.0).contains(z)),
            "{heights:?}"
        );
        assert!(heights.iter().any(|&z| z > 400.0));
    }

    #[test]
    fn the_tube_faces_outward() {
        let cage = sample();
        let surface = LimitSurface::new(&cage).unwrap();
        let tube = cage.topology().face_count() - 4 * (RINGS + 1) / 2;
        for face in [tube - 2, tube - 1, tube, tube + 1] {
            let place = Place {
                face,
                u: 0.5,
                v: 0.5,
            };
            let sample = surface.evaluate(place.face, place.u, place.v).unwrap();
            let [x, y, z] = sample.position;
            // Away from the middle of the arch's cross-section near the crown.
            let out = if z > 450.0 * (1.0 - ((x - 450.0) / 450.0).powi(2)).max(0.0).sqrt() {
                1.0
            } else {
                -1.0
            };
            let outward = sample.normal[2] * out * 0.5 + sample.normal[1] * y / 80.0;
            assert!(outward > 0.0, "{face}: {sample:?}");
        }
    }

    #[test]
    fn an_arch_too_thick_for_its_span_is_refused() {
        let path = Path::new(vec![[0.0, 0.0], [100.0, 0.0]]).unwrap();
        let thick = Arch {
            height: 90.0,
            width: 60.0,
        };
        assert!(arch(&path, &thick, &flat).is_err());
    }
}
