//! The verbs as a user types them.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{
    copy_tree, drumlin, drumlin_fails, drumlin_json, drumlin_ok, files, folder, rainier,
    rainier_pyramid, shared,
};

/// Arguments of mixed kinds as one list.
macro_rules! args {
    ($($argument:expr),* $(,)?) => { [$(std::ffi::OsStr::new($argument).to_owned()),*] };
}

fn heights(pyramid: &Path, at: &[[f64; 2]]) -> Vec<Option<f64>> {
    let mut arguments = vec![
        "height".into(),
        pyramid.as_os_str().to_owned(),
        "--json".into(),
    ];
    for [x, y] in at {
        arguments.push("--at".into());
        arguments.push(format!("{x},{y}").into());
    }
    let answer = drumlin_json(arguments);
    let list = answer.as_array().expect("a list");
    assert_eq!(list.len(), at.len());
    list.iter().map(|entry| entry["height"].as_f64()).collect()
}

#[test]
fn integer_data_comes_back_exactly() {
    let Some(golden) = shared("data/dem/variants/GOLDEN_300x260_i16le.raw") else {
        return;
    };
    // The golden window starts at column 660 and row 720 of the sample DEM.
    let golden = fs::read(golden).expect("the window can be read");
    let places: Vec<_> = (0..260)
        .step_by(37)
        .flat_map(|row| (0..300).step_by(41).map(move |column| (row, column)))
        .collect();
    let at: Vec<_> = places
        .iter()
        .map(|&(row, column)| {
            let step = 1.0 / 1200.0;
            [
                -122.0 + f64::from(660 + column) * step,
                47.0 - f64::from(720 + row) * step,
            ]
        })
        .collect();
    let found = heights(rainier_pyramid(), &at);
    for (&(row, column), height) in places.iter().zip(found) {
        let at = 2 * (row as usize * 300 + column as usize);
        let source = i16::from_le_bytes([golden[at], golden[at + 1]]);
        let height = height.expect("the window has no voids");
        // Places given in decimal degrees lie beside the sample by rounding; slopes here stay below 3.
        assert!(
            (height - f64::from(source)).abs() < 0.51,
            "row {row}, column {column}: {height} for {source}"
        );
    }
}

#[test]
fn outside_and_void_are_null() {
    let found = heights(rainier_pyramid(), &[[-125.0, 46.5], [-121.7603, 46.8529]]);
    assert_eq!(found[0], None);
    let summit = found[1].expect("the summit is no void");
    assert!((4200.0..4400.0).contains(&summit), "{summit}");
}

#[test]
fn info_tells_the_grid_the_crs_and_the_levels() {
    let info = drumlin_json(args!["info", rainier_pyramid(), "--json"]);
    let text = info.to_string();
    assert!(
        text.contains("EPSG:4326") && text.contains("1201"),
        "{text}"
    );
    let told = drumlin_ok(args!["info", rainier_pyramid()]);
    assert!(
        told.contains("EPSG:4326") && told.contains("1201"),
        "{told}"
    );
}

#[test]
fn a_fresh_pyramid_is_valid_to_the_last_bit() {
    drumlin_ok(args!["validate", rainier_pyramid()]);
    drumlin_ok(args!["validate", rainier_pyramid(), "--deep"]);
}

#[test]
fn validate_finds_a_bit_flipped_in_any_file() {
    let copy = folder("flipped").join("rainier.zarr");
    copy_tree(rainier_pyramid(), &copy);
    let mut all = Vec::new();
    files(&copy, &mut all);
    all.sort();
    assert!(all.len() > 8);
    for path in all {
        let good = fs::read(&path).expect("a file can be read");
        for at in [0, good.len() / 2, good.len() - 1] {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            fs::write(&path, &bad).expect("a file can be written");
            let output = drumlin(args!["validate", &copy, "--deep"]);
            let code = output.status.code();
            // A flip inside a JSON text's white space or free words changes nothing that is said.
            let json = path
                .extension()
                .is_some_and(|extension| extension == "json" || extension == "jsonl");
            assert!(
                code == Some(1) || code == Some(3) || (json && code == Some(0)),
                "{} byte {at}: {code:?}",
                path.display()
            );
            assert!(
                !String::from_utf8_lossy(&output.stderr).contains("panicked"),
                "{}",
                path.display()
            );
        }
        fs::write(&path, &good[..good.len() / 2]).expect("a file can be written");
        drumlin_fails_with_any(&copy);
        fs::remove_file(&path).expect("a file can be removed");
        drumlin_fails_with_any(&copy);
        fs::write(&path, &good).expect("a file can be written");
    }
    drumlin_ok(args!["validate", &copy, "--deep"]);
}

fn drumlin_fails_with_any(pyramid: &Path) {
    let output = drumlin(args!["validate", pyramid, "--deep"]);
    assert!(
        matches!(output.status.code(), Some(1 | 3)),
        "{}",
        crate::support::told(&output)
    );
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"));
}

