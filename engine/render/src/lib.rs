//! Large-terrain streaming for wgpu: pyramids of any size, refined patch by patch, with exact seams.
//!
//! The application brings the device, the queue, the encoder and the render pass; a [`Terrain`] streams a pyramid,
//! keeps its budgets and draws with one indirect draw, and one draw a feature. It needs WebGPU's default limits and no optional feature.
//!
//! ```no_run
//! use drumlin::{Headless, Offscreen, Terrain, TerrainDescriptor, View, wgpu};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A device without a window; an application hands in its own.
//! let gpu = Headless::new()?;
//! let target = Offscreen::new(&gpu.device, [1280, 720]);
//! let mut terrain = Terrain::new(&gpu.device, &gpu.queue, TerrainDescriptor::at("rainier.zarr"))?;
//!
//! // World axes: x east, y north, z up, metres, from the middle of the data set.
//! let ground = terrain.height_at([0.0, 0.0])?.unwrap_or(0.0);
//! for frame in 0..600 {
//!     let eye = [10.0 * f64::from(frame), -9_000.0, ground + 1_500.0];
//!     let view = View::looking_at(eye, [0.0, 0.0, ground], 0.8, target.size());
//!     let report = terrain.update(&view);
//!     println!("{} tiles, {} missing", report.stats.tiles_drawn, report.stats.tiles_missing);
//!
//!     let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
//!     terrain.prepare(&gpu.device, &gpu.queue, &mut encoder);
//!     {
//!         // Reversed depth: cleared to 0, compared with `Greater`.
//!         let mut pass = target.color_pass(&mut encoder, [0.35, 0.53, 0.78, 1.0], None);
//!         terrain.draw(&mut pass);
//!     }
//!     gpu.queue.submit([encoder.finish()]);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! | module | what |
//! |---|---|
//! | `terrain` | the planner on one side, the renderer on the other |
//! | `renderer` | a frame plan goes up, the stages run, one draw |
//! | `stages` | one file a stage; twins in `shaders` and `drumlin_core::reference` |
//! | `pool`, `color_pool`, `feature_pool`, `frame_buffers`, `staging` | what lies on the device; `vram` counts it |
//! | `headless`, `offscreen` | a device and targets without a window |

mod color_pool;
mod error;
mod feature_pool;
mod frame_buffers;
mod gpu_timer;
pub mod headless;
mod limits;
mod look;
pub mod offscreen;
mod pool;
mod readback;
mod renderer;
mod stages;
mod staging;
mod terrain;
mod vram;

pub use drumlin_core::{
    geo::TileId,
    stream::View,
    terrain::{Collider, FramePlan, FrameStats, Hit, PoolSizes},
};
pub use error::RenderError;
pub use frame_buffers::DrawCounts;
pub use gpu_timer::GpuTimes;
pub use headless::Headless;
pub use limits::check_limits;
pub use look::Look;
pub use offscreen::Offscreen;
pub use renderer::{Renderer, RendererBuffers, RendererDescriptor};
pub use stages::{Refine, RefineBuffers, TargetFormats};
pub use terrain::{FrameReport, Pace, Terrain, TerrainDescriptor, TerrainSource};
pub use wgpu;
