//! The same places on every face: limit stencils, shared by all faces of one shape.
//!
//! A stencil is the weights of a face's controls in the position at one place, and in the two derivatives. It is exact
//! however deep the place lies, and costs one multiply-add a control, whatever the depth; places of a face lie side by
//! side ([`LaneWeights`]). Positions may change from call to call; only a change of topology or sharpness needs a new
//! pattern.

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use std::collections::HashMap;

use glam::DVec3;

use super::super::error::CageError;
use super::super::topology::Topology;
use super::shape::{Shape, controls, key};
use super::split::{Scratch, sample};
use super::{LimitSample, patch::Jet};
use crate::subdiv::{LaneWeights, Real};

/// Stencils of one shape of face: weights of all controls at all places in position, `du` and `dv`.
#[derive(Debug)]
struct Stencils<T> {
    jet: [LaneWeights<T>; 3],
}

/// Controls a pattern may have: so many a face on average, and some for a few poles of high valence, each of whose faces
/// depends on the whole ring.
const CONTROLS_A_FACE: u64 = 64;
const CONTROLS_OF_POLES: u64 = 1 << 22;

/// Places that are evaluated on every face of an all-quad cage, in f64 or f32.
#[derive(Debug)]
pub struct LimitPattern<T = f64> {
    place_count: usize,
    stencils: Vec<Stencils<T>>,
    /// For each face its shape's stencils, and the end of its controls in the list.
    faces: Vec<[u32; 2]>,
    controls: Vec<u32>,
    vertex_count: u32,
}

impl<T: Real> LimitPattern<T> {
    /// Prepares places, as (u, v) in the unit square, on all faces of a topology; holes are faces like any other here.
    ///
    /// # Errors
    /// [`CageError::Budget`] where faces depend on too many controls; [`CageError::Place`] for a place outside the square, and for a face that is no quad or has an inner corner of
    /// valence 2; [`refine`](super::super::refine) a cage with such faces first.
    pub fn new(topology: &Topology, places: &[[f64; 2]]) -> Result<Self, CageError> {
        let inside = |place: &[f64; 2]| place.iter().all(|x| (0.0..=1.0).contains(x));
        if let Some(&[u, v]) = places.iter().find(|place| !inside(place)) {
            return Err(CageError::Place {
                face: 0,
                u,
                v,
                reason: "u and v are outside the face",
            });
        }
        let mut pattern = Self {
            place_count: places.len(),
            stencils: Vec::new(),
            faces: Vec::with_capacity(topology.face_count() as usize),
            controls: Vec::with_capacity(17 * topology.face_count() as usize),
            vertex_count: topology.vertex_count(),
        };
        let limit = CONTROLS_OF_POLES + CONTROLS_A_FACE * u64::from(topology.face_count());
        let limit = limit.min(u64::from(u32::MAX));
        let (mut known, mut words) = (HashMap::new(), Vec::new());
        for face in 0..topology.face_count() {
            let fits = topology.face_vertices(face).len() == 4
                && controls(topology, face, &mut pattern.controls);
            if !fits {
                let reason = "a pattern needs quads without inner corners of valence 2";
                return Err(CageError::Place {
                    face,
                    u: 0.0,
                    v: 0.0,
                    reason,
                });
            }
            if pattern.controls.len() as u64 > limit {
                return Err(CageError::Budget {
                    what: "controls of limit stencils",
                    limit,
                });
            }
            key(topology, face, &mut words);
            let class = match known.get(&words) {
                Some(&class) => class,
                None => {
                    pattern
                        .stencils
                        .push(Stencils::new(&Shape::new(topology, face), places));
                    let class = pattern.stencils.len() as u32 - 1;
                    known.insert(words.clone(), class);
                    class
                }
            };
            pattern.faces.push([class, pattern.controls.len() as u32]);
        }
        Ok(pattern)
    }

