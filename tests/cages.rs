//! Cages and landforms as a user types them: looked into, made, laid into the ground, asked for heights; and refused.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::support::{
    drumlin_fails, drumlin_json, drumlin_ok, folder, rainier, rainier_pyramid, root, shared,
};

/// Arguments of mixed kinds as one list.
macro_rules! args {
    ($($argument:expr),* $(,)?) => { [$(std::ffi::OsStr::new($argument).to_owned()),*] };
}

/// The cages in the repository that have limit samples.
fn vectors(name: &str) -> PathBuf {
    root().join("tests/vectors/catmull-clark").join(name)
}

/// A field's number; NaN for an empty one and for nothing else.
fn number(word: &str) -> f64 {
    if word.is_empty() {
        return f64::NAN;
    }
    let number: f64 = word.parse().unwrap_or(f64::NAN);
    assert!(!number.is_nan(), "{word:?} is no number");
    number
}

/// Rows of numbers by id, `skip` columns passed over; empty fields are NaN.
fn rows(text: &str, skip: usize) -> Vec<(String, Vec<f64>)> {
    let row = |line: &str| {
        let mut words = line.split(',');
        let id = words.next().unwrap_or_default().to_owned();
        (id, words.skip(skip).map(number).collect())
    };
    text.lines().skip(1).map(row).collect()
}

/// Compares `cage limit` with the samples beside a cage; the number of rows.
fn check_limits(cage: &Path) -> usize {
    let samples = cage.with_extension("csv");
    let found = rows(
        &drumlin_ok(args!["cage", "limit", cage, "--at", &samples]),
        0,
    );
    let wanted = rows(
        &fs::read_to_string(&samples).expect("samples can be read"),
        5,
    );
    assert_eq!(found.len(), wanted.len());
    let info = drumlin_json(args!["cage", "info", cage, "--json"]);
    let corner = |end: usize, axis: usize| info["bounds"][end][axis].as_f64().expect("a bound");
    let extent = (0..3)
        .map(|axis| corner(1, axis) - corner(0, axis))
        .fold(0.0, f64::max);
    for ((id, found), (other, wanted)) in found.iter().zip(&wanted) {
        assert_eq!((id, found.len()), (other, 12));
        for (at, (a, b)) in found.iter().zip(wanted).enumerate() {
            // The samples are right to their last digit; evaluation may lose a few on the way, normals by the quotient of
            // tangents' lengths more.
            let near = if at < 3 {
                1e-12 * extent
            } else {
                1e-9 * extent.max(1.0)
            };
            assert!(
                b.is_nan() || (a - b).abs() <= near,
                "{id} {at}: {a} for {b}"
            );
        }
    }
    wanted.len()
}

#[test]
fn limits_are_the_references_to_their_last_digits() {
    for name in ["box_creases.obj", "discs_3_5_7_10.obj"] {
        assert_eq!(check_limits(&vectors(name)), 30);
    }
    for name in [
        "polycube_a",
        "regression_car",
        "regression_gregory_test1",
        "regression_helmet",
        "sheet_boundary",
        "terrain_a",
    ] {
        let Some(cage) = shared(&format!("reference/catmull-clark/{name}.obj")) else {
            return;
        };
        assert!(check_limits(&cage) > 150, "{name}");
    }
}

