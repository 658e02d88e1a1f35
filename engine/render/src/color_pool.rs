//! Imagery on the device: one array texture, a layer a tile.

use drumlin_core::{
    stream::COLOR_BYTES,
    terrain::{ColorUpload, PoolSizes},
};

const SIDE: u32 = 256;
/// Mip levels: 256², 128², … 1.
const MIP_COUNT: u32 = SIDE.ilog2() + 1;

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
            mip_level_count: MIP_COUNT,
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
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
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
        let layers = self.texture.size().depth_or_array_layers;
        if upload.texels.len() as u64 != COLOR_BYTES || upload.layer >= layers {
            return;
        }
        let mut offset = 0;
        for mip_level in 0..MIP_COUNT {
            self.write(queue, upload, mip_level, offset);
            offset += u64::from(SIDE >> mip_level).pow(2) * 4;
        }
    }

    /// Puts one mip level, whose texels begin at `offset`, into its layer.
    fn write(&self, queue: &wgpu::Queue, upload: &ColorUpload, mip_level: u32, offset: u64) {
        let side = SIDE >> mip_level;
        let target = wgpu::TexelCopyTextureInfo {
            mip_level,
            origin: wgpu::Origin3d {
                z: upload.layer,
                ..wgpu::Origin3d::ZERO
            },
            ..self.texture.as_image_copy()
        };
        let rows = wgpu::TexelCopyBufferLayout {
            offset,
            bytes_per_row: Some(side * 4),
            rows_per_image: Some(side),
        };
        let size = wgpu::Extent3d {
            width: side,
            height: side,
            depth_or_array_layers: 1,
        };
        queue.write_texture(target, &upload.texels, rows, size);
    }

    /// What the draw stage binds.
    pub(crate) fn bindings(&self) -> (&wgpu::TextureView, &wgpu::Sampler) {
        (&self.view, &self.sampler)
    }

    /// Bytes on the device.
    pub(crate) fn byte_count(&self) -> u64 {
        u64::from(self.texture.size().depth_or_array_layers) * COLOR_BYTES
    }
}
