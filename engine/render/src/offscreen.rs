//! Targets without a window: what the camera sees, read back as plain images.

use crate::RenderError;

/// Colour, depth and (on request) distance targets of one size.
#[derive(Debug)]
pub struct Offscreen {
    size: [u32; 2],
    color: wgpu::Texture,
    color_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
    distance: wgpu::Texture,
    distance_view: wgpu::TextureView,
}

/// Bytes of a texel of every format here.
const TEXEL_BYTES: u32 = 4;

impl Offscreen {
    /// Format of the colours.
    pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
    /// Format of the depths.
    pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
    /// Format of the distances: metres along the view axis.
    pub const DISTANCE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

    /// Targets of `[width, height]` pixels, at least one each.
    #[must_use]
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let size = size.map(|side| side.max(1));
        let color = target(device, size, Self::COLOR_FORMAT);
        let depth = target(device, size, Self::DEPTH_FORMAT);
        let distance = target(device, size, Self::DISTANCE_FORMAT);
        Self {
            size,
            color_view: color.create_view(&wgpu::TextureViewDescriptor::default()),
            depth_view: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            distance_view: distance.create_view(&wgpu::TextureViewDescriptor::default()),
            color,
            distance,
        }
    }

    /// Width and height, pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// A pass into colour and depth; colour starts as `background` (linear), depth as infinitely far.
    pub fn color_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        background: [f64; 4],
        times: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'encoder> {
        let [r, g, b, a] = background;
        self.pass(encoder, &self.color_view, wgpu::Color { r, g, b, a }, times)
    }

    /// A pass into distance and depth; distance starts as +∞.
    pub fn distance_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'encoder> {
        let far = wgpu::Color {
            r: f64::INFINITY,
            g: 0.0,
            b: 0.0,
            a: 0.0,
        };
        self.pass(encoder, &self.distance_view, far, None)
    }

    /// The colours, RGBA and sRGB, row by row from the top; waits for the device.
    ///
    /// # Errors
    ///
    /// [`RenderError::Device`] when the device is lost.
    pub fn read_color(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Vec<u8>, RenderError> {
        read_texture(device, queue, &self.color)
    }

    /// The distances along the view axis, metres, +∞ where nothing is; waits for the device.
    ///
    /// # Errors
    ///
    /// [`RenderError::Device`] when the device is lost.
    pub fn read_distance(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Vec<f32>, RenderError> {
        let bytes = read_texture(device, queue, &self.distance)?;
        let (words, _) = bytes.as_chunks::<4>();
        Ok(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
    }

    fn pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        clear: wgpu::Color,
        times: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'encoder> {
        let color = wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(clear),
                store: wgpu::StoreOp::Store,
            },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("drumlin offscreen"),
            color_attachments: &[Some(color)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: times,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

/// The texels of a texture of four bytes each, row by row from the top; waits for the device.
///
/// # Errors
///
/// [`RenderError::Device`] when the device is lost.
pub fn read_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<u8>, RenderError> {
    let row_bytes = texture.width() * TEXEL_BYTES;
    let pitch = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = mappable(device, u64::from(pitch) * u64::from(texture.height()));
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(pitch),
        rows_per_image: Some(texture.height()),
    };
    let destination = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout,
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), destination, texture.size());
    queue.submit([encoder.finish()]);
    let bytes = read_mappable(device, &buffer)?;
    let rows = bytes
        .chunks(pitch as usize)
        .map(|row| &row[..row_bytes as usize]);
    Ok(rows.collect::<Vec<_>>().concat())
}

/// The first bytes of a buffer that may be copied from; waits for the device.
///
/// # Errors
///
/// [`RenderError::Device`] when the device is lost.
pub fn read_buffer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    source: &wgpu::Buffer,
    byte_count: u64,
) -> Result<Vec<u8>, RenderError> {
    let buffer = mappable(device, byte_count);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, byte_count);
    queue.submit([encoder.finish()]);
    read_mappable(device, &buffer)
}

fn mappable(device: &wgpu::Device, byte_count: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("drumlin reading"),
        size: byte_count.max(4),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}

fn read_mappable(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, RenderError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver lives until the poll below has run this.
        let _ = sender.send(result);
    });
    let failed = |what: String| RenderError::Device(what);
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| failed(error.to_string()))?;
    let mapped = receiver
        .recv()
        .map_err(|_| failed("a buffer could not be mapped".into()))?;
    mapped.map_err(|error| failed(error.to_string()))?;
    let bytes = buffer
        .get_mapped_range(..)
        .map_err(|error| failed(error.to_string()))?
        .to_vec();
    buffer.unmap();
    Ok(bytes)
}

fn target(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("drumlin target"),
        size: wgpu::Extent3d {
            width: size[0],
            height: size[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Headless;

    #[test]
    fn an_empty_pass_leaves_the_background_and_infinite_distance() {
        let Some(gpu) = crate::headless::for_tests() else {
            return;
        };
        let Headless { device, queue, .. } = &gpu;
        let target = Offscreen::new(device, [70, 3]);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        drop(target.color_pass(&mut encoder, [1.0, 0.0, 1.0, 1.0], None));
        drop(target.distance_pass(&mut encoder));
        queue.submit([encoder.finish()]);
        let color = target.read_color(device, queue).expect("a picture");
        assert_eq!(color, [255, 0, 255, 255].repeat(210));
        let distance = target.read_distance(device, queue).expect("distances");
        assert_eq!(distance, vec![f32::INFINITY; 210]);
        gpu.finish().expect("no complaint");
    }
}
