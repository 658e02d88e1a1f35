//! A flight is true: every pixel's depth against the source raster, and nothing shows through the ground.

use std::{fs, path::Path};

use drumlin_core::{dem, geo::Grid};
use serde_json::{Value, json};

use crate::support::{
    copy_tree, drumlin_fails, drumlin_ok, files, folder, has_gpu, rainier, rainier_pyramid,
};

const WIDTH: usize = 480;
const HEIGHT: usize = 270;

/// A path of a few seconds low over Mt Rainier: the Carbon glacier, the summit, the view to Mt Adams.
fn path_file(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("path.json");
    let key = |t: f64, position: [f64; 3], look_at: [f64; 3]| json!({"t": t, "position": position, "look_at": look_at, "fov_y": 50.0});
    let keys = json!({"keys": [
        key(0.0, [-121.80, 46.97, 3200.0], [-121.76, 46.85, 3500.0]),
        key(1.0, [-121.70, 46.90, 3600.0], [-121.76, 46.85, 4000.0]),
        key(2.0, [-121.72, 46.80, 4300.0], [-121.55, 46.45, 2000.0]),
        key(3.0, [-121.60, 46.60, 5200.0], [-121.49, 46.20, 3000.0]),
    ]});
    fs::write(&path, keys.to_string()).expect("a path can be written");
    path
}

/// Heights of the source raster, read by the reader alone.
struct Source {
    grid: Grid,
    heights: Vec<f64>,
}

impl Source {
    fn open(path: &Path) -> Self {
        let raster = dem::open(path, &dem::OpenOptions::default()).expect("the sample opens");
        let grid = raster.header().grid;
        let mut heights = vec![0.0; grid.rows as usize * grid.columns as usize];
        let all = dem::Window {
            row: 0,
            column: 0,
            rows: grid.rows,
            columns: grid.columns,
        };
        raster.read(all, &mut heights).expect("the sample reads");
        Self { grid, heights }
    }

    /// The height at a CRS place: cells cut from north-west to south-east. None outside and where a corner is void.
    fn height(&self, place: [f64; 2]) -> Option<f64> {
        let [row, column] = self.grid.row_column(place);
        let (rows, columns) = (self.grid.rows as usize, self.grid.columns as usize);
        if row < 0.0 || column < 0.0 || row >= (rows - 1) as f64 || column >= (columns - 1) as f64 {
            return None;
        }
        let (i, j) = (row.floor(), column.floor());
        let (v, u) = (row - i, column - j);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "inside the grid, checked above"
        )]
        let at = i as usize * columns + j as usize;
        let [nw, ne, sw, se] = [0, 1, columns, columns + 1].map(|step| self.heights[at + step]);
        let height = if u > v {
            nw + u * (ne - nw) + v * (se - ne)
        } else {
            nw + v * (sw - nw) + u * (se - sw)
        };
        [nw, ne, sw, se]
            .iter()
            .all(|corner| corner.is_finite())
            .then_some(height)
    }
}

fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| value[axis].as_f64().expect("a number"))
}

/// Pixels' errors in pixels, and how many had none (sky, void, too near or outside).
fn pixel_errors(
    source: &Source,
    cameras: &Value,
    frame: &Value,
    depth: &[f32],
    eps: f64,
) -> (Vec<f64>, usize) {
    let [eye, right, up, forward] =
        ["eye", "right", "up", "forward"].map(|name| three(&frame[name]));
    let fov = frame["fov_y"].as_f64().expect("an angle").to_radians();
    let k = HEIGHT as f64 / (2.0 * (0.5 * fov).tan());
    let affine = [0, 1].map(|row| three(&cameras["world_from_crs"][row]));
    // Diagonal by the definition of the world frame.
    let to_crs = |x: f64, y: f64| {
        [
            (x - affine[0][2]) / affine[0][0],
            (y - affine[1][2]) / affine[1][1],
        ]
    };
    let cell = affine[0][0] * source.grid.step[0].abs();
    let (mut errors, mut without) = (Vec::new(), 0);
    for (index, &along) in depth.iter().enumerate() {
        let along = f64::from(along);
        let x = (index % WIDTH) as f64 + 0.5 - 0.5 * WIDTH as f64;
        let y = 0.5 * HEIGHT as f64 - ((index / WIDTH) as f64 + 0.5);
        let ray = [0, 1, 2].map(|axis| forward[axis] + (x * right[axis] + y * up[axis]) / k);
        let point = [0, 1, 2].map(|axis| eye[axis] + along * ray[axis]);
        let distance = along * ray.iter().map(|part| part * part).sum::<f64>().sqrt();
        let height = along
            .is_finite()
            .then(|| source.height(to_crs(point[0], point[1])))
            .flatten();
        match height {
            Some(height) if cell * k / distance < 8.0 => {
                errors.push(((point[2] - height).abs() - eps).max(0.0) * k / distance);
            }
            _ => without += 1,
        }
    }
    (errors, without)
}

fn depth_image(path: &Path) -> Vec<f32> {
    use exr::prelude::*;
    let image = read_first_flat_layer_from_file(path).expect("the depth frame opens");
    assert_eq!(image.layer_data.size, Vec2(WIDTH, HEIGHT));
    image.layer_data.channel_data.list[0]
        .sample_data
        .values_as_f32()
        .collect()
}

