//! Points of one coordinate system in another.

use super::definition::{CrsError, Definition};
use super::proj::ProjTransform;
use super::{Crs, Ellipsoid};

/// Turns points of one system into another's.
///
/// x is east and y is north in both, longitude before latitude, in degrees or in the system's own unit of length.
pub trait Transform: Send + Sync {
    /// Turns points in place; NaN where the other system has no such place. Longitudes come out within ±180°.
    fn apply(&self, points: &mut [[f64; 2]]);
}

/// How two systems' datums are related.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DatumShift {
    /// They are one: exact.
    None,
    /// By published constants, as a rule true to a few metres; where both say that they agree with WGS 84, to one or
    /// two.
    Constants,
    /// One of them says nothing, and stands on an ellipsoid about the Earth's centre: taken as the same.
    Assumed,
}

/// Equatorial radii of one planet's systems differ by less than this share.
const PLANET_TOLERANCE: f64 = 0.01;

/// The transform from one system to another, and how their datums are related.
///
/// Heights are left as they are.
///
/// # Errors
/// [`CrsError`] for unknown systems, axes that are not east and north, another planet's, and datums whose relation
/// is not known or given by a grid of shifts, which is not carried: never a shift left out in silence.
pub fn transform(from: &Crs, to: &Crs) -> Result<(Box<dyn Transform>, DatumShift), CrsError> {
    let [a, b] = [Definition::of(from)?, Definition::of(to)?];
    for definition in [&a, &b] {
        if let Some(axes) = definition.axes() {
            let what = format!("its axes are {axes}, not east and north");
            return Err(CrsError::System {
                system: definition.label().into(),
                what,
            });
        }
    }
    let shift = datum_shift(&a, &b)?;
    let transform = if shift == DatumShift::Constants {
        ProjTransform::new(&a, &b)?
    } else {
        ProjTransform::new(&a.without_datum(), &b.without_datum())?
    };
    Ok((Box::new(transform), shift))
}

fn datum_shift(from: &Definition, to: &Definition) -> Result<DatumShift, CrsError> {
    let refuse = |what: &str| {
        Err(CrsError::Pair {
            from: from.label().into(),
            to: to.label().into(),
            what: what.into(),
        })
    };
    let radius = |definition: &Definition| {
        definition
            .ellipsoid()
            .map(|Ellipsoid { semi_major, .. }| semi_major)
    };
    let [a, b] = [radius(from)?, radius(to)?];
    if (a - b).abs() > PLANET_TOLERANCE * a {
        return refuse("they are of different planets");
    }
    match (from.datum(), to.datum()) {
        (a, b) if a == b && (a.is_some() || from.ellipsoid()? == to.ellipsoid()?) => {
            Ok(DatumShift::None)
        }
        (Some(_), Some(_)) if from.needs_grid() || to.needs_grid() => refuse(
            "their datums are related by a grid of shifts, which is not carried; warp it first",
        ),
        (Some(_), Some(_)) => Ok(DatumShift::Constants),
        _ if from.is_earth_centred() && to.is_earth_centred() => Ok(DatumShift::Assumed),
        _ => refuse("how their datums are related is not known; warp it first"),
    }
}

#[cfg(test)]
mod tests;
