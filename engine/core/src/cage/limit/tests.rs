//! The limit surface against the reference samples, and against itself.

use std::path::{Path, PathBuf};

use super::super::{
    Cage, CageBudget, CageError, LimitPattern, LimitSample, LimitSurface, Place, read_obj, refine,
};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> Cage {
    read_obj(&std::fs::read(path).unwrap(), CageBudget::default()).unwrap()
}

fn parse(text: &str) -> Cage {
    read_obj(text.as_bytes(), CageBudget::default()).unwrap()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

fn length(a: [f64; 3]) -> f64 {
    distance(a, [0.0; 3])
}

/// A row of a reference file; vectors are absent where the surface has none.
struct Row {
    line: String,
    place: Place,
    position: [f64; 3],
    derivatives: Option<[[f64; 3]; 2]>,
    normal: Option<[f64; 3]>,
}

fn rows(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(row).collect()
}

fn row(line: &str) -> Row {
    let words: Vec<&str> = line.split(',').collect();
    let vector = |from: usize| -> Option<[f64; 3]> {
        let values: Vec<f64> = words[from..from + 3]
            .iter()
            .filter_map(|word| word.parse().ok())
            .collect();
        values.try_into().ok()
    };
    Row {
        line: line.to_owned(),
        place: Place {
            face: words[1].parse().unwrap(),
            u: words[2].parse().unwrap(),
            v: words[3].parse().unwrap(),
        },
        position: vector(6).unwrap(),
        derivatives: vector(9).zip(vector(12)).map(|(du, dv)| [du, dv]),
        normal: vector(15),
    }
}

/// Compares every row; returns the number of rows.
fn check(folder: &Path, name: &str) -> usize {
    let cage = read(&folder.join(format!("{name}.obj")));
    let surface = LimitSurface::new(&cage).unwrap();
    let rows = rows(&folder.join(format!("{name}.csv")));
    let places: Vec<Place> = rows.iter().map(|row| row.place).collect();
    for (row, sample) in rows.iter().zip(surface.evaluate_many(&places).unwrap()) {
        check_row(row, &sample, cage.extent(), name);
    }
    rows.len()
}

fn check_row(row: &Row, sample: &LimitSample, extent: f64, name: &str) {
    let line = &row.line;
    let off = distance(sample.position, row.position);
    assert!(
        off <= 1e-13 * extent,
        "{name}: position off by {off:e}\n{line}\n{sample:?}"
    );
    if let Some([du, dv]) = row.derivatives {
        // The reference was compared to 2e-11 of the derivatives.
        let scale = length(du).max(length(dv));
        let off = distance(sample.du, du).max(distance(sample.dv, dv));
        assert!(
            off <= 1e-10 * scale,
            "{name}: derivatives off by {off:e}\n{line}\n{sample:?}"
        );
    }
    if let Some(normal) = row.normal {
        let off = distance(sample.normal, normal);
        assert!(
            off <= 1e-9,
            "{name}: normal off by {off:e}\n{line}\n{sample:?}"
        );
    }
}

#[test]
fn committed_samples_are_met() {
    let folder = repository().join("tests/vectors/catmull-clark");
    assert_eq!(check(&folder, "discs_3_5_7_10"), 30);
    assert_eq!(check(&folder, "box_creases"), 30);
}

#[test]
fn every_reference_sample_is_met() {
    let folder = repository().join("../shared/reference/catmull-clark");
    if !folder.is_dir() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "no ../shared/reference/catmull-clark in CI"
        );
        println!("skipped: no ../shared/reference/catmull-clark");
        return;
    }
    let names = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut count = 0;
    for path in names.filter(|path| path.extension().is_some_and(|ext| ext == "csv")) {
        let name = path.file_stem().unwrap().to_str().unwrap();
        if name != "counts" {
            count += check(&folder, name);
        }
    }
    assert!(count > 1500, "{count}");
}

/// A triangle, a quad, a pentagon and a crease that ends between them.
const MIXED: &str = "v 0 0 0\nv 1 0 0.3\nv 2 0 0\nv 0 1 0.2\nv 1 1 1\nv 2 1 -0.4\nv 0.2 2 0.1\nv 1 2 0.5\nv 2.1 2 0\n\
    v 3 1 0.7\nf 1 2 5 4\nf 2 3 6 5\nf 4 5 8 7\nf 5 6 8\nf 6 10 9 8\nf 3 10 6\n\
    t crease 2/1/0 4 7 1.75\nt crease 2/1/0 4 5 10\nt crease 2/1/0 4 1 0.5\nt corner 1/1/0 5 0.5\n";

