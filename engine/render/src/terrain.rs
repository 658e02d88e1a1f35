//! A terrain in an application: the planner on one side, the renderer on the other.
//!
//! ```text
//! update(view) → plan (another thread) ‖ prepare(encoder): uploads, stages → draw(pass): one indirect draw, and one a feature
//! ```
//!
//! Follows wgpu's middleware pattern: the caller owns the device, the queue, the encoder and the pass. Nothing waits,
//! unless the terrain was made to wait for its tiles.

use std::{path::PathBuf, sync::Arc};

use drumlin_core::{
    geo::TileId,
    pyramid::Metadata,
    stream::{Retry, TileSource, View},
    terrain::{
        Collider, FramePlan, FrameStats, Hit, Planner, PlannerDescriptor, PyramidSource, Surface,
        Updater,
    },
};

use crate::{
    DrawCounts, GpuTimes, Look, RenderError, Renderer, RendererBuffers, RendererDescriptor,
    TargetFormats, vram,
};

/// Where a terrain's tiles come from.
#[derive(Clone)]
pub enum TerrainSource {
    /// A pyramid's folder.
    Path(PathBuf),
    /// Anything that hands out tiles.
    Tiles(Arc<dyn TileSource>),
}

/// How plans keep step with frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// Plans are made on a thread of their own; a frame draws the latest there is, from where the camera is now.
    #[default]
    Paced,
    /// Every frame makes its own plan, on the caller's thread; tiles still arrive when they arrive.
    Stepped,
    /// As stepped, and every frame waits until nothing is missing: for pictures and tests. What cannot be read eight times
    /// within about four seconds is gone without, and so is a feature without a mesh; [`FrameStats::given_up`] and
    /// [`FrameStats::features_refused`] count them.
    Complete,
}

/// What a terrain is made from.
#[derive(Clone)]
pub struct TerrainDescriptor {
    /// Where its tiles come from.
    pub source: TerrainSource,
    /// What it is drawn into.
    pub formats: TargetFormats,
    /// Bytes of tiles and imagery in RAM.
    pub ram_budget_bytes: u64,
    /// Bytes on the device, everything counted.
    pub vram_budget_bytes: u64,
    /// Largest error on the screen, pixels.
    pub error_px: f64,
    /// Threads that read.
    pub loader_threads: usize,
    /// Every patch takes this depth, 0 to 2; none: each its own.
    pub uniform_depth: Option<u32>,
    /// How plans keep step with frames.
    pub pace: Pace,
    /// Light, air and what else colours depend on.
    pub look: Look,
}

impl TerrainDescriptor {
    /// A pyramid's folder, drawn with the usual budgets and an error of one pixel.
    #[must_use]
    pub fn at(path: impl Into<PathBuf>) -> Self {
        Self::with_source(TerrainSource::Path(path.into()))
    }

    /// A source, drawn with the usual budgets and an error of one pixel.
    #[must_use]
    pub fn with_source(source: TerrainSource) -> Self {
        Self {
            source,
            formats: TargetFormats::default(),
            ram_budget_bytes: 512 << 20,
            vram_budget_bytes: 512 << 20,
            error_px: 1.0,
            loader_threads: 2,
            uniform_depth: None,
            pace: Pace::default(),
            look: Look::default(),
        }
    }
}

/// What a frame cost and what it lacks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Of the plan that is drawn; its times are of the frame that made it.
    pub stats: FrameStats,
    /// True when this frame has a new plan and not the one before from another place.
    pub has_new_plan: bool,
    /// Triangles and patches of the latest frame that has come back from the device; a few frames late.
    pub counts: Option<DrawCounts>,
    /// GPU times of the latest frame that has come back.
    pub gpu_times: Option<GpuTimes>,
    /// Bytes on the device.
    pub vram_bytes: u64,
    /// What went wrong since the frame before, as tiles that cannot be read; their parents are drawn.
    pub errors: Vec<String>,
}

/// A streamed terrain and one view of it.
pub struct Terrain {
    source: Arc<dyn TileSource>,
    updater: Updater,
    renderer: Renderer,
    surface: Surface,
    look: Look,
    plan: FramePlan,
    is_prepared: bool,
    stats: FrameStats,
}

impl std::fmt::Debug for Terrain {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Terrain")
            .field("renderer", &self.renderer)
            .finish_non_exhaustive()
    }
}

