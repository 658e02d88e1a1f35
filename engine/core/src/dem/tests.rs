//! Whole files: the shared rasters against their known heights, and every awkward file against panics.

mod damage;
mod formats;
mod written;

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use super::*;
use crate::geo::{CrsKind, Ellipsoid};

/// A folder or file of the shared data; none, with a message, where a clone has no such folder.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data")
        .join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{} is missing",
        path.display()
    );
    println!("skipped: no {}", path.display());
    None
}

fn read_all(raster: &dyn Raster) -> Result<Vec<f64>, DemError> {
    let window = Window::whole(&raster.header().grid);
    let mut out = vec![0.0; usize::try_from(window.sample_count()).expect("small")];
    raster.read(window, &mut out).map(|()| out)
}

fn heights(path: &Path, options: &OpenOptions) -> Result<Vec<f64>, DemError> {
    read_all(&*open(path, options)?)
}

fn golden(folder: &Path, name: &str) -> Vec<f64> {
    let bytes = fs::read(folder.join(name)).expect("the golden heights");
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|&value| i16::from_le_bytes(value).into())
        .collect()
}

/// Files of one folder that begin and end so, in order.
fn files(folder: &Path, begin: &str, end: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path());
    let matches = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(begin) && name.ends_with(end)
    };
    let mut files: Vec<_> = entries.filter(matches).collect();
    files.sort();
    files
}

#[test]
fn one_window_in_many_encodings_has_one_set_of_heights() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let golden = golden(&folder, "GOLDEN_300x260_i16le.raw");
    let mut refused = Vec::new();
    for path in files(&folder, "v_", ".tif") {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let tolerance = if name.contains("lossy") { 1.0 } else { 0.0 };
        match heights(&path, &OpenOptions::default()) {
            Ok(heights) => {
                let pairs = heights.iter().zip(&golden);
                let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(
                    heights.len() == golden.len() && largest <= tolerance,
                    "{name}: {largest}"
                );
            }
            Err(error) => refused.push(error.to_string()),
        }
    }
    assert_eq!(
        refused,
        [
            "v_f32_lerc_deflate_tiled.tif: not supported: LERC compression (34887, tag 259)",
            "v_i16_3band_chunky_p2.tif: not supported: 3 bands (tag 277); an elevation model has one",
            "v_i16_lerc.tif: not supported: LERC compression (34887, tag 259)",
        ]
    );
}

/// All pixels of an image; none of one that is too large for a test.
fn pixels(path: &Path) -> Result<Vec<Pixel>, DemError> {
    let image = open_image(path, &OpenOptions::default())?;
    let whole = Window {
        row: 0,
        column: 0,
        rows: image.height,
        columns: image.width,
    };
    let count = usize::try_from(whole.sample_count()).unwrap_or(0);
    if count > 1 << 24 {
        return Ok(Vec::new());
    }
    let mut pixels = vec![Pixel::default(); count];
    image.read(whole, &mut pixels).map(|()| pixels)
}

#[test]
fn no_awkward_tiff_makes_the_reader_panic_or_hang() {
    let Some(folder) = shared("tricky-tiff") else {
        return;
    };
    let (mut models, mut images) = (0, 0);
    for path in files(&folder, "", "") {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let image = catch_unwind(|| pixels(&path).map(|pixels| pixels.len()));
        let image = image.unwrap_or_else(|_| panic!("{name}"));
        let model = catch_unwind(|| heights(&path, &OpenOptions::default()));
        let model = model.unwrap_or_else(|_| panic!("{name}"));
        println!("{name:50} {}", describe(&model));
        println!("{:50} {image:?}", "");
        models += usize::from(model.is_ok());
        images += usize::from(image.is_ok());
        for error in [model.err(), image.err()].into_iter().flatten() {
            assert!(error.to_string().starts_with(&name), "{error}");
        }
    }
    // Fewer would mean that sound files are refused, more that broken ones are taken.
    assert_eq!((models, images), (35, 24));
}

fn describe(result: &Result<Vec<f64>, DemError>) -> String {
    match result {
        Ok(heights) => {
            let known = heights.iter().filter(|height| !height.is_nan());
            let (min, max) = known.fold((f64::MAX, f64::MIN), |(a, b), &h| (a.min(h), b.max(h)));
            format!("{} heights {min} .. {max}", heights.len())
        }
        Err(error) => error.to_string(),
    }
}

#[test]
fn georeference_scale_and_voids_come_out() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let golden = golden(&folder, "GOLDEN_300x260_i16le.raw");
    let north_west = [-121.45, 46.4];
    for name in [
        "compound_vertical_egm96",
        "nad83_geographic",
        "no_crs_worldfile",
        "pixel_is_point",
        "south_up",
    ] {
        let raster = open(
            &folder.join(format!("g_{name}.tif")),
            &OpenOptions::default(),
        )
        .expect(name);
        let header = raster.header();
        let off = [0, 1].map(|axis| (header.grid.origin[axis] - north_west[axis]).abs());
        assert!(
            off[0] < 1e-9 && off[1] < 1e-9 && header.georeferenced && header.integer,
            "{name}"
        );
        assert_eq!(read_all(&*raster).expect(name), golden, "{name}");
    }
    for name in [
        "g_u16_offset_minus1000",
        "g_u16_scale_0p1",
        "o_cog_overviews",
        "o_external_ovr",
    ] {
        let path = folder.join(format!("{name}.tif"));
        assert_eq!(
            heights(&path, &OpenOptions::default()).expect(name),
            golden,
            "{name}"
        );
    }
    for path in files(&folder, "n_", ".tif") {
        let heights = heights(&path, &OpenOptions::default()).expect("readable");
        let voids = heights.iter().filter(|height| height.is_nan()).count();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let expected = match &*name {
            "n_i16_all_nodata.tif" => 78_000..=78_000,
            "n_i16_constant_1234.tif" => 0..=0,
            "n_i16_speckle_voids.tif" => 1_400..=1_700,
            _ => 4_800..=4_800,
        };
        assert!(expected.contains(&voids), "{name}: {voids} voids");
    }
    assert!(
        heights(
            &folder.join("o_sparse_all_missing_tiles.tif"),
            &OpenOptions::default()
        )
        .is_ok_and(|heights| { heights.iter().all(|height| height.is_nan()) })
    );
}

