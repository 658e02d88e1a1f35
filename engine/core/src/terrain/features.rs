//! Features in flight: which are drawn in place of their ground, and which meshes that takes.
//!
//! ```text
//! unknown → (all tiles drawn at the finest level) → meshing → ready → up ⇄ meshing anew as the view moves
//! ```
//!
//! A feature is drawn when all its tiles are drawn at the finest level and its mesh is up; and, as a tile's cut bits speak
//! of all its features, when all features of its tiles are so too. Otherwise its ground is drawn. Meshes are made on a
//! thread of their own, the nearest first, and count in shares of the RAM and VRAM budgets; where not all fit, the farthest
//! are not drawn until they do.

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
    reference::shared::{TILE_CUT, border::TILE_QUADS},
    stream::{Bounds, Drawn, Tree, View},
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
    refusal: Option<Refusal>,
    /// The view of the last job.
    seen: Option<Seen>,
    /// Last plan whose drawn cut held all its tiles.
    used: u64,
}

/// Why a feature has no mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Refusal {
    /// It cannot be meshed.
    Broken,
    /// Its mesh took so many bytes, in VRAM and in RAM, and did not fit beside nearer ones.
    TooLarge([u64; 2]),
}

/// What a mesh was made for.
#[derive(Clone, Copy, Debug)]
struct Seen {
    eye: [f64; 3],
    pixels_per_radian: f64,
    /// The plan that asked for it.
    plan: u64,
}

/// A group all of whose tiles are drawn at the finest level.
struct Candidate<'a> {
    group: &'a FeatureGroup,
    drawn: Vec<u32>,
    tiles: Vec<&'a Arc<Tile>>,
    /// Metres from the eye to the nearest of its tiles' boxes.
    distance: f64,
}

