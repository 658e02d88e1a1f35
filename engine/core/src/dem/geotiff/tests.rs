use std::fs;

use super::*;
use crate::dem::{OpenOptions, open};
use crate::geo::{CrsKind, Ellipsoid};

fn grid(rows: u32, columns: u32) -> Grid {
    Grid {
        columns,
        rows,
        origin: [500_000.0, 4_000_000.0],
        step: [10.0, -10.0],
    }
}

fn height(row: u32, column: u32) -> f32 {
    0.25 * (row * 3 + column) as f32
}

fn fill(window: Window, out: &mut [f32]) -> Result<(), DemError> {
    for (row, out) in (window.row..).zip(out.chunks_exact_mut(window.columns as usize)) {
        for (column, out) in (window.column..).zip(out) {
            *out = height(row, column);
        }
    }
    Ok(())
}

fn write(layout: &GeoTiffLayout<'_>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let mut file = File::create(&path).unwrap();
    let mut writer = GeoTiffWriter::new(&mut file, &path, layout).unwrap();
    for image in (0..layout.image_shapes().len()).rev() {
        writer.write_image(image, fill, |_| {}).unwrap();
    }
    writer.finish().unwrap();
    (folder, path)
}

fn check(layout: &GeoTiffLayout<'_>) {
    let (_folder, path) = write(layout);
    let raster = open(&path, &OpenOptions::default()).unwrap();
    let header = raster.header();
    assert_eq!(&header.grid, layout.grid);
    assert!(header.georeferenced);
    assert_eq!(header.crs.kind, layout.crs.kind);
    assert_eq!(header.crs.code, layout.crs.code);
    assert_eq!(header.crs.unit_metres, layout.crs.unit_metres);
    let whole = Window::whole(&header.grid);
    let mut found = vec![0.0; (whole.rows * whole.columns) as usize];
    raster.read(whole, &mut found).unwrap();
    let columns = whole.columns;
    for (at, found) in (0..).zip(found) {
        assert_eq!(found, f64::from(height(at / columns, at % columns)));
    }
}

#[test]
fn what_is_written_is_read() {
    let utm = Crs {
        kind: CrsKind::Projected,
        code: Some("EPSG:32633".into()),
        ..Crs::unknown()
    };
    let feet = Crs {
        unit_metres: 0.3048,
        code: None,
        name: Some("somewhere".into()),
        ..utm.clone()
    };
    for crs in [Crs::unknown(), Crs::wgs84(), utm, feet] {
        for (rows, columns) in [(1, 1), (512, 512), (513, 700)] {
            for compression in [Compression::None, Compression::Zstd(1)] {
                check(&GeoTiffLayout {
                    grid: &grid(rows, columns),
                    crs: &crs,
                    voids: rows == 1,
                    compression,
                    overviews: columns == 700,
                });
            }
        }
    }
}

#[test]
fn the_ellipsoid_of_another_planet_is_kept() {
    let moon = Crs {
        kind: CrsKind::Geographic,
        code: None,
        ellipsoid: Ellipsoid::MOON,
        ..Crs::unknown()
    };
    let (_folder, path) = write(&GeoTiffLayout {
        grid: &grid(3, 4),
        crs: &moon,
        voids: false,
        compression: Compression::None,
        overviews: false,
    });
    let raster = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(raster.header().crs.ellipsoid, Ellipsoid::MOON);
}

#[test]
fn overviews_halve_down_to_one_tile() {
    let crs = Crs::unknown();
    let layout = |rows, columns| GeoTiffLayout {
        grid: Box::leak(Box::new(grid(rows, columns))),
        crs: &crs,
        voids: false,
        compression: Compression::None,
        overviews: true,
    };
    assert_eq!(layout(512, 3).image_shapes(), [[512, 3]]);
    assert_eq!(
        layout(2049, 513).image_shapes(),
        [[2049, 513], [1025, 257], [513, 129], [257, 65]]
    );
}

#[test]
fn a_file_that_may_pass_four_gibibytes_is_a_bigtiff() {
    let header = |rows, columns| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        let grid = grid(rows, columns);
        let layout = GeoTiffLayout {
            grid: &grid,
            crs: &Crs::unknown(),
            voids: true,
            compression: Compression::Zstd(1),
            overviews: true,
        };
        let mut file = File::create(&path).unwrap();
        let mut writer = GeoTiffWriter::new(&mut file, &path, &layout).unwrap();
        // Void from end to end: no tile is stored.
        let void = |_: Window, out: &mut [f32]| -> Result<(), DemError> {
            out.fill(f32::NAN);
            Ok(())
        };
        let last = layout.image_shapes().len() - 1;
        writer.write_image(last, void, |_| {}).unwrap();
        writer.finish().unwrap();
        let raster = open(&path, &OpenOptions::default()).unwrap();
        let mut found = [0.0; 4];
        let window = Window {
            row: rows - 2,
            column: columns - 2,
            rows: 2,
            columns: 2,
        };
        raster.read(window, &mut found).unwrap();
        assert!(found.iter().all(|height| height.is_nan()));
        fs::read(&path).unwrap()[..4].to_vec()
    };
    assert_eq!(header(20_000, 20_000), b"II\x2a\0");
    assert_eq!(header(40_000, 40_000), b"II\x2b\0");
}

#[test]
fn a_raster_becomes_a_file_of_the_same_heights() {
    let window = Window {
        row: 70,
        column: 30,
        rows: 600,
        columns: 530,
    };
    let synth = crate::dem::Synth::new(1, window).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let mut file = File::create(&path).unwrap();
    let mut told = Vec::new();
    write_raster(
        &synth,
        Compression::Zstd(1),
        &mut file,
        &path,
        |done, total| {
            told.push([done, total]);
        },
    )
    .unwrap();
    assert_eq!(told.last(), Some(&[4, 4]));
    let raster = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(raster.header().grid, synth.header().grid);
    let whole = Window::whole(&synth.header().grid);
    let read = |raster: &dyn Raster| {
        let mut out = vec![0.0; (whole.rows * whole.columns) as usize];
        raster.read(whole, &mut out).unwrap();
        out
    };
    assert!(read(&*raster) == read(&synth));
}
