//! A foreign wgpu application that draws two terrains into its own picture.
//!
//! It has a device, a queue, an encoder, a render pass and target formats of its own; Drumlin only joins in. Left and
//! right half of the picture are two views; at the end it asks the ground a few questions and leaves.
//!
//! ```text
//! cargo run --example embed -- LEFT.zarr [RIGHT.zarr] [PICTURE.png]
//! ```

use std::{error::Error, path::PathBuf};

use drumlin::{Pace, TargetFormats, Terrain, TerrainDescriptor, View, headless, wgpu};

const SIZE: [u32; 2] = [1280, 360];
const FORMATS: TargetFormats = TargetFormats {
    color: wgpu::TextureFormat::Bgra8Unorm,
    depth: wgpu::TextureFormat::Depth24Plus,
    sample_count: 4,
};

fn main() -> Result<(), Box<dyn Error>> {
    let (pyramids, picture) = arguments();
    let [left, right] = match pyramids.as_slice() {
        [one] => [one, one],
        [one, other, ..] => [one, other],
        [] => return Err("usage: embed LEFT.zarr [RIGHT.zarr] [PICTURE.png]".into()),
    };
    let (device, queue) = pollster::block_on(own_device())?;
    let targets = Targets::new(&device);
    let mut terrains = [join(&device, &queue, left)?, join(&device, &queue, right)?];
    let views = [view_of(&terrains[0], 0.7)?, view_of(&terrains[1], 3.6)?];

    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    for (terrain, view) in terrains.iter_mut().zip(&views) {
        let report = terrain.update(view);
        println!(
            "{} tiles drawn, {} missing",
            report.stats.tiles_drawn, report.stats.tiles_missing
        );
        terrain.prepare(&device, &queue, &mut encoder);
    }
    draw(&mut encoder, &targets, &terrains);
    queue.submit([encoder.finish()]);

    for (terrain, view) in terrains.iter().zip(&views) {
        ask(terrain, view)?;
    }
    if let Some(path) = picture {
        targets.save(&device, &queue, &path)?;
        println!("picture: {}", path.display());
    }
    Ok(())
}

/// Pyramids, and a picture's name if there is one.
fn arguments() -> (Vec<PathBuf>, Option<PathBuf>) {
    let is_picture = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "png");
    let (pictures, pyramids): (Vec<_>, Vec<_>) = std::env::args_os()
        .skip(1)
        .map(PathBuf::from)
        .partition(is_picture);
    (pyramids, pictures.into_iter().next())
}

/// The application's own device, with the limits every WebGPU device has.
async fn own_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(headless::instance_descriptor());
    let adapter = instance
        .request_adapter(&wgpu::RequestAdapterOptions::default())
        .await?;
    Ok(adapter
        .request_device(&wgpu::DeviceDescriptor::default())
        .await?)
}

/// A terrain in the application's formats. A program with a window would leave the pace as it is.
fn join(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    pyramid: &PathBuf,
) -> Result<Terrain, Box<dyn Error>> {
    let descriptor = TerrainDescriptor {
        formats: FORMATS,
        pace: Pace::Complete,
        vram_budget_bytes: 128 << 20,
        ..TerrainDescriptor::at(pyramid)
    };
    Ok(Terrain::new(device, queue, descriptor)?)
}

/// A view of the middle of a data set from `heading` radians around it.
fn view_of(terrain: &Terrain, heading: f64) -> Result<View, Box<dyn Error>> {
    let [[scale, ..], _] = terrain.world_from_crs();
    let grid = &terrain.metadata().grid;
    let radius = 0.35 * scale * grid.step[0] * f64::from(grid.columns);
    let ground = terrain.height_at([0.0, 0.0])?.unwrap_or(0.0);
    let eye = [
        radius * heading.cos(),
        radius * heading.sin(),
        ground + 0.35 * radius,
    ];
    Ok(View::looking_at(
        eye,
        [0.0, 0.0, ground],
        0.8,
        [SIZE[0] / 2, SIZE[1]],
    ))
}

/// One pass of the application, half a picture a terrain.
fn draw(encoder: &mut wgpu::CommandEncoder, targets: &Targets, terrains: &[Terrain; 2]) {
    let sky = wgpu::Color {
        r: 0.6,
        g: 0.74,
        b: 0.89,
        a: 1.0,
    };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("application"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &targets.samples,
            depth_slice: None,
            resolve_target: Some(&targets.color_view),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(sky),
                store: wgpu::StoreOp::Discard,
            },
        })],
        // Depth is reversed: 0 is infinitely far.
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let (width, height) = (SIZE[0] as f32 / 2.0, SIZE[1] as f32);
    for (terrain, left) in terrains.iter().zip([0.0, width]) {
        pass.set_viewport(left, 0.0, width, height, 0.0, 1.0);
        terrain.draw(&mut pass);
    }
}

/// The ground answers on the CPU, from the numbers that are drawn.
fn ask(terrain: &Terrain, view: &View) -> Result<(), Box<dyn Error>> {
    println!(
        "height at the middle: {:?} m",
        terrain.height_at([0.0, 0.0])?
    );
    println!("normal at the middle: {:?}", terrain.normal_at([0.0, 0.0])?);
    match terrain.raycast(view.eye, view.forward, 1e7)? {
        Some(hit) => println!(
            "the middle pixel shows {:?}, {:.1} m away",
            hit.position, hit.distance
        ),
        None => println!("the middle pixel shows the sky"),
    }
    Ok(())
}

/// The application's own targets.
struct Targets {
    samples: wgpu::TextureView,
    color: wgpu::Texture,
    color_view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl Targets {
    fn new(device: &wgpu::Device) -> Self {
        let color = target(device, FORMATS.color, 1);
        Self {
            samples: target(device, FORMATS.color, FORMATS.sample_count)
                .create_view(&Default::default()),
            depth: target(device, FORMATS.depth, FORMATS.sample_count)
                .create_view(&Default::default()),
            color_view: color.create_view(&Default::default()),
            color,
        }
    }

    fn save(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        path: &PathBuf,
    ) -> Result<(), Box<dyn Error>> {
        let mut bytes = drumlin::offscreen::read_texture(device, queue, &self.color)?;
        for texel in bytes.chunks_exact_mut(4) {
            texel.swap(0, 2);
        }
        Ok(image::save_buffer(
            path,
            &bytes,
            SIZE[0],
            SIZE[1],
            image::ColorType::Rgba8,
        )?)
    }
}

fn target(device: &wgpu::Device, format: wgpu::TextureFormat, sample_count: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("application"),
        size: wgpu::Extent3d {
            width: SIZE[0],
            height: SIZE[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
