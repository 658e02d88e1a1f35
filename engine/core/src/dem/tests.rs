//! Whole files: the shared rasters against their known heights, and every awkward file against panics.

mod damage;
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

#[test]
fn no_awkward_tiff_makes_the_reader_panic_or_hang() {
    let Some(folder) = shared("tricky-tiff") else {
        return;
    };
    let (mut read, mut refused) = (0, 0);
    for path in files(&folder, "", "") {
        let image = catch_unwind(|| open_image(&path).map(|image| image.rgb.len()));
        assert!(image.is_ok(), "{}", path.display());
        let result = catch_unwind(|| heights(&path, &OpenOptions::default()));
        let result = result.unwrap_or_else(|_| panic!("{}", path.display()));
        match (&result, image.expect("checked")) {
            (Ok(_), _) => read += 1,
            (Err(_), _) => refused += 1,
        }
        println!(
            "{:50} {}",
            path.file_name().unwrap_or_default().to_string_lossy(),
            describe(&result)
        );
    }
    println!("{read} read, {refused} refused");
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

#[test]
fn height_maps_without_georeference_have_their_heights() {
    let Some(folder) = shared("dem/derived") else {
        return;
    };
    let options = OpenOptions {
        spacing: Some(30.0),
        ..OpenOptions::default()
    };
    let golden = golden(&folder, "bigtujunga_512_GOLDEN_i16le.raw");
    assert_eq!(
        heights(&folder.join("bigtujunga_512_u16_metres.png"), &options).expect("png"),
        golden
    );
    let decametres = OpenOptions {
        scale: Some(10.0),
        ..options.clone()
    };
    let eight_bits = heights(
        &folder.join("bigtujunga_512_u8_decametres.png"),
        &decametres,
    )
    .expect("png");
    assert!(
        eight_bits
            .iter()
            .zip(&golden)
            .all(|(a, b)| *a == (b / 10.0).floor() * 10.0)
    );
    let coloured = heights(&folder.join("bigtujunga_512_terrarium.png"), &options);
    assert!(coloured.is_err_and(|error| error.to_string().contains("grey")));

    let puget = folder.join("../ps_height_1k.png");
    let decimetres = OpenOptions {
        scale: Some(0.1),
        ..options.clone()
    };
    let decimetres = heights(&puget, &decimetres).expect("png");
    let exr = heights(&folder.join("ps_height_1k_metres_f32_zip.exr"), &options).expect("exr");
    assert!(
        decimetres
            .iter()
            .zip(&exr)
            .all(|(a, b)| (a - b).abs() < 1e-3)
    );
    let half = heights(&folder.join("ps_height_512_metres_f16_piz.exr"), &options).expect("exr");
    assert_eq!(half.len(), 512 * 512);
    let north_west = |index: usize| decimetres[index / 512 * 1025 + index % 512];
    assert!(
        half.iter()
            .enumerate()
            .all(|(index, height)| (height - north_west(index)).abs() <= 2.0)
    );
}

#[test]
fn older_formats_have_the_same_heights() {
    let Some(folder) = shared("dem") else { return };
    let options = OpenOptions::default();
    let golden = golden(&folder.join("variants"), "GOLDEN_300x260_i16le.raw");
    let float_grid =
        open(&folder.join("derived/rainier_south_300x260.flt"), &options).expect("flt");
    assert_eq!(read_all(&*float_grid).expect("flt"), golden);
    assert_eq!(float_grid.header().grid.origin, [-121.45, 46.4]);
    assert_eq!(float_grid.header().crs.code.as_deref(), Some("EPSG:4326"));

    let dem = open(&folder.join("SainteHelens.dem"), &options).expect("dem");
    let asc = open(&folder.join("derived/SainteHelens.asc"), &options).expect("asc");
    // The text was made from the corners of the quadrangle, a row more on either side than there are heights.
    let (grid, framed) = (dem.header().grid, asc.header().grid);
    assert_eq!((grid.columns, grid.rows, framed.rows), (327, 466, 468));
    assert_eq!(grid.origin, framed.position(1.0, 0.0));
    assert_eq!(asc.header().crs.kind, CrsKind::Projected);
    let mut inner = vec![0.0; 466 * 327];
    asc.read(
        Window {
            row: 1,
            ..Window::whole(&grid)
        },
        &mut inner,
    )
    .expect("asc");
    let pairs = read_all(&*dem).expect("dem").into_iter().zip(inner);
    let (mut known, mut void) = (0, 0);
    for (a, b) in pairs {
        assert!(a == b || (a.is_nan() && b.is_nan()), "{a} {b}");
        *(if a.is_nan() { &mut void } else { &mut known }) += 1;
    }
    assert!(known > 100_000 && void > 1_000 && dem.header().integer && asc.header().integer);

    let bil = open(&folder.join("gabilan.bil"), &options).expect("bil");
    let asc = open(&folder.join("derived/gabilan_300x260_f32.asc"), &options).expect("asc");
    let [row, column] = bil
        .header()
        .grid
        .row_column(asc.header().grid.origin)
        .map(|place| place.round());
    let mut window = vec![0.0; 300 * 260];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a place in the grid"
    )]
    let place = Window {
        row: row as u32,
        column: column as u32,
        rows: 260,
        columns: 300,
    };
    bil.read(place, &mut window).expect("bil");
    let asc = read_all(&*asc).expect("asc");
    assert!(window.iter().zip(&asc).all(|(a, b)| (a - b).abs() < 1e-3));

    let dted = open(&folder.join("n43.dt0"), &options).expect("dt0");
    let grid = dted.header().grid;
    assert_eq!(
        (grid.columns, grid.rows, grid.origin),
        (121, 121, [-80.0, 44.0])
    );
    let known: Vec<f64> = read_all(&*dted)
        .expect("dt0")
        .into_iter()
        .filter(|height| !height.is_nan())
        .collect();
    let range = known
        .iter()
        .fold((f64::MAX, f64::MIN), |(a, b), &h| (a.min(h), b.max(h)));
    assert_eq!(range, (75.0, 460.0));

    // No void mark is declared, and -9999 is the format's own.
    let hugo = heights(&folder.join("hugo_site_filled.asc"), &options).expect("asc");
    assert!(
        hugo.iter().any(|height| height.is_nan())
            && hugo.iter().all(|height| height.is_nan() || *height >= 0.0)
    );
    assert!(
        heights(&folder.join("srtmgl3_rockies_degrees.asc"), &options)
            .is_ok_and(|heights| heights[0] == 2569.0)
    );
}

