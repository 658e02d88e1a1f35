//! The limit surface of a cage: exact position, derivatives and normal at any place.
//!
//! A place is a face and (u, v) in the unit square. The face's corners in the order listed are at (0, 0), (1, 0),
//! (1, 1) and (0, 1): u runs from the first corner to the second, v from the first to the last. Derivatives are by
//! the u and v of the whole face. On an infinitely sharp edge they are one-sided, the given face's.
//!
//! A face of `n ≠ 4` corners is `n` sub-faces, one a corner: sub-face `k` has its (0, 0) at corner `k`, its (1, 0) at
//! the middle of the side that leaves the corner, (1, 1) at the face's centre and (0, 1) at the middle of the side that
//! arrives. It is addressed by `k + u` for u (the end `n` belonging to the last), and derivatives are by its own u, v.
//!
//! How: the face's neighbourhood is split exactly towards the place until the quarter left is one bicubic patch. What
//! lies on a vertex that never becomes regular is found by the vertex's limit masks. All points are kept relative to
//! an origin near the place, so places very close to a vertex lose no digits.
//!
//! Based on: E. Catmull, J. Clark (1978); J. Stam, *Exact evaluation of Catmull-Clark subdivision surfaces at arbitrary
//! parameter values* (1998), whose patches are those reached here by splitting.

mod patch;
mod regular;
mod ring;
mod vertex;

use glam::DVec3;

use self::patch::{Jet, patch, regular_sides};
use self::regular::RegularFaces;
use self::ring::Neighbourhood;
use self::vertex::{VertexLimit, vertex_limit};
use super::error::CageError;
use super::topology::Cage;
use super::uniform::refine;

/// A place on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// The face.
    pub face: u32,
    /// First parameter, 0 to 1 (to `n` on faces of `n ≠ 4` corners).
    pub u: f64,
    /// Second parameter, 0 to 1.
    pub v: f64,
}

/// The surface at a place.
///
/// At a vertex where the derivatives have no limit (extraordinary ones) `du` and `dv` are the limit tangents along the
/// face's two sides, in direction exact and of finite length. The normal is zero where the surface has none because
/// it is degenerate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LimitSample {
    /// Position.
    pub position: [f64; 3],
    /// Derivative by u.
    pub du: [f64; 3],
    /// Derivative by v.
    pub dv: [f64; 3],
    /// Unit normal, `du × dv`: outward for counter-clockwise faces.
    pub normal: [f64; 3],
}

/// Splits after which a place counts as the vertex it is next to. The surface there differs from the vertex's limit by
/// less than one part in 10¹²: a ring shrinks by at least 0.66 a level at any valence.
const DEEPEST: u32 = 72;

/// A cage ready for evaluation.
#[derive(Debug)]
pub struct LimitSurface<'a> {
    cage: &'a Cage,
    /// The cage one level finer, where not all faces are quads; face numbers are the cage's corner numbers.
    quads: Option<Cage>,
    regular: RegularFaces,
}

impl<'a> LimitSurface<'a> {
    /// Prepares a cage: finds its regular faces, and refines it once if it has faces other than quads.
    ///
    /// # Errors
    /// [`CageError::Budget`] where that refinement is too large.
    pub fn new(cage: &'a Cage) -> Result<Self, CageError> {
        let quads = if cage.topology().all_quads() {
            None
        } else {
            Some(refine(cage)?)
        };
        let regular = RegularFaces::new(quads.as_ref().unwrap_or(cage).topology());
        Ok(Self {
            cage,
            quads,
            regular,
        })
    }

    /// The surface at a place.
    ///
    /// # Errors
    /// [`CageError::Place`] for a face that is not there or a hole, or parameters outside the face.
    pub fn evaluate(&self, face: u32, u: f64, v: f64) -> Result<LimitSample, CageError> {
        self.evaluate_with(Place { face, u, v }, &mut Scratch::default())
    }

    /// The surface at many places, in order; fastest when places on one face follow each other.
    ///
    /// # Errors
    /// As [`LimitSurface::evaluate`], for the first place that is wrong.
    pub fn evaluate_many(&self, places: &[Place]) -> Result<Vec<LimitSample>, CageError> {
        let mut scratch = Scratch::default();
        places
            .iter()
            .map(|&place| self.evaluate_with(place, &mut scratch))
            .collect()
    }

    fn evaluate_with(&self, place: Place, scratch: &mut Scratch) -> Result<LimitSample, CageError> {
        self.check(place)?;
        let Some(quads) = &self.quads else {
            return Ok(self.evaluate_quad(self.cage, place, scratch));
        };
        let corners = self.cage.topology().face_corners(place.face);
        let (corner, child, turn) = if corners.len() == 4 {
            quarter(place)
        } else {
            sub_face(place, corners.len())
        };
        let child = Place {
            face: (corners.start + corner) as u32,
            ..child
        };
        let sample = self.evaluate_quad(quads, child, scratch);
        Ok(LimitSample {
            du: turn.du(&sample),
            dv: turn.dv(&sample),
            ..sample
        })
    }

    fn check(&self, place: Place) -> Result<(), CageError> {
        let topology = self.cage.topology();
        let wrong = |reason| {
            Err(CageError::Place {
                face: place.face,
                u: place.u,
                v: place.v,
                reason,
            })
        };
        if place.face >= topology.face_count() {
            return wrong("there is no such face");
        }
        if topology.is_hole(place.face) {
            return wrong("the face is a hole");
        }
        let size = topology.face_corners(place.face).len();
        let widest = if size == 4 { 1.0 } else { size as f64 };
        if !(0.0..=widest).contains(&place.u) || !(0.0..=1.0).contains(&place.v) {
            return wrong("u and v are outside the face");
        }
        Ok(())
    }

