//! Coordinate systems as text (`.prj` files, WKT 1): kind, name, code, ellipsoid, unit and the usual projections.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::DemError;
use super::projection::{Method, Projection};
use crate::geo::{Crs, CrsKind, Ellipsoid};

/// Bytes a `.prj` file may have.
const MAX_BYTES: u64 = 1 << 16;

/// The coordinate system in the `.prj` beside a file; unknown where there is none.
pub(super) fn beside(path: &Path) -> Result<Crs, DemError> {
    let path = path.with_extension("prj");
    let Ok(file) = File::open(&path) else {
        return Ok(Crs::unknown());
    };
    let mut bytes = Vec::new();
    file.take(MAX_BYTES)
        .read_to_end(&mut bytes)
        .map_err(|error| DemError::io(&path, error))?;
    parse(&String::from_utf8_lossy(&bytes)).map_err(|what| DemError::unsupported(&path, what))
}

/// Reads a `PROJCS[…]` or `GEOGCS[…]`; other texts say nothing that is understood.
pub(super) fn parse(text: &str) -> Result<Crs, String> {
    let text = text.trim();
    let projected = text.starts_with("PROJCS[");
    if !projected && !text.starts_with("GEOGCS[") {
        return Ok(Crs::unknown());
    }
    // The system's own unit is its last; in front of it stand those of its parts.
    let unit = text.rfind("UNIT[").and_then(|at| number(&text[at..], 1));
    let unit = unit
        .filter(|unit| *unit > 0.0)
        .ok_or("a coordinate system without a unit")?;
    if !projected && (unit.to_degrees() - 1.0).abs() > 1e-6 {
        return Err(format!(
            "angles in units of {unit} radians; only degrees are read"
        ));
    }
    let spheroid = text.find("SPHEROID[").map(|at| &text[at..]);
    let axes = spheroid.and_then(|text| Some((number(text, 1)?, number(text, 2)?)));
    let ellipsoid = axes.filter(|(major, _)| *major > 0.0);
    let ellipsoid = ellipsoid.map_or(Ellipsoid::WGS84, |(semi_major, inverse_flattening)| {
        Ellipsoid {
            semi_major,
            inverse_flattening,
        }
    });
    let code = code(text);
    let definition = (projected && code.is_none()).then(|| definition(text, ellipsoid, unit));
    Ok(Crs {
        definition: definition.flatten(),
        kind: if projected {
            CrsKind::Projected
        } else {
            CrsKind::Geographic
        },
        code,
        name: text.split('"').nth(1).map(str::to_owned),
        ellipsoid,
        unit_metres: if projected { unit } else { 1.0 },
    })
}

/// The projection of a system that has no code.
fn definition(text: &str, ellipsoid: Ellipsoid, unit_metres: f64) -> Option<String> {
    let method = text.split("PROJECTION[").nth(1)?.split('"').nth(1)?;
    let method = match method {
        "Transverse_Mercator" | "Gauss_Kruger" => Method::TransverseMercator,
        "Mercator" | "Mercator_1SP" | "Mercator_2SP" => Method::Mercator,
        "Lambert_Conformal_Conic_2SP" => Method::LambertConic2,
        "Lambert_Conformal_Conic_1SP" => Method::LambertConic1,
        // Esri's word for both.
        "Lambert_Conformal_Conic" if text.contains("\"Standard_Parallel_2\"") => {
            Method::LambertConic2
        }
        "Lambert_Conformal_Conic" => Method::LambertConic1,
        "Lambert_Azimuthal_Equal_Area" => Method::LambertAzimuthal,
        "Albers" | "Albers_Conic_Equal_Area" => Method::Albers,
        "Polar_Stereographic" | "Stereographic_North_Pole" | "Stereographic_South_Pole" => {
            Method::PolarStereographic
        }
        "Equirectangular" | "Equidistant_Cylindrical" | "Plate_Carree" => Method::Equirectangular,
        "Sinusoidal" => Method::Sinusoidal,
        _ => return None,
    };
    let value = |names: &[&str]| {
        text.split("PARAMETER[").skip(1).find_map(|parameter| {
            let name = parameter.split('"').nth(1)?.to_lowercase();
            names
                .contains(&name.as_str())
                .then(|| number(parameter, 1))?
        })
    };
    let projection = Projection {
        method,
        latitude: value(&["latitude_of_origin", "latitude_of_center"]),
        longitude: value(&[
            "central_meridian",
            "longitude_of_center",
            "longitude_of_origin",
        ]),
        parallels: [
            value(&["standard_parallel_1"]),
            value(&["standard_parallel_2"]),
        ],
        scale: value(&["scale_factor"]),
        false_origin: [value(&["false_easting"]), value(&["false_northing"])],
    };
    // The geographic system's own code, where it stands: right after its unit.
    let geographic = text.split("GEOGCS[").nth(1)?.split("PROJECTION[").next()?;
    let geographic = geographic
        .trim_end()
        .trim_end_matches(',')
        .strip_suffix(']');
    let geographic = geographic.and_then(code).or_else(|| named_datum(text));
    let base = Crs::base_parameters(geographic.as_deref(), ellipsoid);
    projection.definition(&base, unit_metres)
}

