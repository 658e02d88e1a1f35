//! `balance`: frame, tiles, depths → raised depths → a word a patch; one thread a patch, twice.

use super::{Access, SharedLayouts, group, module, own_layout, per_patch, pipeline};
use crate::frame_buffers::FrameBuffers;

/// The stage's pipelines, in the order in which they run.
pub(crate) struct Balance {
    own: wgpu::BindGroupLayout,
    raise: wgpu::ComputePipeline,
    edges: wgpu::ComputePipeline,
}

impl Balance {
    /// Builds them.
    pub(crate) fn new(device: &wgpu::Device, shared: &SharedLayouts) -> Self {
        let own = own_layout(
            device,
            "drumlin balance",
            &[Access::Read, Access::Write, Access::Write],
        );
        let module = module(device, "balance");
        let layouts = [Some(&shared.frame), Some(&shared.tiles), Some(&own)];
        Self {
            raise: pipeline(device, &module, "raise", &layouts),
            edges: pipeline(device, &module, "edges", &layouts),
            own,
        }
    }

    /// What they bind of a view.
    pub(crate) fn bind(&self, device: &wgpu::Device, view: &FrameBuffers) -> wgpu::BindGroup {
        group(
            device,
            "drumlin balance",
            &self.own,
            &[&view.depths, &view.raised, &view.patches],
        )
    }

    /// Runs them over the drawn tiles.
    pub(crate) fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        own: &wgpu::BindGroup,
        drawn: u32,
    ) {
        pass.set_bind_group(2, own, &[]);
        per_patch(pass, &self.raise, drawn);
        per_patch(pass, &self.edges, drawn);
    }
}
