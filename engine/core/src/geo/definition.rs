//! Coordinate systems written out: PROJ strings, by EPSG code or from a file's own parameters.
//!
//! Knows what a definition says and not how points are turned by it.

use super::proj;
use super::{Crs, CrsKind, Ellipsoid};

/// Why coordinates cannot be turned from one system into another.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CrsError {
    /// A code of no known system.
    #[error("{0}: not a known coordinate system; EPSG:n of a projected or geographic one is")]
    Code(String),
    /// A system whose coordinates cannot be turned, and why.
    #[error("{system}: coordinates cannot be transformed: {what}")]
    System {
        /// What the system is called.
        system: String,
        /// What is in the way.
        what: String,
    },
    /// Two systems that have no known relation.
    #[error("no transformation from {from} to {to}: {what}")]
    Pair {
        /// The one.
        from: String,
        /// The other.
        to: String,
        /// What is in the way.
        what: String,
    },
}

/// Parameters that place a system's ellipsoid: the datum.
const DATUM_KEYS: [&str; 3] = ["datum", "towgs84", "nadgrids"];
/// Parameters that give an ellipsoid's shape.
const ELLIPSOID_KEYS: [&str; 6] = ["ellps", "a", "b", "rf", "f", "R"];
/// Named datums whose ellipsoid must be said where the datum is left out.
const DATUM_ELLIPSOIDS: [(&str, &str); 10] = [
    ("WGS84", "WGS84"),
    ("NAD83", "GRS80"),
    ("NAD27", "clrk66"),
    ("GGRS87", "GRS80"),
    ("OSGB36", "airy"),
    ("carthage", "clrk80ign"),
    ("hermannskogel", "bessel"),
    ("potsdam", "bessel"),
    ("ire65", "mod_airy"),
    ("nzgd49", "intl"),
];

/// A PROJ string in its parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Definition {
    /// What the system is called in messages.
    label: String,
    parameters: Vec<(String, Option<String>)>,
}

impl Definition {
    /// The definition of an EPSG code.
    pub(super) fn of_code(code: &str) -> Result<Self, CrsError> {
        let number = code
            .split_once(':')
            .filter(|(authority, _)| authority.eq_ignore_ascii_case("EPSG"))
            .and_then(|(_, number)| number.parse::<u16>().ok());
        let known = number.and_then(crs_definitions::from_code);
        let known = known.ok_or_else(|| CrsError::Code(code.into()))?;
        let definition = Self::parse(code.to_uppercase(), known.proj4);
        match definition.value("proj") {
            // Places in space, and a definition that is empty.
            None | Some("geocent") => Err(CrsError::Code(code.into())),
            _ => Ok(definition),
        }
    }

    /// The definition of a system, by its code, its own parameters or its ellipsoid.
    pub(super) fn of(crs: &Crs) -> Result<Self, CrsError> {
        let label = || crs.label().to_owned();
        match (crs.kind, &crs.code, &crs.definition) {
            (CrsKind::Unknown, ..) => Err(CrsError::System {
                system: label(),
                what: "nothing says what they are".into(),
            }),
            (_, Some(code), _) => Self::of_code(code),
            (_, None, Some(text)) => Ok(Self::parse(label(), text)),
            (CrsKind::Geographic, None, None) => {
                let Ellipsoid {
                    semi_major,
                    inverse_flattening,
                } = crs.ellipsoid;
                let shape = if inverse_flattening == 0.0 {
                    format!("+R={semi_major}")
                } else {
                    format!("+a={semi_major} +rf={inverse_flattening}")
                };
                Ok(Self::parse(label(), &format!("+proj=longlat {shape}")))
            }
            (CrsKind::Projected, None, None) => Err(CrsError::System {
                system: label(),
                what: "its file names no code, and no projection that is read".into(),
            }),
        }
    }

    fn parse(label: String, text: &str) -> Self {
        let words = text.split_whitespace();
        let parameters = words.map(|word| {
            let word = word.trim_start_matches('+');
            match word.split_once('=') {
                Some((key, value)) => (key.to_owned(), Some(value.to_owned())),
                None => (word.to_owned(), None),
            }
        });
        Self {
            label,
            parameters: parameters.collect(),
        }
    }

    pub(super) fn label(&self) -> &str {
        &self.label
    }

    pub(super) fn is_geographic(&self) -> bool {
        matches!(
            self.value("proj"),
            Some("longlat" | "latlong" | "latlon" | "lonlat")
        )
    }

