//! `depth`: frame, tiles, pages → depths; one thread a patch.

use super::{Access, SharedLayouts, group, module, own_layout, per_patch, pipeline};
use crate::frame_buffers::FrameBuffers;

/// The stage's pipeline.
pub(crate) struct Depth {
    own: wgpu::BindGroupLayout,
    depth: wgpu::ComputePipeline,
}

impl Depth {
    /// Builds it.
    pub(crate) fn new(device: &wgpu::Device, shared: &SharedLayouts) -> Self {
        let own = own_layout(device, "drumlin depth", &[Access::Write]);
        let module = module(device, "depth");
        let layouts = [Some(&shared.frame), Some(&shared.tiles), Some(&own)];
        Self {
            depth: pipeline(device, &module, "depth", &layouts),
            own,
        }
    }

    /// What it binds of a view.
    pub(crate) fn bind(&self, device: &wgpu::Device, view: &FrameBuffers) -> wgpu::BindGroup {
        group(device, "drumlin depth", &self.own, &[&view.depths])
    }

    /// Runs it over the drawn tiles.
    pub(crate) fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        own: &wgpu::BindGroup,
        drawn: u32,
    ) {
        pass.set_bind_group(2, own, &[]);
        per_patch(pass, &self.depth, drawn);
    }
}
