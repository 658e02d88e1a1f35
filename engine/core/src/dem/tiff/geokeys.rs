//! GeoKeys: what a GeoTIFF's coordinates are.
//!
//! Based on: OGC GeoTIFF 1.1 (19-008r4).

use std::collections::BTreeMap;

use self::geo_key::{
    ANGULAR_UNIT, CITATION, ELLIPSOID, GEOGRAPHIC, GEOGRAPHIC_CITATION, INVERSE_FLATTENING,
    LINEAR_UNIT, LINEAR_UNIT_METRES, METHOD, MODEL_TYPE, PROJECTED, PROJECTED_CITATION,
    RASTER_TYPE, SEMI_MAJOR, SEMI_MINOR, VERTICAL, VERTICAL_UNIT,
};
use super::super::projection::{Method, Projection};
use super::super::{DemError, bytes::Bytes, units};
use super::ifd::{Ifd, tag};
use crate::geo::{Crs, CrsKind, Ellipsoid};

/// Numbers of keys.
pub(crate) mod geo_key {
    pub(crate) const MODEL_TYPE: u16 = 1024;
    pub(crate) const RASTER_TYPE: u16 = 1025;
    pub(crate) const CITATION: u16 = 1026;
    pub(crate) const GEOGRAPHIC: u16 = 2048;
    pub(crate) const GEOGRAPHIC_CITATION: u16 = 2049;
    pub(crate) const ANGULAR_UNIT: u16 = 2054;
    pub(crate) const ELLIPSOID: u16 = 2056;
    pub(crate) const SEMI_MAJOR: u16 = 2057;
    pub(crate) const SEMI_MINOR: u16 = 2058;
    pub(crate) const INVERSE_FLATTENING: u16 = 2059;
    pub(crate) const PROJECTED: u16 = 3072;
    pub(crate) const PROJECTED_CITATION: u16 = 3073;
    pub(crate) const METHOD: u16 = 3075;
    pub(crate) const LINEAR_UNIT: u16 = 3076;
    pub(crate) const LINEAR_UNIT_METRES: u16 = 3077;
    pub(crate) const VERTICAL: u16 = 4096;
    pub(crate) const VERTICAL_UNIT: u16 = 4099;
}

/// "The user defines it in other keys."
const USER_DEFINED: u16 = 32767;

/// The keys of a file, with their values.
#[derive(Debug, Default)]
pub(super) struct GeoKeys {
    shorts: BTreeMap<u16, u16>,
    doubles: BTreeMap<u16, f64>,
    texts: BTreeMap<u16, String>,
}

impl GeoKeys {
    /// Reads the keys; a file without them has none.
    pub(super) fn read(bytes: &Bytes, ifd: &Ifd) -> Result<Self, DemError> {
        let mut keys = Self::default();
        let Some(directory) = ifd.numbers(bytes, tag::GEO_KEYS)? else {
            return Ok(keys);
        };
        let doubles = ifd.doubles(bytes, tag::GEO_DOUBLES)?.unwrap_or_default();
        let text = ifd.text(bytes, tag::GEO_TEXT)?.unwrap_or_default();
        let directory: Vec<u16> = directory
            .iter()
            .filter_map(|&v| u16::try_from(v).ok())
            .collect();
        for entry in directory.chunks_exact(4).skip(1) {
            let &[key, place, count, value] = entry else {
                continue;
            };
            let at = usize::from(value);
            match place {
                0 => drop(keys.shorts.insert(key, value)),
                tag::GEO_DOUBLES => {
                    let Some(&value) = doubles.get(at) else {
                        return Err(cut_off(bytes, key));
                    };
                    keys.doubles.insert(key, value);
                }
                tag::GEO_TEXT => {
                    // A tolerated slip: counts one past the end, for the NUL.
                    let end = (at + usize::from(count)).min(text.len());
                    let value = text.get(at..end).ok_or_else(|| cut_off(bytes, key))?;
                    keys.texts
                        .insert(key, value.trim_end_matches(['|', '\0', ' ']).to_owned());
                }
                _ => {}
            }
        }
        Ok(keys)
    }

    /// True when coordinates are those of sample points and not of their areas' corners.
    pub(super) fn pixel_is_point(&self) -> bool {
        self.shorts.get(&RASTER_TYPE) == Some(&2)
    }

    /// Metres a unit of height, where the keys say it.
    pub(super) fn vertical_unit(&self) -> Option<f64> {
        let unit = self
            .shorts
            .get(&VERTICAL_UNIT)
            .and_then(|&code| units::from_code(code));
        unit.or_else(|| {
            self.shorts
                .get(&VERTICAL)
                .and_then(|&code| units::of_vertical_reference(code))
        })
    }

