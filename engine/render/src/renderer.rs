//! Frame plans become pictures: the half of a terrain that knows the device and no camera.
//!
//! A plan goes up (tiles, imagery, the view, the drawn list), the stages run in one compute pass, and one indirect draw
//! puts the result into the caller's render pass. Nothing is made per frame but a pool page that is used for the first
//! time; nothing is waited for. [`Terrain`](crate::Terrain) owns one; tests hand it plans of their own.

use drumlin_core::terrain::FramePlan;

use crate::{
    DrawCounts, GpuTimes, RenderError, check_limits,
    color_pool::ColorPool,
    frame_buffers::FrameBuffers,
    gpu_timer::GpuTimer,
    pool::Pool,
    stages::{
        SharedLayouts, TargetFormats,
        balance::Balance,
        decode::Decode,
        depth::Depth,
        draw::{Draw, DrawBindings},
        emit::Emit,
        group,
    },
    staging::Staging,
    vram::VramPlan,
};

/// What a renderer is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererDescriptor {
    /// What it draws into.
    pub formats: TargetFormats,
    /// Bytes it may take on the device, everything counted.
    pub vram_budget_bytes: u64,
    /// Metres of a height unit of its tiles.
    pub unit: f32,
    /// True when its tiles have imagery.
    pub imagery: bool,
}

/// What a planner may ask of a renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Slots of the pool.
    pub slots: u32,
    /// Layers of imagery.
    pub layers: u32,
    /// Tiles of a drawn list.
    pub drawn: u32,
    /// Tiles that may go up in one frame.
    pub uploads: u32,
}

/// Pool, lists and pipelines of one view of one terrain.
pub struct Renderer {
    plan: VramPlan,
    unit: f32,
    srgb_out: bool,
    pool: Pool,
    imagery: ColorPool,
    staging: Staging,
    view: FrameBuffers,
    stages: Stages,
    bindings: Bindings,
    timer: Option<GpuTimer>,
    frame: u64,
    is_drawable: bool,
}

struct Stages {
    shared: SharedLayouts,
    decode: Decode,
    depth: Depth,
    balance: Balance,
    emit: Emit,
    draw: Draw,
}

struct Bindings {
    frame: wgpu::BindGroup,
    tiles: wgpu::BindGroup,
    pages: Vec<wgpu::BindGroup>,
    depth: wgpu::BindGroup,
    balance: wgpu::BindGroup,
    emit: wgpu::BindGroup,
    draw: DrawBindings,
}

