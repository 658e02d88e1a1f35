//! Small files written here: what a clone without the shared data can still check.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::tiff::encoder::colortype::{self, ColorType};
use ::tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffKind, TiffValue};
use ::tiff::tags::Tag;
use tempfile::TempDir;

use super::super::*;
use super::{pixels, read_all};

pub(super) const COLUMNS: u32 = 23;
pub(super) const ROWS: u32 = 17;

/// A hill of whole metres.
pub(super) fn hill() -> Vec<i16> {
    let height = |index: u32| {
        let (row, column) = (index / COLUMNS, index % COLUMNS);
        500 - 3 * row.abs_diff(8).pow(2) as i32 - 2 * column.abs_diff(11).pow(2) as i32
    };
    (0..COLUMNS * ROWS)
        .map(|index| i16::try_from(height(index)).expect("small"))
        .collect()
}

/// A GeoTIFF of 30 m samples in UTM zone 10 whose north-west sample lies at (500015, 5000000 - 15).
pub(super) fn tiff<C: ColorType, K: TiffKind>(
    heights: &[C::Inner],
    compression: Compression,
    predictor: Predictor,
) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut file = Cursor::new(Vec::new());
    let encoder = TiffEncoder::<_, K>::new_generic(&mut file).expect("a header");
    let mut encoder = encoder
        .with_compression(compression)
        .with_predictor(predictor);
    let mut image = encoder.new_image::<C>(COLUMNS, ROWS).expect("an image");
    image.rows_per_strip(5).expect("before any strip");
    let mut tag = |tag: u16, values: &[f64]| {
        let written = image.encoder().write_tag(Tag::Unknown(tag), values);
        written.expect("a tag");
    };
    tag(33550, &[30.0, 30.0, 0.0]);
    tag(33922, &[0.0, 0.0, 0.0, 500_000.0, 5_000_000.0, 0.0]);
    let keys: &[u16] = &[1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32610];
    image
        .encoder()
        .write_tag(Tag::Unknown(34735), keys)
        .expect("a tag");
    image
        .encoder()
        .write_tag(Tag::Unknown(42113), "-9999")
        .expect("a tag");
    image.write_data(heights).expect("samples");
    file.into_inner()
}