    fn evaluate_quad(&self, cage: &Cage, place: Place, scratch: &mut Scratch) -> LimitSample {
        if let Some(patch) = scratch.regular_patch(&self.regular, cage, place.face) {
            return sample(patch.evaluate(place.u, place.v), DVec3::ZERO, 1.0);
        }
        scratch.hood.load(cage, place.face);
        split_to(place.u, place.v, scratch)
    }
}

/// Memory reused from place to place.
#[derive(Debug, Default)]
struct Scratch {
    hood: Neighbourhood,
    quarter: Neighbourhood,
    /// The last regular face's patch.
    patch: Option<(u32, patch::Patch)>,
}

impl Scratch {
    fn regular_patch(
        &mut self,
        regular: &RegularFaces,
        cage: &Cage,
        face: u32,
    ) -> Option<&patch::Patch> {
        if self.patch.as_ref().is_none_or(|(known, _)| *known != face) {
            self.patch = Some((face, regular.patch(face, cage.positions())?));
        }
        self.patch.as_ref().map(|(_, patch)| patch)
    }
}

/// Splits the neighbourhood in `scratch` towards (u, v) until the surface there is known.
fn split_to(mut u: f64, mut v: f64, scratch: &mut Scratch) -> LimitSample {
    let mut scale = 1.0;
    for depth in 0..=DEEPEST {
        let hood = &mut scratch.hood;
        if let Some(sides) = regular_sides(hood) {
            return sample(patch(hood, sides).evaluate(u, v), hood.origin, scale);
        }
        let q = corner_towards(u, v);
        let on_vertex = [u, v].iter().all(|&x| x == 0.0 || x == 1.0);
        if on_vertex || depth == DEEPEST {
            let limit = vertex_limit(&hood.rings[q]);
            if let Some(limit) = limit {
                return vertex_sample(limit, q, hood.origin, scale);
            }
            if depth == DEEPEST {
                return vertex_sample(last_resort(hood, q), q, hood.origin, scale);
            }
        }
        hood.split(q, &mut scratch.quarter);
        std::mem::swap(&mut scratch.hood, &mut scratch.quarter);
        (u, v) = (
            2.0 * u - f64::from(q == 1 || q == 2),
            2.0 * v - f64::from(q >= 2),
        );
        scale *= 2.0;
    }
    LimitSample::default()
}

/// The corner whose quarter holds (u, v).
fn corner_towards(u: f64, v: f64) -> usize {
    match (u > 0.5, v > 0.5) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    }
}

/// Where no mask is known: the control points of the deepest level, a hair's breadth from their limit.
fn last_resort(hood: &Neighbourhood, q: usize) -> VertexLimit {
    let ring = &hood.rings[q];
    let (du, dv) = (
        ring.spokes[ring.spoke(0)] - ring.center,
        ring.spokes[ring.spoke(1)] - ring.center,
    );
    VertexLimit {
        position: ring.center,
        du,
        dv,
        normal: du.cross(dv),
    }
}

/// Tangents at corner `q` run along its leaving and arriving sides; u and v run a quarter turn further for each `q`.
fn vertex_sample(limit: VertexLimit, q: usize, origin: DVec3, scale: f64) -> LimitSample {
    let (leaving, arriving) = (limit.du, limit.dv);
    let (du, dv) = match q {
        0 => (leaving, arriving),
        1 => (-arriving, leaving),
        2 => (-leaving, -arriving),
        _ => (arriving, -leaving),
    };
    LimitSample {
        position: (origin + limit.position).to_array(),
        du: (scale * du).to_array(),
        dv: (scale * dv).to_array(),
        normal: unit(limit.normal).to_array(),
    }
}

fn sample(jet: Jet, origin: DVec3, scale: f64) -> LimitSample {
    LimitSample {
        position: (origin + jet.position).to_array(),
        du: (scale * jet.du).to_array(),
        dv: (scale * jet.dv).to_array(),
        normal: unit(jet.du.cross(jet.dv)).to_array(),
    }
}

/// The unit vector, or zero. Vectors too short or long to be squared are scaled first.
fn unit(vector: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > 0.0 && largest.is_finite() {
        (vector / largest).normalize_or_zero()
    } else {
        DVec3::ZERO
    }
}

/// How the derivatives by a face's u and v follow from those by a child's: `du = a · child du + b · child dv`.
struct Turn {
    du: [f64; 2],
    dv: [f64; 2],
}

impl Turn {
    fn du(&self, child: &LimitSample) -> [f64; 3] {
        std::array::from_fn(|i| self.du[0] * child.du[i] + self.du[1] * child.dv[i])
    }

    fn dv(&self, child: &LimitSample) -> [f64; 3] {
        std::array::from_fn(|i| self.dv[0] * child.du[i] + self.dv[1] * child.dv[i])
    }
}

/// The refined face of a quad that holds a place: its corner, the place there and the turn back. Every child has its
/// own (0, 0) at the parent's corner, so it is turned by as many quarters.
fn quarter(place: Place) -> (usize, Place, Turn) {
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
fn sub_face(place: Place, size: usize) -> (usize, Place, Turn) {
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

#[cfg(test)]
mod tests;
