//! What a build does and what it takes, settled before anything is read.

use super::options::{BuildOptions, Imagery};
use super::{color, read};
use crate::dem::Raster;
use crate::geo::TILE_CELLS;
use crate::pyramid::PyramidError;

/// Bytes that are needed whatever the raster: the program, the writer's groups and its batch of chunks.
const FIXED_BYTES: u64 = 40 << 20;
/// Bytes a thread needs whatever the blocks: its stack, its compressor, a block of errors.
const THREAD_BYTES: u64 = 8 << 20;
/// Tiles a side of the largest block: larger ones save less than a twentieth of their halo.
const MOST_TILES: usize = 8;
/// Samples around a block that are in memory with it.
const HALO: usize = TILE_CELLS;
/// Bytes a sample of a block while its cage is fitted: packed, whole, projected, halved and settled.
const BLOCK_SAMPLE_BYTES: u64 = 18;
/// Bytes a sample of a window while it is read: as a height in metres, in units and packed.
const WINDOW_SAMPLE_BYTES: u64 = 16;

/// How the work is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    /// Threads, each with a block or a window of its own.
    pub(super) threads: usize,
    /// Tiles a side of a block.
    pub(super) block_tiles: usize,
    /// Samples of a window that is read.
    pub(super) window_samples: u64,
    /// The memory it takes at its peak, in bytes.
    pub(super) memory_bytes: u64,
}

impl Shape {
    /// As many threads as asked for, or the most of which even the smallest blocks fit the budget; then the largest
    /// blocks that fit on those.
    ///
    /// # Errors
    /// [`PyramidError::Refused`] where one thread with the smallest blocks takes more than the budget.
    pub(super) fn new(
        raster: &dyn Raster,
        imagery: Option<&Imagery<'_>>,
        options: &BuildOptions,
    ) -> Result<Self, PyramidError> {
        let grid = raster.header().grid;
        let threads = options.threads.filter(|count| *count > 0);
        let threads = threads.unwrap_or_else(|| {
            std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
        });
        let fixed = FIXED_BYTES + raster.memory_bytes() + imagery.map_or(0, color::memory_bytes);
        let thread = imagery.map_or(0, color::thread_bytes);
        let budget = options.memory_budget.unwrap_or(u64::MAX);
        let shapes = (1..=threads).rev().flat_map(|threads| {
            std::iter::successors(Some(MOST_TILES), |tiles| (*tiles > 1).then_some(tiles / 2))
                .map(move |tiles| Self::of(raster, [fixed, thread], threads, tiles))
        });
        let mut least = None;
        for shape in shapes {
            if shape.memory_bytes <= budget {
                return Ok(shape);
            }
            least = Some(shape.memory_bytes);
        }
        Err(PyramidError::Refused(format!(
            "building {} x {} samples takes about {} MiB of memory at least; the budget is {} MiB",
            grid.rows,
            grid.columns,
            least.unwrap_or(fixed).div_ceil(1 << 20),
            budget >> 20
        )))
    }

    fn of(
        raster: &dyn Raster,
        [fixed, thread]: [u64; 2],
        threads: usize,
        block_tiles: usize,
    ) -> Self {
        let side = block_tiles * TILE_CELLS;
        let window_samples = (side * side) as u64;
        // A plane's last block of a row or column takes the plane's last sample too.
        let block = ((side + 1 + 2 * HALO) as u64).pow(2) * BLOCK_SAMPLE_BYTES;
        let samples = read::window_samples(raster, window_samples);
        let window = samples * WINDOW_SAMPLE_BYTES + raster.read_bytes(samples);
        let memory_bytes = fixed + threads as u64 * (THREAD_BYTES + block.max(window).max(thread));
        Self {
            threads,
            block_tiles,
            window_samples,
            memory_bytes,
        }
    }

    /// Samples a side of a block.
    pub(super) const fn block_side(&self) -> usize {
        self.block_tiles * TILE_CELLS
    }
}