impl Terrain {
    /// Opens the source, starts its threads and makes everything it needs on the device.
    ///
    /// # Errors
    ///
    /// The source cannot be read; a budget or a limit of the device is too small; the device is out of memory.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: TerrainDescriptor,
    ) -> Result<Self, RenderError> {
        let source: Arc<dyn TileSource> = match &descriptor.source {
            TerrainSource::Path(path) => Arc::new(PyramidSource::open(path)?),
            TerrainSource::Tiles(tiles) => Arc::clone(tiles),
        };
        let planner = Planner::new(
            Arc::clone(&source),
            planner_descriptor(&descriptor, &*source)?,
        )?;
        let renderer = Renderer::new(
            device,
            queue,
            &RendererDescriptor {
                formats: descriptor.formats,
                sizes: planner.pool(),
                unit: single(source.metadata().unit()),
            },
        )?;
        let updater = match descriptor.pace {
            Pace::Paced => Updater::paced(planner)?,
            Pace::Stepped | Pace::Complete => Updater::stepped(planner),
        };
        Ok(Self {
            surface: Surface::new(Arc::clone(&source)),
            source,
            updater,
            renderer,
            look: descriptor.look,
            plan: FramePlan::default(),
            is_prepared: false,
            stats: FrameStats::default(),
        })
    }

    /// Says what the camera sees now. Never blocks, unless the terrain's pace is [`Pace::Complete`].
    pub fn update(&mut self, view: &View) -> FrameReport {
        let planned = self.updater.update(view);
        let has_new_plan = planned.is_some();
        let mut errors = Vec::new();
        if let Some(planned) = planned {
            let mut before = std::mem::replace(&mut self.plan, planned.plan);
            if !self.is_prepared {
                take_over(&mut before, &mut self.plan);
            }
            self.updater.recycle(before);
            self.stats = planned.stats;
            errors = planned.errors;
            self.is_prepared = false;
        } else {
            self.plan.aim(view);
        }
        let metadata = self.source.metadata();
        if let Some(frame) = &mut self.plan.frame {
            self.look.apply(frame, metadata);
        }
        FrameReport {
            stats: self.stats,
            has_new_plan,
            counts: self.renderer.counts(),
            gpu_times: self.renderer.gpu_times(),
            vram_bytes: self.renderer.byte_count(),
            errors,
        }
    }

    /// Uploads what has arrived and encodes the stages; after [`Terrain::update`], once a submission.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        self.renderer.prepare(device, queue, encoder, &self.plan);
        self.plan.uploads.clear();
        self.plan.color_uploads.clear();
        self.plan.feature_uploads.clear();
        self.plan.feature_frees.clear();
        self.is_prepared = true;
    }

    /// Draws into the caller's pass, whose targets have the terrain's formats; depth is reversed: cleared to 0.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.renderer.draw(pass);
    }

    /// Draws metres along the view axis into a pass of [`Offscreen::distance_pass`](crate::Offscreen::distance_pass).
    pub fn draw_distances(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.renderer.draw_distances(pass);
    }

    /// What the caller's render pass may write its time to, where the device has timestamps; reported frames later.
    pub fn pass_times(&mut self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.renderer.pass_times()
    }

    /// Changes light, air and what else colours depend on.
    pub fn set_look(&mut self, look: Look) {
        self.look = look;
    }

    /// Light, air and what else colours depend on.
    #[must_use]
    pub fn look(&self) -> Look {
        self.look
    }

    /// Changes the largest error on the screen, pixels.
    pub fn set_error_px(&mut self, error_px: f64) {
        self.updater.set_error_px(error_px);
    }

    /// What the data set says of itself.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        self.source.metadata()
    }

    /// The affine map from CRS coordinates to world metres: `x = a X + b Y + c`, `y = d X + e Y + f`.
    #[must_use]
    pub fn world_from_crs(&self) -> [[f64; 3]; 2] {
        self.surface.frame().world_from_crs
    }

    /// Height of the surface at world x and y, metres; none where it is void or outside. Reads tiles as needed.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn height_at(&self, place: [f64; 2]) -> Result<Option<f64>, RenderError> {
        Ok(self.surface.height_at(place)?)
    }

    /// Upward unit normal of the surface at world x and y; none where it is void or outside.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn normal_at(&self, place: [f64; 2]) -> Result<Option<[f64; 3]>, RenderError> {
        Ok(self.surface.normal_at(place)?)
    }

    /// Where a ray first meets the surface, at most `max` metres away.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn raycast(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        max: f64,
    ) -> Result<Option<Hit>, RenderError> {
        Ok(self.surface.raycast(origin, direction, max)?)
    }

    /// The mesh of a tile, of every `stride`th sample, for a physics engine.
    ///
    /// # Errors
    ///
    /// When there is no such tile or stride, or a tile cannot be read.
    pub fn collider(&self, tile: TileId, stride: usize) -> Result<Collider, RenderError> {
        Ok(self.surface.collider(tile, stride)?)
    }

    /// The buffers behind the picture, for tests and tools that look inside.
    #[must_use]
    pub fn buffers(&self) -> RendererBuffers<'_> {
        self.renderer.buffers()
    }
}

/// A frame that waits for its tiles gives one up after its eight tries: three to four seconds.
const WAITING_RETRY: Retry = Retry {
    first_millis: 25,
    longest_millis: 2000,
};

fn planner_descriptor(
    descriptor: &TerrainDescriptor,
    source: &dyn TileSource,
) -> Result<PlannerDescriptor, RenderError> {
    let (usual, wait_for_tiles) = (
        PlannerDescriptor::default(),
        descriptor.pace == Pace::Complete,
    );
    Ok(PlannerDescriptor {
        ram_budget_bytes: descriptor.ram_budget_bytes,
        vram_budget_bytes: vram::planner_budget(
            descriptor.vram_budget_bytes,
            source.metadata().color.is_some(),
            source.has_features(),
        )?,
        loader_threads: descriptor.loader_threads.max(1),
        error_px: descriptor.error_px,
        wait_for_tiles,
        uniform_depth: descriptor.uniform_depth,
        retry: if wait_for_tiles {
            WAITING_RETRY
        } else {
            usual.retry
        },
        ..usual
    })
}

/// A plan that was never drawn leaves its uploads to the next, but for slots that the next fills anew.
fn take_over(before: &mut FramePlan, plan: &mut FramePlan) {
    before
        .uploads
        .retain(|old| plan.uploads.iter().all(|new| new.slot != old.slot));
    plan.uploads.append(&mut before.uploads);
    before
        .color_uploads
        .retain(|old| plan.color_uploads.iter().all(|new| new.layer != old.layer));
    plan.color_uploads.append(&mut before.color_uploads);
    before.feature_uploads.retain(|old| {
        plan.feature_uploads
            .iter()
            .all(|new| new.feature != old.feature)
            && !plan.feature_frees.contains(&old.feature)
    });
    plan.feature_uploads.append(&mut before.feature_uploads);
    plan.feature_frees.append(&mut before.feature_frees);
}

#[expect(clippy::cast_possible_truncation, reason = "a power of two")]
fn single(unit: f64) -> f32 {
    unit as f32
}