#[test]
fn the_same_input_gives_the_same_bytes_for_any_number_of_threads() {
    let out = folder("threads");
    let trees: Vec<_> = ["1", "3"]
        .iter()
        .map(|threads| {
            let path = out.join(format!("{threads}.zarr"));
            drumlin_ok(args!["build", &rainier(), "-o", &path, "-j", threads]);
            let mut all = Vec::new();
            files(&path, &mut all);
            all.sort();
            all.into_iter()
                .map(|file| {
                    let bytes = fs::read(&file).expect("a file can be read");
                    (
                        file.strip_prefix(&path).expect("it lies inside").to_owned(),
                        bytes,
                    )
                })
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(trees[0] == trees[1]);
}

#[test]
fn a_mosaic_of_two_tiles_shows_no_edge() {
    let (Some(west), Some(east)) = (
        shared("data/dem/N49W124.tif"),
        shared("data/dem/N49W123.tif"),
    ) else {
        return;
    };
    let out = folder("mosaic").join("both.zarr");
    let summary = drumlin_json(args!["build", &west, &east, "-o", &out, "--json"]);
    assert!(summary.is_object(), "{summary}");
    let step = 1.0 / 1200.0;
    // The shared column is longitude -123; both sides of it are the sources' own heights.
    let row: Vec<_> = (-3..=3)
        .map(|column| [-123.0 + f64::from(column) * step, 49.5])
        .collect();
    let found = heights(&out, &row);
    assert!(found.iter().all(Option::is_some), "{found:?}");
    for pair in found.windows(2) {
        assert!(
            (pair[0].unwrap_or(0.0) - pair[1].unwrap_or(0.0)).abs() < 120.0,
            "{found:?}"
        );
    }
    drumlin_ok(args!["validate", &out, "--deep"]);
}

#[test]
fn an_output_that_is_something_else_is_left_alone() {
    let out = folder("occupied").join("notes.zarr");
    fs::create_dir_all(&out).expect("a folder can be made");
    fs::write(out.join("diary.txt"), "keep me").expect("a file can be written");
    drumlin_fails_any(args!["build", &rainier(), "-o", &out], &[1, 2, 3]);
    drumlin_fails_any(
        args!["build", &rainier(), "-o", &out, "--overwrite"],
        &[1, 2, 3],
    );
    assert_eq!(
        fs::read_to_string(out.join("diary.txt")).expect("still there"),
        "keep me"
    );
}

fn drumlin_fails_any<S: AsRef<std::ffi::OsStr>>(
    arguments: impl IntoIterator<Item = S>,
    codes: &[i32],
) -> String {
    let output = drumlin(arguments);
    let text = crate::support::told(&output);
    assert!(
        output
            .status
            .code()
            .is_some_and(|code| codes.contains(&code)),
        "{text}"
    );
    assert!(!text.contains("panicked"), "{text}");
    text
}

#[test]
fn bad_inputs_are_told_in_one_line_and_leave_nothing() {
    let out = folder("bad");
    let text = out.join("words.tif");
    fs::write(&text, "not a raster").expect("a file can be written");
    let empty = out.join("empty.tif");
    fs::write(&empty, "").expect("a file can be written");
    let half = out.join("half.tif");
    let whole = fs::read(rainier()).expect("the sample can be read");
    fs::write(&half, &whole[..whole.len() / 2]).expect("a file can be written");
    let target = out.join("out.zarr");
    for input in [&text, &empty, &half] {
        let line = drumlin_fails(1, args!["build", input, "-o", &target]);
        let name = input
            .file_name()
            .expect("it has a name")
            .to_string_lossy()
            .into_owned();
        assert!(line.contains(&name), "{line}");
        assert!(!target.exists(), "something was left for {name}");
    }
    drumlin_fails(3, args!["build", &out.join("absent.tif"), "-o", &target]);
    drumlin_fails(2, args!["build", "-o", &target]);
    drumlin_fails(2, args!["height", rainier_pyramid(), "--at", "here"]);
    drumlin_fails_any(args!["info", &out.join("absent.zarr")], &[1, 3]);
    drumlin_fails_any(args!["info", &out], &[1]);
}

#[test]
fn a_raster_without_a_height_and_one_too_high_are_invalid_and_named() {
    let out = folder("unfit");
    let target = out.join("out.zarr");
    for (name, height, word) in [("void", f32::NAN, "void"), ("high", 1e8, "2^25")] {
        let input = out.join(format!("{name}.tif"));
        let file = fs::File::create(&input).expect("a file can be made");
        tiff::encoder::TiffEncoder::new(file)
            .and_then(|mut tiff| {
                tiff.write_image::<tiff::encoder::colortype::Gray32Float>(3, 2, &[height; 6])
            })
            .expect("a TIFF");
        let line = drumlin_fails(1, args!["build", &input, "-o", &target, "--spacing", "10"]);
        let file = format!("{name}.tif");
        assert!(line.contains(&file) && line.contains(word), "{line}");
        fs::remove_file(&input).expect("the input can be removed");
        let left = fs::read_dir(&out).expect("the folder can be read").count();
        assert_eq!(left, 0, "something was left for {name}");
    }
}

#[test]
fn awkward_tiffs_are_built_or_refused_but_never_crash() {
    let Some(tricky) = shared("data/tricky-tiff") else {
        return;
    };
    let out = folder("tricky").join("out.zarr");
    let mut all = Vec::new();
    files(&tricky, &mut all);
    all.sort();
    for input in all
        .iter()
        .filter(|path| path.extension().is_some_and(|extension| extension != "md"))
    {
        let output = drumlin(args![
            "build",
            input,
            "-o",
            &out,
            "--overwrite",
            "--spacing",
            "1"
        ]);
        let text = crate::support::told(&output);
        assert!(
            matches!(output.status.code(), Some(0..=3)),
            "{}: {text}",
            input.display()
        );
        assert!(!text.contains("panicked"), "{}: {text}", input.display());
        if out.exists() {
            fs::remove_dir_all(&out).expect("a small pyramid can be removed");
        }
    }
}

/// What is done after the Python lines of `FORMAT.md`: every tile of every level is decoded by them and by the shared
/// rule, borders are compared, and some heights of the finest level are printed.
const READ_PYRAMID: &str = r#"
import json, sys
sys.path.insert(0, sys.argv[2])
import tile_rule
root = zarr.open_group(sys.argv[1], mode="r")
about, grid = root.attrs, root.attrs["grid"]
tiles, samples = 0, []
for number, level in enumerate(about["levels"]):
    heights = {}
    for row, column in np.ndindex(*level["tiles"]):
        cage, h = tile(root, number, row, column)
        widths = level["cage_bytes"], level["detail_bytes"]
        record = root[f"tile/{number}"][row, column]
        planes = record[-16641 * widths[1]:].view("i1").reshape(widths[1], 129, 129).astype(np.int64)
        detail = sum(plane << 8 * place for place, plane in enumerate(planes))
        assert np.array_equal(tile_rule.decode(cage, detail, level["step"]), h), (number, row, column)
        if (row, column - 1) in heights:
            assert np.array_equal(heights[row, column - 1][:, 128], h[:, 0]), (number, row, column)
        if (row - 1, column) in heights:
            assert np.array_equal(heights[row - 1, column][128], h[0]), (number, row, column)
        heights[row, column] = h
        tiles += 1
        y, x = 128 * row + (7 * row + 31) % 128, 128 * column + (11 * column + 57) % 128
        if number == len(about["levels"]) - 1 and y < grid["rows"] and x < grid["columns"]:
            samples.append({
                "x": grid["origin"][0] + x * grid["step"][0],
                "y": grid["origin"][1] + y * grid["step"][1],
                "height": float(h[y % 128, x % 128]) * 2.0 ** about["unit_exponent"],
            })
print(json.dumps({"tiles": tiles, "samples": samples}))
"#;

#[test]
fn zarr_python_reads_every_array_and_the_shared_rule_gives_the_same_heights() {
    let (Some(python), Some(rule)) = (crate::support::python(), shared("reference/tile")) else {
        return;
    };
    let format = fs::read_to_string(crate::support::root().join("engine/core/FORMAT.md"))
        .expect("the format is described");
    let (_, rest) = format.split_once("```python\n").expect("it shows Python");
    let (lines, _) = rest.split_once("```").expect("the lines end");
    let output = std::process::Command::new(python)
        .args(["-c", &format!("{lines}{READ_PYRAMID}")])
        .arg(rainier_pyramid())
        .arg(&rule)
        .output()
        .expect("python starts");
    assert!(output.status.success(), "{}", crate::support::told(&output));
    let told: Value = serde_json::from_slice(&output.stdout).expect("the script prints JSON");
    assert!(
        told["tiles"].as_u64().is_some_and(|tiles| tiles > 100),
        "{told}"
    );
    let samples = told["samples"].as_array().expect("a list");
    let at: Vec<_> = samples
        .iter()
        .map(|sample| {
            [
                sample["x"].as_f64().expect("x"),
                sample["y"].as_f64().expect("y"),
            ]
        })
        .collect();
    let mut compared = 0;
    for (sample, height) in samples.iter().zip(heights(rainier_pyramid(), &at)) {
        let Some(height) = height else { continue };
        let other = sample["height"].as_f64().expect("a height");
        assert!((height - other).abs() < 0.01, "{sample}: {height}");
        compared += 1;
    }
    assert!(compared > 60, "{compared} compared");
}
