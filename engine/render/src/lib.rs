//! Large-terrain streaming for wgpu.

mod color_pool;
mod error;
mod frame_buffers;
mod gpu_timer;
pub mod headless;
mod limits;
pub mod offscreen;
mod pool;
mod readback;
mod renderer;
mod stages;
mod staging;
mod vram;

pub use error::RenderError;
pub use frame_buffers::DrawCounts;
pub use gpu_timer::GpuTimes;
pub use headless::Headless;
pub use limits::check_limits;
pub use offscreen::Offscreen;
pub use renderer::{Capacity, Renderer, RendererBuffers, RendererDescriptor};
pub use stages::TargetFormats;
pub use wgpu;