#[test]
fn what_is_drawn_is_the_source_within_a_pixel() {
    if !has_gpu() {
        return;
    }
    let out = folder("truth");
    let (depths, cameras) = (out.join("depth"), out.join("cameras.json"));
    let size = format!("{WIDTH}x{HEIGHT}");
    let path = path_file(&out);
    let pyramid = rainier_pyramid();
    let [pyramid, path, depths_text, cameras_text, frames] =
        [pyramid, &path, &depths, &cameras, &out.join("frames")]
            .map(|path| path.to_str().expect("a plain path").to_owned());
    drumlin_ok([
        "fly",
        &pyramid,
        "--path",
        &path,
        "--size",
        &size,
        "--fps",
        "2",
        "--error-px",
        "1",
        "--wait-for-tiles",
        "--depth-frames",
        &depths_text,
        "--cameras",
        &cameras_text,
        "--frames",
        &frames,
    ]);
    let cameras: Value =
        serde_json::from_slice(&fs::read(&cameras).expect("cameras are written")).expect("JSON");
    let source = Source::open(&rainier());
    let mut images: Vec<_> = fs::read_dir(&depths)
        .expect("depth frames are written")
        .map(|entry| entry.expect("the entry can be read").path())
        .collect();
    images.sort();
    let frames = cameras["frames"].as_array().expect("a list");
    assert_eq!(images.len(), frames.len());
    assert!(frames.len() >= 6);
    for (image, frame) in images.iter().zip(frames) {
        let (mut errors, without) =
            pixel_errors(&source, &cameras, frame, &depth_image(image), 0.5);
        assert!(
            errors.len() > WIDTH * HEIGHT / 10,
            "{}: only {} pixels, {without} without",
            image.display(),
            errors.len()
        );
        errors.sort_by(f64::total_cmp);
        let p99 = errors[errors.len() * 99 / 100];
        let worst = errors[errors.len() - 1];
        println!(
            "{}: p99 {p99:.3} px, worst {worst:.3} px of {} pixels",
            image.display(),
            errors.len()
        );
        assert!(p99 <= 1.0, "{}: p99 {p99} px", image.display());
    }
}

#[test]
fn below_the_horizon_every_pixel_is_ground_while_tiles_arrive_late() {
    if !has_gpu() {
        return;
    }
    let out = folder("late");
    let (depths, cameras) = (out.join("depth"), out.join("cameras.json"));
    let size = format!("{WIDTH}x{HEIGHT}");
    let path = path_file(&out);
    let [pyramid, path, depths_text, cameras_text] = [rainier_pyramid(), &path, &depths, &cameras]
        .map(|path| path.to_str().expect("a plain path").to_owned());
    // No waiting: frames are drawn with what has arrived, from the root tile on.
    drumlin_ok([
        "fly",
        &pyramid,
        "--path",
        &path,
        "--size",
        &size,
        "--fps",
        "8",
        "--depth-frames",
        &depths_text,
        "--cameras",
        &cameras_text,
    ]);
    let cameras: Value =
        serde_json::from_slice(&fs::read(&cameras).expect("cameras are written")).expect("JSON");
    let mut images: Vec<_> = fs::read_dir(&depths)
        .expect("depth frames are written")
        .map(|entry| entry.expect("the entry can be read").path())
        .collect();
    images.sort();
    for (image, _) in images
        .iter()
        .zip(cameras["frames"].as_array().expect("a list"))
    {
        let depth = depth_image(image);
        // In each column, below the first pixel of ground there is ground: voids are drawn filled by default.
        for column in 0..WIDTH {
            let mut seen = false;
            for row in 0..HEIGHT {
                let ground = depth[row * WIDTH + column].is_finite();
                assert!(
                    ground || !seen,
                    "{}: a hole at column {column}, row {row}",
                    image.display()
                );
                seen |= ground;
            }
        }
    }
}

#[test]
fn a_flight_that_waits_for_a_broken_tile_ends_and_names_it() {
    if !has_gpu() {
        return;
    }
    let out = folder("broken");
    let pyramid = out.join("rainier.zarr");
    copy_tree(rainier_pyramid(), &pyramid);
    let mut finest = Vec::new();
    files(&pyramid.join("tile/4"), &mut finest);
    // The second half of a shard holds tiles, and some of those are always seen along the path.
    for file in finest {
        let mut bytes = fs::read(&file).expect("a file can be read");
        let half = bytes.len() / 2;
        bytes[half..].iter_mut().for_each(|byte| *byte ^= 0x10);
        fs::write(&file, bytes).expect("a file can be written");
    }
    let path = path_file(&out);
    let fly = |wait: &[&str]| {
        let [pyramid, path] = [&pyramid, &path].map(|path| path.to_str().expect("a plain path"));
        [
            "fly", pyramid, "--path", path, "--size", "160x90", "--fps", "1",
        ]
        .into_iter()
        .chain(wait.iter().copied())
        .map(str::to_owned)
        .collect::<Vec<_>>()
    };
    let line = drumlin_fails(1, fly(&["--wait-for-tiles"]));
    assert!(line.contains("tile 4/"), "{line}");
    // Who does not wait sees the parents instead, and the flight goes on.
    drumlin_ok(fly(&[]));
}
