use super::*;
use crate::geo::CrsKind;

/// Steps between systems of one datum are the library's formulas, and PROJ's are the same series: a tenth of a
/// millimetre. Constants of datum shifts are rounded by a digit in some definitions: a centimetre.
const METRES: [f64; 2] = [1e-4, 1e-2];

fn degrees_apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    let across = ((a[0] - b[0] + 540.0).rem_euclid(360.0) - 180.0) * a[1].to_radians().cos();
    across.hypot(a[1] - b[1]) * 111_320.0
}

#[test]
fn points_are_where_proj_puts_them_and_come_back() {
    let mut count = 0;
    for line in include_str!("vectors.txt").lines().skip(1) {
        let (code, numbers) = line.split_once(' ').expect("a code");
        let numbers: Vec<f64> = numbers
            .split(' ')
            .map(|number| number.parse().expect("a number"))
            .collect();
        let (place, expected) = ([numbers[0], numbers[1]], [numbers[2], numbers[3]]);
        let system = Crs::from_code(code).expect("known");
        let (there, shift) = transform(&Crs::wgs84(), &system).expect("transforms");
        let (back, _) = transform(&system, &Crs::wgs84()).expect("transforms back");
        let tolerance = METRES[usize::from(matches!(code, "EPSG:27700" | "EPSG:2056"))];
        let mut points = [place, [f64::NAN, 0.0]];
        there.apply(&mut points);
        let [found, nowhere] = points;
        let off = match system.kind {
            CrsKind::Geographic => degrees_apart(expected, found),
            _ => (found[0] - expected[0]).hypot(found[1] - expected[1]) * system.unit_metres,
        };
        assert!(off <= tolerance, "{line}: {off} m, {shift:?}");
        assert!(nowhere[0].is_nan());
        let mut points = [expected];
        back.apply(&mut points);
        let off = degrees_apart(place, points[0]);
        assert!(off <= tolerance, "{line} back: {off} m");
        count += 1;
    }
    assert!(count >= 60);
}

#[test]
fn other_planets_are_spheres_with_projections_of_their_own() {
    let moon = Crs {
        kind: CrsKind::Geographic,
        ellipsoid: Ellipsoid::MOON,
        ..Crs::unknown()
    };
    // By PROJ 9.5.1.
    for (definition, place, expected) in [
        (
            "+proj=eqc +lat_ts=30 +lon_0=10 +R=1737400",
            [15.0, -80.0],
            [131_303.958_975_855, -2_425_868.033_931_959],
        ),
        (
            "+proj=stere +lat_0=-90 +lon_0=0 +k=1 +R=1737400",
            [-170.0, -88.5],
            [-7_898.842_966_486, -44_796.564_511_846],
        ),
    ] {
        let system = Crs {
            kind: CrsKind::Projected,
            definition: Some(definition.into()),
            ellipsoid: Ellipsoid::MOON,
            ..Crs::unknown()
        };
        let (there, shift) = transform(&moon, &system).expect("transforms");
        let mut points = [place];
        there.apply(&mut points);
        let off = (points[0][0] - expected[0]).hypot(points[0][1] - expected[1]);
        assert!(
            off < 1e-4 && shift == DatumShift::None,
            "{definition}: {off} m"
        );
        let refused = transform(&Crs::wgs84(), &system).err().expect("refused");
        assert!(
            refused
                .to_string()
                .ends_with("they are of different planets")
        );
    }
}

#[test]
fn datums_are_never_shifted_in_silence() {
    let crs = |code| Crs::from_code(code).expect("known");
    let shift = |a, b| transform(&crs(a), &crs(b)).map(|(_, shift)| shift);
    assert_eq!(shift("EPSG:32633", "EPSG:4326"), Ok(DatumShift::None));
    assert_eq!(shift("EPSG:26710", "EPSG:4267"), Ok(DatumShift::None));
    assert_eq!(shift("EPSG:26910", "EPSG:4326"), Ok(DatumShift::Constants));
    assert_eq!(shift("EPSG:6330", "EPSG:4326"), Ok(DatumShift::Assumed));
    // NAD 27 by grids; Anguilla 1957 by nothing that is known; axes that point west and south.
    for (a, b) in [
        ("EPSG:26710", "EPSG:4326"),
        ("EPSG:2000", "EPSG:4326"),
        ("EPSG:2053", "EPSG:4326"),
    ] {
        assert!(shift(a, b).is_err(), "{a} to {b}");
    }
    for code in [
        "EPSG:1",
        "EPSG:99999999",
        "EPSG:4978",
        "32633",
        "ESRI:102001",
    ] {
        assert!(Crs::from_code(code).is_err(), "{code}");
    }
}