#[test]
fn refining_a_cage_does_not_change_its_surface() {
    let cage = parse(MIXED);
    let (fine, surface) = (refine(&cage).unwrap(), LimitSurface::new(&cage).unwrap());
    let finer = LimitSurface::new(&fine).unwrap();
    for face in (0..cage.topology().face_count())
        .filter(|&face| cage.topology().face_vertices(face).len() == 4)
    {
        let first = u32::try_from(cage.topology().face_corners(face).start).unwrap();
        for (u, v) in [(0.1, 0.3), (0.0, 0.01), (0.25, 0.0), (0.5, 0.5)] {
            let (whole, quarter) = (
                surface.evaluate(face, u, v).unwrap(),
                finer.evaluate(first, 2.0 * u, 2.0 * v).unwrap(),
            );
            assert!(
                distance(whole.position, quarter.position) < 1e-14,
                "face {face} at {u}, {v}"
            );
            assert!(distance(whole.du, quarter.du.map(|x| 2.0 * x)) < 1e-11);
            assert!(distance(whole.normal, quarter.normal) < 1e-11);
        }
    }
}

#[test]
fn faces_meet_along_their_edges() {
    let cage = parse(MIXED);
    let surface = LimitSurface::new(&cage).unwrap();
    // Along the side of a quad and two sub-faces of a triangle beyond it: vertices 5 to 6 and back.
    for t in [0.0, 0.125, 0.3, 0.5] {
        let quad = surface.evaluate(1, 1.0 - t, 1.0).unwrap();
        assert!(
            distance(
                quad.position,
                surface.evaluate(1, 1.0 - t, 1.0 - 1e-13).unwrap().position
            ) < 1e-12
        );
        let end = surface.evaluate(3, 1.0, 2.0 * t).unwrap();
        assert!(distance(quad.position, end.position) < 1e-14, "at {t}");
    }
}

#[test]
fn derivatives_are_those_of_the_positions() {
    let cage = parse(MIXED);
    let surface = LimitSurface::new(&cage).unwrap();
    let step = 1e-5;
    for (face, u, v) in [
        (0, 0.7, 0.8),
        (1, 0.2, 0.9),
        (2, 0.9, 0.1),
        (3, 0.4, 0.3),
        (3, 2.6, 0.2),
        (4, 0.77, 0.6),
    ] {
        let at = |du: f64, dv: f64| surface.evaluate(face, u + du, v + dv).unwrap();
        let sample = at(0.0, 0.0);
        let slope = |plus: LimitSample, minus: LimitSample| -> [f64; 3] {
            std::array::from_fn(|i| (plus.position[i] - minus.position[i]) / (2.0 * step))
        };
        // A central difference is off by step² / 6 times the third derivative, and 1e-16 / step in rounding.
        assert!(
            distance(sample.du, slope(at(step, 0.0), at(-step, 0.0))) < 1e-8,
            "du on {face}"
        );
        assert!(
            distance(sample.dv, slope(at(0.0, step), at(0.0, -step))) < 1e-8,
            "dv on {face}"
        );
    }
}

/// A closed fan of quads about vertex 0, wavy, and so far from the origin that an f64 has half its digits left.
fn disc(valence: u32, far: f64) -> Cage {
    let mut text = format!("v {far} 0 {far}\n");
    for ring in [1.0, 2.0] {
        for i in 0..2 * valence {
            let angle = f64::from(i) * std::f64::consts::PI / f64::from(valence);
            let (sin, cos) = angle.sin_cos();
            text += &format!(
                "v {} {} {}\n",
                far + ring * cos,
                ring * sin,
                far + 0.3 * (3.0 * angle).cos() * ring
            );
        }
    }
    let (inner, outer) = (
        |i: u32| 2 + i % (2 * valence),
        |i: u32| 2 + 2 * valence + i % (2 * valence),
    );
    for i in 0..valence {
        text += &format!(
            "f 1 {} {} {}\n",
            inner(2 * i),
            inner(2 * i + 1),
            inner(2 * i + 2)
        );
    }
    for i in 0..2 * valence {
        text += &format!(
            "f {} {} {} {}\n",
            inner(i),
            outer(i),
            outer(i + 1),
            inner(i + 1)
        );
    }
    parse(&text)
}

