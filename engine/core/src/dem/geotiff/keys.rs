//! GeoKeys: what coordinates are, as a GeoTIFF says it; `dem/tiff/geokeys.rs` reads them back.
//!
//! Based on: OGC GeoTIFF 1.1 (19-008r4).

use crate::dem::tiff::{geo_key, tag};
use crate::geo::{Crs, CrsKind};

/// "The user defines it in other keys."
const USER_DEFINED: u16 = 32_767;
const DEGREE: u16 = 9102;
const METRE: u16 = 9001;

/// The three tags of GeoKeys.
pub(super) struct GeoKeys {
    pub(super) directory: Vec<u16>,
    pub(super) doubles: Vec<f64>,
    pub(super) text: String,
}

/// The keys of a CRS; samples are points.
pub(super) fn geo_keys(crs: &Crs) -> GeoKeys {
    let mut keys = GeoKeys {
        directory: vec![1, 1, 0, 0],
        doubles: Vec::new(),
        text: String::new(),
    };
    let model = match crs.kind {
        CrsKind::Projected => Some(1),
        CrsKind::Geographic => Some(2),
        CrsKind::Unknown => None,
    };
    if let Some(model) = model {
        keys.short(geo_key::MODEL_TYPE, model);
    }
    keys.short(geo_key::RASTER_TYPE, 2);
    let code = crs
        .code
        .as_deref()
        .and_then(|code| code.strip_prefix("EPSG:")?.parse().ok());
    match crs.kind {
        CrsKind::Geographic => {
            keys.short(geo_key::GEOGRAPHIC, code.unwrap_or(USER_DEFINED));
            keys.name(geo_key::GEOGRAPHIC_CITATION, crs);
            keys.short(geo_key::ANGULAR_UNIT, DEGREE);
            keys.ellipsoid(crs);
        }
        CrsKind::Projected => {
            if code.is_none() {
                keys.ellipsoid(crs);
            }
            keys.short(geo_key::PROJECTED, code.unwrap_or(USER_DEFINED));
            keys.name(geo_key::PROJECTED_CITATION, crs);
            if crs.unit_metres == 1.0 {
                keys.short(geo_key::LINEAR_UNIT, METRE);
            } else {
                keys.short(geo_key::LINEAR_UNIT, USER_DEFINED);
                keys.double(geo_key::LINEAR_UNIT_METRES, crs.unit_metres);
            }
        }
        CrsKind::Unknown => {}
    }
    keys.directory[3] = u16::try_from(keys.directory.len() / 4 - 1).unwrap_or(0);
    keys
}

impl GeoKeys {
    fn short(&mut self, key: u16, value: u16) {
        self.directory.extend([key, 0, 1, value]);
    }

    fn double(&mut self, key: u16, value: f64) {
        let at = u16::try_from(self.doubles.len()).unwrap_or(u16::MAX);
        self.directory.extend([key, tag::GEO_DOUBLES, 1, at]);
        self.doubles.push(value);
    }

    /// The CRS's name, where it has one of plain letters; the text tag holds no others.
    fn name(&mut self, key: u16, crs: &Crs) {
        let Some(name) = crs.name.as_deref().filter(|name| name.is_ascii()) else {
            return;
        };
        let name = name.replace(['|', '\0'], " ") + "|";
        let (Ok(at), Ok(count)) = (u16::try_from(self.text.len()), u16::try_from(name.len()))
        else {
            return;
        };
        self.directory.extend([key, tag::GEO_TEXT, count, at]);
        self.text += &name;
    }

    fn ellipsoid(&mut self, crs: &Crs) {
        self.double(geo_key::SEMI_MAJOR, crs.ellipsoid.semi_major);
        self.double(
            geo_key::INVERSE_FLATTENING,
            crs.ellipsoid.inverse_flattening,
        );
    }
}
