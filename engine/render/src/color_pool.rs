//! Imagery on the device: one array texture, a layer a tile.

use drumlin_core::terrain::{ColorUpload, PoolSizes};

use crate::vram::LAYER_BYTES;

const SIDE: u32 = 256;

/// Layers of imagery, and how they are sampled.
pub(crate) struct ColorPool {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl ColorPool {
    /// A pool of `layers` layers, at least one so that there is something to bind.
    pub(crate) fn new(device: &wgpu::Device, layers: u32) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("drumlin imagery"),
            size: wgpu::Extent3d {
                width: SIDE,
                height: SIDE,
                depth_or_array_layers: layers.clamp(1, PoolSizes::MAX_COLOR_LAYERS),
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("drumlin imagery"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            texture,
            view,
            sampler,
        }
    }

    /// Puts imagery into its layer; one of the wrong size or past the last layer is not put up.
    pub(crate) fn upload(&self, queue: &wgpu::Queue, upload: &ColorUpload) {
        let layer = self.texture.size().depth_or_array_layers;
        if upload.texels.len() as u64 != LAYER_BYTES || upload.layer >= layer {
            return;
        }
        let origin = wgpu::Origin3d {
            x: 0,
            y: 0,
            z: upload.layer,
        };
        queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                origin,
                ..self.texture.as_image_copy()
            },
            &upload.texels,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(SIDE * 4),
                rows_per_image: Some(SIDE),
            },
            wgpu::Extent3d {
                width: SIDE,
                height: SIDE,
                depth_or_array_layers: 1,
            },
        );
    }

    /// What the draw stage binds.
    pub(crate) fn bindings(&self) -> (&wgpu::TextureView, &wgpu::Sampler) {
        (&self.view, &self.sampler)
    }

    /// Bytes on the device.
    pub(crate) fn byte_count(&self) -> u64 {
        u64::from(self.texture.size().depth_or_array_layers) * LAYER_BYTES
    }
}
