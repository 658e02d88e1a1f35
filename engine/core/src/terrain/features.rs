//! Features in flight: which are drawn in place of their ground, and which meshes that takes.
//!
//! ```text
//! unknown → (all tiles drawn at the finest level) → meshing → ready → up ⇄ meshing anew as the view moves
//! ```
//!
//! A feature is drawn when all its tiles are drawn at the finest level and its mesh is up; and, as a tile's cut bits speak
//! of all its features, when all features of its tiles are so too. Otherwise its ground is drawn. Meshes are made on a
//! thread of their own, and count in shares of the RAM and VRAM budgets; one that does not fit is not drawn.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
    time::Duration,
};

use super::{
    FeatureDraw, FeatureUpload, FramePlan,
    feature_mesh::{CutPlace, FeatureShape},
    mesher::{MeshJob, Mesher, ReadyMesh, ShapeParts, Source},
};
use crate::{
    geo::TileId,
    pyramid::{PyramidError, Tile, feature::FeatureGroup},
    reference::shared::{
        TILE_CUT,
        border::{QUAD_SAMPLES, TILE_QUADS},
    },
    stream::{Drawn, Tree, View},
};

/// Share of a feature's distance that the eye moves before its depths are chosen anew.
const MOVED: f64 = 0.05;

/// All features that were met, and the thread that meshes them.
#[derive(Debug)]
pub(super) struct FeaturePool {
    mesher: Mesher,
    groups: BTreeMap<u32, Group>,
    ram_budget: u64,
    vram_budget: u64,
    unit: f64,
    errors: Vec<String>,
}

#[derive(Debug, Default)]
struct Group {
    shape: Option<Arc<FeatureShape>>,
    mesh: Option<ReadyMesh>,
    /// A mesh, this one or the one before, is in a plan that was handed out.
    is_up: bool,
    /// This mesh is in no plan yet.
    is_new: bool,
    /// It cannot be meshed, or does not fit.
    is_refused: bool,
    /// View of the last job: the eye and pixels per radian.
    seen: Option<([f64; 3], f64)>,
    /// Last plan whose drawn cut held all its tiles.
    used: u64,
}

/// A group all of whose tiles are drawn at the finest level.
struct Candidate {
    group: FeatureGroup,
    drawn: Vec<u32>,
    tiles: Vec<Arc<Tile>>,
}

impl FeaturePool {
    pub(super) fn new(ram_budget: u64, vram_budget: u64, unit: f64) -> Result<Self, PyramidError> {
        Ok(Self {
            mesher: Mesher::new()?,
            groups: BTreeMap::new(),
            ram_budget,
            vram_budget,
            unit,
            errors: Vec::new(),
        })
    }

    /// What went wrong since the last call.
    pub(super) fn take_errors(&mut self) -> Vec<String> {
        std::mem::take(&mut self.errors)
    }

    /// The device was lost: meshes go up again.
    pub(super) fn forget_uploads(&mut self) {
        for group in self.groups.values_mut() {
            (group.is_up, group.is_new) = (false, group.mesh.is_some());
        }
    }

    /// Bytes in VRAM and in RAM.
    pub(super) fn byte_counts(&self) -> [u64; 2] {
        let (mut vram, mut ram) = (0, 0);
        for group in self.groups.values() {
            let mesh = group.mesh.as_ref().map_or([0; 2], ReadyMesh::byte_counts);
            vram += if group.is_up { mesh[0] } else { 0 };
            ram += mesh[1] + group.shape.as_ref().map_or(0, |shape| shape.byte_count());
        }
        [vram, ram]
    }

    /// Puts into a plan what its features need; when the plan is to wait, meshes are waited for.
    pub(super) fn plan(
        &mut self,
        plan: &mut FramePlan,
        tree: &Tree,
        drawn: &Drawn,
        view: &View,
        (number, wait): (u64, bool),
    ) {
        let candidates = candidates(plan, tree, drawn);
        for candidate in candidates.values() {
            self.groups.entry(candidate.group.id).or_default().used = number;
        }
        self.receive(Duration::ZERO);
        self.start_next(&candidates, tree, view);
        while wait && self.mesher.is_busy() {
            self.receive(Duration::from_secs(1));
            self.start_next(&candidates, tree, view);
        }
        self.leave_unused(plan, number);
        self.upload(plan, &candidates, wait);
        self.draw(plan, tree, drawn, &candidates);
    }