pub(super) fn save(folder: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

fn check(path: &Path, integer: bool) {
    let raster = open(path, &OpenOptions::default()).expect("readable");
    let header = raster.header();
    assert_eq!((header.grid.columns, header.grid.rows), (COLUMNS, ROWS));
    assert_eq!(header.grid.origin, [500_015.0, 4_999_985.0]);
    assert_eq!(header.crs.code.as_deref(), Some("EPSG:32610"));
    assert_eq!(header.integer, integer);
    let expected: Vec<f64> = hill().into_iter().map(f64::from).collect();
    assert_eq!(read_all(&*raster).expect("readable"), expected);
}

#[test]
fn every_compression_of_whole_numbers_gives_them_back() {
    let folder = TempDir::new().expect("a folder");
    let compressions = [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Deflate(DeflateLevel::Fast),
        Compression::Packbits,
    ];
    for compression in compressions {
        for predictor in [Predictor::None, Predictor::Horizontal] {
            // The encoder differences PackBits too, which no reader undoes.
            if matches!(
                compression,
                Compression::Packbits | Compression::Uncompressed
            ) && predictor == Predictor::Horizontal
            {
                continue;
            }
            let classic = tiff::<colortype::GrayI16, ::tiff::encoder::TiffKindStandard>(
                &hill(),
                compression,
                predictor,
            );
            check(&save(&folder, "a.tif", &classic), true);
            let big = tiff::<colortype::GrayI16, ::tiff::encoder::TiffKindBig>(
                &hill(),
                compression,
                predictor,
            );
            check(&save(&folder, "b.tif", &big), true);
        }
    }
}

#[test]
fn every_type_of_number_gives_the_same_heights() {
    let folder = TempDir::new().expect("a folder");
    let lzw = (Compression::Lzw, Predictor::None);
    let hill = hill();
    let i32s: Vec<i32> = hill.iter().map(|&h| h.into()).collect();
    let f32s: Vec<f32> = hill.iter().map(|&h| h.into()).collect();
    let f64s: Vec<f64> = hill.iter().map(|&h| h.into()).collect();
    let i32s = tiff::<colortype::GrayI32, ::tiff::encoder::TiffKindStandard>(&i32s, lzw.0, lzw.1);
    let f32s =
        tiff::<colortype::Gray32Float, ::tiff::encoder::TiffKindStandard>(&f32s, lzw.0, lzw.1);
    let f64s = tiff::<colortype::Gray64Float, ::tiff::encoder::TiffKindBig>(&f64s, lzw.0, lzw.1);
    check(&save(&folder, "i32.tif", &i32s), true);
    check(&save(&folder, "f32.tif", &f32s), false);
    check(&save(&folder, "f64.tif", &f64s), false);
}

#[test]
fn declared_void_is_nan() {
    let folder = TempDir::new().expect("a folder");
    let mut heights = hill();
    heights[7] = -9999;
    let file = tiff::<colortype::GrayI16, ::tiff::encoder::TiffKindStandard>(
        &heights,
        Compression::Uncompressed,
        Predictor::None,
    );
    let raster = open(&save(&folder, "a.tif", &file), &OpenOptions::default()).expect("readable");
    let voids = |height: &f64| height.is_nan();
    assert_eq!(
        read_all(&*raster).expect("readable").iter().position(voids),
        Some(7)
    );
}

#[test]
fn the_strips_kept_and_decoded_are_counted() {
    let folder = TempDir::new().expect("a folder");
    let deflate = Compression::Deflate(DeflateLevel::Fast);
    let bytes = tiff::<colortype::GrayI16, ::tiff::encoder::TiffKindStandard>(
        &hill(),
        deflate,
        Predictor::None,
    );
    let path = save(&folder, "strips.tif", &bytes);
    let opened = |cache_bytes| {
        let options = OpenOptions {
            cache_bytes,
            ..OpenOptions::default()
        };
        open(&path, &options).expect("readable")
    };
    // Strips of 5 rows of 2 bytes a sample, 4 of them.
    let strip = 5 * 2 * COLUMNS as usize;
    for (asked, kept) in [
        (None, 4 * strip),
        (Some(usize::MAX), 4 * strip),
        (Some(strip), strip),
        (Some(strip - 1), 0),
    ] {
        assert_eq!(opened(asked).memory_bytes(), kept as u64, "{asked:?}");
    }
    let one = opened(Some(strip));
    let read = one.read_bytes(100);
    assert!((strip as u64..bytes.len() as u64 * 2 + strip as u64).contains(&read));
    let mosaic = Mosaic::new(vec![opened(Some(strip)), opened(Some(0)), one]).expect("they fit");
    assert_eq!(mosaic.memory_bytes(), 2 * strip as u64);
    assert_eq!(mosaic.read_bytes(100), 800 + read);
}

#[test]
fn mosaics_take_the_later_and_fill_its_voids() {
    let folder = TempDir::new().expect("a folder");
    let grid = |west: f64, values: &str| {
        format!("ncols 2\nnrows 2\nxllcorner {west}\nyllcorner 0\ncellsize 1\n{values}\n")
    };
    let file = |name: &str, text: &str| {
        open(
            &save(&folder, name, text.as_bytes()),
            &OpenOptions::default(),
        )
        .expect("a grid")
    };
    let one = file("one.asc", &grid(0.0, "1 2 3 4"));
    let two = file("two.asc", &grid(1.0, "5 6 -9999 8"));
    let far = file("far.asc", &grid(4.0, "9 9 9 9"));
    let mosaic = Mosaic::new(vec![one, two, far]).expect("they fit");
    assert_eq!(
        (mosaic.header().grid.columns, mosaic.header().grid.rows),
        (6, 2)
    );
    let heights = read_all(&mosaic).expect("readable");
    let expected = [
        1.0,
        5.0,
        6.0,
        f64::NAN,
        9.0,
        9.0,
        3.0,
        4.0,
        8.0,
        f64::NAN,
        9.0,
        9.0,
    ];
    let equal = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
    assert!(heights.iter().zip(&expected).all(equal), "{heights:?}");

    let error = |name: &str, text: &str| {
        let rasters = vec![file("one.asc", &grid(0.0, "1 2 3 4")), file(name, text)];
        Mosaic::new(rasters)
            .err()
            .expect("they do not fit")
            .to_string()
    };
    assert!(error("off.asc", &grid(0.5, "1 2 3 4")).starts_with("one.asc and off.asc do not fit"));
    let coarse = grid(0.0, "1 2 3 4").replace("cellsize 1", "cellsize 2");
    assert!(error("coarse.asc", &coarse).contains("apart"));
    assert!(Mosaic::new(Vec::new()).is_err());
}

#[test]
fn one_sample_is_a_raster_and_none_is_an_error() {
    let folder = TempDir::new().expect("a folder");
    let text = "ncols 1\nnrows 1\nxllcenter 3\nyllcenter 4\ncellsize 10\n7.5";
    let raster = open(
        &save(&folder, "a.asc", text.as_bytes()),
        &OpenOptions::default(),
    )
    .expect("a grid");
    assert_eq!(
        (raster.header().grid.origin, raster.header().integer),
        ([3.0, 4.0], false)
    );
    assert_eq!(read_all(&*raster).expect("readable"), [7.5]);
    for (name, bytes) in [
        ("empty.tif", &b""[..]),
        ("text.tif", b"<html>"),
        ("x.hgt", b"12"),
        ("y", b"II*"),
    ] {
        let error = open(&save(&folder, name, bytes), &OpenOptions::default())
            .err()
            .expect(name);
        assert!(error.to_string().starts_with(name), "{error}");
    }
    let missing = open(&folder.path().join("none.tif"), &OpenOptions::default());
    assert!(matches!(missing.err(), Some(DemError::Io { .. })));
}

#[test]
fn a_rows_from_the_south_world_file_turns_an_image() {
    let folder = TempDir::new().expect("a folder");
    let image = ::image::RgbImage::from_raw(1, 2, vec![1, 2, 3, 4, 5, 6]).expect("two pixels");
    let path = folder.path().join("a.png");
    image.save(&path).expect("a PNG");
    save(&folder, "a.pgw", b"2 0 0 2 11 21");
    let image = open_image(&path, &OpenOptions::default()).expect("readable");
    let all = pixels(&path).expect("readable");
    assert_eq!(all, [[4, 5, 6, 255], [1, 2, 3, 255]]);
    let extent = image.extent.expect("placed");
    assert_eq!((extent.min, extent.max), ([10.0, 20.0], [12.0, 24.0]));
}

/// A TIFF of 3 × 2 pixels of 8 bits, four bands and so much else.
fn small_tiff(extra: Option<u16>, nodata: Option<&str>) -> Vec<u8> {
    let pixels: Vec<u8> = (0..3 * 2)
        .flat_map(|at| [40 * at, 10, 20, if at == 4 { 128 } else { 255 * (at % 2) }])
        .collect();
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).expect("a header");
    let mut image = encoder
        .new_image::<colortype::RGBA8>(3, 2)
        .expect("an image");
    image.rows_per_strip(1).expect("before any strip");
    let mut tag = |tag: u16, values: &[u16]| {
        image
            .encoder()
            .write_tag(Tag::Unknown(tag), values)
            .expect("a tag");
    };
    tag(338, &[extra.unwrap_or(0)]);
    if let Some(nodata) = nodata {
        image
            .encoder()
            .write_tag(Tag::Unknown(42113), nodata)
            .expect("a tag");
    }
    image.write_data(&pixels).expect("pixels");
    file.into_inner()
}

