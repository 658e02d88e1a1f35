//! The limit surface against itself: what must hold on any cage.

use super::super::{
    Cage, CageBudget, CageError, Corner, Crease, LimitPattern, LimitSample, LimitSurface, Place,
    Tags, read_obj, refine,
};
use super::tests::{distance, length, read, repository};

fn parse(text: &str) -> Cage {
    read_obj(text.as_bytes(), CageBudget::default()).unwrap()
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

/// The disc with creases along some of the edges at its middle, out to the boundary.
fn creased_disc(valence: u32, creases: &[u32], corner: &str) -> Cage {
    let mut text = super::super::write_obj(&disc(valence, 0.0));
    for crease in creases {
        let (inner, outer) = (1 + 2 * crease, 1 + 2 * valence + 2 * crease);
        text += &format!("t crease 2/1/0 0 {inner} 10\nt crease 2/1/0 {inner} {outer} 10\n");
    }
    parse(&(text + corner))
}

#[test]
fn masks_at_a_vertex_are_the_limit_of_places_that_come_close() {
    let cases: [(u32, &[u32], &str); 8] = [
        (5, &[0, 2], ""),
        (7, &[0, 3], ""),
        (8, &[1, 4], ""),
        (4, &[0, 1], ""),
        (6, &[0, 1, 3], ""),
        (5, &[2], ""),
        (5, &[], "t corner 1/1/0 0 10\n"),
        (5, &[0, 2], "t corner 1/1/0 0 2.5\n"),
    ];
    for (valence, creases, corner) in cases {
        let cage = creased_disc(valence, creases, corner);
        let surface = LimitSurface::new(&cage).unwrap();
        for face in 0..valence {
            let vertex = surface.evaluate(face, 0.0, 0.0).unwrap();
            let tiny = 0.5_f64.powi(52);
            let near = surface.evaluate(face, 0.6 * tiny, tiny).unwrap();
            let case = format!("valence {valence}, creases {creases:?} {corner:?}, face {face}");
            // The slowest ring shrinks to 0.66^52 of the cage.
            assert!(distance(vertex.position, near.position) < 1e-8, "{case}");
            // Sides of two and three quads have a tangent plane; with one the surface has a cusp, with four and more a
            // second wave shrinks no faster than the crease. So have corners of several quads, and darts, none we know.
            let side = match creases {
                [a, b] if (a..b).contains(&&face) => b - a,
                [a, b] => valence - (b - a),
                _ => 0,
            };
            let settled = (2..=3).contains(&side);
            let off = distance(vertex.normal, near.normal);
            assert!(
                !settled || off < 1e-3,
                "{case}: {off:e} {vertex:?} {near:?}"
            );
        }
    }
}

#[test]
fn at_valence_two_the_tangent_runs_from_end_to_end() {
    let pillow = parse("v -1 -1 0\nv 1 -1 0.1\nv 1 1 0\nv -1 1 0.1\nf 1 2 3 4\nf 4 3 2 1\n");
    let surface = LimitSurface::new(&pillow).unwrap();
    let sample = surface.evaluate(0, 0.0, 0.0).unwrap();
    let [x, y, z] = sample.du;
    // From vertex 3 to vertex 1: (2, -2, 0) times 4 / 6.
    assert!(
        (x - 4.0 / 3.0).abs() < 1e-12 && (y + 4.0 / 3.0).abs() < 1e-12 && z.abs() < 1e-12,
        "{sample:?}"
    );
    assert!(
        sample
            .position
            .iter()
            .chain(&sample.normal)
            .all(|x| x.is_finite())
    );
}

/// Numbers below a bound, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u32) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32 % bound
    }
}

#[test]
fn random_faces_are_refused_or_have_a_finite_surface() {
    let (mut dice, mut accepted) = (Dice(7), 0);
    for _ in 0..20_000 {
        let vertex_count = 3 + dice.below(5);
        let positions: Vec<[f64; 3]> = (0..vertex_count)
            .map(|_| [0; 3].map(|_| f64::from(dice.below(9))))
            .collect();
        let faces: Vec<Vec<u32>> = (0..1 + dice.below(5))
            .map(|_| {
                (0..3 + dice.below(3))
                    .map(|_| dice.below(vertex_count))
                    .collect()
            })
            .collect();
        let crease = Crease {
            vertices: [faces[0][0], faces[0][1]],
            sharpness: f64::from(dice.below(24)) / 2.0,
        };
        let corner = Corner {
            vertex: faces[0][2],
            sharpness: f64::from(dice.below(5)) / 4.0,
        };
        let tags = Tags {
            creases: vec![crease],
            corners: vec![corner],
            holes: Vec::new(),
        };
        let Ok(cage) = Cage::new(positions, faces.iter().collect(), &tags) else {
            continue;
        };
        accepted += 1;
        let (surface, finer) = (LimitSurface::new(&cage).unwrap(), refine(&cage).unwrap());
        let finer = LimitSurface::new(&finer).unwrap();
        for (u, v) in [(0.0, 0.0), (1.0, 1.0), (0.3, 0.0), (0.2, 0.9)] {
            let sample = surface.evaluate(0, u, v).unwrap();
            assert!(
                sample
                    .position
                    .iter()
                    .chain(&sample.du)
                    .chain(&sample.normal)
                    .all(|x| x.is_finite())
            );
            if (u, v) == (0.3, 0.0) && faces[0].len() == 4 {
                let child = finer.evaluate(0, 0.6, 0.0).unwrap();
                assert!(
                    distance(child.position, sample.position) < 1e-12,
                    "{faces:?}"
                );
            }
        }
    }
    assert!(accepted > 300, "{accepted}");
}
