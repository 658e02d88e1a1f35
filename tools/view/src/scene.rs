//! A terrain on a device, with the looks this program gives it: sky, haze, and what the debug keys show.

use anyhow::Result;
use drumlin::{DrawCounts, GpuTimes, Renderer, RendererDescriptor, TargetFormats, wgpu};
use drumlin_core::{
    reference::shared::{FLAG_DEPTH_COLORS, FLAG_DRAW_VOIDS, FLAG_WIREFRAME},
    stream::View,
    terrain::{FramePlan, FrameStats, Planner, PlannerDescriptor},
};

use crate::{arguments::TerrainArguments, camera::Camera, data_set::DataSet, sky::Sky};

/// The colour of the sky at the horizon, and of haze: linear red, green, blue.
pub(crate) const SKY: [f32; 3] = [0.47, 0.63, 0.83];
/// Near planes are this much of the data set's size.
const NEAR: f64 = 1e-6;
/// Haze swallows all but 1 / e of the ground at this many sizes of the data set.
const CLEAR_SIZES: f64 = 0.9;

/// What debug keys turn on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Debug {
    pub(crate) wireframe: bool,
    pub(crate) depth_colors: bool,
}

impl Debug {
    /// What the command line turns on.
    pub(crate) const fn of(arguments: &TerrainArguments) -> Self {
        Self {
            wireframe: arguments.wireframe,
            depth_colors: arguments.depth_colors,
        }
    }
}

/// A terrain on a device.
pub(crate) struct Scene {
    planner: Planner,
    renderer: Renderer,
    plan: FramePlan,
    stats: FrameStats,
    sky: Sky,
    view: Option<View>,
    size: f64,
}

impl Scene {
    #[expect(clippy::cast_possible_truncation, reason = "a height unit is a power of two")]
    /// Opens a terrain that draws into pictures of a format, beside a depth buffer.
    pub(crate) fn open(
        data: &DataSet,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        color: wgpu::TextureFormat,
        arguments: &TerrainArguments,
        wait_for_tiles: bool,
    ) -> Result<Self> {
        let planner = Planner::new(
            data.source.clone(),
            PlannerDescriptor {
                ram_budget_bytes: arguments.ram_budget,
                vram_budget_bytes: arguments.vram_budget / 3,
                error_px: arguments.error_px,
                wait_for_tiles,
                uniform_depth: arguments.uniform_depth.then_some(2),
                ..PlannerDescriptor::default()
            },
        )?;
        let metadata = data.metadata();
        let formats = TargetFormats {
            color,
            depth: wgpu::TextureFormat::Depth32Float,
            ..Default::default()
        };
        let renderer = Renderer::new(
            device,
            queue,
            &RendererDescriptor {
                formats,
                vram_budget_bytes: arguments.vram_budget,
                unit: metadata.unit() as f32,
                imagery: metadata.color.is_some(),
            },
        )?;
        Ok(Self {
            planner,
            renderer,
            plan: FramePlan::default(),
            stats: FrameStats::default(),
            sky: Sky::new(device, color),
            view: None,
            size: data.size_metres(),
        })
    }

    /// The camera as the terrain takes it, at a moment in seconds.
    pub(crate) fn view(&self, camera: &Camera, [width, height]: [u32; 2], seconds: f64) -> View {
        View {
            eye: camera.eye.into(),
            right: camera.right.into(),
            up: camera.up.into(),
            forward: camera.forward.into(),
            fov_y: camera.fov_y_degrees.to_radians(),
            width,
            height,
            near: (NEAR * self.size).clamp(1e-3, 1.0),
            time: seconds,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a haze of seven digits; an index list under 2^32 words")]
    /// Chooses what is drawn for a view; never waits, unless it was opened to.
    pub(crate) fn update(&mut self, view: &View, debug: Debug) {
        self.view = Some(*view);
        self.stats = self.planner.plan_into(view, &mut self.plan);
        if let Some(frame) = &mut self.plan.frame {
            frame.sky = SKY;
            frame.haze = (1.0 / (CLEAR_SIZES * self.size)) as f32;
            frame.index_capacity = (self.renderer.buffers().indices.size() / 4) as u32;
            let flags = [
                (FLAG_DRAW_VOIDS, true),
                (FLAG_WIREFRAME, debug.wireframe),
                (FLAG_DEPTH_COLORS, debug.depth_colors),
            ];
            frame.flags = flags.iter().filter(|flag| flag.1).map(|flag| flag.0).sum();
        }
        for error in self.planner.take_errors() {
            eprintln!("drumlin-view: {error}");
        }
    }

    /// Encodes the update's uploads and stages.
    pub(crate) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        if let Some(view) = &self.view {
            self.sky.prepare(queue, view);
        }
        let most = self.renderer.capacity().uploads as usize;
        while self.plan.uploads.len() > most {
            let plan = FramePlan {
                uploads: self.plan.uploads.drain(..most).collect(),
                ..FramePlan::default()
            };
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.renderer.prepare(device, queue, &mut encoder, &plan);
            queue.submit([encoder.finish()]);
        }
        self.renderer.prepare(device, queue, encoder, &self.plan);
    }

    /// Draws into a pass of the formats it was opened for.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.renderer.draw(pass);
        self.sky.draw(pass);
    }

    /// Draws distances along the view axis.
    pub(crate) fn draw_distances(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.renderer.draw_distances(pass);
    }

    /// What the pass that draws may write its times to.
    pub(crate) fn pass_times(&mut self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.renderer.pass_times()
    }

    /// What is behind the terrain: linear red, green, blue, and 1.
    pub(crate) fn background() -> [f64; 4] {
        let [r, g, b] = SKY.map(f64::from);
        [r, g, b, 1.0]
    }

    /// What the last update came to.
    pub(crate) fn stats(&self) -> &FrameStats {
        &self.stats
    }

    /// What was drawn in the latest frame whose numbers have come back.
    pub(crate) fn counts(&mut self) -> Option<DrawCounts> {
        self.renderer.counts()
    }

    /// GPU times of the latest frame whose times have come back.
    pub(crate) fn gpu_times(&self) -> Option<GpuTimes> {
        self.renderer.gpu_times()
    }

    /// Frames prepared so far.
    pub(crate) fn frame_number(&self) -> u64 {
        self.renderer.frame_number()
    }

    /// Bytes on the device.
    pub(crate) fn vram_bytes(&self) -> u64 {
        self.renderer.byte_count()
    }
}