#[test]
fn a_picture_has_nothing_where_its_alpha_or_its_value_for_nothing_says_so() {
    let folder = TempDir::new().expect("a folder");
    let read = |extra, nodata| {
        let path = save(&folder, "a.tif", &small_tiff(extra, nodata));
        pixels(&path).expect("readable")
    };
    assert_eq!(
        read(None, None)[2..4],
        [[80, 10, 20, 255], [120, 10, 20, 255]]
    );
    let straight = read(Some(2), None);
    assert_eq!(
        straight[2..5],
        [[0; 4], [120, 10, 20, 255], [160, 10, 20, 128]]
    );
    assert_eq!(read(Some(1), None)[4], [255, 20, 40, 128]);
    // All colours must have the value.
    assert!(read(None, Some("10")).iter().all(|pixel| pixel[3] == 255));
    let grey = ::image::GrayImage::from_raw(2, 1, vec![7, 8]).expect("two pixels");
    let path = folder.path().join("grey.png");
    grey.save(&path).expect("a PNG");
    assert_eq!(
        pixels(&path).expect("readable"),
        [[7, 7, 7, 255], [8, 8, 8, 255]]
    );
}

#[test]
fn windows_of_a_picture_are_parts_of_the_whole_and_no_larger() {
    let folder = TempDir::new().expect("a folder");
    let path = save(&folder, "a.tif", &small_tiff(None, None));
    let image = open_image(&path, &OpenOptions::default()).expect("readable");
    let window = Window {
        row: 1,
        column: 1,
        rows: 1,
        columns: 2,
    };
    let mut part = [[0; 4]; 2];
    image.read(window, &mut part).expect("inside");
    assert_eq!(part, pixels(&path).expect("readable")[4..]);
    assert!(image.read(window, &mut [[0; 4]; 3]).is_err());
    let outside = image.read(Window { row: 2, ..window }, &mut part);
    assert!(matches!(outside, Err(DemError::Window { .. })));
}
