//! Golden pictures: what was looked at and found right once stays so.
//!
//! `golden/NAME.png` is at most 256 pixels a side and 16 KiB; `UPDATE_GOLDEN=1` rewrites it, and whoever did looks at it
//! before committing. A picture that differs is left as `target/golden/NAME.png` beside the old one, `NAME.old.png`.
//! Golden pictures are stored in steps of [`STEP`], without which relief takes twice the bytes.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use drumlin::{Headless, Look, Pace, Terrain, TerrainDescriptor, View};
use image::{
    ExtendedColorType, ImageEncoder, Rgb, RgbImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use crate::{
    features,
    imagery::{self, Motif},
    picture,
    support::{rainier_pyramid, root},
};

const SIZE: [u32; 2] = [192, 108];
const MOST_BYTES: u64 = 16 << 10;
/// Stored colours are multiples of this, so they are up to half of it off.
const STEP: u8 = 4;
/// What adapters may differ by in a pixel they agree to be on one surface: slopes, light and the sRGB curve are rounded
/// differently, by a step of 255 each at most. Half a stored step comes on top.
const ROUNDING: u8 = 3;
/// Linear sky behind the ground.
const SKY: [f64; 4] = [0.47, 0.63, 0.83, 1.0];

/// Share of pixels, 0 to 1, of which a channel is further off than rounding explains.
fn share_of_others(new: &RgbImage, old: &RgbImage) -> f64 {
    assert_eq!(new.dimensions(), old.dimensions());
    let is_other = |(new, old): &(&Rgb<u8>, &Rgb<u8>)| {
        (0..3).any(|at| new.0[at].abs_diff(old.0[at]) > STEP / 2 + ROUNDING)
    };
    let others = new.pixels().zip(old.pixels()).filter(is_other).count();
    others as f64 / f64::from(new.width() * new.height())
}

fn golden(name: &str) -> PathBuf {
    root().join(format!("tests/golden/{name}.png"))
}

/// Writes a picture in as few bytes as a PNG takes.
fn write(path: &Path, picture: &RgbImage) {
    let folder = path.parent().expect("a file lies in a folder");
    fs::create_dir_all(folder).expect("a folder can be made");
    let mut bytes = Vec::new();
    let (width, height) = picture.dimensions();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
        .write_image(picture, width, height, ExtendedColorType::Rgb8)
        .expect("a PNG");
    fs::write(path, bytes).expect("a picture can be written");
}

/// The nearest colours that are stored.
fn stored(picture: &RgbImage) -> RgbImage {
    let mut picture = picture.clone();
    for value in picture.iter_mut() {
        *value = value.saturating_add(STEP / 2) / STEP * STEP;
    }
    picture
}

/// Asks that a picture is the golden one but for rounding and `share` of its pixels; rewrites that when told to.
fn check(name: &str, picture: &RgbImage, share: f64) {
    let path = golden(name);
    if env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1") {
        write(&path, &stored(picture));
    }
    let old = image::open(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; UPDATE_GOLDEN=1 makes it", path.display()))
        .into_rgb8();
    let bytes = fs::metadata(&path).expect("it was just read").len();
    assert!(
        bytes <= MOST_BYTES,
        "{name} takes {bytes} bytes of {MOST_BYTES}"
    );
    let others = share_of_others(picture, &old);
    if others > share {
        let new = root().join(format!("target/golden/{name}.png"));
        write(&new, picture);
        fs::copy(&path, new.with_extension("old.png")).expect("a picture can be copied");
        panic!(
            "{name}: {others} of the pixels differ, allowed are {share}; see {}",
            new.display()
        );
    }
}

fn draw(gpu: &Headless, terrain: &mut Terrain, view: &View, name: &str) -> RgbImage {
    let (_, color) = picture::draw(gpu, terrain, view, SKY, &format!("golden_{name}.png"));
    let (pixels, _) = color.as_chunks::<4>();
    let colors = pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
    RgbImage::from_raw(view.width, view.height, colors).expect("three bytes a pixel")
}

fn terrain(gpu: &Headless, pyramid: &Path, look: Look) -> Terrain {
    let descriptor = TerrainDescriptor {
        pace: Pace::Complete,
        vram_budget_bytes: 256 << 20,
        look,
        ..TerrainDescriptor::at(pyramid)
    };
    Terrain::new(&gpu.device, &gpu.queue, descriptor).expect("a terrain")
}

/// Mt Rainier from the south-west.
fn rainier_view(terrain: &Terrain) -> View {
    let [a, b] = terrain.world_from_crs();
    let world = |[x, y, z]: [f64; 3]| [a[0] * x + a[1] * y + a[2], b[0] * x + b[1] * y + b[2], z];
    let eye = world([-121.83, 46.80, 3300.0]);
    View::looking_at(eye, world([-121.76, 46.852, 3500.0]), 0.75, SIZE)
}

/// The view from a camera turned by a pixel to the right.
fn turned(view: &View) -> View {
    let (sin, cos) = view.pixels_per_radian().recip().sin_cos();
    let mix = |a: [f64; 3], b: [f64; 3], share: f64| {
        [0, 1, 2].map(|axis| cos * a[axis] + share * b[axis])
    };
    View {
        forward: mix(view.forward, view.right, sin),
        right: mix(view.right, view.forward, -sin),
        ..*view
    }
}

/// Asks that a tolerance does not hide a picture that is another one.
fn assert_noticed(name: &str, picture: &RgbImage, share: f64) {
    let old = image::open(golden(name))
        .expect("it was just read")
        .into_rgb8();
    let others = share_of_others(picture, &old);
    println!("{name}: {others} of the pixels differ, allowed are {share}");
    assert!(others > share, "{name}: {others}");
}

/// The skyline is a pixel in each column, one of a hundred; adapters may place it differently in all of them.
const SILHOUETTES: f64 = 0.01;
/// Lines of triangles cover a third of that picture's ground, and their rims are soft: a line moved by a tenth of a pixel
/// changes up to a tenth of their pixels by more than rounding, a thirtieth of all.
const LINES: f64 = 0.034;
/// The rims of fields that are larger than pixels are a pixel wide and about one of forty; adapters that filter in steps
/// of a 256th of a texel differ by less than rounding in most of them.
const FIELDS: f64 = 0.02;

#[test]
fn mt_rainier_looks_as_it_did() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu, rainier_pyramid(), Look::default());
    let view = rainier_view(&terrain);
    let picture = draw(&gpu, &mut terrain, &view, "rainier");
    check("rainier", &picture, SILHOUETTES);
    let aside = draw(&gpu, &mut terrain, &turned(&view), "rainier_turned");
    assert_noticed("rainier", &aside, SILHOUETTES);

    // Nor is the sun a tenth of a right angle on.
    let look = terrain.look();
    let [sin, cos] = [0.157_f32.sin(), 0.157_f32.cos()];
    let [x, y, z] = look.sun;
    let sun = [cos * x - sin * y, sin * x + cos * y, z];
    terrain.set_look(Look { sun, ..look });
    let lit = draw(&gpu, &mut terrain, &view, "rainier_lit");
    assert_noticed("rainier", &lit, SILHOUETTES);
}

