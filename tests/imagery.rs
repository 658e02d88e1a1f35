//! Pictures laid over the ground: drawn where they lie, in their own colours, alike on both sides of tiles' borders, calm
//! where texels are smaller than pixels, and bare ground beyond their edge.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use drumlin::{Headless, Look, Offscreen, Pace, Terrain, TerrainDescriptor, View};
use image::{ExtendedColorType, ImageBuffer, Luma, Rgb, RgbImage};

use crate::support::{drumlin_ok, folder};

const SIZE: [u32; 2] = [320, 180];
/// Samples of the flat ground, ten metres apart: six by four finest tiles.
const SAMPLES: [u32; 2] = [700, 500];
const STEP: f64 = 10.0;
/// World metres of the picture's box: west and south, east and north. The ground reaches 3,495 m west and east, and
/// 2,495 m south and north.
const PICTURE: [[f64; 2]; 2] = [[-3000.0, -2000.0], [2500.0, 1800.0]];
/// Metres of a pixel of the picture: about a texel of the finest tiles.
const PIXEL: f64 = 5.0;
/// As far from the picture's edge every level shows what is inside alone: three texels of the coarsest, 40 m each.
const EDGE: f64 = 120.0;

/// The stored colour of the gradient at world x and y.
fn gradient(at: [f64; 2]) -> [f64; 3] {
    let [[west, south], [east, north]] = PICTURE;
    let [x, y] = [
        (at[0] - west) / (east - west),
        (north - at[1]) / (north - south),
    ];
    [40.0 + 160.0 * x, 200.0 - 150.0 * y, 90.0]
}

/// A gradient of many colours, and fields of twenty metres in black and white.
#[derive(Clone, Copy)]
enum Motif {
    Gradient,
    Fields,
}

impl Motif {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "colours of the gradient lie between 40 and 200"
    )]
    fn image(self) -> RgbImage {
        let [[west, south], [east, north]] = PICTURE;
        let pixels = [(east - west) / PIXEL, (north - south) / PIXEL].map(|count| count as u32);
        RgbImage::from_fn(pixels[0], pixels[1], |column, row| match self {
            Self::Gradient => {
                let x = west + PIXEL * (f64::from(column) + 0.5);
                let y = north - PIXEL * (f64::from(row) + 0.5);
                Rgb(gradient([x, y]).map(|value| value.round() as u8))
            }
            Self::Fields => Rgb([if (column / 4 + row / 4) % 2 == 0 {
                255
            } else {
                0
            }; 3]),
        })
    }
}

/// Six lines beside an image: where it lies.
fn world_file(image: &Path, step: f64, corner: [f64; 2]) {
    let [x, y] = corner;
    let text = format!("{step}\n0\n0\n-{step}\n{x}\n{y}\n");
    std::fs::write(image.with_extension("pgw"), text).expect("a world file");
}

/// Flat ground, 100 m high, whose CRS coordinates are world metres.
fn ground(folder: &Path) -> PathBuf {
    let path = folder.join("ground.png");
    let [columns, rows] = SAMPLES;
    ImageBuffer::from_pixel(columns, rows, Luma([1000_u16]))
        .save(&path)
        .expect("a PNG");
    let corner = [-1.0, 1.0].map(|sign| sign * STEP / 2.0);
    world_file(
        &path,
        STEP,
        [
            corner[0] * f64::from(columns - 1),
            corner[1] * f64::from(rows - 1),
        ],
    );
    path
}

/// A pyramid of the flat ground, with or without a picture.
fn pyramid(name: &str, motif: Option<Motif>) -> PathBuf {
    let folder = folder(&format!("imagery_{name}"));
    let out = folder.join("ground.zarr");
    let mut arguments: Vec<OsString> = vec!["build".into(), ground(&folder).into()];
    arguments.extend([
        "--scale".into(),
        "0.1".into(),
        "-o".into(),
        out.clone().into(),
    ]);
    if let Some(motif) = motif {
        let picture = folder.join("picture.png");
        motif.image().save(&picture).expect("a PNG");
        let [[west, _], [_, north]] = PICTURE;
        world_file(&picture, PIXEL, [west + 0.5 * PIXEL, north - 0.5 * PIXEL]);
        arguments.extend(["--imagery".into(), picture.into()]);
    }
    drumlin_ok(&arguments);
    out
}

