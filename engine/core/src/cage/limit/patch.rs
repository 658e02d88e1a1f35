//! The bicubic B-spline patch over a quad, where its neighbourhood is regular.

use glam::DVec3;

use super::ring::{Neighbourhood, Ring};
use crate::subdiv::{basis, basis_derivative};

/// Sixteen controls, row by row in v, and the patch they make.
///
/// ```text
///   12 13 14 15
///    8  9 10 11       9 and 10 are the corners at (0, 1) and (1, 1),
///    4  5  6  7       5 and 6 those at (0, 0) and (1, 0)
///    0  1  2  3
/// ```
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub(super) controls: [DVec3; 16],
}

/// Position and derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jet {
    pub(super) position: DVec3,
    pub(super) du: DVec3,
    pub(super) dv: DVec3,
}

impl Patch {
    /// Position at (u, v) in the unit square.
    pub(super) fn position(&self, u: f64, v: f64) -> [f64; 3] {
        let (bu, bv) = (basis(u), basis(v));
        let mut position = DVec3::ZERO;
        for (row, bv) in self.controls.chunks_exact(4).zip(bv) {
            position += bv * (row[0] * bu[0] + row[1] * bu[1] + row[2] * bu[2] + row[3] * bu[3]);
        }
        position.to_array()
    }

    /// Evaluates at (u, v) in the unit square.
    pub(super) fn evaluate(&self, u: f64, v: f64) -> Jet {
        let (bu, bv, du, dv) = (basis(u), basis(v), basis_derivative(u), basis_derivative(v));
        let mut jet = Jet {
            position: DVec3::ZERO,
            du: DVec3::ZERO,
            dv: DVec3::ZERO,
        };
        for (row, (bv, dv)) in self.controls.chunks_exact(4).zip(bv.into_iter().zip(dv)) {
            let along = |weights: [f64; 4]| {
                row[0] * weights[0]
                    + row[1] * weights[1]
                    + row[2] * weights[2]
                    + row[3] * weights[3]
            };
            let (value, slope) = (along(bu), along(du));
            jet.position += bv * value;
            jet.du += bv * slope;
            jet.dv += dv * value;
        }
        jet
    }
}

/// Which sides of a regular quad are sharp, side `i` running from corner `i` to the next. `None` for a quad whose
/// surface is not one bicubic patch.
///
/// * A corner between smooth sides must be a smooth vertex of valence 4.
/// * A corner with one sharp side must lie on a crease for ever, with this quad and one more on this side of it.
/// * A corner with two must be a corner for ever.
pub(super) fn regular_sides(neighbourhood: &Neighbourhood) -> Option<[bool; 4]> {
    let mut sides = [false; 4];
    for (ring, side) in neighbourhood.rings.iter().zip(&mut sides) {
        *side = regular_side(ring.spoke_sharpness[ring.at])?;
    }
    let fits = |i: usize| regular_corner(&neighbourhood.rings[i], sides[i], sides[(i + 3) & 3]);
    (0..4).all(fits).then_some(sides)
}

/// True for a side sharp for ever, false for a smooth one, `None` in between.
fn regular_side(sharpness: f64) -> Option<bool> {
    if sharpness == 0.0 {
        Some(false)
    } else {
        (sharpness == f64::INFINITY).then_some(true)
    }
}

fn regular_corner(ring: &Ring, leaving: bool, arriving: bool) -> bool {
    let [sharp, for_ever] = ring.sharp_counts();
    if leaving && arriving {
        return ring.sharpness == f64::INFINITY || for_ever >= 3;
    }
    if ring.sharpness > 0.0 || sharp != for_ever {
        return false;
    }
    if leaving || arriving {
        let (own, other) = if leaving { (0, 2) } else { (1, -1) };
        let (own, other) = (ring.spoke(own), ring.spoke(other));
        return sharp == 2 && own != other && ring.spoke_sharpness[other] > 0.0;
    }
    sharp == 0 && ring.closed() && ring.spokes.len() == 4
}

/// The patch of a regular quad. Controls past a sharp side are mirrored at it: `2 · border - inside`, which makes the
/// border the B-spline curve of its own controls, as the crease rule does.
pub(super) fn patch(neighbourhood: &Neighbourhood, sides: [bool; 4]) -> Patch {
    let mut controls = [DVec3::ZERO; 16];
    for (i, ring) in neighbourhood.rings.iter().enumerate() {
        let (leaving, arriving) = (sides[i], sides[(i + 3) & 3]);
        let mut put =
            |column: usize, row: usize, point: DVec3| controls[turned(i, column, row)] = point;
        put(1, 1, ring.center);
        if !arriving {
            put(0, 1, ring.spokes[ring.spoke(2)]);
            put(0, 2, ring.diagonals[ring.quad(1)]);
        }
        if !leaving {
            put(1, 0, ring.spokes[ring.spoke(-1)]);
            put(2, 0, ring.diagonals[ring.quad(-1)]);
        }
        if !leaving && !arriving {
            put(0, 0, ring.diagonals[ring.quad(2)]);
        }
    }
    mirror(&mut controls, sides);
    Patch { controls }
}

/// Place of a control counted from corner `i`, as if that were corner 0.
fn turned(i: usize, mut column: usize, mut row: usize) -> usize {
    for _ in 0..i {
        (column, row) = (3 - row, column);
    }
    4 * row + column
}

/// Fills the rows, then the columns past sharp sides; the corner between two comes out mirrored twice.
pub(super) fn mirror(controls: &mut [DVec3; 16], sides: [bool; 4]) {
    for i in 0..4 {
        let mut reflect = |outside: usize, border: usize, inside: usize| {
            controls[outside] = 2.0 * controls[border] - controls[inside];
        };
        if sides[0] {
            reflect(i, 4 + i, 8 + i);
        }
        if sides[2] {
            reflect(12 + i, 8 + i, 4 + i);
        }
    }
    for row in [0, 4, 8, 12] {
        let mut reflect = |outside: usize, border: usize, inside: usize| {
            controls[outside] = 2.0 * controls[border] - controls[inside];
        };
        if sides[3] {
            reflect(row, row + 1, row + 2);
        }
        if sides[1] {
            reflect(row + 3, row + 2, row + 1);
        }
    }
}
