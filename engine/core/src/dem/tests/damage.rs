//! Damaged files of every format: cut short at many places, and with bytes changed. No reader may panic.

use std::io::Cursor;
use std::panic::catch_unwind;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
};
use ::exr::prelude::{SmallVec, WritableImage};
use ::tiff::encoder::colortype;
use ::tiff::encoder::{Compression, DeflateLevel, Predictor, TiffKindBig, TiffKindStandard};
use tempfile::TempDir;

use super::super::*;
use super::written::{COLUMNS, ROWS, hill, save, tiff};
use super::{pixels, read_all};

/// One small sound file of each format.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let lzw = tiff::<colortype::GrayI16, TiffKindStandard>(
        &hill(),
        Compression::Lzw,
        Predictor::Horizontal,
    );
    let deflate = Compression::Deflate(DeflateLevel::Fast);
    let deflate = tiff::<colortype::GrayI16, TiffKindBig>(&hill(), deflate, Predictor::None);
    let plain = tiff::<colortype::GrayI16, TiffKindStandard>(
        &hill(),
        Compression::Uncompressed,
        Predictor::None,
    );
    let text =
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value 0\n1 2 3 4 5 6\n";
    vec![
        ("lzw.tif", lzw),
        ("deflate.tif", deflate),
        ("plain.tif", plain),
        ("grid.asc", text.into()),
        ("map.png", png()),
        ("map.exr", exr()),
        ("cell.dt0", dted()),
        ("quad.dem", usgs()),
    ]
}

fn png() -> Vec<u8> {
    let grey: Vec<u16> = hill().iter().map(|height| height.unsigned_abs()).collect();
    let image = ::image::ImageBuffer::<::image::Luma<u16>, _>::from_raw(COLUMNS, ROWS, grey)
        .expect("an image");
    let mut file = Cursor::new(Vec::new());
    image
        .write_to(&mut file, ::image::ImageFormat::Png)
        .expect("a PNG");
    file.into_inner()
}

