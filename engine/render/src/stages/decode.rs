//! `decode`: headers and staging → slots of one page; heights and slopes a thread a sample, strides a thread a patch.

use drumlin_core::{
    geo::{PATCH_COUNT, TILE_SAMPLE_COUNT},
    reference::shared::{UPLOAD_WORDS, UploadHeader},
};

use super::{Access, layout, module, pipeline, storage};
use crate::{
    staging::{Batch, Staging},
    vram::UPLOADS_AT_ONCE,
};

const GROUP: usize = 64;

/// The stage's pipelines, in the order in which they run.
pub(crate) struct Decode {
    own: wgpu::BindGroupLayout,
    heights: wgpu::ComputePipeline,
    slopes: wgpu::ComputePipeline,
    strides: wgpu::ComputePipeline,
}

impl Decode {
    /// Builds them.
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let seen = wgpu::ShaderStages::COMPUTE;
        let moving = |binding| {
            let mut entry = storage(binding, Access::Read, seen);
            if let wgpu::BindingType::Buffer {
                has_dynamic_offset, ..
            } = &mut entry.ty
            {
                *has_dynamic_offset = true;
            }
            entry
        };
        let own = layout(
            device,
            "drumlin decode",
            &[storage(0, Access::Write, seen), moving(1), moving(2)],
        );
        let module = module(device, "decode");
        let make = |entry| pipeline(device, &module, entry, &[Some(&own)]);
        Self {
            heights: make("heights"),
            slopes: make("slopes"),
            strides: make("strides"),
            own,
        }
    }

    /// What they bind of a page.
    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
        page: &wgpu::Buffer,
        staging: &Staging,
    ) -> wgpu::BindGroup {
        let window = |buffer, tile_bytes: usize| wgpu::BufferBinding {
            buffer,
            offset: 0,
            size: std::num::NonZeroU64::new(u64::from(UPLOADS_AT_ONCE) * tile_bytes as u64),
        };
        let headers = window(&staging.headers, size_of::<UploadHeader>());
        let tiles = window(&staging.tiles, UPLOAD_WORDS * 4);
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("drumlin decode"),
            layout: &self.own,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: page.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Buffer(headers),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: wgpu::BindingResource::Buffer(tiles),
                },
            ],
        })
    }

    /// Runs them over the tiles of a batch, all of one page.
    pub(crate) fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        page: &wgpu::BindGroup,
        batch: &Batch,
    ) {
        pass.set_bind_group(0, page, &[batch.header_offset, batch.tile_offset]);
        let kernels = [
            (&self.heights, TILE_SAMPLE_COUNT),
            (&self.slopes, TILE_SAMPLE_COUNT),
            (&self.strides, PATCH_COUNT),
        ];
        for (kernel, threads) in kernels {
            pass.set_pipeline(kernel);
            pass.dispatch_workgroups(
                u32::try_from(threads.div_ceil(GROUP)).unwrap_or(u32::MAX),
                batch.count,
                1,
            );
        }
    }
}
