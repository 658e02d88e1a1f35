//! `emit`: frame, tiles, voids, patch words → how many indices, then the indices and the draw's arguments; one thread a
//! patch, twice.

use super::{Access, SharedLayouts, group, module, own_layout, per_patch, pipeline};
use crate::frame_buffers::FrameBuffers;

/// The stage's pipelines, in the order in which they run.
pub(crate) struct Emit {
    own: wgpu::BindGroupLayout,
    count: wgpu::ComputePipeline,
    write: wgpu::ComputePipeline,
}

impl Emit {
    /// Builds them.
    pub(crate) fn new(device: &wgpu::Device, shared: &SharedLayouts) -> Self {
        let own = own_layout(
            device,
            "drumlin emit",
            &[Access::Read, Access::Write, Access::Write],
        );
        let module = module(device, "emit");
        let layouts = [Some(&shared.frame), Some(&shared.tiles), Some(&own)];
        Self {
            count: pipeline(device, &module, "count", &layouts),
            write: pipeline(device, &module, "write", &layouts),
            own,
        }
    }

    /// What they bind of a view.
    pub(crate) fn bind(&self, device: &wgpu::Device, view: &FrameBuffers) -> wgpu::BindGroup {
        group(
            device,
            "drumlin emit",
            &self.own,
            &[&view.patches, &view.draw_list, &view.indices],
        )
    }

    /// Runs them over the drawn tiles; the draw list is zero before.
    pub(crate) fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        own: &wgpu::BindGroup,
        drawn: u32,
    ) {
        pass.set_bind_group(2, own, &[]);
        per_patch(pass, &self.count, drawn);
        per_patch(pass, &self.write, drawn);
    }
}
