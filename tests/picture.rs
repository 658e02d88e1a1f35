//! What a terrain looks like from somewhere, as bytes; kept for a look where `DRUMLIN_PICTURES` names a folder.

use std::path::Path;

use drumlin::{FrameReport, Headless, Offscreen, Terrain, View, wgpu};
use image::ExtendedColorType;

/// Draws a view of a terrain that waits for its tiles, before a background (linear); red, green, blue, alpha as stored.
///
/// # Panics
/// Where a tile cannot be read or the device complains.
pub(crate) fn draw(
    gpu: &Headless,
    terrain: &mut Terrain,
    view: &View,
    background: [f64; 4],
    name: &str,
) -> (FrameReport, Vec<u8>) {
    let (report, target) = frame(gpu, terrain, view, |terrain, target, encoder| {
        terrain.draw(&mut target.color_pass(encoder, background, None));
    });
    (report, color(gpu, &target, name))
}

/// A frame of a terrain that waits for its tiles, in the passes that `record` makes.
///
/// # Panics
/// Where a tile cannot be read.
pub(crate) fn frame(
    gpu: &Headless,
    terrain: &mut Terrain,
    view: &View,
    record: impl FnOnce(&Terrain, &Offscreen, &mut wgpu::CommandEncoder),
) -> (FrameReport, Offscreen) {
    let target = Offscreen::new(&gpu.device, [view.width, view.height]);
    let report = terrain.update(view);
    assert!(report.errors.is_empty(), "{:?}", report.errors);
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    terrain.prepare(&gpu.device, &gpu.queue, &mut encoder);
    record(terrain, &target, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    (report, target)
}

/// The colours of a target, kept for a look.
///
/// # Panics
/// Where the device complains.
pub(crate) fn color(gpu: &Headless, target: &Offscreen, name: &str) -> Vec<u8> {
    let color = target.read_color(&gpu.device, &gpu.queue).expect("colours");
    gpu.finish().expect("no complaint");
    keep(name, target.size(), &color);
    color
}

/// Keeps a picture for a look at it, where `DRUMLIN_PICTURES` names a folder.
fn keep(name: &str, [width, height]: [u32; 2], color: &[u8]) {
    if let Some(folder) = std::env::var_os("DRUMLIN_PICTURES") {
        let path = Path::new(&folder).join(name);
        image::save_buffer(path, color, width, height, ExtendedColorType::Rgba8).expect("a PNG");
    }
}
