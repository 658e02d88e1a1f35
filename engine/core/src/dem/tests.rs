//! Whole files: the shared rasters against their known heights, and every awkward file against panics.

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use super::*;
use crate::geo::{CrsKind, Ellipsoid};

/// A folder or file of the shared data; none, with a message, where a clone has no such folder.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{} is missing", path.display());
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
    bytes.as_chunks().0.iter().map(|&value| i16::from_le_bytes(value).into()).collect()
}

/// Files of one folder that begin and end so, in order.
fn files(folder: &Path, begin: &str, end: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
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
    let Some(folder) = shared("dem/variants") else { return };
    let golden = golden(&folder, "GOLDEN_300x260_i16le.raw");
    let mut refused = Vec::new();
    for path in files(&folder, "v_", ".tif") {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let tolerance = if name.contains("lossy") { 1.0 } else { 0.0 };
        match heights(&path, &OpenOptions::default()) {
            Ok(heights) => {
                let pairs = heights.iter().zip(&golden);
                let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(heights.len() == golden.len() && largest <= tolerance, "{name}: {largest}");
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
    let Some(folder) = shared("tricky-tiff") else { return };
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
        println!("{:50} {}", path.file_name().unwrap_or_default().to_string_lossy(), describe(&result));
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
    let Some(folder) = shared("dem/variants") else { return };
    for path in [files(&folder, "g_", ".tif"), files(&folder, "n_", ".tif"), files(&folder, "o_", ".tif")].concat() {
        let header = open(&path, &OpenOptions::default()).map(|raster| format!("{:?}", raster.header()));
        println!("{} {}", path.display(), describe(&heights(&path, &OpenOptions::default())));
        println!("    {}", header.unwrap_or_default());
    }
}
