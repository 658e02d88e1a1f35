//! Formats other than GeoTIFF, mosaics and imagery: the shared files against each other.

use super::super::*;
use super::{golden, heights, pixels, read_all, shared};
use crate::geo::CrsKind;

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
    let image = open_image(
        &folder.join("everest_landsat7_RGB.tif"),
        &OpenOptions::default(),
    )
    .expect("a TIFF");
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
        let pixels = pixels(&folder.join(name)).expect(name);
        assert!(pixels.iter().any(|pixel| pixel[0] != pixel[2]), "{name}");
    }
    let text = pixels(&folder.join("SainteHelens.dem")).expect_err("not an image");
    assert!(text.to_string().contains("not an image"));
}