    /// Metres in one unit of plane coordinates.
    pub(super) fn unit_metres(&self) -> Result<f64, CrsError> {
        Ok(proj::open(&self.without_datum())?.to_meter())
    }

    pub(super) fn ellipsoid(&self) -> Result<Ellipsoid, CrsError> {
        let (semi_major, semi_minor) = proj::open(&self.without_datum())?.ellipse_parameters();
        Ok(Ellipsoid {
            semi_major,
            inverse_flattening: if semi_major == semi_minor {
                0.0
            } else {
                semi_major / (semi_major - semi_minor)
            },
        })
    }

    /// The order and sense of its axes, where they are not east and north.
    pub(super) fn axes(&self) -> Option<&str> {
        self.value("axis").filter(|axis| !axis.starts_with("en"))
    }

    /// The datum's parameters, in a form that is equal for equal datums; none where the definition says nothing.
    pub(super) fn datum(&self) -> Option<String> {
        match self.value("datum") {
            Some("WGS84") => return Some("WGS84".into()),
            Some(name @ ("NAD83" | "NAD27")) => return Some(name.into()),
            _ => {}
        }
        // Web Mercator: a sphere for the projection alone, on WGS 84's datum.
        if self.value("nadgrids") == Some("@null") {
            return Some("WGS84".into());
        }
        let parts: Vec<_> = DATUM_KEYS
            .iter()
            .filter_map(|key| self.value(key))
            .collect();
        (!parts.is_empty()).then(|| format!("{} {}", self.shape(), parts.join(" ")))
    }

    /// True when its datum is tied to WGS 84's by a grid of shifts, which is not carried.
    pub(super) fn needs_grid(&self) -> bool {
        self.value("datum") == Some("NAD27")
            || self.value("nadgrids").is_some_and(|grid| grid != "@null")
    }

    /// True for datums that agree with WGS 84's, and for its ellipsoid and GRS 80's, whose centres are the Earth's,
    /// where no datum is said.
    pub(super) fn is_earth_centred(&self) -> bool {
        let earths = |ellipsoid: Ellipsoid| {
            ellipsoid.semi_major == Ellipsoid::WGS84.semi_major
                && (ellipsoid.inverse_flattening - Ellipsoid::WGS84.inverse_flattening).abs() < 1e-3
        };
        let zero = |shift: &str| shift.split(',').all(|value| value.parse() == Ok(0.0));
        match (self.value("datum"), self.value("towgs84")) {
            (Some(name), _) => matches!(name, "WGS84" | "NAD83"),
            (None, Some(shift)) => zero(shift),
            (None, None) => {
                self.value("nadgrids") == Some("@null") || self.ellipsoid().is_ok_and(earths)
            }
        }
    }

    /// The same system on its bare ellipsoid: for steps between systems of one datum.
    pub(super) fn without_datum(&self) -> Self {
        let mut bare = self.clone();
        let has_shape = ELLIPSOID_KEYS.iter().any(|key| self.has(key));
        let named = self.value("datum").filter(|_| !has_shape);
        let shape = DATUM_ELLIPSOIDS
            .iter()
            .find(|(name, _)| Some(*name) == named);
        bare.parameters
            .retain(|(key, _)| !DATUM_KEYS.contains(&key.as_str()));
        if let Some((_, ellipsoid)) = shape {
            bare.parameters
                .push(("ellps".into(), Some((*ellipsoid).into())));
        }
        bare
    }

    /// As PROJ reads it.
    pub(super) fn text(&self) -> String {
        let words = self.parameters.iter().map(|(key, value)| match value {
            Some(value) => format!("+{key}={value}"),
            None => format!("+{key}"),
        });
        words.collect::<Vec<_>>().join(" ")
    }

    /// The parameters of datum and ellipsoid alone.
    pub(super) fn base(&self) -> Self {
        let mut base = self.clone();
        base.parameters.retain(|(key, _)| {
            let key = key.as_str();
            DATUM_KEYS.contains(&key) || ELLIPSOID_KEYS.contains(&key) || key == "pm"
        });
        base
    }

    fn shape(&self) -> String {
        let shape = ELLIPSOID_KEYS.iter().filter_map(|key| self.value(key));
        shape.collect::<Vec<_>>().join(" ")
    }

    fn has(&self, key: &str) -> bool {
        self.parameters.iter().any(|(own, _)| own == key)
    }

    fn value(&self, key: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(own, _)| own == key);
        found.and_then(|(_, value)| value.as_deref())
    }
}