    fn receive(&mut self, wait: Duration) {
        let Some(meshed) = self.mesher.answer(wait) else {
            return;
        };
        let Some(group) = self.groups.get_mut(&meshed.feature) else {
            return;
        };
        if let Some(error) = meshed.error {
            group.is_refused = true;
            self.errors.push(error);
            return;
        }
        group.shape = meshed.shape;
        if let Some(mesh) = meshed.mesh {
            (group.mesh, group.is_new) = (Some(mesh), true);
        }
    }

    /// Gives the thread its next job: a feature without a mesh, or one from which the eye has moved.
    fn start_next(&mut self, candidates: &BTreeMap<u32, Candidate>, tree: &Tree, view: &View) {
        if self.mesher.is_busy() {
            return;
        }
        let pixels_per_radian = view.pixels_per_radian();
        for (id, candidate) in candidates {
            let Some(group) = self.groups.get_mut(id) else {
                continue;
            };
            if group.is_refused || !is_due(group, view) {
                continue;
            }
            group.seen = Some((view.eye, pixels_per_radian));
            let source = match &group.shape {
                Some(shape) => Source::Shape(Arc::clone(shape)),
                None => Source::Parts(Box::new(ShapeParts {
                    place: cut_place(candidate.group.cut, tree, self.unit),
                    group: candidate.group.clone(),
                    tiles: candidate.tiles.clone(),
                })),
            };
            let depths = group
                .mesh
                .as_ref()
                .map_or_else(Arc::default, |mesh| Arc::clone(&mesh.depths));
            self.mesher.start(Box::new(MeshJob {
                feature: *id,
                source,
                eye: view.eye,
                pixels_per_radian,
                depths,
            }));
            return;
        }
    }

    /// Forgets features that no drawn cut holds any more, as soon as there is no room for all.
    fn leave_unused(&mut self, plan: &mut FramePlan, number: u64) {
        let [vram, ram] = self.wanted_bytes();
        if vram <= self.vram_budget && ram <= self.ram_budget {
            return;
        }
        self.groups.retain(|&id, group| {
            let stays = group.used == number || group.is_refused;
            if !stays && group.is_up {
                plan.feature_frees.push(id);
            }
            stays
        });
        // Still too much: the last ones are not drawn.
        while let Some((&id, group)) = self
            .groups
            .iter_mut()
            .rev()
            .find(|(_, group)| group.mesh.is_some())
        {
            let mesh = group.mesh.take();
            let freed = std::mem::take(&mut group.is_up);
            let [vram, ram] = self.wanted_bytes();
            let own = mesh.as_ref().map_or([0; 2], ReadyMesh::byte_counts);
            if vram + own[0] <= self.vram_budget && ram + own[1] <= self.ram_budget {
                if let Some(group) = self.groups.get_mut(&id) {
                    (group.mesh, group.is_up) = (mesh, freed);
                }
                return;
            }
            if let Some(group) = self.groups.get_mut(&id) {
                (group.shape, group.is_refused) = (None, true);
            }
            if freed {
                plan.feature_frees.push(id);
            }
            self.errors.push(format!(
                "feature {id}: its mesh does not fit the budget; its ground is drawn"
            ));
        }
    }

    fn wanted_bytes(&self) -> [u64; 2] {
        let meshes = self.groups.values().filter_map(|group| group.mesh.as_ref());
        [
            meshes.map(|mesh| mesh.byte_counts()[0]).sum(),
            self.byte_counts()[1],
        ]
    }

    /// One mesh a plan; all of them when the plan waits.
    fn upload(&mut self, plan: &mut FramePlan, candidates: &BTreeMap<u32, Candidate>, wait: bool) {
        for id in candidates.keys() {
            let Some(group) = self.groups.get_mut(id).filter(|group| group.is_new) else {
                continue;
            };
            if let Some(mesh) = &group.mesh {
                plan.feature_uploads.push(FeatureUpload {
                    feature: *id,
                    tables: Arc::clone(&mesh.tables),
                    indices: Arc::clone(&mesh.indices),
                });
                (group.is_up, group.is_new) = (true, false);
                if !wait {
                    return;
                }
            }
        }
    }