fn gradient_pyramid() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| pyramid("gradient", Some(Motif::Gradient)))
}

/// What a view sees of a pyramid in clear air, red, green and blue as stored.
fn draw(gpu: &Headless, pyramid: &Path, view: &View, name: &str) -> Vec<[u8; 3]> {
    let descriptor = TerrainDescriptor {
        pace: Pace::Complete,
        vram_budget_bytes: 128 << 20,
        look: Look {
            haze: Some(0.0),
            ..Look::default()
        },
        ..TerrainDescriptor::at(pyramid)
    };
    let mut terrain = Terrain::new(&gpu.device, &gpu.queue, descriptor).expect("a terrain");
    let target = Offscreen::new(&gpu.device, SIZE);
    let report = terrain.update(view);
    assert!(report.errors.is_empty(), "{:?}", report.errors);
    assert_eq!(report.stats.colors_missing, 0);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    terrain.prepare(&gpu.device, &gpu.queue, &mut encoder);
    terrain.draw(&mut target.color_pass(&mut encoder, [1.0, 0.0, 1.0, 1.0], None));
    gpu.queue.submit([encoder.finish()]);
    let color = target.read_color(&gpu.device, &gpu.queue).expect("colours");
    gpu.finish().expect("no complaint");
    if let Some(folder) = std::env::var_os("DRUMLIN_PICTURES") {
        let path = Path::new(&folder).join(name);
        let [width, height] = SIZE;
        image::save_buffer(path, &color, width, height, ExtendedColorType::Rgba8).expect("a PNG");
    }
    let (pixels, _) = color.as_chunks::<4>();
    pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}

/// World x and y that each pixel's centre shows; none above the horizon.
fn places(view: &View) -> Vec<Option<[f64; 2]>> {
    let k = view.pixels_per_radian();
    let [width, height] = SIZE.map(f64::from);
    let place = |index: u32| {
        let side = (f64::from(index % SIZE[0]) + 0.5 - 0.5 * width) / k;
        let rise = (0.5 * height - f64::from(index / SIZE[0]) - 0.5) / k;
        let ray: [f64; 3] = std::array::from_fn(|axis| {
            view.forward[axis] + side * view.right[axis] + rise * view.up[axis]
        });
        let along = (100.0 - view.eye[2]) / ray[2];
        (along > 0.0).then(|| [0, 1].map(|axis| view.eye[axis] + along * ray[axis]))
    };
    (0..SIZE[0] * SIZE[1]).map(place).collect()
}

/// How far inside the picture a place is, metres; negative outside.
fn inside(at: [f64; 2]) -> f64 {
    let [low, high] = PICTURE;
    (0..2)
        .map(|axis| (at[axis] - low[axis]).min(high[axis] - at[axis]))
        .fold(f64::INFINITY, f64::min)
}

/// Metres from a pixel's place to those of the pixels to its left and above, the larger; infinite at the picture's rim
/// and the horizon.
fn spread(places: &[Option<[f64; 2]>], index: usize) -> f64 {
    let width = SIZE[0] as usize;
    let apart = |other: Option<usize>| {
        let (a, b) = (places[index]?, (*places.get(other?)?)?);
        Some((a[0] - b[0]).hypot(a[1] - b[1]))
    };
    let left = apart((index % width).checked_sub(1).map(|_| index - 1));
    let above = apart(index.checked_sub(width));
    left.zip(above)
        .map_or(f64::INFINITY, |(left, above)| left.max(above))
}

fn is_on_the_ground(at: [f64; 2]) -> bool {
    (0..2).all(|axis| at[axis].abs() < 0.5 * STEP * f64::from(SAMPLES[axis] - 1))
}

fn view(eye: [f64; 3], target: [f64; 2]) -> View {
    View::looking_at(eye, [target[0], target[1], 100.0], 0.9, SIZE)
}