/// The geographic system of a datum that texts without codes name.
fn named_datum(text: &str) -> Option<String> {
    let name = text.split("DATUM[").nth(1)?.split('"').nth(1)?;
    let code = match name.trim_start_matches("D_") {
        "WGS_1984" => 4326,
        "North_American_1983" | "North_American_Datum_1983" => 4269,
        "North_American_1927" | "North_American_Datum_1927" => 4267,
        "ETRS_1989" | "European_Terrestrial_Reference_System_1989" => 4258,
        _ => return None,
    };
    Some(format!("EPSG:{code}"))
}

/// The argument at a place of `KEY["name",1,2,…`.
fn number(text: &str, index: usize) -> Option<f64> {
    // Names may hold commas: count after the closing quote.
    let (_, after) = text.split_once('"')?.1.split_once('"')?;
    let argument = after.split([',', ']']).nth(index)?;
    argument
        .trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

/// The authority of the system itself: the last thing it says.
fn code(text: &str) -> Option<String> {
    let last = &text[text.rfind("AUTHORITY[")?..];
    let mut parts = last.split('"');
    let (authority, code) = (parts.nth(1)?, parts.nth(1)?);
    let rest: String = parts.collect();
    rest.trim_start_matches([']', ' '])
        .is_empty()
        .then(|| format!("{authority}:{code}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_matters_of_a_prj_is_read() {
        let text = r#"PROJCS["a, b",GEOGCS["NAD27",DATUM["D",SPHEROID["Clarke_1866",6378206.4,294.9786982]],
            PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Lambert"],UNIT["Foot_US",0.3048006]]"#;
        let crs = parse(text).expect("supported");
        assert_eq!(
            (crs.kind, crs.unit_metres, crs.code),
            (CrsKind::Projected, 0.304_800_6, None)
        );
        assert_eq!(
            (crs.name.as_deref(), crs.ellipsoid.semi_major),
            (Some("a, b"), 6_378_206.4)
        );
        let text = r#"GEOGCS["WGS 84",UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]"#;
        let crs = parse(text).expect("supported");
        assert_eq!(
            (crs.kind, crs.code.as_deref()),
            (CrsKind::Geographic, Some("EPSG:4326"))
        );
        let text = r#"PROJCS["x",GEOGCS["GCS",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],
            PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],
            PARAMETER["False_Easting",500000.0],PARAMETER["Central_Meridian",-123.0],
            PARAMETER["Scale_Factor",0.9996],UNIT["Meter",1.0]]"#;
        let definition = parse(text).expect("supported").definition;
        assert_eq!(
            definition.as_deref(),
            Some(
                "+proj=tmerc +lat_0=0 +lon_0=-123 +k=0.9996 +x_0=500000 +y_0=0 +datum=WGS84 +to_meter=1 +no_defs"
            )
        );
        assert_eq!(parse("Projection UTM"), Ok(Crs::unknown()));
        assert!(parse("PROJCS[").is_err());
    }
}
