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

/// A quarter of a quarter of … a face, and its own quarters as far as they are known.
#[derive(Debug, Default)]
struct Quarter {
    hood: Neighbourhood,
    /// Its patch, where it is regular.
    patch: Option<Patch>,
    /// Places of its quarters among all; the whole's, 0, for those not known.
    quarters: [usize; 4],
}

impl Quarter {
    fn settle(&mut self) {
        self.patch = regular_sides(&self.hood).map(|sides| patch(&self.hood, sides));
        self.quarters = [WHOLE; 4];
    }
}

/// Place of the whole face among its quarters.
const WHOLE: usize = 0;

/// Quarters kept of one face, about two megabytes. Past that its splitting begins anew.
const MOST_QUARTERS: usize = 1024;

/// The face last split, and memory reused from face to face.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    face: Option<u32>,
    /// The whole face first; only so many are in use.
    quarters: Vec<Quarter>,
    used: usize,
}

impl Scratch {
    fn load(&mut self, cage: &Cage, face: u32) {
        if self.face != Some(face) {
            self.fill(|hood| hood.load(cage, face));
            self.face = Some(face);
        }
    }

    /// Takes a neighbourhood that is no face's.
    pub(super) fn fill(&mut self, fill: impl FnOnce(&mut Neighbourhood)) {
        (self.face, self.used) = (None, 0);
        self.add(fill);
    }

    fn add(&mut self, fill: impl FnOnce(&mut Neighbourhood)) -> usize {
        if self.used == self.quarters.len() {
            self.quarters.push(Quarter::default());
        }
        let quarter = &mut self.quarters[self.used];
        fill(&mut quarter.hood);
        quarter.settle();
        self.used += 1;
        self.used - 1
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
        let whole = &self.quarters[WHOLE];
        let mut patch = whole.patch.clone()?;
        patch
            .controls
            .iter_mut()
            .for_each(|control| *control += whole.hood.origin);
        Some(patch)
    }

    /// The surface at a place of an all-quad cage.
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
        if self.used > MOST_QUARTERS {
            self.used = 1;
            self.quarters[WHOLE].quarters = [WHOLE; 4];
        }
        let (mut here, mut depth, mut scale) = (WHOLE, 0, 1.0);
        loop {
            let Quarter { hood, patch, .. } = &self.quarters[here];
            if let Some(patch) = patch {
                return sample(patch.evaluate(u, v), hood.origin, scale);
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
            here = self.quarter(here, q);
            (u, v) = (
                2.0 * u - f64::from(q == 1 || q == 2),
                2.0 * v - f64::from(q >= 2),
            );
            (depth, scale) = (depth + 1, 2.0 * scale);
        }
    }

    /// The quarter of a quarter at corner `q`, split off unless it is known.
    fn quarter(&mut self, of: usize, q: usize) -> usize {
        let known = self.quarters[of].quarters[q];
        if known != WHOLE {
            return known;
        }
        let parent = std::mem::take(&mut self.quarters[of].hood);
        let child = self.add(|hood| parent.split(q, hood));
        self.quarters[of].hood = parent;
        self.quarters[of].quarters[q] = child;
        child
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
