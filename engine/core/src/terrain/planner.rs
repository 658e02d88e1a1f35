//! The planner: a view in, a frame plan out.
//!
//! ```text
//! answers → cut within budget → requests → uploads → drawn cut → plan → prefetch
//! ```
//!
//! Owns residency: what is in RAM, what is in which slot of the pool, what is under way. Never waits for a read unless it
//! was told to; what is missing is drawn by its parent. The rules that keep it so:
//!
//! * the wanted cut, ancestors included, never takes more than RAM and pool can hold (the pixel target rises instead),
//!   so what a plan wants never has to leave for what it wants too;
//! * a tile is uploaded after its parent and leaves before it, so a parent is always ready;
//! * a slot that a plan does not want is reused by that plan's uploads, so plans are to be carried out in their order.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::{
    ColorUpload, FramePlan, FrameStats, PlannerDescriptor, PoolSizes, Upload,
    features::{FeaturePool, cut_bits},
    frame::FrameBase,
    list,
};
use crate::{
    geo::TileId,
    pyramid::PyramidError,
    stream::{
        COLOR_BYTES, ColorLife, ColorPool, CutLimit, CutRule, Drawn, Life, Loader, Motion, NO_NODE,
        PATIENCE, Relaxation, Requester, Residency, Scheduler, TileSource, Tree, View, Wanted,
    },
};

/// See the module.
#[derive(Debug)]
pub struct Planner {
    descriptor: PlannerDescriptor,
    source: SharedSource,
    pool: PoolSizes,
    base: FrameBase,
    tree: Tree,
    wanted: Wanted,
    ahead: Wanted,
    drawn: Drawn,
    room: Residency,
    colors: ColorPool,
    scheduler: Scheduler,
    features: Option<FeaturePool>,
    motion: Motion,
    relaxation: Relaxation,
    limit: CutLimit,
    /// Counts cuts; tiles are stamped with it.
    number: u64,
    queue: Vec<(f32, TileId, u32)>,
    clock: Instant,
}

struct SharedSource(Arc<dyn TileSource>);

impl std::fmt::Debug for SharedSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("TileSource")
    }
}

impl Planner {
    /// Reads the root, on this thread, and starts the loader threads.
    ///
    /// # Errors
    ///
    /// When the root cannot be read, a budget is too small, or the system gives no thread.
    pub fn new(
        source: Arc<dyn TileSource>,
        descriptor: PlannerDescriptor,
    ) -> Result<Self, PyramidError> {
        let metadata = source.metadata();
        let (descriptor, features) = set_features_aside(&*source, descriptor)?;
        let pool = PoolSizes::within(descriptor.vram_budget_bytes, metadata.color.is_some())?;
        let color_limit = descriptor.color_limit(&pool);
        let limit = descriptor.cut_limit(&pool, color_limit)?;
        let root = Arc::new(source.load(TileId::ROOT, None)?);
        let mut room = Residency::new(pool.slots, descriptor.ram_budget_bytes);
        room.ram_bytes = root.byte_count() as u64;
        let loader = Loader::new(&source, descriptor.loader_threads, descriptor.in_flight)?;
        Ok(Self {
            base: FrameBase::new(metadata, &pool, descriptor.uniform_depth),
            tree: Tree::new(metadata, root),
            wanted: Wanted::default(),
            ahead: Wanted::default(),
            drawn: Drawn::default(),
            room,
            colors: ColorPool::new(metadata, pool.color_layers, descriptor.texel_px),
            scheduler: Scheduler::new(loader, descriptor.in_flight, descriptor.retry, color_limit),
            features,
            motion: Motion::default(),
            relaxation: Relaxation::default(),
            limit,
            number: 0,
            queue: Vec::new(),
            clock: Instant::now(),
            source: SharedSource(source),
            descriptor,
            pool,
        })
    }

    /// What the GPU's buffers must hold.
    #[must_use]
    pub fn pool(&self) -> PoolSizes {
        self.pool
    }

    /// Changes the largest screen-space error, from the next plan on.
    pub fn set_error_px(&mut self, error_px: f64) {
        self.descriptor.error_px = error_px.max(1e-3);
    }

