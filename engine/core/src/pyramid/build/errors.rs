//! The way up again: how far every level's triangles lie from the finest samples, measured in one pass over those.
//!
//! A block of finest samples is read once and every coarser level's patches over it are measured against it. Where a
//! patch is larger than a block, its error is the greatest of its parts': an entry of a level's plane is a patch or the
//! part of one in a block, and whoever wants a patch's errors joins its entries.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::area::{Area, Blocks};
use super::journal::Made;
use super::levels::Levels;
use super::measure::{Drawn, Finest, PatchErrors};
use super::options::Stage;
use super::planes::TASK_SIDE;
use super::samples::Samples;
use super::scratch::{Check, Plane, Written};
use super::tasks::{Job, Tasks};
use crate::geo::{Grid, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS, TILE_QUADS, TileId};
use crate::pyramid::PyramidError;

/// Finest samples a side of a block.
const SIDE: usize = 4 * TILE_CELLS;
/// Entries read at once.
const READ_ENTRIES: usize = 1 << 15;

/// The errors of all levels but the finest, whose triangles at stride 1 are its samples.
pub(super) struct Errors {
    /// Coarsest level first.
    planes: Vec<ErrorPlane>,
    /// Least and greatest finest height that is not void.
    pub(super) height_range: [i32; 2],
}

/// One level's errors.
struct ErrorPlane {
    /// Entries of [`PatchErrors`], as f32 bits, rounded up.
    plane: Plane<3>,
    stride: usize,
    /// Finest samples a side of an entry.
    entry: usize,
}

impl Errors {
    /// Measures all levels.
    pub(super) fn measure(
        levels: &Levels,
        grid: &Grid,
        scratch: &Path,
        tasks: &Tasks<'_>,
    ) -> Result<Self, PyramidError> {
        let data = [grid.rows, grid.columns].map(|count| count as usize);
        let coarser = 0..grid.level_count() - 1;
        let planes = coarser.map(|level| ErrorPlane::create(scratch, level, grid, data));
        let mut errors = Self {
            planes: planes.collect::<Result<_, _>>()?,
            height_range: [i32::MAX, i32::MIN],
        };
        // A sample on the border of blocks is in both, and one past the last whole block in one more.
        let advance = tasks.watch.stage(Stage::Measure, block_count(grid));
        let planes: Vec<&dyn Check> = errors
            .planes
            .iter()
            .map(|errors| &errors.plane as _)
            .collect();
        let job = Job {
            pass: "measure",
            planes: &planes,
            in_turn: false,
            advance: &advance,
        };
        let parts = parts(grid);
        let blocks = |task| {
            let Area { rows, columns } = parts.area(task);
            rows.flat_map(|row| columns.clone().map(move |column| [row, column]))
                .collect()
        };
        let block = |place: [i64; 2]| {
            let first = place.map(|index| usize::try_from(index).unwrap_or(0) * SIDE);
            errors.measure_block(levels, first, data)
        };
        let range = tasks.run(&job, blocks, block, Range::join)?.found;
        errors.height_range = range.0;
        Ok(errors)
    }

    fn measure_block(
        &self,
        levels: &Levels,
        first: [usize; 2],
        data: [usize; 2],
    ) -> Result<Made<Range>, PyramidError> {
        let [rows, columns] =
            [0, 1].map(|axis| first[axis]..(first[axis] + SIDE + 1).min(data[axis]));
        let area = Area::new(rows, columns);
        let Some(finest) = levels.samples.last() else {
            return Ok(Made::default());
        };
        let finest = finest.read(&area)?;
        let finest = Finest::new(&finest);
        let mut written = Vec::new();
        for (errors, drawn) in self.planes.iter().zip(&levels.samples) {
            let patches = errors.patches(first);
            let samples = |range: &std::ops::Range<usize>| {
                range.start * QUAD_SAMPLES..range.end * QUAD_SAMPLES + 1
            };
            let [rows, columns] = &patches;
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            let own = Area::new(samples(rows), samples(columns));
            written.push(errors.write(first, &patches, &drawn.read(&own)?, &finest)?);
        }
        Ok(Made::new(Range(finest.range()), written))
    }

    /// The errors of a tile: of the whole of it at stride 1, and of its patches; in units, rounded up. None at the
    /// finest level.
    pub(super) fn tile(&self, tile: TileId) -> Result<Option<Vec<PatchErrors>>, PyramidError> {
        self.planes
            .get(usize::from(tile.level))
            .map(|errors| errors.tile([tile.row, tile.column]))
            .transpose()
    }
}

/// The tasks, in blocks.
pub(super) fn parts(grid: &Grid) -> Blocks {
    let blocks = [grid.rows, grid.columns].map(|count| (count as usize).div_ceil(SIDE));
    Blocks::new(blocks, TASK_SIDE / SIDE)
}