fn exr() -> Vec<u8> {
    let heights = hill().iter().map(|&height| f32::from(height)).collect();
    let channels = AnyChannels {
        list: SmallVec::from_vec(vec![AnyChannel::new("Y", FlatSamples::F32(heights))]),
    };
    let size = (COLUMNS as usize, ROWS as usize);
    let layer = Layer::new(
        size,
        LayerAttributes::named("heights"),
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let mut file = Cursor::new(Vec::new());
    ExrImage::from_layer(layer)
        .write()
        .to_buffered(&mut file)
        .expect("an EXR");
    file.into_inner()
}

/// Two columns of three heights.
fn dted() -> Vec<u8> {
    let mut file = format!(
        "{:<80}",
        "UHL10800000W0430000N180018000200U              000200030"
    );
    file += &" ".repeat(648 + 2700);
    let mut file = file.into_bytes();
    for column in 0..2 {
        file.extend([0xaa, 0, 0, 0, 0, column, 0, 0]);
        file.extend([0, 10, 0, 20, 0x80, 5]);
        file.extend([0; 4]);
    }
    file
}

/// Two profiles of two heights.
fn usgs() -> Vec<u8> {
    let mut file = vec![b' '; 3 * 1024];
    let mut put =
        |at: usize, text: &str| file[at..at + text.len()].copy_from_slice(text.as_bytes());
    for (at, number) in [
        (144, 1),
        (150, 1),
        (156, 1),
        (162, 10),
        (528, 2),
        (534, 2),
        (540, 4),
        (852, 1),
        (858, 2),
    ] {
        put(at, &format!("{number:>6}"));
    }
    put(816, "0.300000E+020.300000E+020.100000E+01");
    for (profile, x) in [(1, "0.50000D+06"), (2, "0.50003D+06")] {
        let at = profile * 1024;
        put(at, &format!("{:>6}{profile:>6}{:>6}{:>6}", 1, 2, 1));
        put(
            at + 24,
            &format!("{x:>24}{:>24}{:>24}", "0.50000D+07", "0.0"),
        );
        put(
            at + 144,
            &format!("{:>6}{:>6}", 100 * profile, 100 * profile + 1),
        );
    }
    file
}

/// Opens and reads a file as a model and as an image; what comes of it does not matter.
fn try_all(path: &Path) -> bool {
    let path = path.to_owned();
    catch_unwind(|| {
        let _ = pixels(&path);
        open(&path, &OpenOptions::default()).and_then(|raster| {
            // A damaged size may still be allowed; only small ones are read whole.
            let small = Window::whole(&raster.header().grid).sample_count() < 1 << 22;
            if small {
                read_all(&*raster).map(|heights| heights.len())
            } else {
                Ok(0)
            }
        })
    })
    .is_ok()
}

#[test]
fn the_sound_files_are_read() {
    let folder = TempDir::new().expect("a folder");
    for (name, bytes) in files() {
        let raster = open(&save(&folder, name, &bytes), &OpenOptions::default()).expect(name);
        let heights = read_all(&*raster).expect(name);
        match name {
            "quad.dem" => assert_eq!(heights, [101.0, 201.0, 100.0, 200.0]),
            "cell.dt0" => assert_eq!(heights, [-5.0, -5.0, 20.0, 20.0, 10.0, 10.0]),
            "grid.asc" => assert_eq!(heights, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            "map.exr" => assert_eq!(
                heights,
                hill().into_iter().map(f64::from).collect::<Vec<_>>()
            ),
            _ => assert_eq!(heights.len(), 23 * 17, "{name}"),
        }
    }
}

#[test]
fn a_file_cut_short_is_an_error_and_no_panic() {
    let folder = TempDir::new().expect("a folder");
    for (name, bytes) in files() {
        let step = (bytes.len() / 150).max(1);
        for len in (0..bytes.len()).step_by(step) {
            let path = save(&folder, name, &bytes[..len]);
            assert!(try_all(&path), "{name} of {len} bytes");
        }
        let path = save(&folder, name, &bytes[..bytes.len() / 2]);
        let half = open(&path, &OpenOptions::default()).and_then(|raster| read_all(&*raster));
        assert!(half.is_err(), "{name} cut in half");
    }
}

#[test]
fn changed_bytes_make_no_panic() {
    let folder = TempDir::new().expect("a folder");
    // A small generator of our own: the same changes on every machine.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(state >> 33).expect("31 bits") % below
    };
    for (name, bytes) in files() {
        for round in 0..300 {
            let mut bytes = bytes.clone();
            for _ in 0..=round % 4 {
                // Headers lie at the start, a TIFF's tags at the end.
                let near = bytes.len().min(400);
                let at = match random(3) {
                    0 => random(near),
                    1 => bytes.len() - 1 - random(near),
                    _ => random(bytes.len()),
                };
                bytes[at] = [0, 1, 0x7f, 0x80, 0xff, b'9'][random(6)];
            }
            let path = save(&folder, name, &bytes);
            assert!(try_all(&path), "{name}, round {round}");
        }
    }
}

#[test]
fn absurd_sizes_are_refused_before_memory_is_taken() {
    let folder = TempDir::new().expect("a folder");
    let error = |name: &str, bytes: &[u8]| {
        let opened = open(&save(&folder, name, bytes), &OpenOptions::default());
        opened.err().expect(name).to_string()
    };
    let mut file = exr();
    let key = b"dataWindow\0box2i\0\x10\0\0\0";
    let window = file
        .windows(key.len())
        .position(|part| part == key)
        .expect("an EXR")
        + key.len();
    for (max, said) in [
        ([30_000, 30_000], "limit"),
        ([9_999, 9_999], "in a file of"),
        ([i32::MAX, -1], "EXR"),
    ] {
        for (value, at) in max.iter().zip([window + 8, window + 12]) {
            file[at..at + 4].copy_from_slice(&i32::to_le_bytes(*value));
        }
        let error = error("a.exr", &file);
        assert!(error.contains(said), "{error}");
    }

    let text = "ncols 60000\nnrows 60000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3";
    assert!(error("a.asc", text.as_bytes()).contains("limit"));
    let text = text.replace("60000", "9999");
    assert!(error("a.asc", text.as_bytes()).contains("cannot hold"));

    // A PNG of 100,000 x 100,000: the size and its checksum are right, the pixels are not there.
    let mut file = png();
    file[16..24].copy_from_slice(&[0, 1, 0x86, 0xa0, 0, 1, 0x86, 0xa0]);
    let mut crc = u32::MAX;
    for byte in &file[12..29] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & 0u32.wrapping_sub(crc & 1));
        }
    }
    file[29..33].copy_from_slice(&(!crc).to_be_bytes());
    assert!(error("a.png", &file).contains("limit"));
    let image = pixels(&save(&folder, "b.png", &file)).expect_err("too large");
    assert!(image.to_string().contains("limit"), "{image}");
}

#[test]
fn options_that_make_no_grid_are_refused() {
    let folder = TempDir::new().expect("a folder");
    let path = save(&folder, "map.png", &png());
    for (spacing, scale) in [
        (0.0, 1.0),
        (f64::NAN, 1.0),
        (1.0, 0.0),
        (1.0, f64::INFINITY),
    ] {
        let options = OpenOptions {
            spacing: Some(spacing),
            scale: Some(scale),
            ..OpenOptions::default()
        };
        assert!(open(&path, &options).is_err(), "{spacing} {scale}");
    }
}