#[test]
fn info_counts_patches_as_the_reference_does() {
    let Some(counts) = shared("reference/catmull-clark/counts.csv") else {
        return;
    };
    let folder = counts.parent().expect("a folder");
    let text = fs::read_to_string(&counts).expect("counts can be read");
    let mut compared = 0;
    for line in text.lines().skip(1) {
        let words: Vec<&str> = line.split(',').collect();
        let mut cage = folder.join(format!("{}.obj", words[0]));
        if !cage.exists() {
            cage = folder.join(format!("table1/{}.obj", words[0]));
        }
        let info = drumlin_json(args!["cage", "info", &cage, "--depth", words[1], "--json"]);
        let tables = &info["tables"];
        let found = [
            &info["faces"],
            &info["irregular_faces"],
            &tables["refined_points"],
            &tables["patches"],
            &tables["irregular"],
            &tables["templates"]["one"],
            &tables["templates"]["two_adjacent"],
            &tables["templates"]["two_opposite"],
            &tables["templates"]["three"],
            &tables["templates"]["four"],
        ];
        let wanted = [2, 3, 5, 6, 8, 10, 11, 12, 13, 14].map(|at: usize| words[at]);
        for (found, wanted) in found.into_iter().zip(wanted) {
            assert_eq!(found.to_string(), wanted, "{line}: {info}");
        }
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn refined_cages_keep_the_surface_and_are_four_times_the_faces() {
    let out = folder("refined").join("fine.obj");
    let cage = vectors("box_creases.obj");
    drumlin_ok(args!["cage", "refine", &cage, "--depth", "2", "-o", &out]);
    let info = drumlin_json(args!["cage", "info", &out, "--json"]);
    assert_eq!(info["faces"], 32 * 16);
    // Where four children meet, at a face's middle, is a corner of one of them: child corners c, then its own third.
    let at = out.with_extension("csv");
    let limits = |cage: &Path, places: &str| {
        fs::write(&at, places).expect("places can be written");
        rows(&drumlin_ok(args!["cage", "limit", cage, "--at", &at]), 0)
    };
    let places: Vec<usize> = (0..32).collect();
    let row = |face: usize, u: f64, v: f64| format!("a,{face},{u},{v}\n");
    let coarse: String = places.iter().map(|&face| row(face, 0.5, 0.5)).collect();
    // Face f's first child is 4 f, and the middle is that child's third corner; so once more.
    let fine: String = places
        .iter()
        .map(|&face| row(4 * (4 * face) + 2, 0.0, 0.0))
        .collect();
    for ((_, a), (_, b)) in limits(&cage, &coarse).iter().zip(limits(&out, &fine)) {
        for axis in 0..3 {
            assert!((a[axis] - b[axis]).abs() < 1e-12, "{a:?} {b:?}");
        }
    }
}

/// OBJ texts that are no cages, and what is said of each.
const BAD: &[(&str, &str, &str)] = &[
    (
        "missing",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n",
        "line 4: face 0 names vertex 8",
    ),
    (
        "far",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 1000000000\n",
        "names vertex 999999999",
    ),
    (
        "repeated",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2 3\n",
        "line 5: face 1 repeats face 0",
    ),
    (
        "edge",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
        "line 8: the edge of vertices 0 and 1 has 3 faces",
    ),
    (
        "fans",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 0 0\nv -1 -1 0\nf 1 2 3\nf 1 4 5\n",
        "the faces around vertex 0",
    ),
    (
        "nan",
        "v 0 0 0\nv 1 nan 0\nv 1 1 0\nf 1 2 3\n",
        "line 2: vertex 1 is at [1.0, NaN, 0.0]",
    ),
    (
        "infinite",
        "v 0 0 1e999\nv 1 0 0\nv 1 1 0\nf 1 2 3\n",
        "line 1: vertex 0",
    ),
    (
        "announced",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nt corner 1000000000/1/0 0 1\n",
        "line 5: a tag has fewer numbers than it says",
    ),
    (
        "sharp",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nt crease 2/1/0 0 1 -1\n",
        "line 5: sharpness -1",
    ),
    (
        "unsharp",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nt corner 1/1/0 0 nan\n",
        "line 5: sharpness NaN",
    ),
    ("empty", "", "the cage has no faces"),
];

#[test]
fn bad_cages_are_told_in_one_line_and_leave_nothing() {
    let folder = folder("bad_cages");
    let (out, pyramid) = (folder.join("out.obj"), folder.join("out.zarr"));
    for (name, text, what) in BAD {
        let file = folder.join(format!("{name}.obj"));
        let placed = format!("# drumlin position -121.67 46.92 ground\n{text}");
        fs::write(&file, text).expect("a file can be written");
        for arguments in [
            args!["cage", "info", &file].to_vec(),
            args!["cage", "limit", &file, "--at", &file].to_vec(),
            args!["cage", "refine", &file, "--depth", "1", "-o", &out].to_vec(),
        ] {
            let line = drumlin_fails(1, arguments);
            assert!(line.contains(what) && line.contains(name), "{line}");
        }
        fs::write(&file, placed).expect("a file can be written");
        drumlin_fails(
            1,
            args!["build", &rainier(), "-o", &pyramid, "--features", &file],
        );
        fs::remove_file(&file).expect("a file can be removed");
    }
    let cage = vectors("box_creases.obj");
    let line = drumlin_fails(
        1,
        args!["cage", "refine", &cage, "--depth", "12", "-o", &out],
    );
    assert!(line.contains("more than 134217728 face corners"), "{line}");
    drumlin_fails(
        2,
        args!["cage", "refine", &cage, "--depth", "13", "-o", &out],
    );
    drumlin_fails(3, args!["cage", "info", &out]);
    let left = fs::read_dir(&folder)
        .expect("the folder can be read")
        .count();
    assert_eq!(left, 0, "something is left in {}", folder.display());
}

/// Makes a landform along a path on the ground of Mt Rainier.
fn landform(shape: &str, along: &str, folder: &Path) -> PathBuf {
    let file = folder.join(format!("{shape}.obj"));
    let ground = rainier_pyramid();
    drumlin_ok(args![
        "feature", shape, "--along", along, "--ground", ground, "-o", &file
    ]);
    file
}

/// Heights by `drumlin height`.
fn heights(pyramid: &Path, places: &[[f64; 2]]) -> Vec<f64> {
    let mut arguments = args!["height", pyramid, "--json"].to_vec();
    arguments.extend(places.iter().map(|[x, y]| format!("{x},{y}").into()));
    let list = drumlin_json(arguments);
    let entries = list.as_array().expect("a list").iter();
    entries
        .map(|entry| entry["height"].as_f64().expect("a height"))
        .collect()
}

#[test]
fn landforms_are_made_built_validated_and_answer_heights() {
    let folder = folder("landforms");
    let shapes = [
        (
            "cliff",
            "-121.84,46.915 -121.825,46.921",
            [-121.8325, 46.918],
        ),
        ("arch", "-121.676,46.919 -121.664,46.921", [-121.67, 46.92]),
        ("road", "-121.68,46.6 -121.66,46.61", [-121.67, 46.605]),
    ];
    let files = shapes.map(|(shape, along, _)| landform(shape, along, &folder));
    let out = folder.join("out.zarr");
    let mut arguments = args!["build", &rainier(), "-o", &out, "--json", "--features"].to_vec();
    arguments.extend(files.iter().map(|file| file.clone().into_os_string()));
    let report: Value = drumlin_json(arguments);
    assert_eq!(report["features"], 3);
    drumlin_ok(args!["validate", &out, "--deep"]);
    let middles = shapes.map(|(_, _, middle)| middle);
    let rise: Vec<f64> = heights(&out, &middles)
        .iter()
        .zip(heights(rainier_pyramid(), &middles))
        .map(|(feature, ground)| feature - ground)
        .collect();
    // By the defaults' own lengths. The cliff's path is 1,323 m long and its brink an eighth of that high, 165 m; over its
    // foot stands the leaning face, of which the highest place is the answer. The arch's is 941 m long: half of that, 470 m,
    // to the middle of the crown, and up to half its thickness of 157 m more. The road lies 6 m deep in ground that is not
    // level.
    assert!((145.0..166.0).contains(&rise[0]), "{rise:?}");
    assert!((470.0..549.0).contains(&rise[1]), "{rise:?}");
    assert!((-8.0..-3.0).contains(&rise[2]), "{rise:?}");
    // Far from all three nothing has changed.
    let away = [[-121.5, 46.5], [-121.76, 46.853]];
    assert_eq!(heights(&out, &away), heights(rainier_pyramid(), &away));
}

#[test]
fn features_that_do_not_fit_are_told_in_one_line_and_leave_nothing() {
    let folder = folder("misfits");
    let arch = root().join("assets/rainier_arch.obj");
    let text = fs::read_to_string(&arch).expect("the arch can be read");
    let moved = |name: &str, from: &str, to: &str| {
        assert!(text.contains(from));
        let file = folder.join(name);
        fs::write(&file, text.replace(from, to)).expect("a file can be written");
        file
    };
    let position = "position -121.67 46.92 ground";
    let twin = moved("twin.obj", position, "position -121.66 46.92 ground");
    let away = moved("away.obj", position, "position 10 10 ground");
    let edge = moved("edge.obj", position, "position -121.9999 46.92 ground");
    let high = moved("high.obj", position, "position -121.67 46.92 1e8");
    let large = moved("large.obj", "scale 1", "scale 1000");
    let nowhere = moved("nowhere.obj", "# drumlin position", "# position");
    let void = moved(
        "void.obj",
        position,
        &format!("position {} {} ground", VOID[0], VOID[1]),
    );
    let out = folder.join("out.zarr");
    for (files, what) in [
        (vec![&arch, &twin], "are laid on one spot"),
        (vec![&away], "is outside the terrain"),
        (vec![&edge], "past the data"),
        (vec![&high], "heights are smaller than"),
        (vec![&large], "past the data"),
        (vec![&nowhere], "does not say where it stands"),
        (vec![&void], "there is no ground under"),
    ] {
        let mut arguments = args!["build", &rainier(), "-o", &out, "--features"].to_vec();
        arguments.extend(files.iter().map(|file| file.as_os_str().to_owned()));
        let line = drumlin_fails(1, arguments);
        assert!(line.contains(what), "{line}");
        let names = fs::read_dir(&folder).expect("the folder can be read");
        let names: Vec<_> = names
            .map(|entry| entry.expect("an entry").file_name())
            .collect();
        let whole = names
            .iter()
            .all(|name| name.to_string_lossy().ends_with(".obj"));
        assert!(whole, "something is left: {names:?}");
    }
}

/// Longitude and latitude amid voids of the sample data, under the summit.
const VOID: [f64; 2] = [-121.75, 46.841_67];

#[test]
fn landforms_that_cannot_be_are_told_in_one_line() {
    let folder = folder("no_landforms");
    let out = folder.join("out.obj");
    for (code, arguments, what) in [
        (
            2,
            args!["--along", "1,2"].to_vec(),
            "expected two places or more",
        ),
        (2, args!["--along", "1,2 1,2"].to_vec(), "0 m apart"),
        (
            2,
            args!["--along", "0,0 9,0", "--height=-3"].to_vec(),
            "must be greater than 0",
        ),
        (1, args!["--along", "0,0 1e300,0"].to_vec(), "at most 1e150"),
        (
            2,
            args!["--along", "0,0 9,0", "--ground", rainier_pyramid()].to_vec(),
            "there is no ground at",
        ),
    ] {
        let mut all = args!["feature", "cliff", "-o", &out].to_vec();
        all.extend(arguments);
        let text = drumlin_fails(code, &all);
        assert!(text.contains(what), "{text}");
        assert!(!out.exists(), "{text}");
    }
}
