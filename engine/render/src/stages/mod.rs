//! The stages on the device: one file a stage, each a sentence of what it binds and how much it dispatches.
//!
//! Twins: `shaders/stages/S.wgsl` (the work) and `drumlin_core::reference::S` (the same on the CPU).
//! Bind group 0 is the frame, 1 the tiles and pages, 2 the stage's own.

pub(crate) mod balance;
pub(crate) mod decode;
pub(crate) mod depth;
pub(crate) mod draw;
pub(crate) mod emit;
pub(crate) mod refine;

pub use draw::TargetFormats;
pub use refine::{Refine, RefineBuffers};

use crate::pool::PAGE_COUNT;

/// Workgroups of 64 threads for the patches of a tile.
const PATCH_GROUPS: u32 = 16;

/// Layouts all stages after `decode` share.
pub(crate) struct SharedLayouts {
    /// Group 0: the frame.
    pub(crate) frame: wgpu::BindGroupLayout,
    /// Group 1: the drawn tiles and the pages.
    pub(crate) tiles: wgpu::BindGroupLayout,
}

impl SharedLayouts {
    /// Makes them.
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let seen = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        let frame = layout(device, "drumlin frame", &[uniform(0, seen)]);
        let tiles: Vec<_> = (0..=PAGE_COUNT)
            .map(|binding| storage(binding, Access::Read, seen))
            .collect();
        Self {
            frame,
            tiles: layout(device, "drumlin tiles", &tiles),
        }
    }
}

/// What a stage may do with a storage buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// Read alone.
    Read,
    /// Read and write.
    Write,
}

/// A storage buffer's entry of a layout.
pub(crate) fn storage(
    binding: u32,
    access: Access,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Storage {
        read_only: access == Access::Read,
    };
    buffer_entry(binding, ty, visibility)
}

/// A uniform buffer's entry of a layout.
pub(crate) fn uniform(binding: u32, visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayoutEntry {
    buffer_entry(binding, wgpu::BufferBindingType::Uniform, visibility)
}

fn buffer_entry(
    binding: u32,
    ty: wgpu::BufferBindingType,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// A layout of entries.
pub(crate) fn layout(
    device: &wgpu::Device,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries,
    })
}

/// The layout of a stage that writes `written` of its own buffers, in binding order.
pub(crate) fn own_layout(
    device: &wgpu::Device,
    label: &str,
    buffers: &[Access],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, &access)| storage(binding, access, wgpu::ShaderStages::COMPUTE))
        .collect();
    layout(device, label, &entries)
}

/// A bind group of whole buffers, bindings counted from 0.
pub(crate) fn group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// The shader module of a stage.
pub(crate) fn module(device: &wgpu::Device, stage: &str) -> wgpu::ShaderModule {
    // A stage that does not exist becomes an empty module, which the device refuses by its label.
    let text = drumlin_shaders::stage(stage).unwrap_or_default();
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(stage),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    })
}

/// A compute pipeline over layouts for groups 0, 1, 2 …
pub(crate) fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    entry: &str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Runs a kernel with one thread a patch over `drawn` tiles.
pub(crate) fn per_patch(
    pass: &mut wgpu::ComputePass<'_>,
    kernel: &wgpu::ComputePipeline,
    drawn: u32,
) {
    pass.set_pipeline(kernel);
    pass.dispatch_workgroups(PATCH_GROUPS, drawn, 1);
}
