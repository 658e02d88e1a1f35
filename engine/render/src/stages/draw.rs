//! `draw`: frame, tiles, pages, imagery, patch words → colours or distances; one indirect draw of the emitted indices,
//! and one of each feature's mesh.

use super::{Access, SharedLayouts, group, layout, module, storage};
use crate::{
    color_pool::ColorPool, feature_pool::FeaturePool, frame_buffers::FrameBuffers,
    offscreen::Offscreen, pool::Pool,
};

/// What a caller draws into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TargetFormats {
    /// Format of the colours; colours are encoded as sRGB where the format does not do it itself.
    pub color: wgpu::TextureFormat,
    /// Format of the depths; cleared to 0, which is infinitely far.
    pub depth: wgpu::TextureFormat,
    /// Samples a pixel: 1 or 4.
    pub sample_count: u32,
}

impl Default for TargetFormats {
    fn default() -> Self {
        Self {
            color: Offscreen::COLOR_FORMAT,
            depth: Offscreen::DEPTH_FORMAT,
            sample_count: 1,
        }
    }
}

/// The stage's pipelines.
pub(crate) struct Draw {
    tiles: wgpu::BindGroupLayout,
    own: wgpu::BindGroupLayout,
    color: wgpu::RenderPipeline,
    distance: wgpu::RenderPipeline,
    feature: wgpu::BindGroupLayout,
    feature_color: wgpu::RenderPipeline,
    feature_distance: wgpu::RenderPipeline,
}

/// What the stage binds.
pub(crate) struct DrawBindings {
    tiles: wgpu::BindGroup,
    own: wgpu::BindGroup,
}

impl Draw {
    /// Builds them.
    pub(crate) fn new(
        device: &wgpu::Device,
        shared: &SharedLayouts,
        formats: &TargetFormats,
    ) -> Self {
        let tiles = layout(device, "drumlin tiles and imagery", &tile_entries());
        let read = |binding| storage(binding, Access::Read, wgpu::ShaderStages::FRAGMENT);
        let own = layout(device, "drumlin draw", &[read(0), read(1)]);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("drumlin draw"),
            bind_group_layouts: &[Some(&shared.frame), Some(&tiles), Some(&own)],
            immediate_size: 0,
        });
        let module = module(device, "draw");
        let seen = |binding| storage(binding, Access::Read, wgpu::ShaderStages::VERTEX);
        let feature = layout(device, "drumlin feature", &[seen(2), seen(3)]);
        let feature_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("drumlin feature"),
            bind_group_layouts: &[Some(&shared.frame), Some(&tiles), Some(&feature)],
            immediate_size: 0,
        });
        let make = |entry, formats: &TargetFormats| {
            pipeline(
                device,
                &module,
                &pipeline_layout,
                ["vertex", entry],
                formats,
            )
        };
        let make_feature = |entry, formats: &TargetFormats| {
            let entries = ["feature_vertex", entry];
            pipeline(device, &module, &feature_layout, entries, formats)
        };
        let distances = TargetFormats {
            color: Offscreen::DISTANCE_FORMAT,
            depth: Offscreen::DEPTH_FORMAT,
            sample_count: 1,
        };
        Self {
            color: make("color", formats),
            distance: make("depth_image", &distances),
            feature_color: make_feature("feature_color", formats),
            feature_distance: make_feature("feature_depth_image", &distances),
            feature,
            tiles,
            own,
        }
    }

    /// What they bind of a view, the pool and the imagery.
    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
        view: &FrameBuffers,
        pool: &Pool,
        imagery: &ColorPool,
    ) -> DrawBindings {
        let (texture, sampler) = imagery.bindings();
        let buffers = std::iter::once(&view.drawn).chain(pool.bindings());
        let mut entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        entries.push(wgpu::BindGroupEntry {
            binding: 5,
            resource: wgpu::BindingResource::TextureView(texture),
        });
        entries.push(wgpu::BindGroupEntry {
            binding: 6,
            resource: wgpu::BindingResource::Sampler(sampler),
        });
        let tiles = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("drumlin tiles and imagery"),
            layout: &self.tiles,
            entries: &entries,
        });
        DrawBindings {
            tiles,
            own: group(
                device,
                "drumlin draw",
                &self.own,
                &[&view.patches, &view.draw_list],
            ),
        }
    }

    /// Draws the emitted list: its colours, or its distances along the view axis.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        frame: &wgpu::BindGroup,
        bindings: &DrawBindings,
        view: &FrameBuffers,
        distances: bool,
    ) {
        pass.set_pipeline(if distances {
            &self.distance
        } else {
            &self.color
        });
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &bindings.tiles, &[]);
        pass.set_bind_group(2, &bindings.own, &[]);
        pass.set_index_buffer(view.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed_indirect(&view.draw_list, 0);
    }

    /// What a feature's mesh and place are bound as.
    pub(crate) fn feature_layout(&self) -> wgpu::BindGroupLayout {
        self.feature.clone()
    }

    /// Draws the features of a frame, after [`Draw::draw`], whose first two groups stay bound.
    pub(crate) fn draw_features(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        features: &FeaturePool,
        distances: bool,
    ) {
        for (at, feature) in features.drawn().enumerate() {
            if at == 0 {
                pass.set_pipeline(if distances {
                    &self.feature_distance
                } else {
                    &self.feature_color
                });
            }
            pass.set_bind_group(2, feature.bindings.as_ref(), &[]);
            pass.set_index_buffer(feature.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..feature.index_count, 0, 0..1);
        }
    }
}

fn tile_entries() -> Vec<wgpu::BindGroupLayoutEntry> {
    let mut entries: Vec<_> = (0..5)
        .map(|binding| storage(binding, Access::Read, wgpu::ShaderStages::VERTEX_FRAGMENT))
        .collect();
    let picture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    for (binding, ty) in [(5, picture), (6, sampler)] {
        let visibility = wgpu::ShaderStages::FRAGMENT;
        entries.push(wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        });
    }
    entries
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex, fragment]: [&str; 2],
    formats: &TargetFormats,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        // Both sides are drawn: a camera may look along a skirt from within.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: formats.depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: formats.sample_count,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(formats.color.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