#[test]
fn srtm_tiles_join_without_a_seam_and_the_later_wins() {
    let Some(folder) = shared("dem") else { return };
    let tile = |name: &str| open(&folder.join(name), &OpenOptions::default()).expect(name);
    let mosaic = Mosaic::new(vec![tile("N41E001.hgt"), tile("N42E001.hgt")]).expect("they fit");
    let grid = mosaic.header().grid;
    assert_eq!(
        (grid.columns, grid.rows, grid.origin),
        (1201, 2401, [1.0, 43.0])
    );
    let whole = read_all(&mosaic).expect("readable");
    let (north, south) = (
        read_all(&*tile("N42E001.hgt")),
        read_all(&*tile("N41E001.hgt")),
    );
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a == b || a.is_nan());
    assert!(same(&whole[..1201 * 1200], &north.expect("readable")));
    assert!(same(
        &whole[1201 * 1201..],
        &south.expect("readable")[1201..]
    ));
    let error = Mosaic::new(vec![tile("N41E001.hgt"), tile("greenriver.tif")])
        .err()
        .expect("another system");
    assert!(
        error
            .to_string()
            .starts_with("N41E001.hgt and greenriver.tif do not fit"),
        "{error}"
    );
}

#[test]
fn imagery_comes_with_its_place() {
    let Some(folder) = shared("dem") else { return };
    let image = open_image(&folder.join("everest_landsat7_RGB.tif")).expect("a TIFF");
    assert_eq!(
        (image.width, image.height, image.crs.code.as_deref()),
        (800, 655, Some("EPSG:32645"))
    );
    let extent = image.extent.expect("georeferenced");
    assert_eq!(extent.max[0] - extent.min[0], 800.0 * 30.0);
    assert_eq!(extent.max[1] - extent.min[1], 655.0 * 30.0);
    for name in [
        "ps_texture_1k.png",
        "rmnp-rgb.tif",
        "world.topo.200412.3x5400x2700.jpg",
    ] {
        let image = open_image(&folder.join(name)).expect(name);
        assert_eq!(
            image.rgb.len(),
            image.width as usize * image.height as usize,
            "{name}"
        );
        assert!(image.rgb.iter().any(|rgb| rgb[0] != rgb[2]), "{name}");
    }
    let text = open_image(&folder.join("SainteHelens.dem")).expect_err("not an image");
    assert!(text.to_string().contains("not an image"));
}
