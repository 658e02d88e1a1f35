//! The sky behind the terrain. Not the engine's business: applications have skies of their own.

use drumlin::wgpu;
use drumlin_core::stream::View;

use crate::scene::SKY;

/// The colour overhead: linear red, green, blue.
const ZENITH: [f32; 3] = [0.10, 0.24, 0.54];
const UNIFORM_BYTES: u64 = 5 * 16;

/// A pipeline and its uniforms.
pub(crate) struct Sky {
    pipeline: wgpu::RenderPipeline,
    uniforms: wgpu::Buffer,
    group: wgpu::BindGroup,
    encodes: bool,
}

impl Sky {
    /// A sky for pictures of a format, beside a 32-bit depth buffer.
    pub(crate) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sky"),
            size: UNIFORM_BYTES,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let pipeline = pipeline(device, format);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("sky"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: uniforms.as_entire_binding(),
            }],
        });
        Self {
            pipeline,
            uniforms,
            group,
            encodes: !format.is_srgb(),
        }
    }

    /// Takes the view of the frame to come.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "directions are f32 on the GPU"
    )]
    pub(crate) fn prepare(&self, queue: &wgpu::Queue, view: &View) {
        let tan = (0.5 * view.fov_y).tan();
        let axis = |axis: [f64; 3], scale: f64| {
            [axis[0], axis[1], axis[2], 0.0].map(|part| (part * scale) as f32)
        };
        let color = |[r, g, b]: [f32; 3], w: f32| [r, g, b, w];
        let words = [
            axis(view.right, tan * view.aspect()),
            axis(view.up, tan),
            axis(view.forward, 1.0),
            color(SKY, f32::from(u8::from(self.encodes))),
            color(ZENITH, 0.0),
        ];
        queue.write_buffer(&self.uniforms, 0, bytemuck::cast_slice(&words));
    }

    /// Draws where the pass holds nothing yet.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("sky.wgsl"));
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("sky"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Equal),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("color"),
            compilation_options,
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
