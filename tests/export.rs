//! What leaves a pyramid: boxes of a level, and comparisons.

use std::fs;

use crate::support::{
    drumlin, drumlin_fails, drumlin_json, drumlin_ok, folder, gdal, rainier, rainier_pyramid,
};

#[test]
fn a_box_of_the_finest_level_holds_its_heights() {
    let out = folder("extract");
    let tif = out.join("a.tif");
    let tif = tif.to_str().expect("a plain name");
    let pyramid = rainier_pyramid().to_str().expect("a plain name");
    let told = drumlin_json([
        "extract",
        pyramid,
        "--bbox",
        "-121.9,46.9,-121.5,46.5",
        "-o",
        tif,
        "--json",
    ]);
    assert_eq!(told["columns"].as_u64(), Some(481));
    assert_eq!(told["rows"].as_u64(), Some(481));
    let [again, fine] = ["again.zarr", "fine.tif"].map(|name| out.join(name));
    let again = again.to_str().expect("a plain name");
    drumlin_ok(["build", tif, "-o", again]);
    let heights = |pyramid: &str| {
        drumlin_json([
            "height",
            pyramid,
            "--json",
            "--at",
            "-121.7,46.7",
            "-121.9,46.5",
        ])
    };
    let [part, whole] = [again, pyramid].map(heights);
    for at in 0..2 {
        let [part, whole] =
            [&part, &whole].map(|all| all[at]["height"].as_f64().expect("a height"));
        // Whole metres come back exactly; places beside samples are off by rounding.
        assert!((part - whole).abs() < 0.2, "{part} {whole}");
    }
    drumlin_fails(
        2,
        [
            "extract",
            pyramid,
            "--bbox",
            "0,0,1,1",
            "-o",
            fine.to_str().expect("plain"),
        ],
    );
    drumlin_fails(
        2,
        [
            "extract",
            pyramid,
            "--bbox",
            "0,0,1",
            "-o",
            fine.to_str().expect("plain"),
        ],
    );
    drumlin_fails(
        2,
        [
            "extract",
            pyramid,
            "--bbox",
            "-121.9,46.9,-121.5,46.5",
            "--level",
            "77",
            "-o",
            fine.to_str().expect("plain"),
        ],
    );
    drumlin_fails(
        2,
        [
            "extract",
            pyramid,
            "--bbox",
            "-121.9,46.9,-121.5,46.5",
            "-o",
            tif,
        ],
    );
    assert!(!fine.exists());
    assert_eq!(
        fs::read_dir(&out).expect("the folder can be read").count(),
        2
    );
}

#[test]
fn pyramids_differ_where_they_do_and_the_exit_code_says_so() {
    let out = folder("diff");
    let coarse = out.join("coarse.zarr");
    let coarse = coarse.to_str().expect("a plain name");
    let pyramid = rainier_pyramid().to_str().expect("a plain name");
    drumlin_ok([
        "build",
        rainier().to_str().expect("plain"),
        "-o",
        coarse,
        "--eps",
        "4",
    ]);
    let same = drumlin_json(["diff", pyramid, pyramid, "--json"]);
    assert_eq!(same["differ"], false);
    let output = drumlin(["diff", pyramid, coarse, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["differ"], true);
    let finest = told["levels"]
        .as_array()
        .and_then(|all| all.last())
        .expect("a level");
    let max = finest["max"].as_f64().expect("a distance");
    assert!(max > 1.0 && max <= 4.5, "{finest}");
    assert!(
        finest["place"][0]
            .as_f64()
            .is_some_and(|x| (-122.0..=-121.0).contains(&x))
    );
    // At coarser levels fits to differently rounded samples differ by a little more.
    drumlin_ok(["diff", pyramid, coarse, "--tolerance", "100"]);
    let other = out.join("other.zarr");
    let other = other.to_str().expect("a plain name");
    let tif = out.join("a.tif");
    let tif = tif.to_str().expect("a plain name");
    drumlin_ok(["synth", "--seed", "1", "--size", "200", "-o", tif]);
    drumlin_ok(["build", tif, "-o", other]);
    drumlin_fails(2, ["diff", pyramid, other]);
    drumlin_fails(3, ["diff", pyramid, "nowhere.zarr"]);
    drumlin_fails(2, ["diff", pyramid, coarse, "--tolerance", "-1"]);
}

#[test]
fn gdal_opens_the_exported_heights_with_their_overviews() {
    let out = folder("export-cog");
    let tif = out.join("a.tif");
    let tif = tif.to_str().expect("a plain name");
    let pyramid = rainier_pyramid().to_str().expect("a plain name");
    let told = drumlin_json(["export", pyramid, "--to", "cog", "-o", tif, "--json"]);
    assert_eq!(
        told["bytes"].as_u64(),
        fs::metadata(tif).ok().map(|about| about.len())
    );
    drumlin_fails(2, ["export", pyramid, "--to", "cog", "-o", tif]);
    drumlin_fails(2, ["export", pyramid, "--to", "shapefile", "-o", tif]);
    // Our own reader: every finest height.
    let again = out.join("again.zarr");
    let again = again.to_str().expect("a plain name");
    drumlin_ok(["build", tif, "-o", again, "--eps", "0.5"]);
    let output = drumlin(["diff", pyramid, again, "--json"]);
    let differences: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let finest = differences["levels"]
        .as_array()
        .and_then(|all| all.last())
        .expect("a level");
    assert!(
        finest["max"].as_f64().is_some_and(|max| max <= 0.5),
        "{finest}"
    );
    assert_eq!(finest["void_count"], 0);
    // GDAL: size, place, overviews, and a height of each.
    let Some(mut info) = gdal("gdalinfo") else {
        return;
    };
    let output = info.args(["-json", tif]).output().expect("gdalinfo starts");
    let about: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(about["size"], serde_json::json!([1201, 1201]));
    let sizes = about["bands"][0]["overviews"]
        .as_array()
        .expect("overviews");
    let sizes: Vec<_> = sizes.iter().map(|overview| &overview["size"]).collect();
    assert_eq!(
        sizes,
        [
            &serde_json::json!([601, 601]),
            &serde_json::json!([301, 301])
        ]
    );
    let height = |overview: &[&str]| {
        let mut command = gdal("gdallocationinfo").expect("it lies beside gdalinfo");
        let output = command
            .args(["-valonly", "-wgs84"])
            .args(overview)
            .args([tif, "-121.6", "46.8"])
            .output()
            .expect("gdallocationinfo starts");
        let text = String::from_utf8_lossy(&output.stdout);
        text.trim().parse::<f64>().expect("a height")
    };
    let ours = drumlin_json(["height", pyramid, "--json", "--at", "-121.6,46.8"]);
    let ours = ours[0]["height"].as_f64().expect("a height");
    // GDAL takes the nearest pixel; ground here rises by less than 60 m a sample.
    assert!((height(&[]) - ours).abs() < 60.0);
    assert!((height(&["-overview", "1"]) - ours).abs() < 120.0);
}
