//! The thread that meshes features: shapes from cages and samples, meshes from shapes and views.
//!
//! One job at a time; both channels hold one, so neither side ever waits unless it wants to.

use std::{
    collections::HashMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread::JoinHandle,
    time::Duration,
};

use crossbeam::channel::{Receiver, Sender, bounded};

use super::feature_mesh::{CutPlace, FeatureShape};
use crate::{
    cage::Cage,
    geo::{TILE_SAMPLES, TileId},
    pyramid::{PyramidError, Tile, feature::FeatureGroup, surface},
    reference::{refine::RefineTables, shared::border::TILE_CELLS},
};

/// What a shape is made from: the group, its cage, and its tiles in the group's order.
#[derive(Clone, Debug)]
pub(super) struct ShapeParts {
    pub(super) group: FeatureGroup,
    pub(super) place: CutPlace,
    pub(super) tiles: Vec<Arc<Tile>>,
}

/// What to mesh.
#[derive(Clone, Debug)]
pub(super) enum Source {
    /// Nothing is made yet.
    Parts(Box<ShapeParts>),
    /// The shape is there.
    Shape(Arc<FeatureShape>),
}

/// A feature to be meshed for a view.
#[derive(Clone, Debug)]
pub(super) struct MeshJob {
    pub(super) feature: u32,
    pub(super) source: Source,
    pub(super) eye: [f64; 3],
    pub(super) pixels_per_radian: f64,
    /// Depths of the mesh there is; empty when there is none.
    pub(super) depths: Arc<[u8]>,
}

/// Bytes of a buffer that WebGPU's default limits let a stage bind.
const BUFFER_BYTES: u64 = 128 << 20;

/// A mesh as the GPU gets it.
#[derive(Clone, Debug)]
pub(super) struct ReadyMesh {
    pub(super) tables: Arc<RefineTables>,
    pub(super) indices: Arc<[u32]>,
    pub(super) depths: Arc<[u8]>,
}

impl ReadyMesh {
    /// Bytes on the device, while its tables are executed, and in RAM.
    pub(super) fn byte_counts(&self) -> [u64; 2] {
        let indices = size_of_val(&*self.indices) as u64;
        [self.tables.device_bytes(), self.tables.byte_count()].map(|bytes| bytes + indices)
    }
}

/// What came of a job.
#[derive(Debug)]
pub(super) struct Meshed {
    pub(super) feature: u32,
    pub(super) shape: Option<Arc<FeatureShape>>,
    /// None when the depths are still those of the mesh there is.
    pub(super) mesh: Option<ReadyMesh>,
    pub(super) error: Option<String>,
}

/// The thread and the channels to it.
#[derive(Debug)]
pub(super) struct Mesher {
    jobs: Option<Sender<Box<MeshJob>>>,
    answers: Receiver<Meshed>,
    thread: Option<JoinHandle<()>>,
    is_busy: bool,
}

impl Mesher {
    pub(super) fn new() -> Result<Self, PyramidError> {
        let (jobs, inbox) = bounded(1);
        let (outbox, answers) = bounded(1);
        let thread = std::thread::Builder::new().name("drumlin-mesher".into());
        let thread = thread
            .spawn(move || work(&inbox, &outbox))
            .map_err(|error| {
                PyramidError::Refused(format!("starting the meshing thread: {error}"))
            })?;
        Ok(Self {
            jobs: Some(jobs),
            answers,
            thread: Some(thread),
            is_busy: false,
        })
    }

    /// True while a job is under way.
    pub(super) fn is_busy(&self) -> bool {
        self.is_busy
    }

    /// Starts a job; nothing may be under way.
    pub(super) fn start(&mut self, job: Box<MeshJob>) {
        let sent = self.jobs.as_ref().map(|jobs| jobs.try_send(job));
        self.is_busy = matches!(sent, Some(Ok(())));
    }

    /// What came of the job, waiting for it at most so long.
    pub(super) fn answer(&mut self, wait: Duration) -> Option<Meshed> {
        let answer = if wait.is_zero() {
            self.answers.try_recv().ok()
        } else {
            self.answers.recv_timeout(wait).ok()
        };
        self.is_busy &= answer.is_none();
        answer
    }
}

impl Drop for Mesher {
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has nothing left to say.
            let _ = thread.join();
        }
    }
}

fn work(jobs: &Receiver<Box<MeshJob>>, answers: &Sender<Meshed>) {
    for job in jobs {
        let feature = job.feature;
        // A panic is a bug of ours; it costs a feature and not the flight.
        let meshed = catch_unwind(AssertUnwindSafe(|| mesh(&job)))
            .unwrap_or_else(|_| Err("meshing it panicked".into()));
        let meshed = meshed.unwrap_or_else(|error| Meshed {
            feature,
            shape: None,
            mesh: None,
            error: Some(format!("feature {feature}: {error}")),
        });
        if answers.send(meshed).is_err() {
            return;
        }
    }
}

fn mesh(job: &MeshJob) -> Result<Meshed, String> {
    let shape = match &job.source {
        Source::Shape(shape) => Arc::clone(shape),
        Source::Parts(parts) => Arc::new(shape_of(parts).map_err(|error| error.to_string())?),
    };
    let depths = shape.depths(job.eye, job.pixels_per_radian, &job.depths);
    let mesh = if depths[..] == job.depths[..] {
        None
    } else {
        let table = shape.table(&depths).map_err(|error| error.to_string())?;
        let (tables, indices) = table.packed(&shape);
        let largest = tables
            .largest_buffer_bytes()
            .max(size_of_val(&*indices) as u64);
        if largest > BUFFER_BYTES {
            return Err(format!(
                "its mesh needs a buffer of {largest} bytes, above the limit of {BUFFER_BYTES}"
            ));
        }
        Some(ReadyMesh {
            tables: tables.into(),
            indices: indices.into(),
            depths: depths.into(),
        })
    };
    Ok(Meshed {
        feature: job.feature,
        shape: Some(shape),
        mesh,
        error: None,
    })
}

fn shape_of(parts: &ShapeParts) -> Result<FeatureShape, PyramidError> {
    let cage = parts
        .group
        .cage
        .as_ref()
        .ok_or_else(|| PyramidError::Refused("its home tile has no cage".into()))?;
    let tiles = parts.tiles.iter().map(|tile| &**tile);
    shape(cage, parts.place, tiles)
}

/// The shape of a cage laid into tiles.
pub(super) fn shape<'a>(
    cage: &Cage,
    place: CutPlace,
    tiles: impl Iterator<Item = &'a Tile>,
) -> Result<FeatureShape, PyramidError> {
    let heights: HashMap<TileId, Vec<i32>> = tiles
        .map(|tile| {
            let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
            (tile.id, heights)
        })
        .collect();
    let level = heights.keys().next().map_or(0, |id| id.level);
    FeatureShape::new(cage, place, |sample| {
        let [row, column] = sample.map(|at| at / TILE_CELLS);
        let inside = sample.map(|at| (at % TILE_CELLS) as usize);
        heights
            .get(&TileId::new(level, row, column))
            .map_or(0, |heights| heights[inside[0] * TILE_SAMPLES + inside[1]])
    })
}