    /// The coordinate system, or what is not supported of it.
    pub(super) fn crs(&self) -> Result<Crs, String> {
        let projected =
            self.shorts.contains_key(&PROJECTED) || self.shorts.contains_key(&LINEAR_UNIT);
        let geographic =
            self.shorts.contains_key(&GEOGRAPHIC) || self.doubles.contains_key(&SEMI_MAJOR);
        match self.shorts.get(&MODEL_TYPE) {
            Some(1) if projected => self.projected(),
            Some(2) if geographic => self.geographic(),
            Some(3) => Err("geocentric coordinates (GeoKey 1024)".into()),
            // A model type alone says nothing that helps; no model type at all is a writer's slip.
            None if projected => self.projected(),
            None if geographic => self.geographic(),
            _ => Ok(Crs::unknown()),
        }
    }

    fn geographic(&self) -> Result<Crs, String> {
        match self.shorts.get(&ANGULAR_UNIT) {
            None | Some(9102 | 9122) => {}
            Some(unit) => {
                return Err(format!(
                    "angles in unit {unit} (GeoKey 2054); only degrees are read"
                ));
            }
        }
        Ok(Crs {
            kind: CrsKind::Geographic,
            definition: None,
            code: self.code(GEOGRAPHIC),
            name: self.name([GEOGRAPHIC_CITATION, CITATION]),
            ellipsoid: self.ellipsoid(),
            unit_metres: 1.0,
        })
    }

    fn projected(&self) -> Result<Crs, String> {
        let unit_metres = match self.shorts.get(&LINEAR_UNIT) {
            Some(&USER_DEFINED) => self.doubles.get(&LINEAR_UNIT_METRES).copied(),
            Some(&code) => units::from_code(code),
            None => Some(self.named_unit()),
        };
        let unit_metres = unit_metres.filter(|unit| unit.is_finite() && *unit > 0.0);
        let unit_metres = unit_metres.ok_or("an unknown unit of length (GeoKeys 3076, 3077)")?;
        Ok(Crs {
            kind: CrsKind::Projected,
            definition: self.definition(unit_metres),
            code: self.code(PROJECTED),
            name: self.name([PROJECTED_CITATION, CITATION]),
            ellipsoid: self.ellipsoid(),
            unit_metres,
        })
    }

    /// A projection that has no code, by its own parameters.
    fn definition(&self, unit_metres: f64) -> Option<String> {
        if self.code(PROJECTED).is_some() {
            return None;
        }
        let method = match self.shorts.get(&METHOD)? {
            1 => Method::TransverseMercator,
            7 => Method::Mercator,
            8 => Method::LambertConic2,
            9 => Method::LambertConic1,
            10 => Method::LambertAzimuthal,
            11 => Method::Albers,
            15 => Method::PolarStereographic,
            17 => Method::Equirectangular,
            24 => Method::Sinusoidal,
            _ => return None,
        };
        // Keys of natural origin, false origin, centre, and the meridian straight up from the pole.
        let value = |keys: &[u16]| keys.iter().find_map(|key| self.doubles.get(key)).copied();
        let projection = Projection {
            method,
            latitude: value(&[3081, 3085, 3089]),
            longitude: value(&[3095, 3080, 3084, 3088]),
            parallels: [value(&[3078]), value(&[3079])],
            scale: value(&[3092, 3093]),
            false_origin: [value(&[3082, 3086, 3090]), value(&[3083, 3087, 3091])],
        };
        let geographic = self.code(GEOGRAPHIC);
        let base = Crs::base_parameters(geographic.as_deref(), self.ellipsoid());
        projection.definition(&base, unit_metres)
    }

    /// The unit of a system whose keys name none: its name tells feet, as in "NAD83 / California zone 6 (ftUS)".
    fn named_unit(&self) -> f64 {
        let name = self
            .name([PROJECTED_CITATION, CITATION])
            .unwrap_or_default();
        if name.contains("(ftUS)") {
            units::US_FOOT
        } else if name.contains("(ft)") {
            units::FOOT
        } else {
            1.0
        }
    }

    fn code(&self, key: u16) -> Option<String> {
        let code = self
            .shorts
            .get(&key)
            .filter(|&&code| code != USER_DEFINED && code != 0)?;
        Some(format!("EPSG:{code}"))
    }

    /// The first citation there is, without the prefixes that GDAL and ESRI put before a name.
    fn name(&self, keys: [u16; 2]) -> Option<String> {
        let text = keys.iter().find_map(|key| self.texts.get(key))?;
        let first = text.split('|').next().unwrap_or(text).trim();
        let name = first
            .rsplit_once(" = ")
            .map_or(first, |(_, name)| name)
            .trim();
        (!name.is_empty()).then(|| name.to_owned())
    }

