//! An arch of stone in the ground, streamed and drawn: no gap along its border, daylight under it.

use std::{ffi::OsString, sync::Arc};

use drumlin::{Headless, Look, Pace, Terrain, TerrainDescriptor, TerrainSource, View};
use drumlin_tests::scene::HillSource;

use crate::{
    picture,
    support::{drumlin_ok, folder, rainier},
};

const SIZE: [u32; 2] = [640, 360];

/// World x and y of the arch's middle; it spans 80 m from west to east.
const ARCH: [f64; 2] = [-512.0, 886.0];

/// A hill with the arch in it, which waits for its tiles.
pub(crate) fn terrain(gpu: &Headless) -> Terrain {
    let source = Arc::new(HillSource::with_arch());
    let descriptor = TerrainDescriptor {
        pace: Pace::Complete,
        vram_budget_bytes: 64 << 20,
        ..TerrainDescriptor::with_source(TerrainSource::Tiles(source))
    };
    Terrain::new(&gpu.device, &gpu.queue, descriptor).expect("a terrain")
}

/// Metres along the view axis for every pixel; features drawn.
fn draw(gpu: &Headless, terrain: &mut Terrain, name: &str, view: &View) -> (usize, Vec<f32>) {
    let (report, target) = picture::frame(gpu, terrain, view, |terrain, target, encoder| {
        terrain.draw(&mut target.color_pass(encoder, [1.0, 0.0, 1.0, 1.0], None));
        terrain.draw_distances(&mut target.distance_pass(encoder));
    });
    let distances = target
        .read_distance(&gpu.device, &gpu.queue)
        .expect("distances");
    picture::color(gpu, &target, name);
    (report.stats.features_drawn, distances)
}

fn ground(terrain: &Terrain) -> f64 {
    terrain
        .height_at([ARCH[0], ARCH[1] - 40.0])
        .expect("it can be read")
        .expect("ground")
}

/// From the south, low enough to see the sky under the arch.
pub(crate) fn below_the_arch(terrain: &Terrain, size: [u32; 2]) -> View {
    let z = ground(terrain);
    let eye = [ARCH[0] + 60.0, ARCH[1] - 130.0, z + 60.0];
    View::looking_at(eye, [ARCH[0], ARCH[1], z + 10.0], 0.8, size)
}

#[test]
fn an_arch_has_no_gap_along_its_border_from_any_side() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu);
    let z = ground(&terrain);
    // From straight above, and from the north, so that the data's end is out of sight.
    for (at, [turn, out, height]) in [
        [0.0, 1.0, 150.0],
        [0.7, 70.0, 140.0],
        [1.57, 70.0, 110.0],
        [2.4, 70.0, 80.0],
    ]
    .into_iter()
    .enumerate()
    {
        let eye = [
            ARCH[0] + out * f64::cos(turn),
            ARCH[1] - 30.0 + out * f64::sin(turn),
            z + height,
        ];
        let view = View::looking_at(eye, [ARCH[0], ARCH[1] - 30.0, z], 0.5, SIZE);
        let name = format!("arch_above_{at}.png");
        let (features, distances) = draw(&gpu, &mut terrain, &name, &view);
        assert_eq!(features, 1);
        let holes = distances
            .iter()
            .filter(|distance| distance.is_infinite())
            .count();
        assert_eq!(holes, 0, "view {at}");
    }
}

#[test]
fn there_is_daylight_under_the_arch_and_stone_above_it() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu);
    let view = below_the_arch(&terrain, SIZE);
    let (features, distances) = draw(&gpu, &mut terrain, "arch.png", &view);
    assert_eq!(features, 1);
    let is_there =
        |row: usize, column: usize| distances[row * SIZE[0] as usize + column].is_finite();
    // From the top down the middle: sky, the crown, daylight, ground.
    let mut runs = vec![(false, 0)];
    for row in 0..SIZE[1] as usize {
        let found = is_there(row, SIZE[0] as usize / 2);
        match runs.last_mut() {
            Some((same, rows)) if *same == found => *rows += 1,
            _ => runs.push((found, 1)),
        }
    }
    let [(false, sky), (true, crown), (false, daylight), (true, _)] = runs[..] else {
        panic!("{runs:?}");
    };
    assert!(sky > 20 && crown > 20 && daylight > 20, "{runs:?}");
    // Beside the arch there is nothing but sky above ground.
    for column in [20, 100, 500, 620] {
        let mut rows = (0..SIZE[1] as usize).map(|row| is_there(row, column));
        assert!(rows.by_ref().any(|is_ground| is_ground));
        assert!(rows.all(|is_ground| is_ground), "column {column}");
    }
}

#[test]
fn engine_colours_show_the_arch_too_and_far_away_its_ground_is_drawn() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu);
    let z = ground(&terrain);
    let target = [ARCH[0], ARCH[1], z + 10.0];
    terrain.set_look(Look {
        depth_colors: true,
        wireframe: true,
        ..terrain.look()
    });
    let view = below_the_arch(&terrain, SIZE);
    let (features, _) = draw(&gpu, &mut terrain, "arch_depths.png", &view);
    assert_eq!(features, 1);
    let view = View::looking_at([9000.0, -9000.0, 3000.0], target, 0.8, SIZE);
    let (features, _) = draw(&gpu, &mut terrain, "arch_far.png", &view);
    assert_eq!(features, 0);
}

/// The features of the assets, built into Mt Rainier by the command that builds them.
#[test]
fn authored_features_are_built_streamed_and_drawn_without_gaps() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let folder = folder("features");
    let path = folder.join("features.zarr");
    let assets = rainier();
    let assets = assets.parent().expect("a folder");
    let files = ["arch", "cliff", "road"].map(|name| assets.join(format!("rainier_{name}.obj")));
    let mut arguments: Vec<OsString> = vec!["build".into(), rainier().into(), "-o".into()];
    arguments.extend([path.clone().into(), "--features".into()]);
    arguments.extend(files.map(OsString::from));
    drumlin_ok(&arguments);
    let mut terrain = Terrain::new(
        &gpu.device,
        &gpu.queue,
        TerrainDescriptor {
            pace: Pace::Complete,
            ..TerrainDescriptor::at(&path)
        },
    )
    .expect("a terrain");
    // The data has voids of its own.
    terrain.set_look(Look {
        draw_voids: true,
        ..terrain.look()
    });
    let [a, b] = terrain.world_from_crs();
    for (name, [x, y]) in [
        ("arch", [-121.67, 46.92]),
        ("cliff", [-121.835, 46.92]),
        ("road", [-121.67, 46.6]),
    ] {
        let place = [a[0] * x + a[1] * y + a[2], b[0] * x + b[1] * y + b[2]];
        let z = terrain.height_at(place).expect("read").expect("ground");
        for (at, [east, north, up]) in [[0.0, -900.0, 2200.0], [1500.0, 1800.0, 1500.0]]
            .into_iter()
            .enumerate()
        {
            let eye = [place[0] + east, place[1] + north, z + up];
            let view = View::looking_at(eye, [place[0], place[1], z - 200.0], 0.6, SIZE);
            let (features, distances) =
                draw(&gpu, &mut terrain, &format!("{name}_{at}.png"), &view);
            assert!(features > 0, "{name} {at}");
            let holes = distances
                .iter()
                .filter(|distance| distance.is_infinite())
                .count();
            assert_eq!(holes, 0, "{name} {at}");
        }
    }
}