#[test]
fn depths_and_triangles_look_as_they_did() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let look = Look {
        depth_colors: true,
        wireframe: true,
        ..Look::default()
    };
    let mut terrain = terrain(&gpu, rainier_pyramid(), look);
    // Coarse, so that triangles are larger than their lines.
    terrain.set_error_px(4.0);
    let view = rainier_view(&terrain);
    let picture = draw(&gpu, &mut terrain, &view, "depths");
    check("depths", &picture, LINES);
    let aside = draw(&gpu, &mut terrain, &turned(&view), "depths_turned");
    assert_noticed("depths", &aside, LINES);
}

#[test]
fn a_rock_arch_looks_as_it_did() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = features::terrain(&gpu);
    let view = features::below_the_arch(&terrain, SIZE);
    let picture = draw(&gpu, &mut terrain, &view, "arch");
    check("arch", &picture, SILHOUETTES);
    let aside = draw(&gpu, &mut terrain, &turned(&view), "arch_turned");
    assert_noticed("arch", &aside, SILHOUETTES);
}

#[test]
fn a_picture_on_the_ground_looks_as_it_did() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let pyramid = imagery::pyramid("golden", Some(Motif::Fields));
    let mut terrain = terrain(&gpu, &pyramid, Look::default());
    // Over the picture's south-western corner: bare ground, single fields, and fields smaller than pixels.
    let view = View::looking_at(
        [-3150.0, -2250.0, 300.0],
        [-2500.0, -1500.0, 100.0],
        0.9,
        SIZE,
    );
    let picture = draw(&gpu, &mut terrain, &view, "imagery");
    check("imagery", &picture, FIELDS);
    let aside = draw(&gpu, &mut terrain, &turned(&view), "imagery_turned");
    assert_noticed("imagery", &aside, FIELDS);
}