/// Blocks of finest samples that are measured.
pub(super) fn block_count(grid: &Grid) -> u64 {
    let [rows, columns] =
        [grid.rows, grid.columns].map(|count| u64::from(count).div_ceil(SIDE as u64));
    rows * columns
}

impl ErrorPlane {
    fn create(
        scratch: &Path,
        level: u8,
        grid: &Grid,
        data: [usize; 2],
    ) -> Result<Self, PyramidError> {
        let stride = grid.stride(level) as usize;
        let entry = SIDE.min(QUAD_SAMPLES * stride);
        // Every patch with data in it; one that starts where both the data and the tiles end is none.
        let tiles = grid.tiles(level).map(|count| count as usize);
        let size = [0, 1].map(|axis| {
            let all = tiles[axis] * TILE_CELLS * stride / entry;
            data[axis].div_ceil(entry).min(all)
        });
        Ok(Self {
            plane: Plane::create(scratch, &format!("errors-{level}"), size, TASK_SIDE / entry)?,
            stride,
            entry,
        })
    }

    /// Finest samples a side of a patch.
    const fn patch_side(&self) -> usize {
        QUAD_SAMPLES * self.stride
    }

    /// The rows and columns of entries of a block that starts at a row and column of finest samples.
    fn entries(&self, first: [usize; 2]) -> [std::ops::Range<usize>; 2] {
        let size = self.plane.size();
        [0, 1].map(|axis| {
            let start = (first[axis] / self.entry).min(size[axis]);
            start..(start + SIDE / self.entry).min(size[axis])
        })
    }

    /// The rows and columns of patches those lie in.
    fn patches(&self, first: [usize; 2]) -> [std::ops::Range<usize>; 2] {
        let per_patch = self.patch_side() / self.entry;
        self.entries(first)
            .map(|range| range.start / per_patch..range.end.div_ceil(per_patch))
    }

    fn write(
        &self,
        first: [usize; 2],
        [rows, columns]: &[std::ops::Range<usize>; 2],
        samples: &Samples,
        finest: &Finest<'_>,
    ) -> Result<Written, PyramidError> {
        let drawn = Drawn {
            samples,
            stride: self.stride,
        };
        let entries: Vec<[i32; 3]> = rows
            .clone()
            .flat_map(|row| columns.clone().map(move |column| [row, column]))
            .map(|patch| to_bits(&drawn.patch(patch, finest)))
            .collect();
        let [entry_rows, entry_columns] = self.entries(first);
        let area = Area::new(entry_rows, entry_columns);
        self.plane.write(&area, &area, &entries)
    }

    fn tile(&self, place: [u32; 2]) -> Result<Vec<PatchErrors>, PyramidError> {
        let per_patch = self.patch_side() / self.entry;
        let side = TILE_QUADS * per_patch;
        let first = place.map(|index| index as usize * side);
        let mut patches = vec![PatchErrors::default(); PATCH_COUNT];
        let band = (READ_ENTRIES / side).clamp(1, side);
        for start in (0..side).step_by(band) {
            let rows = first[0] + start..first[0] + (start + band).min(side);
            let area = Area::new(rows, first[1]..first[1] + side);
            // Past the data nothing is measured and nothing is wrong.
            let area = area.and(&Area::whole(self.plane.size()));
            let [_, columns] = area.size();
            for (at, bits) in self.plane.read(&area)?.into_iter().enumerate() {
                let [row, column] = [(start + at / columns) / per_patch, at % columns / per_patch];
                join(&mut patches[row * TILE_QUADS + column], bits);
            }
        }
        Ok(patches)
    }
}

/// Heights from least to greatest.
#[derive(Debug, Serialize, Deserialize)]
struct Range([i32; 2]);

impl Default for Range {
    fn default() -> Self {
        Self([i32::MAX, i32::MIN])
    }
}

impl Range {
    fn join(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].max(other.0[1])])
    }
}

/// The least f32 that is no less.
#[expect(clippy::cast_possible_truncation, reason = "corrected upwards")]
pub(super) fn ceil_f32(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value {
        nearest.next_up()
    } else {
        nearest
    }
}

fn to_bits(errors: &PatchErrors) -> [i32; 3] {
    [errors.whole, errors.coarse, errors.middle]
        .map(|error| ceil_f32(error).to_bits().cast_signed())
}

fn join(patch: &mut PatchErrors, bits: [i32; 3]) {
    let [whole, coarse, middle] = bits.map(|bits| f64::from(f32::from_bits(bits.cast_unsigned())));
    patch.whole = patch.whole.max(whole);
    patch.coarse = patch.coarse.max(coarse);
    patch.middle = patch.middle.max(middle);
}
