//! Evaluation by splitting: from a face's neighbourhood to the patch or vertex that holds a place.

use glam::DVec3;

use super::super::topology::Cage;
use super::patch::{Jet, Patch, patch, regular_sides};
use super::regular::RegularFaces;
use super::ring::Neighbourhood;
use super::vertex::{VertexLimit, vertex_limit};
use super::{LimitSample, Place};

/// Splits after which a place counts as the vertex it is next to. The surface there differs from the vertex's limit by
/// less than one part in 10¹²: a ring shrinks by at least 0.66 a level at any valence.
const DEEPEST: u32 = 72;

/// Memory reused from place to place.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// The neighbourhood of the face last loaded.
    whole: Neighbourhood,
    face: Option<u32>,
    /// Two levels of splitting.
    part: Neighbourhood,
    quarter: Neighbourhood,
}

impl Scratch {
    fn load(&mut self, cage: &Cage, face: u32) {
        if self.face != Some(face) {
            self.whole.load(cage, face);
            self.face = Some(face);
        }
    }

    /// Takes a neighbourhood that is no face's.
    pub(super) fn fill(&mut self, fill: impl FnOnce(&mut Neighbourhood)) {
        self.face = None;
        fill(&mut self.whole);
    }

    /// The patch of a face that is one.
    pub(super) fn patch(
        &mut self,
        regular: &RegularFaces,
        cage: &Cage,
        face: u32,
    ) -> Option<Patch> {
        if let Some(patch) = regular.patch(face, cage.positions()) {
            return Some(patch);
        }
        self.load(cage, face);
        let mut patch = patch(&self.whole, regular_sides(&self.whole)?);
        patch
            .controls
            .iter_mut()
            .for_each(|control| *control += self.whole.origin);
        Some(patch)
    }

    pub(super) fn evaluate(
        &mut self,
        regular: &RegularFaces,
        cage: &Cage,
        place: Place,
    ) -> LimitSample {
        if let Some(patch) = regular.patch(place.face, cage.positions()) {
            return sample(patch.evaluate(place.u, place.v), DVec3::ZERO, 1.0);
        }
        self.load(cage, place.face);
        self.split_to(place.u, place.v)
    }

    /// Splits the face's neighbourhood towards (u, v) until the surface there is known.
    pub(super) fn split_to(&mut self, mut u: f64, mut v: f64) -> LimitSample {
        let mut scale = 1.0;
        let mut depth = 0;
        loop {
            let hood = if depth == 0 { &self.whole } else { &self.part };
            if let Some(sides) = regular_sides(hood) {
                return sample(patch(hood, sides).evaluate(u, v), hood.origin, scale);
            }
            let q = corner_towards(u, v);
            let on_vertex = [u, v].iter().all(|&x| x == 0.0 || x == 1.0);
            if on_vertex && let Some(limit) = vertex_limit(&hood.rings[q]) {
                return vertex_sample(limit, q, hood.origin, scale);
            }
            if depth == DEEPEST {
                let limit = vertex_limit(&hood.rings[q]).unwrap_or_else(|| last_resort(hood, q));
                return vertex_sample(limit, q, hood.origin, scale);
            }
            hood.split(q, &mut self.quarter);
            std::mem::swap(&mut self.part, &mut self.quarter);
            (u, v) = (
                2.0 * u - f64::from(q == 1 || q == 2),
                2.0 * v - f64::from(q >= 2),
            );
            (depth, scale) = (depth + 1, 2.0 * scale);
        }
    }
}

/// The corner whose quarter holds (u, v).
pub(super) fn corner_towards(u: f64, v: f64) -> usize {
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

#[inline]
pub(super) fn sample(jet: Jet, origin: DVec3, scale: f64) -> LimitSample {
    LimitSample {
        position: (origin + jet.position).to_array(),
        du: (scale * jet.du).to_array(),
        dv: (scale * jet.dv).to_array(),
        normal: unit(jet.du.cross(jet.dv)).to_array(),
    }
}

/// The unit vector, or zero.
#[inline]
fn unit(vector: DVec3) -> DVec3 {
    let squared = vector.length_squared();
    if (1e-280..1e280).contains(&squared) {
        return vector * squared.sqrt().recip();
    }
    // Too short or too long to be squared.
    let largest = vector.abs().max_element();
    if largest > 0.0 && largest.is_finite() {
        (vector / largest).normalize_or_zero()
    } else {
        DVec3::ZERO
    }
}
