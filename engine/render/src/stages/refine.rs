//! `refine`: header, tasks, tables → points level by level, one thread a row; then vertices, one thread a vertex.
//!
//! Belongs to no frame: a feature's tables are executed once, when they arrive.

use drumlin_core::reference::{
    refine::RefineTables,
    shared::{
        FeatureVertex,
        refine::{REFINE_TASK_STRIDE, RefineHeader, RefineTask},
    },
};

use super::{Access, layout, module, pipeline, storage, uniform};

/// Threads of a workgroup.
const GROUP: u32 = 64;
/// Workgroups along one axis of a dispatch, by WebGPU's default limits.
const GROUPS_ACROSS: u32 = 65_535;

/// The stage's pipelines.
#[derive(Debug)]
pub struct Refine {
    own: wgpu::BindGroupLayout,
    points: wgpu::ComputePipeline,
    vertices: wgpu::ComputePipeline,
}

/// A feature's tables on the device, and what they are executed into.
#[derive(Debug)]
pub struct RefineBuffers {
    /// Three f32 a point, the cage's first.
    pub points: wgpu::Buffer,
    /// A [`FeatureVertex`] a vertex.
    pub vertices: wgpu::Buffer,
    tables: wgpu::Buffer,
    /// The header, then the tasks, each at a multiple of [`REFINE_TASK_STRIDE`].
    tasks: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    /// Rows of each task.
    counts: Vec<u32>,
    vertex_count: u32,
}

impl Refine {
    /// Builds them.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        let seen = wgpu::ShaderStages::COMPUTE;
        let mut task = uniform(1, seen);
        if let wgpu::BindingType::Buffer {
            has_dynamic_offset, ..
        } = &mut task.ty
        {
            *has_dynamic_offset = true;
        }
        let entries = [
            uniform(0, seen),
            task,
            storage(2, Access::Read, seen),
            storage(3, Access::Write, seen),
            storage(4, Access::Write, seen),
        ];
        let own = layout(device, "drumlin refine", &entries);
        let module = module(device, "refine");
        let make = |entry| pipeline(device, &module, entry, &[Some(&own)]);
        Self {
            points: make("points_of_level"),
            vertices: make("vertices"),
            own,
        }
    }

    /// Puts tables up; a buffer above the device's limit is the device's error.
    #[must_use]
    pub fn upload(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tables: &RefineTables,
    ) -> RefineBuffers {
        use wgpu::BufferUsages as Usage;
        let storage =
            |label, bytes: u64, usage| buffer(device, label, bytes, Usage::STORAGE | usage);
        let words: &[u8] = bytemuck::cast_slice(&tables.words);
        let vertices = u64::from(tables.header.vertex_count) * size_of::<FeatureVertex>() as u64;
        let tasks = task_bytes(tables);
        let made = [
            storage("drumlin refine tables", words.len() as u64, Usage::COPY_DST),
            storage(
                "drumlin refine points",
                u64::from(tables.point_count) * 12,
                Usage::COPY_DST | Usage::COPY_SRC,
            ),
            storage("drumlin refine vertices", vertices, Usage::COPY_SRC),
            buffer(
                device,
                "drumlin refine tasks",
                tasks.len() as u64,
                Usage::UNIFORM | Usage::COPY_DST,
            ),
        ];
        queue.write_buffer(&made[0], 0, words);
        queue.write_buffer(&made[1], 0, bytemuck::cast_slice(&tables.cage));
        queue.write_buffer(&made[3], 0, &tasks);
        let bindings = self.bind(device, &made);
        let [table_words, points, vertices, tasks] = made;
        RefineBuffers {
            points,
            vertices,
            tables: table_words,
            tasks,
            bindings,
            counts: tables.tasks.iter().map(|task| task.count).collect(),
            vertex_count: tables.header.vertex_count,
        }
    }

    fn bind(
        &self,
        device: &wgpu::Device,
        [tables, points, vertices, tasks]: &[wgpu::Buffer; 4],
    ) -> wgpu::BindGroup {
        let window = |bytes: usize| {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: tasks,
                offset: 0,
                size: std::num::NonZeroU64::new(bytes as u64),
            })
        };
        let resources = [
            window(size_of::<RefineHeader>()),
            window(size_of::<RefineTask>()),
            tables.as_entire_binding(),
            points.as_entire_binding(),
            vertices.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("drumlin refine"),
            layout: &self.own,
            entries: &entries,
        })
    }

    /// Runs them: every level's points, then the vertices.
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, buffers: &RefineBuffers) {
        pass.set_pipeline(&self.points);
        let stride = u32::try_from(REFINE_TASK_STRIDE).unwrap_or(u32::MAX);
        for (&count, task) in buffers.counts.iter().zip(1..) {
            pass.set_bind_group(0, &buffers.bindings, &[task * stride]);
            per_row(pass, count);
        }
        if buffers.vertex_count > 0 {
            pass.set_pipeline(&self.vertices);
            pass.set_bind_group(0, &buffers.bindings, &[0]);
            per_row(pass, buffers.vertex_count);
        }
    }
}

impl RefineBuffers {
    /// Bytes on the device.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        [&self.points, &self.vertices, &self.tables, &self.tasks]
            .into_iter()
            .map(wgpu::Buffer::size)
            .sum()
    }
}

/// One thread a row, in as many rows of workgroups as it takes.
fn per_row(pass: &mut wgpu::ComputePass<'_>, count: u32) {
    let groups = count.div_ceil(GROUP);
    let across = groups.min(GROUPS_ACROSS);
    pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
}

fn task_bytes(tables: &RefineTables) -> Vec<u8> {
    let mut bytes = bytemuck::bytes_of(&tables.header).to_vec();
    for task in &tables.tasks {
        bytes.resize(bytes.len().next_multiple_of(REFINE_TASK_STRIDE), 0);
        bytes.extend_from_slice(bytemuck::bytes_of(task));
    }
    bytes.resize(bytes.len().next_multiple_of(REFINE_TASK_STRIDE), 0);
    bytes
}

/// A buffer of at least one vertex, as a binding may not be empty.
fn buffer(
    device: &wgpu::Device,
    label: &str,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(size_of::<FeatureVertex>() as u64),
        usage,
        mapped_at_creation: false,
    })
}