    fn ellipsoid(&self) -> Ellipsoid {
        if let Some(&semi_major) = self
            .doubles
            .get(&SEMI_MAJOR)
            .filter(|&&a| a.is_finite() && a > 0.0)
        {
            let from_minor = self
                .doubles
                .get(&SEMI_MINOR)
                .map(|minor| inverse_flattening(semi_major, *minor));
            let given = self
                .doubles
                .get(&INVERSE_FLATTENING)
                .copied()
                .filter(|f| f.is_finite());
            let inverse_flattening = given.or(from_minor).unwrap_or(0.0);
            return Ellipsoid {
                semi_major,
                inverse_flattening,
            };
        }
        known_ellipsoid(
            self.shorts.get(&ELLIPSOID).copied(),
            self.shorts.get(&GEOGRAPHIC).copied(),
        )
    }
}

fn cut_off(bytes: &Bytes, key: u16) -> DemError {
    DemError::format(
        bytes.path(),
        format!("the value of GeoKey {key} is cut off"),
    )
}

fn inverse_flattening(semi_major: f64, semi_minor: f64) -> f64 {
    if semi_major == semi_minor {
        0.0
    } else {
        semi_major / (semi_major - semi_minor)
    }
}

/// The ellipsoid of an EPSG ellipsoid code, or of a geographic system's; WGS 84's where neither is known.
fn known_ellipsoid(ellipsoid: Option<u16>, geographic: Option<u16>) -> Ellipsoid {
    let (semi_major, inverse_flattening) = match (ellipsoid, geographic) {
        (Some(7019), _) | (_, Some(4269 | 4258 | 4283 | 4617)) => (6_378_137.0, 298.257_222_101),
        (Some(7008), _) | (_, Some(4267)) => (6_378_206.4, 294.978_698_213_898),
        (Some(7004), _) => (6_377_397.155, 299.152_812_8),
        (Some(7022), _) | (_, Some(4230)) => (6_378_388.0, 297.0),
        (Some(7001), _) | (_, Some(4277)) => (6_377_563.396, 299.324_964_6),
        _ => return Ellipsoid::WGS84,
    };
    Ellipsoid {
        semi_major,
        inverse_flattening,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moon_is_a_sphere_with_a_name_and_no_code() {
        let mut keys = GeoKeys::default();
        keys.shorts.extend([
            (MODEL_TYPE, 2),
            (GEOGRAPHIC, USER_DEFINED),
            (ANGULAR_UNIT, 9102),
        ]);
        keys.doubles
            .extend([(SEMI_MAJOR, 1_737_400.0), (SEMI_MINOR, 1_737_400.0)]);
        keys.texts.insert(
            GEOGRAPHIC_CITATION,
            "GCS Name = Moon 2000|Datum = D_Moon_2000".into(),
        );
        let crs = keys.crs().expect("a sphere is supported");
        assert_eq!((crs.kind, crs.code.as_deref()), (CrsKind::Geographic, None));
        assert_eq!(
            (crs.name.as_deref(), crs.ellipsoid),
            (Some("Moon 2000"), Ellipsoid::MOON)
        );
    }

    #[test]
    fn feet_are_feet() {
        let mut keys = GeoKeys::default();
        keys.shorts.extend([
            (MODEL_TYPE, 1),
            (PROJECTED, 2927),
            (LINEAR_UNIT, 9003),
            (VERTICAL_UNIT, 9002),
        ]);
        let crs = keys.crs().expect("feet are supported");
        assert_eq!(
            (crs.code.as_deref(), crs.unit_metres),
            (Some("EPSG:2927"), units::US_FOOT)
        );
        assert_eq!(keys.vertical_unit(), Some(units::FOOT));
    }

    #[test]
    fn a_projection_without_a_code_is_written_out() {
        let mut keys = GeoKeys::default();
        keys.shorts.extend([
            (MODEL_TYPE, 1),
            (PROJECTED, USER_DEFINED),
            (METHOD, 15),
            (LINEAR_UNIT, 9001),
        ]);
        keys.doubles.extend([
            (SEMI_MAJOR, 1_737_400.0),
            (SEMI_MINOR, 1_737_400.0),
            (3081, -90.0),
            (3092, 1.0),
        ]);
        let crs = keys.crs().expect("a polar stereographic sphere");
        assert_eq!(
            crs.definition.as_deref(),
            Some(
                "+proj=stere +lat_0=-90 +lon_0=0 +k=1 +x_0=0 +y_0=0 +R=1737400 +to_meter=1 +no_defs"
            )
        );
    }

    #[test]
    fn a_system_without_a_unit_may_name_it() {
        let mut keys = GeoKeys::default();
        keys.shorts.extend([(MODEL_TYPE, 1), (PROJECTED, 2230)]);
        assert_eq!(keys.crs().map(|crs| crs.unit_metres), Ok(1.0));
        keys.texts
            .insert(CITATION, "NAD83 / California zone 6 (ftUS)".into());
        assert_eq!(keys.crs().map(|crs| crs.unit_metres), Ok(units::US_FOOT));
    }

    #[test]
    fn a_model_type_alone_says_nothing() {
        let mut keys = GeoKeys::default();
        keys.shorts.insert(MODEL_TYPE, 1);
        assert_eq!(keys.crs(), Ok(Crs::unknown()));
    }
}