impl Renderer {
    /// Makes everything a view needs, once.
    ///
    /// # Errors
    ///
    /// The budget or a limit of the device is too small, or the device is out of memory.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: &RendererDescriptor,
    ) -> Result<Self, RenderError> {
        check_limits(&device.limits())?;
        let plan = VramPlan::new(descriptor.vram_budget_bytes, descriptor.imagery)?;
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validity = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let renderer = Self::build(device, queue, descriptor, plan);
        let invalid = pollster::block_on(validity.pop());
        let full = pollster::block_on(memory.pop());
        match (full, invalid) {
            (Some(error), _) => Err(RenderError::OutOfMemory(error.to_string())),
            (None, Some(error)) => Err(RenderError::Device(error.to_string())),
            (None, None) => Ok(renderer),
        }
    }

    fn build(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: &RendererDescriptor,
        plan: VramPlan,
    ) -> Self {
        let pool = Pool::new(device, plan.slots);
        let imagery = ColorPool::new(device, plan.layers);
        let staging = Staging::new(device);
        let view = FrameBuffers::new(device, &plan);
        let stages = Stages::new(device, &descriptor.formats);
        let bindings = stages.bind(device, &pool, &imagery, &staging, &view);
        Self {
            plan,
            unit: descriptor.unit,
            srgb_out: !descriptor.formats.color.is_srgb(),
            pool,
            imagery,
            staging,
            view,
            stages,
            bindings,
            timer: GpuTimer::new(device, queue),
            frame: 0,
            is_drawable: false,
        }
    }

    /// What a planner may ask of it.
    #[must_use]
    pub fn capacity(&self) -> Capacity {
        let VramPlan {
            slots,
            layers,
            drawn,
            ..
        } = self.plan;
        Capacity {
            slots,
            layers,
            drawn,
            uploads: crate::vram::UPLOADS_PER_FRAME,
        }
    }

    /// Puts a plan up and encodes the stages; once a submission, before [`Renderer::draw`].
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        plan: &FramePlan,
    ) {
        self.frame += 1;
        if let Some(timer) = &mut self.timer {
            timer.begin(encoder);
        }
        self.grow(device, plan);
        for upload in &plan.color_uploads {
            self.imagery.upload(queue, upload);
        }
        if let Some(frame) = &plan.frame {
            self.view.write(queue, &plan.drawn, frame, self.srgb_out);
        }
        encoder.clear_buffer(&self.view.draw_list, 0, None);
        self.encode_stages(queue, encoder, plan);
        self.view.record_counts(encoder, self.frame);
        self.is_drawable = true;
    }

    /// Draws the prepared frame into a pass with the renderer's formats; nothing before the first frame.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_as(pass, false);
    }

    /// Draws the prepared frame's distances along the view axis, metres, into a pass of
    /// [`Offscreen::distance_pass`](crate::Offscreen::distance_pass)'s formats.
    pub fn draw_distances(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_as(pass, true);
    }

    fn draw_as(&self, pass: &mut wgpu::RenderPass<'_>, distances: bool) {
        if self.is_drawable {
            let Bindings { frame, draw, .. } = &self.bindings;
            self.stages
                .draw
                .draw(pass, frame, draw, &self.view, distances);
        }
    }

    /// What the stages emitted, of the latest frame that has come back; a few frames late.
    pub fn counts(&mut self) -> Option<DrawCounts> {
        self.view.latest_counts()
    }

    /// GPU times of the latest frame that has come back, where the device has timestamps.
    #[must_use]
    pub fn gpu_times(&self) -> Option<GpuTimes> {
        self.timer.as_ref().and_then(GpuTimer::latest)
    }

    /// What the caller's render pass may write its time to, where the device has timestamps.
    pub fn pass_times(&mut self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.timer.as_mut().map(GpuTimer::pass_writes)
    }

    /// Frames prepared so far; the number of the latest.
    #[must_use]
    pub fn frame_number(&self) -> u64 {
        self.frame
    }

    /// Bytes on the device now; never more than the budget.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        self.pool.byte_count()
            + self.imagery.byte_count()
            + self.staging.byte_count()
            + self.view.byte_count()
            + self.timer.as_ref().map_or(0, GpuTimer::byte_count)
    }

    /// The buffers behind the picture, for tests and tools that look inside.
    #[must_use]
    pub fn buffers(&self) -> RendererBuffers<'_> {
        let FrameBuffers {
            depths,
            patches,
            indices,
            draw_list,
            ..
        } = &self.view;
        RendererBuffers {
            pages: self.pool.bindings(),
            depths,
            patches,
            indices,
            draw_list,
        }
    }

    fn grow(&mut self, device: &wgpu::Device, plan: &FramePlan) {
        let Some(slot) = plan.uploads.iter().map(|upload| upload.slot).max() else {
            return;
        };
        if self.pool.hold(device, slot) {
            self.bindings =
                self.stages
                    .bind(device, &self.pool, &self.imagery, &self.staging, &self.view);
        }
    }

    fn encode_stages(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        plan: &FramePlan,
    ) {
        let Self {
            stages,
            bindings,
            staging,
            pool,
            view,
            timer,
            ..
        } = self;
        let batches = staging.write(queue, pool, &plan.uploads, self.unit);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("drumlin stages"),
            timestamp_writes: timer.as_ref().map(GpuTimer::stage_writes),
        });
        for batch in batches {
            stages
                .decode
                .dispatch(&mut pass, &bindings.pages[batch.page], batch);
        }
        if plan.frame.is_some() && view.drawn_count() > 0 {
            pass.set_bind_group(0, &bindings.frame, &[]);
            pass.set_bind_group(1, &bindings.tiles, &[]);
            stages
                .depth
                .dispatch(&mut pass, &bindings.depth, view.drawn_count());
            stages
                .balance
                .dispatch(&mut pass, &bindings.balance, view.drawn_count());
            stages
                .emit
                .dispatch(&mut pass, &bindings.emit, view.drawn_count());
        }
        drop(pass);
        if let Some(timer) = timer {
            timer.end(self.frame);
        }
    }
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Renderer")
            .field("plan", &self.plan)
            .field("frame", &self.frame)
            .finish_non_exhaustive()
    }
}

/// Buffers of a renderer; all may be copied from.
#[derive(Clone, Copy, Debug)]
pub struct RendererBuffers<'renderer> {
    /// Pages of slots.
    pub pages: [&'renderer wgpu::Buffer; 4],
    /// A depth a patch.
    pub depths: &'renderer wgpu::Buffer,
    /// A word a patch.
    pub patches: &'renderer wgpu::Buffer,
    /// Emitted indices.
    pub indices: &'renderer wgpu::Buffer,
    /// The draw's arguments and the counters.
    pub draw_list: &'renderer wgpu::Buffer,
}

impl Stages {
    fn new(device: &wgpu::Device, formats: &TargetFormats) -> Self {
        let shared = SharedLayouts::new(device);
        Self {
            decode: Decode::new(device),
            depth: Depth::new(device, &shared),
            balance: Balance::new(device, &shared),
            emit: Emit::new(device, &shared),
            draw: Draw::new(device, &shared, formats),
            shared,
        }
    }

    fn bind(
        &self,
        device: &wgpu::Device,
        pool: &Pool,
        imagery: &ColorPool,
        staging: &Staging,
        view: &FrameBuffers,
    ) -> Bindings {
        let [a, b, c, d] = pool.bindings();
        Bindings {
            frame: group(device, "drumlin frame", &self.shared.frame, &[&view.frame]),
            tiles: group(
                device,
                "drumlin tiles",
                &self.shared.tiles,
                &[&view.drawn, a, b, c, d],
            ),
            pages: pool
                .pages()
                .iter()
                .map(|page| self.decode.bind(device, page, staging))
                .collect(),
            depth: self.depth.bind(device, view),
            balance: self.balance.bind(device, view),
            emit: self.emit.bind(device, view),
            draw: self.draw.bind(device, view, pool, imagery),
        }
    }
}
