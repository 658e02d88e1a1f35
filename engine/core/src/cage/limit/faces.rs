//! Places on the faces of a mixed cage, as places on the quads of its refinement.

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

/// The refined face of a quad that holds a place: its corner, the place there and the turn back. Every child has its
/// own (0, 0) at the parent's corner, so it is turned by as many quarters.
pub(super) fn quarter(place: Place) -> (usize, Place, Turn) {
    let (u, v) = (2.0 * place.u, 2.0 * place.v);
    let (from_right, from_top) = (2.0 - u, 2.0 - v);
    let corner = corner_towards(place.u, place.v);
    let (u, v, du, dv) = match corner {
        0 => (u, v, [2.0, 0.0], [0.0, 2.0]),
        1 => (v, from_right, [0.0, -2.0], [2.0, 0.0]),
        2 => (from_right, from_top, [-2.0, 0.0], [0.0, -2.0]),
        _ => (from_top, u, [0.0, 2.0], [-2.0, 0.0]),
    };
    (corner, Place { u, v, ..place }, Turn { du, dv })
}

/// The sub-face of an n-gon that holds a place.
pub(super) fn sub_face(place: Place, size: usize) -> (usize, Place, Turn) {
    let corner = (place.u.floor() as usize).min(size - 1);
    let u = place.u - corner as f64;
    (
        corner,
        Place { u, ..place },
        Turn {
            du: [1.0, 0.0],
            dv: [0.0, 1.0],
        },
    )
}
