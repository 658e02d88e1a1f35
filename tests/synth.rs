//! Terrain made of a seed: as a file, as a pyramid, and in the eyes of GDAL.

use std::fs;

use crate::support::{drumlin_fails, drumlin_json, drumlin_ok, folder, gdal};

#[test]
fn synthetic_terrain_is_written_whole_and_builds() {
    let out = folder("synth");
    let [tif, part, pyramid] = ["a.tif", "part.tif", "a.zarr"].map(|name| out.join(name));
    let [tif_name, part_name, pyramid_name] =
        [&tif, &part, &pyramid].map(|path| path.to_str().expect("a plain name"));
    let told = drumlin_json([
        "synth", "--seed", "7", "--size", "700", "-o", tif_name, "--json",
    ]);
    assert_eq!(
        (told["rows"].as_u64(), told["columns"].as_u64()),
        (Some(700), Some(700))
    );
    assert_eq!(
        told["bytes"].as_u64(),
        fs::metadata(&tif).ok().map(|about| about.len())
    );
    drumlin_fails(2, ["synth", "--seed", "8", "--size", "9", "-o", tif_name]);
    drumlin_ok(["build", tif_name, "-o", pyramid_name]);
    // A part of it, made by itself: same places, same heights.
    drumlin_ok([
        "synth",
        "--seed",
        "7",
        "--window",
        "300,400,100,120",
        "-o",
        part_name,
        "--compress",
        "none",
    ]);
    let part_pyramid = out.join("part.zarr");
    drumlin_ok([
        "build",
        part_name,
        "-o",
        part_pyramid.to_str().expect("a plain name"),
    ]);
    let heights = |pyramid: &str| {
        drumlin_json([
            "height",
            pyramid,
            "--json",
            "--at",
            "4100,-3200",
            "4500.5,-3507",
        ])
    };
    let [whole, part] = [
        heights(pyramid_name),
        heights(part_pyramid.to_str().expect("a plain name")),
    ];
    for at in 0..2 {
        let [whole, part] =
            [&whole, &part].map(|heights| heights[at]["height"].as_f64().expect("a height"));
        // Both are within 0.1 m of the same sample.
        assert!((whole - part).abs() <= 0.2, "{whole} {part}");
    }
}

#[test]
fn sizes_that_are_none_are_refused_and_leave_nothing() {
    let out = folder("synth-bad");
    let tif = out.join("a.tif");
    let tif = tif.to_str().expect("a plain name");
    drumlin_fails(1, ["synth", "--seed", "1", "--size", "0", "-o", tif]);
    drumlin_fails(
        1,
        ["synth", "--seed", "1", "--size", "4294967295", "-o", tif],
    );
    drumlin_fails(2, ["synth", "--seed", "1", "-o", tif]);
    drumlin_fails(
        2,
        [
            "synth", "--seed", "1", "--size", "9", "--window", "1,2,3,4", "-o", tif,
        ],
    );
    drumlin_fails(2, ["synth", "--seed", "-1", "--size", "9", "-o", tif]);
    let nowhere = out.join("none/a.tif");
    drumlin_fails(
        3,
        [
            "synth",
            "--seed",
            "1",
            "--size",
            "9",
            "-o",
            nowhere.to_str().expect("a plain name"),
        ],
    );
    assert_eq!(
        fs::read_dir(&out).expect("the folder can be read").count(),
        0
    );
}

#[test]
fn gdal_reads_synthetic_terrain() {
    let Some(mut info) = gdal("gdalinfo") else {
        return;
    };
    let out = folder("synth-gdal");
    let tif = out.join("a.tif");
    let name = tif.to_str().expect("a plain name");
    drumlin_ok([
        "synth",
        "--seed",
        "7",
        "--window",
        "10,20,600,513",
        "-o",
        name,
    ]);
    let output = info
        .args(["-json", "-stats", name])
        .output()
        .expect("gdalinfo starts");
    assert!(output.status.success(), "{}", crate::support::told(&output));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["size"], serde_json::json!([513, 600]));
    // Samples are points; GDAL names the corner of the first one's area.
    let transform = told["geoTransform"].as_array().expect("six numbers");
    assert_eq!(transform[0], serde_json::json!(195.0));
    assert_eq!(transform[3], serde_json::json!(-95.0));
    assert_eq!(told["bands"][0]["type"], "Float32");
    assert!(told["bands"][0]["minimum"].is_number(), "{told}");
}
