//! Coordinate systems as text (`.prj` files, WKT 1): kind, name, code, ellipsoid and unit; no more is read.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::DemError;
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
    Ok(Crs {
        kind: if projected {
            CrsKind::Projected
        } else {
            CrsKind::Geographic
        },
        code: code(text),
        name: text.split('"').nth(1).map(str::to_owned),
        ellipsoid: ellipsoid.map_or(Ellipsoid::WGS84, |(semi_major, inverse_flattening)| {
            Ellipsoid {
                semi_major,
                inverse_flattening,
            }
        }),
        unit_metres: if projected { unit } else { 1.0 },
    })
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
        assert_eq!(parse("Projection UTM"), Ok(Crs::unknown()));
        assert!(parse("PROJCS[").is_err());
    }
}