    /// What went wrong since the last call, each thing once, the first few.
    pub fn take_errors(&mut self) -> Vec<String> {
        let mut errors = self.scheduler.take_errors();
        if let Some(features) = &mut self.features {
            errors.append(&mut features.take_errors());
        }
        errors
    }

    /// The pool is empty: its device was lost. Tiles go there again from RAM, pictures are read again.
    pub fn forget_uploads(&mut self) {
        if let Some(features) = &mut self.features {
            features.forget_uploads();
        }
        self.room.empty_slots(&mut self.tree);
        self.colors.empty_layers(&mut self.tree);
    }

    /// The plan of a view.
    pub fn plan(&mut self, view: &View) -> (FramePlan, FrameStats) {
        let mut plan = FramePlan::default();
        let stats = self.plan_into(view, &mut plan);
        (plan, stats)
    }

    /// The plan of a view, in the memory of an earlier one. A view that is none (NaN, no screen) gives an empty plan.
    pub fn plan_into(&mut self, view: &View, plan: &mut FramePlan) -> FrameStats {
        plan.clear();
        if !view.is_valid() {
            return FrameStats::default();
        }
        let started = Instant::now();
        let fill = self.fill();
        self.relaxation.begin(view, fill);
        self.motion.observe(view);
        self.receive(Duration::ZERO);
        let rule = self.choose_and_fetch(view);
        self.scheduler.cancel_stale(&mut self.tree, self.number);
        self.colors.drop_unwanted(&mut self.tree, self.number);
        let mut uploaded_bytes = self.upload(plan);
        self.drawn.find(&mut self.tree);
        list::fill(plan, &self.tree, &self.drawn, self.source.0.metadata());
        plan.ground = self.base.ground();
        let mut features_refused = 0;
        if let Some(features) = &mut self.features {
            let how = (self.number, self.descriptor.wait_for_tiles);
            let (bytes, refused) = features.plan(plan, &self.tree, &self.drawn, view, how);
            uploaded_bytes += bytes;
            features_refused = refused;
        }
        plan.frame = Some(self.base.frame(view, rule.tolerance, plan.drawn.len()));
        plan.aim(view);
        let mut stats = FrameStats {
            uploaded_bytes,
            features_refused,
            tolerance_px: rule.tolerance,
            ..self.count(plan)
        };
        stats.missing_share = self.missing_share(view);
        self.prefetch();
        stats.in_flight = self.scheduler.in_flight();
        stats.update_millis = started.elapsed().as_secs_f64() * 1e3;
        stats
    }

    /// Share of the limit that the last cut took.
    fn fill(&self) -> f64 {
        let share = |count: usize, limit: usize| count as f64 / limit as f64;
        share(self.wanted.nodes.len(), self.limit.nodes)
            .max(share(self.wanted.leaf_count, self.limit.leaves))
    }

