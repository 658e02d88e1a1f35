//! The same places on every face: limit stencils, shared by all faces of one shape.
//!
//! A stencil is the weights of a face's controls in the position at one place, and in the two derivatives. It is exact
//! however deep the place lies, and costs one multiply-add a control, whatever the depth. Positions may change from
//! call to call; only a change of topology or sharpness needs a new pattern.

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

/// Weights of one control in position, `du` and `dv` at one place.
type Weights = [f64; 3];

/// Stencils of one shape of face.
#[derive(Debug)]
struct Stencils {
    control_count: usize,
    /// For every place the weights of all controls in its position.
    position: Vec<f64>,
    /// The same with derivatives; not kept for patterns of positions only.
    jet: Vec<Weights>,
}

/// Controls a pattern may have: so many a face on average, and some for a few poles of high valence, each of whose faces
/// depends on the whole ring.
const CONTROLS_A_FACE: u64 = 64;
const CONTROLS_OF_POLES: u64 = 1 << 22;

/// Places that are evaluated on every face of an all-quad cage.
#[derive(Debug)]
pub struct LimitPattern {
    place_count: usize,
    stencils: Vec<Stencils>,
    /// For each face its shape's stencils, and the end of its controls in the list.
    faces: Vec<[u32; 2]>,
    controls: Vec<u32>,
    vertex_count: u32,
}

impl LimitPattern {
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
    pub fn positions(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut out = Vec::with_capacity(self.faces.len() * self.place_count);
        self.for_each_face(positions, |stencils, controls| {
            let weights = stencils.position.chunks_exact(stencils.control_count);
            out.extend(weights.map(|weights| {
                let [x, y, z, _] = sum(weights, controls);
                [x, y, z]
            }));
        });
        out
    }

    /// Limit samples, face by face and place by place. At extraordinary vertices derivatives are the limit tangents, as
    /// of [`LimitSurface`](super::LimitSurface). The normal is their product always: zero at a crease's vertex with one
    /// face on that side, where both tangents are one line.
    ///
    /// # Panics
    /// When there are fewer positions than the topology has vertices.
    #[must_use]
    pub fn samples(&self, positions: &[[f64; 3]]) -> Vec<LimitSample> {
        let mut out = Vec::with_capacity(self.faces.len() * self.place_count);
        self.for_each_face(positions, |stencils, controls| {
            let weights = stencils.jet.chunks_exact(stencils.control_count);
            out.extend(weights.map(|weights| sample(jet(weights, controls), DVec3::ZERO, 1.0)));
        });
        out
    }

    fn for_each_face(
        &self,
        positions: &[[f64; 3]],
        mut evaluate: impl FnMut(&Stencils, &[[f64; 4]]),
    ) {
        assert!(
            positions.len() >= self.vertex_count as usize,
            "one position for every vertex"
        );
        let (mut gathered, mut start) = (Vec::new(), 0);
        for &[class, end] in &self.faces {
            gathered.clear();
            gathered.extend(self.controls[start..end as usize].iter().map(|&vertex| {
                let [x, y, z] = positions[vertex as usize];
                [x, y, z, 0.0]
            }));
            evaluate(&self.stencils[class as usize], &gathered);
            start = end as usize;
        }
    }
}

#[inline]
fn sum(weights: &[f64], controls: &[[f64; 4]]) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (weight, control) in weights.iter().zip(controls) {
        add(&mut sums, *weight, control);
    }
    sums
}

#[inline]
fn jet(weights: &[Weights], controls: &[[f64; 4]]) -> Jet {
    let mut sums = [[0.0; 4]; 3];
    for (weights, control) in weights.iter().zip(controls) {
        add(&mut sums[0], weights[0], control);
        add(&mut sums[1], weights[1], control);
        add(&mut sums[2], weights[2], control);
    }
    let [position, du, dv] = sums.map(|[x, y, z, _]| DVec3::new(x, y, z));
    Jet { position, du, dv }
}

#[inline(always)]
fn add(sum: &mut [f64; 4], weight: f64, control: &[f64; 4]) {
    for (sum, x) in sum.iter_mut().zip(control) {
        *sum += weight * x;
    }
}

impl Stencils {
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
        Self {
            control_count,
            position: jet.iter().map(|weights| weights[0]).collect(),
            jet,
        }
    }
}
