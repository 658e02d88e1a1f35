//! Coordinate reference systems, as far as Drumlin needs them: a name, a kind, and the size of the planet.

use serde::{Deserialize, Serialize};

use super::CrsError;
use super::definition::Definition;

/// What the coordinates are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CrsKind {
    /// Longitude and latitude in degrees.
    Geographic,
    /// Plane coordinates.
    Projected,
    /// Nothing is said; taken as plane coordinates in metres.
    Unknown,
}

/// An ellipsoid of revolution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ellipsoid {
    /// Equatorial radius in metres.
    pub semi_major: f64,
    /// 1 / flattening; 0 for a sphere.
    pub inverse_flattening: f64,
}

impl Ellipsoid {
    /// The World Geodetic System of 1984.
    pub const WGS84: Self = Self {
        semi_major: 6_378_137.0,
        inverse_flattening: 298.257_223_563,
    };
    /// The Moon's reference sphere.
    pub const MOON: Self = Self {
        semi_major: 1_737_400.0,
        inverse_flattening: 0.0,
    };

    /// Metres a degree of longitude and a degree of latitude at a latitude in degrees: the ellipsoid's radii of
    /// curvature N cos φ and M, times π / 180.
    #[must_use]
    pub fn metres_per_degree(&self, latitude: f64) -> [f64; 2] {
        let flattening = if self.inverse_flattening == 0.0 {
            0.0
        } else {
            1.0 / self.inverse_flattening
        };
        let e2 = flattening * (2.0 - flattening);
        let (sin, cos) = latitude.to_radians().sin_cos();
        let w2 = 1.0 - e2 * sin * sin;
        let prime_vertical = self.semi_major / w2.sqrt();
        let meridian = self.semi_major * (1.0 - e2) / (w2 * w2.sqrt());
        [prime_vertical * cos, meridian].map(f64::to_radians)
    }
}

/// A coordinate reference system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crs {
    /// Geographic, projected or unknown.
    pub kind: CrsKind,
    /// Authority and code, as `EPSG:4326`, where known.
    pub code: Option<String>,
    /// What the coordinates are as a PROJ string, where no code says it and a file's parameters do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub definition: Option<String>,
    /// A human's name for it, as its file says.
    pub name: Option<String>,
    /// The ellipsoid of geographic coordinates.
    pub ellipsoid: Ellipsoid,
    /// Metres in one unit of plane coordinates (1 for metres, 0.3048 for feet); 1 for geographic ones.
    pub unit_metres: f64,
}

impl Crs {
    /// Plane coordinates in metres of which nothing more is known.
    #[must_use]
    pub const fn unknown() -> Self {
        Self {
            kind: CrsKind::Unknown,
            code: None,
            definition: None,
            name: None,
            ellipsoid: Ellipsoid::WGS84,
            unit_metres: 1.0,
        }
    }

    /// Longitude and latitude on WGS 84, EPSG:4326.
    #[must_use]
    pub fn wgs84() -> Self {
        Self {
            kind: CrsKind::Geographic,
            code: Some("EPSG:4326".into()),
            ..Self::unknown()
        }
    }

    /// A system by authority and code, as `EPSG:32633`; x is east and y is north whatever order the authority prefers.
    ///
    /// # Errors
    /// [`CrsError`] when the code is not one of the EPSG registry's projected or geographic systems.
    pub fn from_code(code: &str) -> Result<Self, CrsError> {
        let definition = Definition::of_code(code)?;
        let geographic = definition.is_geographic();
        Ok(Self {
            kind: if geographic {
                CrsKind::Geographic
            } else {
                CrsKind::Projected
            },
            code: Some(code.to_uppercase()),
            definition: None,
            name: None,
            ellipsoid: definition.ellipsoid()?,
            unit_metres: if geographic {
                1.0
            } else {
                definition.unit_metres()?
            },
        })
    }

    /// Datum and ellipsoid as a PROJ string's parameters: by a geographic system's code where there is one, else the
    /// ellipsoid alone.
    pub(crate) fn base_parameters(code: Option<&str>, ellipsoid: Ellipsoid) -> String {
        let known = code.and_then(|code| Definition::of_code(code).ok());
        let geographic = Self {
            kind: CrsKind::Geographic,
            ellipsoid,
            ..Self::unknown()
        };
        let own = known.or_else(|| Definition::of(&geographic).ok());
        own.map_or_else(String::new, |definition| definition.base().text())
    }

    /// True when both mean the same coordinates: equal codes where both have one, else equal in all but the name.
    #[must_use]
    pub fn same_as(&self, other: &Self) -> bool {
        match (&self.code, &other.code) {
            (Some(a), Some(b)) => a == b,
            _ => {
                self.kind == other.kind
                    && self.ellipsoid == other.ellipsoid
                    && self.unit_metres == other.unit_metres
                    && (self.definition == other.definition
                        || self.code.is_some()
                        || other.code.is_some())
            }
        }
    }

    /// What to call it in a message.
    #[must_use]
    pub fn label(&self) -> &str {
        match self.kind {
            CrsKind::Unknown => "unknown",
            _ => self
                .code
                .as_deref()
                .or(self.name.as_deref())
                .unwrap_or("unnamed"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_on_wgs84_has_its_textbook_length() {
        let [longitude, latitude] = Ellipsoid::WGS84.metres_per_degree(0.0);
        assert!((longitude - 111_319.49).abs() < 0.01 && (latitude - 110_574.28).abs() < 0.01);
        let [longitude, latitude] = Ellipsoid::WGS84.metres_per_degree(45.0);
        assert!((longitude - 78_846.835).abs() < 0.01 && (latitude - 111_131.777).abs() < 0.01);
    }
}
