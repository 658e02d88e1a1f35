//! What GDAL writes beside the standard: void mark, scale, offset and unit of heights.
//!
//! Its metadata is a flat list of `<Item name=".." sample="0" role="scale">0.1</Item>`; no more of XML is read.

use super::super::units;

/// Scale, offset and unit of the first band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BandMetadata {
    pub(super) scale: Option<f64>,
    pub(super) offset: Option<f64>,
    /// Metres a unit.
    pub(super) unit: Option<f64>,
}

impl BandMetadata {
    pub(super) fn parse(text: &str) -> Self {
        let mut found = Self::default();
        for item in text.split("<Item ").skip(1) {
            let Some((attributes, rest)) = item.split_once('>') else {
                continue;
            };
            let value = rest.split('<').next().unwrap_or("").trim();
            if attribute(attributes, "sample").is_some_and(|sample| sample != "0") {
                continue;
            }
            match attribute(attributes, "role") {
                Some("scale") => found.scale = number(value),
                Some("offset") => found.offset = number(value),
                Some("unittype") => found.unit = units::from_name(value),
                _ => {}
            }
        }
        found
    }
}

/// A finite number.
fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = attributes.split_once(&format!("{name}=\""))?;
    rest.split('"').next()
}

/// The void mark, as GDAL writes it: a number, `nan`, `inf` or `-inf`.
pub(super) fn nodata(text: &str) -> Option<f64> {
    text.trim()
        .to_lowercase()
        .replace("1.#qnan", "nan")
        .replace("1.#inf", "inf")
        .parse()
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_band_s_items_are_found() {
        let text = "<GDALMetadata>\n<Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-1000</Item>\n\
            <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.1</Item>\n\
            <Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\n\
            <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>";
        let found = BandMetadata::parse(text);
        assert_eq!(
            found,
            BandMetadata {
                scale: Some(0.1),
                offset: Some(-1000.0),
                unit: Some(units::FOOT)
            }
        );
        assert_eq!(
            BandMetadata::parse("no metadata <Item "),
            BandMetadata::default()
        );
    }

    #[test]
    fn void_marks_may_be_no_numbers() {
        assert!(nodata("nan").is_some_and(f64::is_nan));
        assert_eq!(nodata("-inf"), Some(f64::NEG_INFINITY));
        assert_eq!(nodata("-3.4028234663852886e+38"), Some(f64::from(f32::MIN)));
        assert_eq!(nodata("none"), None);
    }
}
