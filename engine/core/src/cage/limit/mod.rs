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

mod faces;
mod patch;
mod pattern;
mod power;
mod regular;
mod ring;
mod shape;
mod split;
mod vertex;

use glam::DVec3;

use self::faces::{child_place, widest};
use self::patch::Patch;
use self::power::PowerPatch;
use self::regular::RegularFaces;
use self::split::{Scratch, sample};
use super::error::CageError;
use super::topology::Cage;
use super::uniform::refine;

pub use self::pattern::LimitPattern;

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

/// Places on one patch from which on turning it into powers pays.
const SHORT_RUN: usize = 4;

/// What is asked of a place, and how it is had: from a patch, from a patch in powers, from the sample of a split face.
trait Answer: Sized {
    fn of_patch(patch: &Patch, u: f64, v: f64) -> Self;
    fn of_powers(patch: &PowerPatch, u: f64, v: f64) -> Self;
    fn of_sample(sample: LimitSample) -> Self;
}

impl Answer for LimitSample {
    fn of_patch(patch: &Patch, u: f64, v: f64) -> Self {
        sample(patch.evaluate(u, v), DVec3::ZERO, 1.0)
    }

    #[inline]
    fn of_powers(patch: &PowerPatch, u: f64, v: f64) -> Self {
        sample(patch.jet(u, v), DVec3::ZERO, 1.0)
    }

    fn of_sample(sample: LimitSample) -> Self {
        sample
    }
}

impl Answer for [f64; 3] {
    fn of_patch(patch: &Patch, u: f64, v: f64) -> Self {
        patch.position(u, v)
    }

    #[inline]
    fn of_powers(patch: &PowerPatch, u: f64, v: f64) -> Self {
        patch.position(u, v)
    }

    fn of_sample(sample: LimitSample) -> Self {
        sample.position
    }
}

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
        self.collect(places)
    }

    /// Positions only, twice as fast.
    ///
    /// # Errors
    /// As [`LimitSurface::evaluate`], for the first place that is wrong.
    pub fn positions_many(&self, places: &[Place]) -> Result<Vec<[f64; 3]>, CageError> {
        self.collect(places)
    }

    fn collect<T: Answer>(&self, places: &[Place]) -> Result<Vec<T>, CageError> {
        let mut scratch = Scratch::default();
        let mut samples = Vec::with_capacity(places.len());
        for run in places.chunk_by(|a, b| a.face == b.face) {
            self.check_face(run[0])?;
            let patch = if self.quads.is_none() {
                scratch.patch(&self.regular, self.cage, run[0].face)
            } else {
                None
            };
            let Some(patch) = patch else {
                for &place in run {
                    samples.push(T::of_sample(self.evaluate_with(place, &mut scratch)?));
                }
                continue;
            };
            run.iter()
                .try_for_each(|place| self.check_parameters(place, 1.0))?;
            if run.len() < SHORT_RUN {
                samples.extend(
                    run.iter()
                        .map(|place| T::of_patch(&patch, place.u, place.v)),
                );
            } else {
                let patch = PowerPatch::from(&patch);
                samples.extend(
                    run.iter()
                        .map(|place| T::of_powers(&patch, place.u, place.v)),
                );
            }
        }
        Ok(samples)
    }

    fn evaluate_with(&self, place: Place, scratch: &mut Scratch) -> Result<LimitSample, CageError> {
        self.check_face(place)?;
        let corners = self.cage.topology().face_corners(place.face);
        self.check_parameters(&place, widest(corners.len()))?;
        let Some(quads) = &self.quads else {
            return Ok(scratch.evaluate(&self.regular, self.cage, place));
        };
        let (child, turn) = child_place(place, corners);
        let sample = scratch.evaluate(&self.regular, quads, child);
        Ok(LimitSample {
            du: turn.du(&sample),
            dv: turn.dv(&sample),
            ..sample
        })
    }

    fn check_face(&self, place: Place) -> Result<(), CageError> {
        let topology = self.cage.topology();
        if place.face >= topology.face_count() {
            return Err(wrong(&place, "there is no such face"));
        }
        if topology.is_hole(place.face) {
            return Err(wrong(&place, "the face is a hole"));
        }
        Ok(())
    }

    #[inline]
    fn check_parameters(&self, place: &Place, widest: f64) -> Result<(), CageError> {
        if (0.0..=widest).contains(&place.u) && (0.0..=1.0).contains(&place.v) {
            return Ok(());
        }
        Err(wrong(place, "u and v are outside the face"))
    }
}

#[cold]
fn wrong(place: &Place, reason: &'static str) -> CageError {
    CageError::Place {
        face: place.face,
        u: place.u,
        v: place.v,
        reason,
    }
}

#[cfg(test)]
mod laws;
#[cfg(test)]
mod tests;
