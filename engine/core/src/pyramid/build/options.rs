//! What a build is asked for, what it says while it runs, and what it says when it is done.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use serde::Serialize;

use super::inputs::InputStamp;
use crate::dem::Image;
use crate::pyramid::feature::FeatureInput;
use crate::pyramid::{ColorCodec, PyramidError, SourceMetadata, VerticalReference};

/// What a build is asked for.
#[derive(Clone, Debug, Default)]
pub struct BuildOptions {
    /// The pyramid's folder.
    pub output: PathBuf,
    /// Replace a pyramid that is there.
    pub overwrite: bool,
    /// Greatest distance of a stored finest sample from its source, in metres. By default the largest whose rounding
    /// gives whole metres back, and 0.1 m for other heights.
    pub eps: Option<f64>,
    /// Height unit in metres, a power of two. By default the largest that is at most eps / 8.
    pub unit: Option<f64>,
    /// Threads; by default as many as the machine has cores. The bytes do not depend on it.
    pub threads: Option<usize>,
    /// Memory the build may take, in bytes: blocks are cut to fit, on fewer threads where they must; refused beforehand
    /// where that is too little. The cages of features, small as a rule, come on top. The bytes do not depend on it.
    pub memory_budget: Option<u64>,
    /// Zero of the heights, where the caller knows.
    pub vertical: VerticalReference,
    /// Authored cages to lay into the finest level.
    pub features: Vec<FeatureInput>,
    /// The input files, as the metadata name them. With them, an interrupted build is gone on with.
    pub sources: Vec<SourceMetadata>,
    /// The files that must not change while they are read, as they were before.
    pub inputs: Vec<InputStamp>,
}

/// Imagery to drape over the terrain.
#[derive(Clone, Debug)]
pub struct Imagery<'a> {
    /// The pictures, later ones over earlier ones; one without an extent is stretched over the elevation model.
    pub images: &'a [Image],
    /// How its tiles are stored.
    pub codec: ColorCodec,
    /// Its files.
    pub sources: Vec<SourceMetadata>,
}

/// What a build is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Throwing away what an earlier run left, of other inputs or options or by another version.
    StartOver,
    /// Reading the raster.
    Read,
    /// Fitting coarser samples and cages.
    Fit,
    /// Quantising cages and residuals.
    Encode,
    /// Measuring true errors.
    Measure,
    /// Compressing and writing shards.
    Write,
    /// Making and writing imagery.
    Color,
}

impl Stage {
    /// What to call it on a progress bar.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::StartOver => "starting over",
            Self::Read => "reading",
            Self::Fit => "fitting",
            Self::Encode => "encoding",
            Self::Measure => "measuring",
            Self::Write => "writing",
            Self::Color => "imagery",
        }
    }
}

/// How far a build is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What it is doing.
    pub stage: Stage,
    /// How much of the stage is done: samples, tiles, blocks or shards.
    pub done: u64,
    /// How much there is.
    pub total: u64,
}

/// What a build made.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BuildReport {
    /// Rows and columns of finest samples.
    pub samples: [u32; 2],
    /// Finest samples that are void.
    pub void_samples: u64,
    /// Bytes of the input files, where they were named.
    pub source_bytes: u64,
    /// Levels of heights.
    pub levels: u8,
    /// Tiles of all levels.
    pub tiles: u64,
    /// The error bound of the finest level in metres.
    pub eps: f64,
    /// One height unit in metres.
    pub unit: f64,
    /// The root tile's true error in metres.
    pub root_error: f64,
    /// Bytes of the shards of each level, coarsest first.
    pub level_bytes: Vec<u64>,
    /// Bytes of all height shards.
    pub height_bytes: u64,
    /// Features laid into the ground.
    pub features: u32,
    /// Bytes of all feature shards.
    pub feature_bytes: u64,
    /// Levels of imagery.
    pub color_levels: u8,
    /// Bytes of all imagery shards.
    pub color_bytes: u64,
    /// Memory the plan allows for, in bytes.
    pub memory_bytes: u64,
    /// Tasks that an earlier run had done.
    pub kept_tasks: usize,
    /// The pyramid was there already, of the same inputs and options and by the same version: nothing was done.
    pub unchanged: bool,
    /// Wall time in seconds.
    pub seconds: f64,
}

/// Tells the caller how far a stage is, and asks whether to go on.
pub(super) struct Watch<'a> {
    progress: &'a (dyn Fn(Progress) + Sync),
    cancel: &'a AtomicBool,
}

impl<'a> Watch<'a> {
    pub(super) fn new(progress: &'a (dyn Fn(Progress) + Sync), cancel: &'a AtomicBool) -> Self {
        Self { progress, cancel }
    }

    /// Says where the caller wants no more.
    pub(super) fn check(&self) -> Result<(), PyramidError> {
        if self.cancel.load(Ordering::Relaxed) {
            Err(PyramidError::Interrupted)
        } else {
            Ok(())
        }
    }

    /// Starts a stage of so many steps; the result is to be called with every few of them.
    pub(super) fn stage(
        &self,
        stage: Stage,
        total: u64,
    ) -> impl Fn(u64) -> Result<(), PyramidError> + Sync + '_ {
        let count = AtomicU64::new(0);
        (self.progress)(Progress {
            stage,
            done: 0,
            total,
        });
        move |steps| {
            let done = count.fetch_add(steps, Ordering::Relaxed) + steps;
            (self.progress)(Progress { stage, done, total });
            self.check()
        }
    }
}