#[test]
fn outside_an_internal_mask_is_void() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let golden = golden(&folder, "GOLDEN_300x260_i16le.raw");
    let path = folder.join("o_internal_mask_disc.tif");
    let masked = heights(&path, &OpenOptions::default()).expect("readable");
    let mut known = 0;
    for (index, (height, golden)) in masked.iter().zip(&golden).enumerate() {
        let (row, column) = (index / 300, index % 300);
        let radius = (row as f64 - 129.5).hypot(column as f64 - 149.5);
        assert!(height.is_nan() || height == golden);
        assert!((radius - 120.0).abs() < 2.0 || height.is_nan() == (radius > 120.0));
        known += usize::from(!height.is_nan());
    }
    assert_eq!(known, 45_225);
}

#[test]
fn what_cannot_be_placed_is_refused_or_takes_the_caller_s_spacing() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let error = |name: &str| {
        open(&folder.join(name), &OpenOptions::default())
            .err()
            .expect(name)
            .to_string()
    };
    assert!(error("g_rotated20_utm10n.tif").contains("rotated"));
    assert!(error("g_gcps_only.tif").contains("4 ground control points"));
    let options = OpenOptions {
        spacing: Some(90.0),
        scale: Some(0.5),
        ..OpenOptions::default()
    };
    let raster = open(&folder.join("g_no_georef.tif"), &options).expect("readable");
    let header = raster.header();
    assert_eq!(
        (header.grid.step, header.georeferenced, header.integer),
        ([90.0, -90.0], false, false)
    );
}

#[test]
fn coordinate_systems_come_out() {
    let Some(folder) = shared("dem") else { return };
    let crs = |name: &str| {
        open(&folder.join(name), &OpenOptions::default())
            .expect(name)
            .header()
            .crs
            .clone()
    };
    let moon = crs("moon_gld100_farside_8192.tif");
    assert_eq!(
        (moon.kind, moon.ellipsoid),
        (CrsKind::Geographic, Ellipsoid::MOON)
    );
    assert_eq!(
        (moon.code.as_deref(), moon.name.as_deref()),
        (None, Some("Moon 2000"))
    );
    let feet = crs("variants/g_wa_south_ftUS_f32.tif");
    assert_eq!(
        (feet.kind, feet.code.as_deref()),
        (CrsKind::Projected, Some("EPSG:2927"))
    );
    assert_eq!(feet.unit_metres, units::US_FOOT);
    assert_eq!(crs("greenriver.tif").code.as_deref(), Some("EPSG:6341"));
    assert_eq!(crs("mt_rainier_90m.tif").code.as_deref(), Some("EPSG:4326"));
}

#[test]
fn windows_of_a_tiled_file_equal_the_whole() {
    let Some(folder) = shared("dem") else { return };
    for name in [
        "mt_rainier_90m.tif",
        "bigtujunga.tif",
        "variants/g_south_up.tif",
        "N41E001.hgt",
    ] {
        let options = OpenOptions {
            cache_bytes: Some(100_000),
            ..OpenOptions::default()
        };
        let raster = open(&folder.join(name), &options).expect(name);
        let grid = raster.header().grid;
        let whole = read_all(&*raster).expect(name);
        for (row, column, rows, columns) in [
            (0, 0, 1, 1),
            (100, 90, 150, 200),
            (255, 255, 2, 2),
            (259, 0, 1, 300),
        ] {
            let window = Window {
                row,
                column,
                rows,
                columns,
            };
            let mut out = vec![0.0; usize::try_from(window.sample_count()).expect("small")];
            raster.read(window, &mut out).expect(name);
            for (index, height) in out.iter().enumerate() {
                let (r, c) = (
                    row as usize + index / columns as usize,
                    column as usize + index % columns as usize,
                );
                let expected = whole[r * grid.columns as usize + c];
                assert!(
                    *height == expected || (height.is_nan() && expected.is_nan()),
                    "{name} {r} {c}"
                );
            }
        }
        let outside = Window {
            row: 0,
            column: grid.columns,
            rows: 1,
            columns: 1,
        };
        assert!(matches!(
            raster.read(outside, &mut [0.0]),
            Err(DemError::Window { .. })
        ));
    }
}

#[test]
fn many_threads_read_one_file() {
    let Some(folder) = shared("dem") else { return };
    let options = OpenOptions {
        cache_bytes: Some(1 << 16),
        ..OpenOptions::default()
    };
    let raster = open(
        &folder.join("variants/v_i16_tiled64x128_deflate.tif"),
        &options,
    )
    .expect("readable");
    let golden = golden(&folder.join("variants"), "GOLDEN_300x260_i16le.raw");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| assert_eq!(read_all(&*raster).expect("readable"), golden));
        }
    });
}
