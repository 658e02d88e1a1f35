//! The one file that knows the projection library (`proj4rs`, a port of PROJ 4 in Rust).

use proj4rs::{
    Proj,
    errors::Result as ProjResult,
    transform::{Transform as Points, TransformClosure, transform},
};

use super::definition::{CrsError, Definition};
use super::transform::Transform;

/// Opens a definition.
pub(super) fn open(definition: &Definition) -> Result<Proj, CrsError> {
    Proj::from_proj_string(&definition.text()).map_err(|error| CrsError::System {
        system: definition.label().into(),
        what: error.to_string(),
    })
}

/// Points of one definition into another's.
pub(super) struct ProjTransform {
    from: Proj,
    to: Proj,
}

impl ProjTransform {
    pub(super) fn new(from: &Definition, to: &Definition) -> Result<Self, CrsError> {
        Ok(Self {
            from: open(from)?,
            to: open(to)?,
        })
    }
}

impl Transform for ProjTransform {
    fn apply(&self, points: &mut [[f64; 2]]) {
        if self.from.is_latlong() {
            points
                .iter_mut()
                .for_each(|point| *point = point.map(f64::to_radians));
        }
        // Each point has its own answer, so the whole never fails.
        let whole = transform(&self.from, &self.to, &mut Batch(points));
        if whole.is_err() {
            points.fill([f64::NAN; 2]);
        }
        let geographic = self.to.is_latlong();
        for point in points {
            if !point.iter().all(|value| value.is_finite()) {
                *point = [f64::NAN; 2];
            } else if geographic {
                *point = point.map(f64::to_degrees);
            }
        }
    }
}

/// Points on their way through the library's steps; NaN once a step has no answer.
struct Batch<'a>(&'a mut [[f64; 2]]);

impl Points for Batch<'_> {
    fn transform_coordinates<F: TransformClosure>(&mut self, step: &mut F) -> ProjResult<()> {
        for point in self.0.iter_mut() {
            let [x, y] = *point;
            *point = if x.is_finite() && y.is_finite() {
                step(x, y, 0.0).map_or([f64::NAN; 2], |(x, y, _)| [x, y])
            } else {
                [f64::NAN; 2]
            };
        }
        Ok(())
    }
}