    /// Draws what can be drawn, and marks its tiles.
    fn draw(
        &self,
        plan: &mut FramePlan,
        tree: &Tree,
        drawn: &Drawn,
        candidates: &BTreeMap<u32, Candidate>,
    ) {
        let is_up = |id: &u32| self.groups.get(id).is_some_and(|group| group.is_up);
        let mut chosen: BTreeMap<u32, &Candidate> = candidates
            .iter()
            .filter(|(id, _)| is_up(id))
            .map(|(&id, candidate)| (id, candidate))
            .collect();
        // A tile with one feature that is not drawn keeps its ground, and so do its other features.
        loop {
            let complete = |candidate: &&Candidate| {
                candidate.drawn.iter().all(|&tile| {
                    let node = tree.node(drawn.leaves[tile as usize].node);
                    node.features
                        .iter()
                        .all(|group| chosen.contains_key(&group.id))
                })
            };
            let dropped: Vec<u32> = chosen
                .iter()
                .filter(|(_, candidate)| !complete(candidate))
                .map(|(&id, _)| id)
                .collect();
            if dropped.is_empty() {
                break;
            }
            for id in dropped {
                chosen.remove(&id);
            }
        }
        for (id, candidate) in chosen {
            let place = self.groups[&id].shape.as_ref().map(|shape| shape.origin());
            plan.features.push(FeatureDraw {
                feature: id,
                place: place.unwrap_or_default(),
                origin: [0.0; 3],
                tiles: candidate.drawn.clone(),
            });
            for &tile in &candidate.drawn {
                plan.drawn[tile as usize].flags |= TILE_CUT;
            }
        }
    }
}

fn is_due(group: &Group, view: &View) -> bool {
    let Some((eye, pixels_per_radian)) = group.seen else {
        return true;
    };
    let distance = |a: [f64; 3], b: [f64; 3]| {
        (0..3)
            .map(|axis| (a[axis] - b[axis]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let origin = group.shape.as_ref().map_or(eye, |shape| shape.origin());
    let has_moved = distance(eye, view.eye) > MOVED * distance(origin, view.eye);
    group.mesh.is_none() || has_moved || (view.pixels_per_radian() - pixels_per_radian).abs() > 1e-9
}

/// The groups all of whose tiles are drawn at the finest level, by number.
fn candidates(plan: &FramePlan, tree: &Tree, drawn: &Drawn) -> BTreeMap<u32, Candidate> {
    let mut found = BTreeMap::new();
    let homes = drawn.leaves.iter().flat_map(|leaf| {
        let features = &tree.node(leaf.node).features;
        features.iter().filter(|group| group.cage.is_some())
    });
    let mut homes = homes.peekable();
    if homes.peek().is_none() {
        return found;
    }
    let places: HashMap<TileId, u32> = plan
        .places
        .iter()
        .zip(0..)
        .map(|(place, drawn)| (place.id, drawn))
        .collect();
    for group in homes {
        let all = group.tiles.iter().map(|id| {
            let &at = places.get(id)?;
            let tile = tree.node(drawn.leaves[at as usize].node).tile()?;
            Some((at, Arc::clone(tile)))
        });
        if let Some(all) = all.collect::<Option<Vec<_>>>() {
            let (drawn, tiles) = all.into_iter().unzip();
            let candidate = Candidate {
                group: group.clone(),
                drawn,
                tiles,
            };
            found.insert(group.id, candidate);
        }
    }
    found
}

fn cut_place(cut: [u32; 4], tree: &Tree, unit: f64) -> CutPlace {
    let first = TileId::new(tree.finest(), 0, 0);
    let ([x, y], step) = tree.corner_and_step(first);
    let [row, column] = [cut[0], cut[1]].map(|patch| f64::from(patch * QUAD_SAMPLES));
    CutPlace {
        cut,
        corner: [x + column * step[0], y + row * step[1]],
        step,
        unit,
    }
}

/// The bits of a tile's patches that features stand in for; none where there is no feature.
pub(super) fn cut_bits(id: TileId, features: &[FeatureGroup]) -> Option<Box<[u32; 32]>> {
    if features.is_empty() {
        return None;
    }
    let mut bits = Box::new([0; 32]);
    for group in features {
        let [row0, column0, row1, column1] = group.cut;
        let part = |from: u32, to: u32, tile: u32| {
            let first = tile * TILE_QUADS;
            from.saturating_sub(first).min(TILE_QUADS)..to.saturating_sub(first).min(TILE_QUADS)
        };
        for row in part(row0, row1, id.row) {
            for column in part(column0, column1, id.column) {
                bits[row as usize] |= 1 << column;
            }
        }
    }
    Some(bits)
}
