//! The stages on a device against their references on the CPU, and the pictures they make.

use drumlin::{Headless, Offscreen, Renderer, RendererDescriptor, TargetFormats, wgpu};
use drumlin_core::terrain::FramePlan;
use drumlin_tests::scene::{self, Camera};

/// Magenta: what no ground looks like.
const BACKGROUND: [f64; 4] = [1.0, 0.0, 1.0, 1.0];

/// A device; none, said aloud, where there is no adapter and `REQUIRE_GPU` does not insist.
fn gpu() -> Option<Headless> {
    match Headless::new() {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var("REQUIRE_GPU").is_ok_and(|value| value == "1") => {
            panic!("{error}")
        }
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}

fn renderer(gpu: &Headless) -> Renderer {
    let descriptor = RendererDescriptor {
        formats: TargetFormats::default(),
        vram_budget_bytes: 64 << 20,
        unit: scene::UNIT,
        imagery: false,
    };
    Renderer::new(&gpu.device, &gpu.queue, &descriptor).expect("a renderer")
}

struct Picture {
    color: Vec<u8>,
    distance: Vec<f32>,
}

fn render(gpu: &Headless, renderer: &mut Renderer, plan: &FramePlan, size: [u32; 2]) -> Picture {
    let Headless { device, queue, .. } = gpu;
    let target = Offscreen::new(device, size);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.prepare(device, queue, &mut encoder, plan);
    renderer.draw(&mut target.color_pass(&mut encoder, BACKGROUND, None));
    renderer.draw_distances(&mut target.distance_pass(&mut encoder));
    queue.submit([encoder.finish()]);
    let color = target.read_color(device, queue).expect("a picture");
    let distance = target.read_distance(device, queue).expect("distances");
    gpu.finish().expect("no complaint");
    Picture { color, distance }
}

fn save(name: &str, color: &[u8], [width, height]: [u32; 2]) {
    if let Some(folder) = std::env::var_os("DRUMLIN_PICTURES") {
        let path = std::path::Path::new(&folder).join(name);
        image::save_buffer(path, color, width, height, image::ColorType::Rgba8).expect("a PNG");
    }
}

#[test]
fn a_hill_of_two_levels_has_no_holes() {
    let Some(gpu) = gpu() else { return };
    let mut renderer = renderer(&gpu);
    let size = [640, 360];
    let plan = scene::plan(&Camera::over_the_hill(size), &scene::mixed_cut());
    let picture = render(&gpu, &mut renderer, &plan, size);
    save("hill.png", &picture.color, size);
    let plan = scene::plan(&Camera::from_above(size), &scene::mixed_cut());
    let picture = render(&gpu, &mut renderer, &plan, size);
    save("above.png", &picture.color, size);
    let holes = picture
        .color
        .chunks(4)
        .filter(|pixel| *pixel == [255, 0, 255, 255])
        .count();
    assert_eq!(holes, 0, "background seen from above");
    assert!(
        picture
            .distance
            .iter()
            .all(|metres| (550.0..1150.0).contains(metres))
    );
}