    fn now(&self) -> u64 {
        u64::try_from(self.clock.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Takes all answers there are; waits for the first of them at most so long.
    fn receive(&mut self, wait: Duration) {
        let now = self.now();
        let mut wait = wait;
        while self
            .scheduler
            .receive(&mut self.tree, &mut self.room, &mut self.colors, now, wait)
        {
            wait = Duration::ZERO;
        }
    }

    /// Chooses the cut and asks for what it lacks; when the plan is to wait, again until it lacks nothing.
    fn choose_and_fetch(&mut self, view: &View) -> CutRule {
        loop {
            let rule = self.choose(view);
            self.fetch();
            if !(self.descriptor.wait_for_tiles && self.lacks()) {
                return rule;
            }
            self.receive(Duration::from_millis(5));
        }
    }

    /// The cut of a view, at the least tolerance that the budgets allow.
    fn choose(&mut self, view: &View) -> CutRule {
        let rule = loop {
            let rule = self.rule(view);
            if self.wanted.find(&mut self.tree, &rule, self.limit) {
                break rule;
            }
            self.relaxation.rise();
        };
        self.number += 1;
        self.room.forget_victims();
        for &place in &self.wanted.nodes {
            let node = self.tree.node_mut(place);
            (node.wanted, node.used) = (self.number, self.number);
        }
        self.colors
            .rank(&mut self.tree, &self.wanted, &rule, self.number);
        rule
    }

    fn rule(&self, view: &View) -> CutRule {
        let Self {
            descriptor,
            relaxation,
            colors,
            ..
        } = self;
        let factor = relaxation.factor();
        let imagery =
            (colors.layers() > 0).then_some((colors.levels(), descriptor.texel_px * factor));
        CutRule::new(
            view,
            descriptor.error_px * factor,
            descriptor.outside.max(1.0),
            imagery,
        )
    }

    fn fetch(&mut self) {
        let (now, in_flight) = (self.now(), self.descriptor.in_flight as usize);
        let color_share = if self.colors.layers() > 0 {
            in_flight.div_ceil(4)
        } else {
            0
        };
        let asker = Requester {
            number: self.number,
            since: u64::MAX,
            in_flight: in_flight - color_share,
        };
        let Self {
            tree,
            wanted,
            room,
            colors,
            scheduler,
            ..
        } = self;
        scheduler.request_tiles(tree, wanted, room, colors, now, asker);
        scheduler.request_colors(tree, room, colors, now, asker);
    }

    /// True while something is missing for which it is worth waiting.
    fn lacks(&self) -> bool {
        let tile = |&place: &u32| match self.tree.node(place).life {
            Life::Absent | Life::Requested { .. } => true,
            Life::Failed { attempts, .. } => attempts < PATIENCE,
            Life::Resident(_) | Life::Uploaded { .. } => false,
        };
        let color = |&place: &u32| match self.tree.node(place).color {
            ColorLife::Absent => self.scheduler.has_color_room(&self.colors),
            ColorLife::Requested { .. } => true,
            ColorLife::Failed { attempts, .. } => {
                attempts < PATIENCE && self.scheduler.has_color_room(&self.colors)
            }
            ColorLife::Ready(_) | ColorLife::Uploaded(_) | ColorLife::Nothing => false,
        };
        self.wanted.nodes.iter().any(tile) || self.colors.wanted.iter().any(color)
    }

    /// Puts what has arrived into slots and layers, most urgent first, parents before children; returns the bytes.
    fn upload(&mut self, plan: &mut FramePlan) -> u64 {
        let budget = if self.descriptor.wait_for_tiles {
            u64::MAX
        } else {
            self.descriptor.upload_budget_bytes
        };
        let mut spent = 0;
        while spent + COLOR_BYTES <= (budget / 4).max(COLOR_BYTES) {
            let Some((layer, texels)) = self.colors.upload(&mut self.tree, self.number) else {
                break;
            };
            plan.color_uploads.push(ColorUpload { layer, texels });
            spent += COLOR_BYTES;
        }
        self.queue.clear();
        for &place in &self.wanted.nodes {
            let node = self.tree.node(place);
            if matches!(node.life, Life::Resident(_)) {
                let gain = if node.parent == NO_NODE {
                    f32::INFINITY
                } else {
                    self.tree.node(node.parent).gain
                };
                self.queue.push((gain, node.id, place));
            }
        }
        self.queue
            .sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for at in 0..self.queue.len() {
            let (_, id, place) = self.queue[at];
            let node = self.tree.node(place);
            let parent_is_in =
                node.parent == NO_NODE || self.tree.node(node.parent).slot().is_some();
            let Some(tile) = node.tile().filter(|_| parent_is_in).cloned() else {
                continue;
            };
            let bytes = tile.byte_count() as u64;
            if spent + bytes > budget {
                break;
            }
            let Some(slot) = self.room.slot(&mut self.tree, self.number) else {
                break;
            };
            spent += bytes;
            self.tree.node_mut(place).life = Life::Uploaded {
                tile: Arc::clone(&tile),
                slot,
            };
            let step = list::step(&self.tree, id);
            let cut = cut_bits(id, &self.tree.node(place).features);
            plan.uploads.push(Upload {
                slot,
                tile,
                step,
                cut,
            });
        }
        spent
    }

    /// Reads ahead of a moving camera while nothing else is to be read.
    fn prefetch(&mut self) {
        let in_flight = self.descriptor.in_flight as usize / 2;
        if self.descriptor.wait_for_tiles
            || self.scheduler.in_flight() >= in_flight
            || self.scheduler.is_behind()
        {
            return;
        }
        let seconds = self.descriptor.prefetch_seconds;
        let Some(view) = Some(seconds)
            .filter(|seconds| *seconds > 0.0)
            .and_then(|seconds| self.motion.predict(seconds))
        else {
            return;
        };
        let (rule, now) = (self.rule(&view), self.now());
        let Self {
            tree,
            ahead,
            room,
            colors,
            scheduler,
            ..
        } = self;
        if !ahead.find(tree, &rule, self.limit) {
            return;
        }
        for &place in &ahead.nodes {
            tree.node_mut(place).used = self.number;
        }
        room.forget_victims();
        let asker = Requester {
            number: self.number,
            since: self.number,
            in_flight,
        };
        scheduler.request_tiles(tree, ahead, room, colors, now, asker);
    }

    fn count(&self, plan: &FramePlan) -> FrameStats {
        use crate::reference::shared::{SLOT_WORDS, TILE_VISIBLE};
        let in_pool = |&&place: &&u32| self.tree.node(place).slot().is_some();
        let in_layer = |&&place: &&u32| self.tree.node(place).color.layer().is_some();
        let wanted = &self.wanted.nodes;
        let slots_used = self.room.slots.used();
        FrameStats {
            tiles_drawn: plan.drawn.len(),
            tiles_visible: plan
                .drawn
                .iter()
                .filter(|drawn| drawn.flags & TILE_VISIBLE != 0)
                .count(),
            tiles_wanted: wanted.len(),
            tiles_missing: wanted.len() - wanted.iter().filter(in_pool).count(),
            colors_missing: self.colors.wanted.len()
                - self.colors.wanted.iter().filter(in_layer).count(),
            bytes_read: self.source.0.bytes_read(),
            ram_bytes: self.room.ram_bytes + self.scheduler.reserved_bytes(&self.colors),
            vram_bytes: u64::from(slots_used) * 4 * SLOT_WORDS as u64
                + u64::from(self.colors.used()) * COLOR_BYTES,
            slots_used,
            color_layers_used: self.colors.used(),
            failures: self.scheduler.failures(),
            given_up: self.given_up(),
            features_drawn: plan.features.len(),
            feature_bytes: self
                .features
                .as_ref()
                .map_or([0; 2], FeaturePool::byte_counts),
            ..FrameStats::default()
        }
    }

    /// Wanted tiles and pictures that are waited for no longer.
    fn given_up(&self) -> usize {
        let tile = |&&place: &&u32| matches!(self.tree.node(place).life, Life::Failed { attempts, .. } if attempts >= PATIENCE);
        let color = |&&place: &&u32| matches!(self.tree.node(place).color, ColorLife::Failed { attempts, .. } if attempts >= PATIENCE);
        self.wanted.nodes.iter().filter(tile).count()
            + self.colors.wanted.iter().filter(color).count()
    }

    /// Of the screen that drawn tiles cover, the share of those that should be finer.
    fn missing_share(&self, view: &View) -> f64 {
        let late = |node: u32| self.tree.node(node).split;
        if !self.drawn.leaves.iter().any(|leaf| late(leaf.node)) {
            return 0.0;
        }
        let (mut missing, mut whole) = (0.0, 0.0);
        for leaf in &self.drawn.leaves {
            let node = self.tree.node(leaf.node);
            if node.visible {
                let area = node.bounds.screen_area(view);
                whole += area;
                missing += if node.split { area } else { 0.0 };
            }
        }
        if whole > 0.0 { missing / whole } else { 0.0 }
    }
}

/// A share of both budgets for features, where there are any.
fn set_features_aside(
    source: &dyn TileSource,
    mut descriptor: PlannerDescriptor,
) -> Result<(PlannerDescriptor, Option<FeaturePool>), PyramidError> {
    if !source.has_features() {
        return Ok((descriptor, None));
    }
    let [ram, vram] = [descriptor.ram_budget_bytes, descriptor.vram_budget_bytes]
        .map(PlannerDescriptor::feature_share);
    descriptor.ram_budget_bytes -= ram;
    descriptor.vram_budget_bytes -= vram;
    let pool = FeaturePool::new(ram, vram, source.metadata().unit())?;
    Ok((descriptor, Some(pool)))
}

#[cfg(test)]
#[path = "planner_feature_tests.rs"]
mod feature_tests;
#[cfg(test)]
#[path = "planner_tests.rs"]
mod tests;
