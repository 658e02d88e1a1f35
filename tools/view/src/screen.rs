//! A window one can draw into: its surface, the device that drives it, and a depth buffer of its size.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use drumlin::{headless, wgpu};
use winit::{event_loop::OwnedDisplayHandle, window::Window};

/// Format of the depth buffer.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The window's side of wgpu.
pub(crate) struct Screen {
    pub(crate) window: Arc<Window>,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    depth: wgpu::TextureView,
}

impl Screen {
    /// A device that can present to the window.
    pub(crate) fn new(window: Arc<Window>, display: OwnedDisplayHandle) -> Result<Self> {
        let descriptor = headless::instance_descriptor().with_display_handle(Box::new(display));
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance
            .create_surface(Arc::clone(&window))
            .context("the window cannot be drawn into")?;
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|error| drumlin::RenderError::NoAdapter(error.to_string()))?;
        let device = headless::device_descriptor(&adapter);
        let (device, queue) =
            pollster::block_on(adapter.request_device(&device)).context("no device")?;
        let config = configuration(&surface, &adapter, &window)?;
        surface.configure(&device, &config);
        let depth = depth_view(&device, [config.width, config.height]);
        Ok(Self {
            window,
            device,
            queue,
            surface,
            config,
            depth,
        })
    }

    /// Format of the pictures.
    pub(crate) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// The window has a new size.
    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        if width == 0 || height == 0 || [width, height] == self.size() {
            return;
        }
        (self.config.width, self.config.height) = (width, height);
        self.surface.configure(&self.device, &self.config);
        self.depth = depth_view(&self.device, self.size());
    }

    /// The picture to draw next; none while the window shows nothing.
    pub(crate) fn acquire(&self) -> Result<Option<wgpu::SurfaceTexture>> {
        use wgpu::CurrentSurfaceTexture as Current;
        Ok(match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => Some(texture),
            Current::Timeout | Current::Occluded => None,
            Current::Outdated | Current::Lost => {
                self.surface.configure(&self.device, &self.config);
                None
            }
            Current::Validation => bail!("the window's surface failed"),
        })
    }

    /// A pass into a picture of this window's size and format, and into the depth buffer; both cleared.
    pub(crate) fn pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        picture: &wgpu::Texture,
        background: [f64; 4],
    ) -> wgpu::RenderPass<'encoder> {
        let [r, g, b, a] = background;
        let color = wgpu::RenderPassColorAttachment {
            view: &picture.create_view(&wgpu::TextureViewDescriptor::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                store: wgpu::StoreOp::Store,
            },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(color)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }

    /// A picture of this window's size and format that can be read back.
    pub(crate) fn readable_picture(&self) -> wgpu::Texture {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        texture(&self.device, self.size(), self.config.format, usage)
    }

    /// The pixels of such a picture as RGBA, row by row from the top; waits for the device.
    pub(crate) fn read(&self, picture: &wgpu::Texture) -> Result<Vec<u8>> {
        let [width, height] = self.size();
        let pitch = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("screenshot"),
            size: u64::from(pitch) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(pitch),
            rows_per_image: Some(height),
        };
        let into = wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout,
        };
        encoder.copy_texture_to_buffer(picture.as_image_copy(), into, picture.size());
        self.queue.submit([encoder.finish()]);
        let bytes =
            drumlin::offscreen::read_buffer(&self.device, &self.queue, &buffer, buffer.size())?;
        let rows = bytes
            .chunks(pitch as usize)
            .map(|row| &row[..4 * width as usize]);
        let mut pixels: Vec<u8> = rows.flatten().copied().collect();
        if matches!(
            self.config.format,
            wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb
        ) {
            pixels
                .chunks_exact_mut(4)
                .for_each(|pixel| pixel.swap(0, 2));
        }
        Ok(pixels)
    }
}

fn configuration(
    surface: &wgpu::Surface<'_>,
    adapter: &wgpu::Adapter,
    window: &Window,
) -> Result<wgpu::SurfaceConfiguration> {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba8UnormSrgb};
    let size = window.inner_size();
    let mut config = surface
        .get_default_config(adapter, size.width.max(1), size.height.max(1))
        .context("the adapter cannot present to this window")?;
    let formats = surface.get_capabilities(adapter).formats;
    let wanted = [Bgra8UnormSrgb, Rgba8UnormSrgb, Bgra8Unorm, Rgba8Unorm];
    let format = wanted.into_iter().find(|format| formats.contains(format));
    config.format = format.context("the window offers no format of four bytes")?;
    config.present_mode = wgpu::PresentMode::AutoVsync;
    Ok(config)
}

fn depth_view(device: &wgpu::Device, size: [u32; 2]) -> wgpu::TextureView {
    texture(
        device,
        size,
        DEPTH_FORMAT,
        wgpu::TextureUsages::RENDER_ATTACHMENT,
    )
    .create_view(&wgpu::TextureViewDescriptor::default())
}

fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("window target"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
