//! Units of length by their EPSG codes and names.

/// Metres in an international foot.
pub(super) const FOOT: f64 = 0.3048;
/// Metres in a US survey foot.
pub(super) const US_FOOT: f64 = 1200.0 / 3937.0;

/// Metres in a unit given by its EPSG code.
pub(super) fn from_code(code: u16) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => FOOT,
        9003 => US_FOOT,
        9005 => 0.304_797_265_4,
        9036 => 1000.0,
        9096 => 0.9144,
        9093 => 1609.344,
        _ => return None,
    })
}

/// Metres in a unit of heights given by its name.
pub(super) fn from_name(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase();
    Some(match name.as_str() {
        "m" | "metre" | "meter" | "metres" | "meters" => 1.0,
        "ft" | "foot" | "feet" | "international foot" => FOOT,
        "ftus" | "us-ft" | "sft" | "us survey foot" | "us survey feet" | "foot_us"
        | "us_survey_foot" => US_FOOT,
        "cm" | "centimetre" | "centimeter" => 0.01,
        "dm" | "decimetre" | "decimeter" => 0.1,
        "km" | "kilometre" | "kilometer" => 1000.0,
        _ => return None,
    })
}

/// Metres in the unit of a vertical reference given by its EPSG code, where that is not the metre.
pub(super) fn of_vertical_reference(code: u16) -> Option<f64> {
    match code {
        // NAVD88 and NGVD29, height and depth in US survey feet.
        5702 | 6358 | 6360 => Some(US_FOOT),
        // NAVD88 height in feet.
        8228 => Some(FOOT),
        _ => None,
    }
}
