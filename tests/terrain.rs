//! A terrain as an application has it: streamed, drawn, asked.

use std::{sync::Arc, time::Duration};

use drumlin::{
    FrameReport, Headless, Offscreen, Pace, Terrain, TerrainDescriptor, TerrainSource, View, wgpu,
};
use drumlin_tests::scene::HillSource;

const SIZE: [u32; 2] = [320, 180];
const BUDGET: u64 = 48 << 20;

fn terrain(gpu: &Headless, pace: Pace, delay: Duration) -> Terrain {
    let source = Arc::new(HillSource::new(delay));
    let descriptor = TerrainDescriptor {
        pace,
        vram_budget_bytes: BUDGET,
        ..TerrainDescriptor::with_source(TerrainSource::Tiles(source))
    };
    Terrain::new(&gpu.device, &gpu.queue, descriptor).expect("a terrain")
}

/// A camera low over the ground on its way across the hill; `share` of the way done.
fn view(share: f64) -> View {
    let eye = [-900.0 + 1300.0 * share, -950.0 + 300.0 * share, 430.0];
    View {
        time: share * 4.0,
        ..View::looking_at(eye, [200.0, 300.0, 60.0], 0.9, SIZE)
    }
}

fn draw(
    gpu: &Headless,
    terrain: &mut Terrain,
    target: &Offscreen,
    view: &View,
) -> (FrameReport, Vec<f32>) {
    let report = terrain.update(view);
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    terrain.prepare(&gpu.device, &gpu.queue, &mut encoder);
    terrain.draw(&mut target.color_pass(&mut encoder, [1.0, 0.0, 1.0, 1.0], None));
    terrain.draw_distances(&mut target.distance_pass(&mut encoder));
    gpu.queue.submit([encoder.finish()]);
    let distances = target
        .read_distance(&gpu.device, &gpu.queue)
        .expect("distances");
    gpu.finish().expect("no complaint");
    (report, distances)
}

/// Columns in which background shows below the first ground.
fn broken_columns(distances: &[f32]) -> usize {
    let [width, height] = SIZE.map(|side| side as usize);
    let is_broken = |column: &usize| {
        let mut rows = (0..height).map(|row| distances[row * width + column].is_finite());
        rows.by_ref().find(|is_ground| *is_ground).is_none() || rows.any(|is_ground| !is_ground)
    };
    (0..width).filter(is_broken).count()
}

#[test]
fn a_complete_frame_lacks_nothing_and_shows_the_surface_that_is_asked() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu, Pace::Complete, Duration::ZERO);
    let target = Offscreen::new(&gpu.device, SIZE);
    let view = view(0.3);
    let (report, distances) = draw(&gpu, &mut terrain, &target, &view);
    assert_eq!((report.stats.tiles_missing, report.errors.len()), (0, 0));
    assert!(report.vram_bytes <= BUDGET, "{} bytes", report.vram_bytes);
    assert_eq!(broken_columns(&distances), 0);

    // Rays through pixel centres meet the surface where the picture shows it: within a pixel's error, doubled for the
    // slope under which the ray meets the ground, on all but the few pixels of silhouettes.
    let k = view.pixels_per_radian();
    let mut wrong = 0;
    for (i, j) in (0..180)
        .step_by(12)
        .flat_map(|j| (0..320).step_by(16).map(move |i| (i, j)))
    {
        let shown = f64::from(distances[j * 320 + i]);
        let side = (i as f64 + 0.5 - 160.0) / k;
        let rise = (90.0 - j as f64 - 0.5) / k;
        let ray: [f64; 3] = std::array::from_fn(|axis| {
            view.forward[axis] + side * view.right[axis] + rise * view.up[axis]
        });
        let hit = terrain.raycast(view.eye, ray, 1e5).expect("readable");
        let length = ray.iter().map(|part| part * part).sum::<f64>().sqrt();
        let expected = hit.map_or(f64::INFINITY, |hit| hit.distance / length);
        let is_right = shown == expected || (shown - expected).abs() < 0.05 * expected;
        wrong += usize::from(!is_right);
    }
    assert!(wrong <= 3, "{wrong} of 300 rays differ");
}

#[test]
fn late_tiles_leave_no_hole_and_budgets_hold() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrain = terrain(&gpu, Pace::Paced, Duration::from_millis(15));
    let target = Offscreen::new(&gpu.device, SIZE);
    let mut first_plan = None;
    for step in 0..60 {
        let (report, distances) = draw(&gpu, &mut terrain, &target, &view(f64::from(step) / 60.0));
        assert!(report.vram_bytes <= BUDGET);
        assert!(report.errors.is_empty(), "{:?}", report.errors);
        if report.has_new_plan {
            first_plan = first_plan.or(Some(step));
        }
        if first_plan.is_some() {
            assert_eq!(broken_columns(&distances), 0, "frame {step}");
        }
    }
    assert!(first_plan.is_some(), "no plan in 60 frames");
}

#[test]
fn two_terrains_live_side_by_side() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut terrains = [(); 2].map(|()| terrain(&gpu, Pace::Complete, Duration::ZERO));
    let target = Offscreen::new(&gpu.device, SIZE);
    let mut pictures = Vec::new();
    for terrain in &mut terrains {
        draw(&gpu, terrain, &target, &view(0.1));
        pictures.push(
            target
                .read_color(&gpu.device, &gpu.queue)
                .expect("a picture"),
        );
    }
    assert!(
        pictures[0] == pictures[1],
        "the same terrain twice is the same picture"
    );
    assert!(
        terrains[0]
            .height_at([0.0, 0.0])
            .expect("readable")
            .is_some()
    );
}