/// Straight down on a corner of four finest tiles (near enough to show single texels); over all the ground; and aslant,
/// from near texels of several pixels to far ones much smaller than a pixel.
fn views() -> [View; 3] {
    let corner = [-3495.0 + 3.0 * 1280.0, 2495.0 - 2.0 * 1280.0];
    [
        view([corner[0], corner[1] - 1.0, 500.0], corner),
        view([0.0, -1500.0, 7000.0], [0.0, 0.0]),
        view([-800.0, -1700.0, 220.0], [300.0, 1500.0]),
    ]
}

#[test]
fn a_picture_has_its_own_colours_at_its_own_places_across_tile_borders() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    for (at, view) in views().iter().enumerate() {
        let name = format!("imagery_gradient_{at}.png");
        let colors = draw(&gpu, gradient_pyramid(), view, &name);
        let (mut seen, places) = (0, places(view));
        for (index, (color, place)) in colors.iter().zip(&places).enumerate() {
            let spread = spread(&places, index);
            let Some(place) = place.filter(|place| inside(*place) > EDGE + spread) else {
                continue;
            };
            seen += 1;
            // Half a step of 255 each is lost where the picture is sampled, at up to three coarser levels, in the smaller
            // version and in the target. Beside a tile's border the far half of a pixel's texels is taken for the
            // border's, which moves their mean by a quarter of the pixel, and the gradient has 0.04 steps a metre.
            let (expected, allowed) = (gradient(place), 3.0 + 0.01 * spread);
            let wrong = (0..3)
                .map(|channel| (f64::from(color[channel]) - expected[channel]).abs())
                .fold(0.0, f64::max);
            assert!(
                wrong <= allowed,
                "view {at}: {color:?} is not {expected:?} at {place:?}"
            );
        }
        assert!(
            seen > 10_000,
            "view {at} shows {seen} pixels of the picture"
        );
    }
}

#[test]
fn beyond_the_picture_the_ground_is_bare_and_its_edge_has_no_dark_seam() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let bare = pyramid("bare", None);
    let [_, view, _] = views();
    let with = draw(&gpu, gradient_pyramid(), &view, "imagery_edge.png");
    let without = draw(&gpu, &bare, &view, "imagery_bare.png");
    let mut counts = [0, 0];
    for ((with, without), place) in with.iter().zip(&without).zip(places(&view)) {
        let Some(place) = place.filter(|place| is_on_the_ground(*place)) else {
            continue;
        };
        if inside(place) < -EDGE {
            assert_eq!(with, without, "at {place:?}");
            counts[0] += 1;
        } else if inside(place) < EDGE {
            // A mixture lies between the two, but for rounding.
            let picture = gradient(place);
            for channel in 0..3 {
                let [a, b] = [f64::from(without[channel]), picture[channel]];
                let value = f64::from(with[channel]);
                let between = a.min(b) - 4.0..=a.max(b) + 4.0;
                assert!(between.contains(&value), "{with:?} at {place:?}");
            }
            counts[1] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 500), "{counts:?}");
}

#[test]
fn texels_much_smaller_than_pixels_become_their_mean() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let fields = pyramid("fields", Some(Motif::Fields));
    let [_, _, view] = views();
    let colors = draw(&gpu, &fields, &view, "imagery_fields.png");
    let places = places(&view);
    let (mut seen, mut near) = (0, [255, 0]);
    for (index, color) in colors.iter().enumerate() {
        let metres = spread(&places, index);
        let Some(here) = places[index].filter(|here| inside(*here) > EDGE + metres) else {
            continue;
        };
        if metres > 80.0 {
            // A pixel covers four fields or more one way, so an eighth of the light at most is left of their difference;
            // as much again for the filter's shape: a quarter to three quarters of the light, stored 137 to 225.
            assert!((137..=225).contains(&color[0]), "{color:?} at {here:?}");
            seen += 1;
        } else if metres < 2.5 {
            near = [near[0].min(color[0]), near[1].max(color[0])];
        }
    }
    assert!(seen > 1000, "{seen} pixels are far away");
    assert!(near[0] < 10 && near[1] > 245, "near fields are {near:?}");
}