    /// Places on each face.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.place_count
    }

    /// Shapes of faces there are.
    #[must_use]
    pub fn shape_count(&self) -> usize {
        self.stencils.len()
    }

    /// Limit positions, face by face and place by place, of the cage with these control positions.
    ///
    /// # Panics
    /// When there are fewer positions than the topology has vertices.
    #[must_use]
    pub fn positions(&self, positions: &[[T; 3]]) -> Vec<[T; 3]> {
        let mut out = vec![[T::default(); 3]; self.faces.len() * self.place_count];
        self.positions_into(positions, &mut out);
        out
    }

    /// [`LimitPattern::positions`] into memory that is there.
    ///
    /// # Panics
    /// When there are fewer positions than the topology has vertices, or `out` is not one a place of every face.
    pub fn positions_into(&self, positions: &[[T; 3]], out: &mut [[T; 3]]) {
        self.evaluate_into(positions, [out]);
    }

    /// Limit positions and derivatives by u and by v, each like [`LimitPattern::positions_into`]. At extraordinary
    /// vertices derivatives are the limit tangents, as of [`LimitSurface`](super::LimitSurface).
    ///
    /// # Panics
    /// When there are fewer positions than the topology has vertices, or a list is not one a place of every face.
    pub fn jets_into(&self, positions: &[[T; 3]], out: [&mut [[T; 3]]; 3]) {
        self.evaluate_into(positions, out);
    }

    /// The first `N` of position, `du` and `dv`.
    fn evaluate_into<const N: usize>(&self, positions: &[[T; 3]], mut out: [&mut [[T; 3]]; N]) {
        assert!(
            positions.len() >= self.vertex_count as usize,
            "one position for every vertex"
        );
        let wanted = self.faces.len() * self.place_count;
        assert!(
            out.iter().all(|out| out.len() == wanted),
            "one sample a place of every face"
        );
        if self.place_count == 0 {
            return;
        }
        let (mut gathered, mut start) = (Vec::new(), 0);
        for (face, &[class, end]) in self.faces.iter().enumerate() {
            let controls = &self.controls[start..end as usize];
            gathered.clear();
            gathered.extend(controls.iter().map(|&vertex| positions[vertex as usize]));
            let places = face * self.place_count..(face + 1) * self.place_count;
            for (weights, out) in self.stencils[class as usize].jet.iter().zip(&mut out) {
                weights.sum_into(&gathered, &mut out[places.clone()]);
            }
            start = end as usize;
        }
    }
}

impl LimitPattern {
    /// Limit samples, face by face and place by place. At extraordinary vertices derivatives are the limit tangents, as
    /// of [`LimitSurface`](super::LimitSurface). The normal is their product always: zero at a crease's vertex with one
    /// face on that side, where both tangents are one line.
    ///
    /// # Panics
    /// When there are fewer positions than the topology has vertices.
    #[must_use]
    pub fn samples(&self, positions: &[[f64; 3]]) -> Vec<LimitSample> {
        let mut parts = [0, 1, 2].map(|_| vec![[0.0; 3]; self.faces.len() * self.place_count]);
        let [at, du, dv] = &mut parts;
        self.jets_into(positions, [at, du, dv]);
        let jets = at.iter().zip(du).zip(dv).map(|((at, du), dv)| Jet {
            position: DVec3::from_array(*at),
            du: DVec3::from_array(*du),
            dv: DVec3::from_array(*dv),
        });
        jets.map(|jet| sample(jet, DVec3::ZERO, 1.0)).collect()
    }
}

impl<T: Real> Stencils<T> {
    /// Evaluates the surface of unit controls, three at a time, one in each coordinate.
    fn new(shape: &Shape, places: &[[f64; 2]]) -> Self {
        let control_count = shape.control_count;
        let mut jet = vec![[0.0; 3]; control_count * places.len()];
        let mut scratch = Scratch::default();
        for first in (0..control_count).step_by(3) {
            let unit = |place: usize| match place.checked_sub(first) {
                Some(0) => DVec3::X,
                Some(1) => DVec3::Y,
                Some(2) => DVec3::Z,
                _ => DVec3::ZERO,
            };
            scratch.fill(|hood| shape.fill(unit, hood));
            for (weights, &[u, v]) in jet.chunks_exact_mut(control_count).zip(places) {
                let sample = scratch.split_to(u, v);
                for (axis, weights) in weights[first..].iter_mut().take(3).enumerate() {
                    *weights = [sample.position[axis], sample.du[axis], sample.dv[axis]];
                }
            }
        }
        let of = |part: usize| {
            LaneWeights::new(places.len(), control_count, |place, control| {
                jet[place * control_count + control][part]
            })
        };
        Self {
            jet: [0, 1, 2].map(of),
        }
    }
}
