//! Places on the faces of a mixed cage, as places on the quads of its refinement.

use std::ops::Range;

use super::split::corner_towards;
use super::{LimitSample, Place};

/// How the derivatives by a face's u and v follow from those by a child's: `du = a · child du + b · child dv`.
pub(super) struct Turn {
    du: [f64; 2],
    dv: [f64; 2],
}

impl Turn {
    pub(super) fn du(&self, child: &LimitSample) -> [f64; 3] {
        std::array::from_fn(|i| self.du[0] * child.du[i] + self.du[1] * child.dv[i])
    }

    pub(super) fn dv(&self, child: &LimitSample) -> [f64; 3] {
        std::array::from_fn(|i| self.dv[0] * child.du[i] + self.dv[1] * child.dv[i])
    }
}

/// The largest u of a face: one for each sub-face, of which a quad has only itself.
pub(super) fn widest(size: usize) -> f64 {
    if size == 4 { 1.0 } else { size as f64 }
}

/// The refined face that holds a place of a face with these corners, and the turn back.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers its corners in 32 bits"
)]
pub(super) fn child_place(place: Place, corners: Range<usize>) -> (Place, Turn) {
    let (corner, u, v, turn) = if corners.len() == 4 {
        quarter(place)
    } else {
        sub_face(place, corners.len())
    };
    let face = (corners.start + corner) as u32;
    (Place { face, u, v }, turn)
}

/// Every child has its own (0, 0) at the parent's corner, so it is turned by as many quarters.
fn quarter(place: Place) -> (usize, f64, f64, Turn) {
    let (u, v) = (2.0 * place.u, 2.0 * place.v);
    let (from_right, from_top) = (2.0 - u, 2.0 - v);
    let corner = corner_towards(place.u, place.v);
    let (u, v, du, dv) = match corner {
        0 => (u, v, [2.0, 0.0], [0.0, 2.0]),
        1 => (v, from_right, [0.0, -2.0], [2.0, 0.0]),
        2 => (from_right, from_top, [-2.0, 0.0], [0.0, -2.0]),
        _ => (from_top, u, [0.0, 2.0], [-2.0, 0.0]),
    };
    (corner, u, v, Turn { du, dv })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "u was checked to be in 0..=size"
)]
fn sub_face(place: Place, size: usize) -> (usize, f64, f64, Turn) {
    let corner = (place.u as usize).min(size - 1);
    let u = place.u - corner as f64;
    (
        corner,
        u,
        place.v,
        Turn {
            du: [1.0, 0.0],
            dv: [0.0, 1.0],
        },
    )
}