#[test]
fn places_close_to_a_vertex_keep_their_digits() {
    for valence in [3, 4, 5, 12, 60] {
        let (near, far) = (disc(valence, 0.0), disc(valence, 1048576.0));
        let (near, far) = (
            LimitSurface::new(&near).unwrap(),
            LimitSurface::new(&far).unwrap(),
        );
        let vertex = near.evaluate(0, 0.0, 0.0).unwrap();
        for depth in [10, 20, 40, 55, 300] {
            let tiny = 0.5_f64.powi(depth);
            let (a, b) = (
                near.evaluate(0, tiny, 0.7 * tiny).unwrap(),
                far.evaluate(0, tiny, 0.7 * tiny).unwrap(),
            );
            // Far away, controls are rounded to 1e-10 of the cage: so good can normals be, and not worse.
            assert!(
                distance(a.normal, b.normal) < 1e-8,
                "valence {valence}, depth {depth}"
            );
            assert!(
                // Normals settle like (λ3 / λ2)^depth, ever slower as the valence grows.
                valence > 5 || depth < 40 || distance(a.normal, vertex.normal) < 1e-6,
                "valence {valence}, depth {depth}"
            );
            assert!(depth < 55 || distance(a.position, vertex.position) < 1e-10);
        }
    }
}

#[test]
fn all_named_cages_have_a_finite_surface_everywhere() {
    let folder = repository().join("../shared/data/cages");
    if !folder.is_dir() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "no ../shared/data/cages in CI"
        );
        println!("skipped: no ../shared/data/cages");
        return;
    }
    for path in std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
    {
        let Ok(cage) = read_obj(&std::fs::read(&path).unwrap(), CageBudget::default()) else {
            continue;
        };
        let surface = LimitSurface::new(&cage).unwrap();
        let faces =
            (0..cage.topology().face_count()).filter(|&face| !cage.topology().is_hole(face));
        for face in faces.step_by(7) {
            for (u, v) in [
                (0.0, 0.0),
                (1.0, 0.0),
                (1.0, 1.0),
                (0.0, 1.0),
                (0.4, 0.0),
                (1.0, 0.3),
                (0.51, 0.52),
            ] {
                let sample = surface.evaluate(face, u, v).unwrap();
                let values = [sample.position, sample.du, sample.dv, sample.normal].concat();
                assert!(
                    values.iter().all(|x| x.is_finite()),
                    "{} face {face} at {u}, {v}",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn places_that_are_not_there_are_errors() {
    let cage = parse(&format!("{MIXED}t hole 1/0/0 0\n"));
    let surface = LimitSurface::new(&cage).unwrap();
    for (face, u, v) in [
        (0, 0.5, 0.5),
        (6, 0.5, 0.5),
        (1, 1.1, 0.5),
        (1, 0.5, -0.1),
        (1, f64::NAN, 0.5),
        (3, 3.1, 0.0),
    ] {
        assert!(
            matches!(surface.evaluate(face, u, v), Err(CageError::Place { .. })),
            "{face} {u} {v}"
        );
    }
    assert!(surface.evaluate(3, 3.0, 1.0).is_ok());
}

#[test]
fn a_pattern_gives_what_single_places_give() {
    let places = [
        [0.5, 0.5],
        [0.1, 0.7],
        [0.01, 0.02],
        [0.99, 0.0],
        [0.3, 1.0],
        [0.0, 0.0],
        [1.0, 1.0],
    ];
    let folder = repository().join("tests/vectors/catmull-clark");
    let mixed = refine(&parse(MIXED)).unwrap();
    let named =
        ["discs_3_5_7_10", "box_creases"].map(|name| read(&folder.join(format!("{name}.obj"))));
    for cage in named.iter().chain([&mixed, &disc(60, 0.0)]) {
        let pattern = LimitPattern::new(cage.topology(), &places).unwrap();
        let surface = LimitSurface::new(cage).unwrap();
        let (samples, positions) = (
            pattern.samples(cage.positions()),
            pattern.positions(cage.positions()),
        );
        let faces = 0..cage.topology().face_count();
        let expected = faces.flat_map(|face| places.map(|[u, v]| Place { face, u, v }));
        for ((place, sample), position) in expected.zip(samples).zip(positions) {
            let exact = surface.evaluate(place.face, place.u, place.v).unwrap();
            assert!(
                distance(sample.position, exact.position) < 1e-13,
                "{place:?}"
            );
            assert!(distance(position, exact.position) < 1e-13, "{place:?}");
            // Deep places have weights of alternating sign and the size of 2^depth.
            let scale = 1.0 + length(exact.du).max(length(exact.dv));
            let off = distance(sample.du, exact.du).max(distance(sample.dv, exact.dv));
            assert!(off < 1e-11 * scale, "{place:?}: {sample:?} {exact:?}");
        }
    }
}
