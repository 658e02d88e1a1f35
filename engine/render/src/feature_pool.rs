//! Meshes of features on the device: vertices and indices of each, and where this frame draws it.
//!
//! Which meshes are up is the planner's to say, within its budget; a mesh is put up in place of the one before. What goes
//! up are tables; the stage `refine` makes them vertices within the same submission, and the tables go with the next.

use std::collections::BTreeMap;

use drumlin_core::terrain::{FeatureDraw, FeatureUpload, FramePlan};

use crate::stages::{Refine, RefineBuffers};

/// Bytes of a feature's place before its tiles; its whole is a multiple of them.
const PLACE_BYTES: u64 = 16;

/// One feature's mesh and place.
pub(crate) struct FeatureBuffers {
    vertices: wgpu::Buffer,
    /// Three a triangle.
    pub(crate) indices: wgpu::Buffer,
    /// How many.
    pub(crate) index_count: u32,
    place: Option<wgpu::Buffer>,
    /// What the draw binds; there once the feature was drawn.
    pub(crate) bindings: Option<wgpu::BindGroup>,
}

/// All features' meshes, and which of them this frame draws.
pub(crate) struct FeaturePool {
    layout: wgpu::BindGroupLayout,
    meshes: BTreeMap<u32, FeatureBuffers>,
    drawn: Vec<u32>,
    /// Tables that this frame executes.
    arrived: Vec<RefineBuffers>,
    /// A place on its way up.
    words: Vec<u32>,
}

impl FeaturePool {
    /// An empty pool; `layout` is the draw's for features.
    pub(crate) fn new(layout: wgpu::BindGroupLayout) -> Self {
        Self {
            layout,
            meshes: BTreeMap::new(),
            drawn: Vec::new(),
            arrived: Vec::new(),
            words: Vec::new(),
        }
    }

    /// Puts tables up, drops meshes no longer needed, and writes where features are.
    pub(crate) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        refine: &Refine,
        plan: &FramePlan,
    ) {
        self.arrived.clear();
        for feature in &plan.feature_frees {
            self.meshes.remove(feature);
        }
        for upload in &plan.feature_uploads {
            let refined = refine.upload(device, queue, &upload.tables);
            let mesh = buffers(device, queue, upload, refined.vertices.clone());
            self.meshes.insert(upload.feature, mesh);
            self.arrived.push(refined);
        }
        self.drawn.clear();
        for draw in &plan.features {
            if let Some(mesh) = self.meshes.get_mut(&draw.feature) {
                mesh.place(device, &self.layout, draw);
                mesh.write_place(queue, draw, &mut self.words);
                self.drawn.push(draw.feature);
            }
        }
    }

    /// Tables to be executed in this frame, before anything is drawn.
    pub(crate) fn arrived(&self) -> &[RefineBuffers] {
        &self.arrived
    }

    /// The features of this frame.
    pub(crate) fn drawn(&self) -> impl Iterator<Item = &FeatureBuffers> {
        self.drawn
            .iter()
            .filter_map(|feature| self.meshes.get(feature))
    }

    /// Bytes on the device.
    pub(crate) fn byte_count(&self) -> u64 {
        let bytes = |mesh: &FeatureBuffers| {
            mesh.vertices.size()
                + mesh.indices.size()
                + mesh.place.as_ref().map_or(0, wgpu::Buffer::size)
        };
        // Vertices of tables on their way are counted with their meshes.
        let under_way = |tables: &RefineBuffers| tables.byte_count() - tables.vertices.size();
        self.meshes.values().map(bytes).sum::<u64>()
            + self.arrived.iter().map(under_way).sum::<u64>()
    }
}

impl FeatureBuffers {
    /// Makes room for where it is drawn.
    fn place(&mut self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, draw: &FeatureDraw) {
        let size = PLACE_BYTES + (4 * draw.tiles.len().max(1) as u64).next_multiple_of(PLACE_BYTES);
        if self.place.as_ref().is_none_or(|place| place.size() < size) {
            let place = buffer(device, size, wgpu::BufferUsages::STORAGE);
            self.bindings = Some(bind(device, layout, &self.vertices, &place));
            self.place = Some(place);
        }
    }

    fn write_place(&self, queue: &wgpu::Queue, draw: &FeatureDraw, words: &mut Vec<u32>) {
        words.clear();
        words.extend(draw.origin.iter().map(|part| part.to_bits()));
        words.push(0);
        words.extend_from_slice(&draw.tiles);
        if let Some(place) = &self.place {
            queue.write_buffer(place, 0, bytemuck::cast_slice(words));
        }
    }
}

fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    vertices: &wgpu::Buffer,
    place: &wgpu::Buffer,
) -> wgpu::BindGroup {
    let entries = [(2, vertices), (3, place)].map(|(binding, buffer)| wgpu::BindGroupEntry {
        binding,
        resource: buffer.as_entire_binding(),
    });
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("drumlin feature"),
        layout,
        entries: &entries,
    })
}

fn buffers(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    upload: &FeatureUpload,
    vertices: wgpu::Buffer,
) -> FeatureBuffers {
    let bytes: &[u8] = bytemuck::cast_slice(&upload.indices);
    let indices = buffer(
        device,
        (bytes.len() as u64).max(4),
        wgpu::BufferUsages::INDEX,
    );
    queue.write_buffer(&indices, 0, bytes);
    FeatureBuffers {
        vertices,
        indices,
        index_count: u32::try_from(upload.indices.len()).unwrap_or(0),
        place: None,
        bindings: None,
    }
}

fn buffer(device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("drumlin feature"),
        size,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
