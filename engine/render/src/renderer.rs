//! Frame plans become pictures: the half of a terrain that knows the device and no camera.
//!
//! A plan goes up (tiles, imagery, the view, the drawn list), the stages run in one compute pass, and one indirect draw
//! for the ground and one draw a feature put the result into the caller's render pass. Buffers are made when a pool page is
//! used for the first time and when a feature's mesh arrives, else never; nothing is waited for. [`Terrain`](crate::Terrain) owns one; tests hand it plans of their own.

use drumlin_core::terrain::{FramePlan, PoolSizes, Upload};

use crate::{
    DrawCounts, GpuTimes, RenderError, check_limits,
    color_pool::ColorPool,
    feature_pool::FeaturePool,
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
        refine::Refine,
    },
    staging::Staging,
    vram::UPLOADS_AT_ONCE,
};

/// What a renderer is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererDescriptor {
    /// What it draws into.
    pub formats: TargetFormats,
    /// What its buffers hold.
    pub sizes: PoolSizes,
    /// Metres of a height unit of its tiles.
    pub unit: f32,
}

/// Pool, lists and pipelines of one view of one terrain.
pub struct Renderer {
    sizes: PoolSizes,
    unit: f32,
    srgb_out: bool,
    pool: Pool,
    imagery: ColorPool,
    features: FeaturePool,
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
    refine: Refine,
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
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validity = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let renderer = Self::build(device, queue, descriptor);
        let invalid = pollster::block_on(validity.pop());
        let full = pollster::block_on(memory.pop());
        match (full, invalid) {
            (Some(error), _) => Err(RenderError::OutOfMemory(error.to_string())),
            (None, Some(error)) => Err(RenderError::Device(error.to_string())),
            (None, None) => Ok(renderer),
        }
    }

    fn build(device: &wgpu::Device, queue: &wgpu::Queue, descriptor: &RendererDescriptor) -> Self {
        let sizes = descriptor.sizes;
        let pool = Pool::new(device, sizes.slots);
        let imagery = ColorPool::new(device, sizes.color_layers);
        let staging = Staging::new(device);
        let view = FrameBuffers::new(device, &sizes);
        let stages = Stages::new(device, &descriptor.formats);
        let bindings = stages.bind(device, &pool, &imagery, &staging, &view);
        Self {
            sizes,
            unit: descriptor.unit,
            srgb_out: !descriptor.formats.color.is_srgb(),
            pool,
            imagery,
            features: FeaturePool::new(stages.draw.feature_layout()),
            staging,
            view,
            stages,
            bindings,
            timer: GpuTimer::new(device, queue),
            frame: 0,
            is_drawable: false,
        }
    }

    /// What its buffers hold.
    #[must_use]
    pub fn sizes(&self) -> PoolSizes {
        self.sizes
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
        let uploads = self.decode_surplus(device, queue, &plan.uploads);
        for upload in &plan.color_uploads {
            self.imagery.upload(queue, upload);
        }
        self.features
            .write(device, queue, &self.stages.refine, plan);
        if let Some(frame) = &plan.frame {
            self.view.write(queue, &plan.drawn, frame, self.srgb_out);
        }
        encoder.clear_buffer(&self.view.draw_list, 0, None);
        self.refine(encoder);
        self.encode_stages(queue, encoder, uploads, plan.frame.is_some());
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
            self.stages
                .draw
                .draw_features(pass, &self.features, distances);
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
            + self.features.byte_count()
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

    /// Decodes in submissions of their own what would not fit into the staging buffers; returns the rest.
    fn decode_surplus<'plan>(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        uploads: &'plan [Upload],
    ) -> &'plan [Upload] {
        let mut rest = uploads;
        while rest.len() > UPLOADS_AT_ONCE as usize {
            let (first, others) = rest.split_at(UPLOADS_AT_ONCE as usize);
            let label = Some("drumlin arrivals");
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            self.decode(queue, &mut pass, first);
            drop(pass);
            queue.submit([encoder.finish()]);
            rest = others;
        }
        rest
    }

    fn decode(
        &mut self,
        queue: &wgpu::Queue,
        pass: &mut wgpu::ComputePass<'_>,
        uploads: &[Upload],
    ) {
        for batch in self.staging.write(queue, &self.pool, uploads, self.unit) {
            self.stages
                .decode
                .dispatch(pass, &self.bindings.pages[batch.page], batch);
        }
    }

    /// Executes the tables of features that arrived.
    fn refine(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if self.features.arrived().is_empty() {
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("drumlin refine"),
            timestamp_writes: self.timer.as_mut().map(GpuTimer::refine_writes),
        });
        for tables in self.features.arrived() {
            self.stages.refine.dispatch(&mut pass, tables);
        }
    }

    fn encode_stages(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        uploads: &[Upload],
        has_view: bool,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("drumlin stages"),
            timestamp_writes: self.timer.as_ref().map(GpuTimer::stage_writes),
        });
        self.decode(queue, &mut pass, uploads);
        let Self {
            stages,
            bindings,
            view,
            ..
        } = self;
        if has_view && view.drawn_count() > 0 {
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
        if let Some(timer) = &mut self.timer {
            timer.end(self.frame);
        }
    }
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Renderer")
            .field("sizes", &self.sizes)
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
            refine: Refine::new(device),
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