type Candidates<'a> = BTreeMap<u32, Candidate<'a>>;

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
        let groups = self.groups.values().map(|group| {
            let [vram, ram] = group.byte_counts();
            [if group.is_up { vram } else { 0 }, ram]
        });
        groups.fold([0; 2], |sum, own| [0, 1].map(|of| sum[of] + own[of]))
    }

    /// Puts into a plan what its features need; when the plan is to wait, meshes are waited for. Returns the bytes that go
    /// up, and how many features could be drawn but for a refusal.
    pub(super) fn plan(
        &mut self,
        plan: &mut FramePlan,
        tree: &Tree,
        drawn: &Drawn,
        view: &View,
        (number, wait): (u64, bool),
    ) -> (u64, usize) {
        let candidates = candidates(plan, tree, drawn, view.eye);
        for &id in candidates.keys() {
            self.groups.entry(id).or_default().used = number;
        }
        self.receive(Duration::ZERO);
        self.retry(&candidates);
        self.start_next(&candidates, tree, view, number);
        while wait && self.mesher.is_busy() {
            self.receive(Duration::from_secs(1));
            self.start_next(&candidates, tree, view, number);
        }
        self.keep_budget(plan, &candidates, number);
        let bytes = self.upload(plan, &candidates, wait);
        self.draw(plan, tree, drawn, &candidates);
        let is_refused = |id: &&u32| self.groups[id].refusal.is_some();
        (bytes, candidates.keys().filter(is_refused).count())
    }

    fn receive(&mut self, wait: Duration) {
        let Some(meshed) = self.mesher.answer(wait) else {
            return;
        };
        let Some(group) = self.groups.get_mut(&meshed.feature) else {
            return;
        };
        if let Some(error) = meshed.error {
            group.refusal = Some(Refusal::Broken);
            self.errors.push(error);
            return;
        }
        group.shape = meshed.shape;
        if let Some(mesh) = meshed.mesh {
            (group.mesh, group.is_new) = (Some(mesh), true);
        }
    }

    /// What did not fit is tried again once it would, beside the candidates that are nearer.
    fn retry(&mut self, candidates: &Candidates<'_>) {
        let mut room = self.room();
        for id in nearest_first(candidates) {
            let Some(group) = self.groups.get_mut(&id) else {
                continue;
            };
            let bytes = match group.refusal {
                Some(Refusal::TooLarge(bytes)) => bytes,
                _ => group.byte_counts(),
            };
            if room.take(bytes) && group.refusal != Some(Refusal::Broken) {
                group.refusal = None;
            }
        }
    }

    /// Gives the thread its next job: the nearest feature without a mesh, or else, of those that the eye has moved from,
    /// the one whose last job is the longest ago.
    fn start_next(&mut self, candidates: &Candidates<'_>, tree: &Tree, view: &View, number: u64) {
        if self.mesher.is_busy() {
            return;
        }
        let due = nearest_first(candidates).into_iter().filter(|id| {
            let group = &self.groups[id];
            group.refusal.is_none() && is_due(group, view)
        });
        let last = |id: &u32| {
            let group = &self.groups[id];
            group.mesh.as_ref().and(group.seen).map(|seen| seen.plan)
        };
        // Of equal ones the first: the nearest.
        let Some(id) = due.min_by_key(last) else {
            return;
        };
        let candidate = &candidates[&id];
        let pixels_per_radian = view.pixels_per_radian();
        let Some(group) = self.groups.get_mut(&id) else {
            return;
        };
        group.seen = Some(Seen {
            eye: view.eye,
            pixels_per_radian,
            plan: number,
        });
        let (corner, step) = tree.corner_and_step(TileId::new(tree.finest(), 0, 0));
        let source = match &group.shape {
            Some(shape) => Source::Shape(Arc::clone(shape)),
            None => Source::Parts(Box::new(ShapeParts {
                place: CutPlace::new(candidate.group.cut, corner, step, self.unit),
                group: candidate.group.clone(),
                tiles: candidate
                    .tiles
                    .iter()
                    .map(|&tile| Arc::clone(tile))
                    .collect(),
            })),
        };
        let depths = group
            .mesh
            .as_ref()
            .map_or_else(Arc::default, |mesh| Arc::clone(&mesh.depths));
        self.mesher.start(Box::new(MeshJob {
            feature: id,
            source,
            eye: view.eye,
            pixels_per_radian,
            depths,
        }));
    }

    /// As soon as there is no room for all: forgets features that no drawn cut holds any more, then leaves out
    /// those that do not fit beside nearer ones.
    fn keep_budget(&mut self, plan: &mut FramePlan, candidates: &Candidates<'_>, number: u64) {
        let mut room = self.room();
        if self
            .groups
            .values()
            .all(|group| room.take(group.byte_counts()))
        {
            return;
        }
        self.groups.retain(|&id, group| {
            let stays = group.used == number || group.refusal == Some(Refusal::Broken);
            if !stays && group.is_up {
                plan.feature_frees.push(id);
            }
            stays
        });
        let mut room = self.room();
        for id in nearest_first(candidates) {
            let Some(group) = self.groups.get_mut(&id) else {
                continue;
            };
            let bytes = group.byte_counts();
            if room.take(bytes) {
                continue;
            }
            if std::mem::take(&mut group.is_up) {
                plan.feature_frees.push(id);
            }
            (group.mesh, group.shape, group.is_new) = (None, None, false);
            group.refusal = Some(Refusal::TooLarge(bytes));
            self.errors.push(format!(
                "feature {id}: its mesh does not fit the budget; its ground is drawn"
            ));
        }
    }

    fn room(&self) -> Room {
        Room([self.vram_budget, self.ram_budget])
    }

    /// One mesh a plan, however large; all of them when the plan waits. Returns the bytes that go up.
    fn upload(&mut self, plan: &mut FramePlan, candidates: &Candidates<'_>, wait: bool) -> u64 {
        let mut bytes = 0;
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
                bytes += mesh.byte_counts()[1];
                (group.is_up, group.is_new) = (true, false);
                if !wait {
                    break;
                }
            }
        }
        bytes
    }

    /// Draws what can be drawn, and marks its tiles.
    fn draw(&self, plan: &mut FramePlan, tree: &Tree, drawn: &Drawn, candidates: &Candidates<'_>) {
        let is_up = |id: &u32| self.groups.get(id).is_some_and(|group| group.is_up);
        let mut chosen: BTreeMap<u32, &Candidate<'_>> = candidates
            .iter()
            .filter(|(id, _)| is_up(id))
            .map(|(&id, candidate)| (id, candidate))
            .collect();
        // A tile with one feature that is not drawn keeps its ground, and so do its other features.
        loop {
            let complete = |candidate: &&Candidate<'_>| {
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

/// Bytes that are left, in VRAM and in RAM.
struct Room([u64; 2]);

impl Room {
    /// Takes bytes, unless there are too few left.
    fn take(&mut self, bytes: [u64; 2]) -> bool {
        let fits = (0..2).all(|of| bytes[of] <= self.0[of]);
        if fits {
            self.0 = [0, 1].map(|of| self.0[of] - bytes[of]);
        }
        fits
    }
}

impl Group {
    /// Bytes of its mesh in VRAM, and of the mesh and its shape in RAM.
    fn byte_counts(&self) -> [u64; 2] {
        let [vram, ram] = self.mesh.as_ref().map_or([0; 2], ReadyMesh::byte_counts);
        [
            vram,
            ram + self.shape.as_ref().map_or(0, |shape| shape.byte_count()),
        ]
    }
}

/// True without a mesh, and when the eye has moved so far, seen from the feature, that its depths may be others.
fn is_due(group: &Group, view: &View) -> bool {
    let (Some(seen), Some(shape), Some(_)) = (group.seen, &group.shape, &group.mesh) else {
        return true;
    };
    let step = [0, 1, 2].map(|axis| view.eye[axis] - seen.eye[axis]);
    let moved = step.iter().map(|part| part * part).sum::<f64>().sqrt();
    let distance = shape.bounds().distance(view.eye).max(view.near);
    moved > MOVED * distance || (view.pixels_per_radian() - seen.pixels_per_radian).abs() > 1e-9
}

/// Numbers of candidates, by distance from the eye.
fn nearest_first(candidates: &Candidates<'_>) -> Vec<u32> {
    let mut ids: Vec<u32> = candidates.keys().copied().collect();
    ids.sort_by(|a, b| candidates[a].distance.total_cmp(&candidates[b].distance));
    ids
}

/// The groups all of whose tiles are drawn at the finest level, by number.
fn candidates<'a>(
    plan: &FramePlan,
    tree: &'a Tree,
    drawn: &Drawn,
    eye: [f64; 3],
) -> Candidates<'a> {
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
            Some((at, tile))
        });
        if let Some(all) = all.collect::<Option<Vec<_>>>() {
            let (drawn, tiles): (Vec<u32>, _) = all.into_iter().unzip();
            let distances = drawn.iter().map(|&at| {
                let bounds: Bounds = plan.places[at as usize].bounds;
                bounds.distance(eye)
            });
            let candidate = Candidate {
                group,
                distance: distances.fold(f64::INFINITY, f64::min),
                drawn,
                tiles,
            };
            found.insert(group.id, candidate);
        }
    }
    found
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
