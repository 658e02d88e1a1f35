//! All levels of a pyramid while it is built: up fitting, down quantising, and the heights a reader will see.
//!
//! Every pass goes over the blocks of a level's plane, reads what a block depends on from the planes of the passes
//! before, halo included, and writes the block. `ARCHITECTURE.md` draws what depends on what.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::area::{Area, Blocks};
use super::border::{continued, plane_size};
use super::fit::{HATS, SPLINES};
use super::journal::Made;
use super::options::Stage;
use super::plan::Shape;
use super::planes::{ControlPlane, SamplePlane, TASK_SAMPLES, TASK_SIDE};
use super::quantise::{Cage, is_key, key_width, quantise};
use super::read::{read_finest, window_count};
use super::samples::Samples;
use super::scale::Scale;
use super::tasks::{Job, Tasks};
use super::voids::Gaps;
use crate::dem::Raster;
use crate::geo::{Grid, QUAD_SAMPLES, TILE_CELLS, TILE_QUADS};
use crate::pyramid::surface::{decode_heights, encode_detail};
use crate::pyramid::{Level, PyramidError, number_bytes};

/// All levels, coarsest first.
pub(super) struct Levels {
    /// What the metadata say of each.
    pub(super) levels: Vec<Level>,
    /// The samples of each, as stored: of whole tiles.
    pub(super) samples: Vec<SamplePlane>,
    /// The cages of each, as stored.
    pub(super) cages: Vec<ControlPlane>,
    /// Finest samples that are void.
    pub(super) void_count: u64,
}

impl Levels {
    /// Reads the finest level, fits the coarser ones and all cages, and settles what a reader will see.
    pub(super) fn new(
        raster: &dyn Raster,
        scale: &Scale,
        shape: &Shape,
        scratch: &Path,
        tasks: &Tasks<'_>,
    ) -> Result<Self, PyramidError> {
        let rise = Rise {
            grid: raster.header().grid,
            scratch,
            side: shape.block_side(),
            tasks,
        };
        let (finest, void_count) = rise.finest(raster, scale, shape)?;
        let fitted = rise.coarser(finest)?;
        let mut levels = Self {
            levels: Vec::new(),
            samples: Vec::new(),
            cages: Vec::new(),
            void_count,
        };
        let blocks = (0..rise.grid.level_count())
            .map(|level| Blocks::new(settled_size(&rise.grid, level), rise.side).count() as u64);
        let advance = tasks.watch.stage(Stage::Encode, blocks.sum());
        for (level, fitted) in (0..).zip(fitted) {
            levels.settle(&rise, scale, level, &fitted, &advance)?;
        }
        Ok(levels)
    }

    /// Fits and quantises a level's cage and replaces its samples by the heights a reader will decode.
    ///
    /// Encoding those again gives the same codes, so no plane of codes is kept.
    fn settle(
        &mut self,
        rise: &Rise<'_>,
        scale: &Scale,
        level: u8,
        fitted: &SamplePlane,
        advance: &(dyn Fn(u64) -> Result<(), PyramidError> + Sync),
    ) -> Result<(), PyramidError> {
        let tiles = rise.grid.tiles(level);
        let size = settled_size(&rise.grid, level);
        let settling = Settling {
            fitted,
            parent: self.cages.last().filter(|_| !is_key(level)),
            step: scale.step_at(rise.grid.level_count() - 1 - level),
            samples: rise.plane("settled", level, size)?,
            cage: ControlPlane::of_tiles(rise.scratch, &format!("cage-{level}"), tiles)?,
        };
        let parts = Blocks::new(size, TASK_SIDE);
        let job = Job {
            pass: &format!("settle-{level}"),
            planes: &[&settling.samples, &settling.cage],
            in_turn: false,
            advance,
        };
        let blocks = |task| parts.area(task).blocks(rise.side);
        let block = |area| settling.block(&area);
        let widths = rise.tasks.run(&job, blocks, block, Widths::join)?.found;
        self.levels.push(Level {
            tiles,
            step: settling.step,
            key: is_key(level),
            cage_bytes: widths.cage,
            detail_bytes: widths.detail,
            voids: widths.voids,
        });
        self.samples.push(settling.samples);
        self.cages.push(settling.cage);
        Ok(())
    }
}

/// The way up: samples of all levels, fitted.
struct Rise<'a> {
    grid: Grid,
    scratch: &'a Path,
    /// Samples a side of a block.
    side: usize,
    tasks: &'a Tasks<'a>,
}

impl Rise<'_> {
    fn plane(&self, what: &str, level: u8, size: [usize; 2]) -> Result<SamplePlane, PyramidError> {
        SamplePlane::create(self.scratch, &format!("{what}-{level}"), size)
    }

    /// The finest samples: read, filled where void, continued past the data; and how many are void.
    fn finest(
        &self,
        raster: &dyn Raster,
        scale: &Scale,
        shape: &Shape,
    ) -> Result<(SamplePlane, u64), PyramidError> {
        let grid = &self.grid;
        let level = grid.level_count() - 1;
        let plane = self.plane("fitted", level, plane_size(grid, level))?;
        let [rows, columns] = [grid.rows, grid.columns];
        let total = u64::from(rows) * u64::from(columns);
        let windows = window_count(raster, shape.window_samples);
        let advance = self.tasks.watch.stage(Stage::Read, windows);
        let name = &raster.header().source.name;
        let heard = (self.tasks, &advance as &(dyn Fn(u64) -> _ + Sync));
        let void_count = read_finest(raster, scale.unit(), &plane, shape.window_samples, heard)
            .map_err(|error| match error {
                PyramidError::Unfit(what) => PyramidError::Unfit(format!("{name}: {what}")),
                other => other,
            })?;
        if void_count == total {
            return Err(PyramidError::Unfit(format!(
                "{name}: all {rows} x {columns} samples are void: there is no terrain"
            )));
        }
        let data = [rows, columns].map(|count| count as usize);
        let gaps = Gaps {
            scratch: self.scratch,
            side: self.side,
            task_samples: TASK_SAMPLES,
            tasks: self.tasks,
        };
        gaps.fill(&plane, data, void_count > 0)?;
        self.continue_finest(&plane, data)?;
        Ok((plane, void_count))
    }

    fn continue_finest(&self, plane: &SamplePlane, data: [usize; 2]) -> Result<(), PyramidError> {
        let size = plane.size();
        let job = Job {
            pass: "continue",
            planes: &[plane],
            in_turn: false,
            advance: &|_| Ok(()),
        };
        let parts = beyond(data, size);
        let blocks = |task: usize| parts[task].blocks(self.side);
        let block = |area| {
            let samples = continued(&area, data, size, |area| plane.read(area))?;
            Ok(Made::new((), [plane.write(&area, &samples)?]))
        };
        self.tasks.run(&job, blocks, block, |(), ()| ())?;
        Ok(())
    }

    /// The samples of all levels, coarsest first, from the finest's.
    fn coarser(&self, finest: SamplePlane) -> Result<Vec<SamplePlane>, PyramidError> {
        let coarser = 0..self.grid.level_count() - 1;
        let blocks = coarser.clone().map(|level| {
            let blocks = fit_blocks(&self.grid, level, self.side);
            blocks.count() as u64
        });
        let advance = self.tasks.watch.stage(Stage::Fit, blocks.sum());
        let mut planes = vec![finest];
        for level in coarser.rev() {
            let coarse = self.plane("fitted", level, plane_size(&self.grid, level))?;
            if let Some(fine) = planes.last() {
                let job = Job {
                    pass: &format!("fit-{level}"),
                    planes: &[&coarse],
                    in_turn: false,
                    advance: &advance,
                };
                let parts = Blocks::new(coarse.size(), TASK_SIDE);
                let blocks = |task| parts.area(task).blocks(self.side / 2);
                let block = |area| coarsen(fine, &coarse, &area);
                self.tasks.run(&job, blocks, block, |(), ()| ())?;
            }
            planes.push(coarse);
        }
        planes.reverse();
        Ok(planes)
    }
}

/// The parts of a plane past the data, to the south and to the east of them, as far as each is one task's.
pub(super) fn beyond(data: [usize; 2], size: [usize; 2]) -> Vec<Area> {
    let parts = Blocks::new(size, TASK_SIDE);
    let south = Area::new(data[0]..size[0], 0..size[1]);
    let east = Area::new(0..data[0], data[1]..size[1]);
    let parts = (0..parts.count()).map(|index| parts.area(index));
    parts
        .flat_map(|part| [&south, &east].map(|beyond| part.and(beyond)))
        .filter(|part| !part.is_empty())
        .collect()
}

/// Rows and columns of a level's samples as stored: of whole tiles.
pub(super) fn settled_size(grid: &Grid, level: u8) -> [usize; 2] {
    grid.tiles(level)
        .map(|count| count as usize * TILE_CELLS + 1)
}

/// The blocks in which a coarser level is fitted: half as wide as those of the finer level that they are fitted to.
pub(super) fn fit_blocks(grid: &Grid, level: u8, side: usize) -> Blocks {
    Blocks::new(plane_size(grid, level), side / 2)
}

/// Fits an area of a coarser level to a finer one.
fn coarsen(
    fine: &SamplePlane,
    coarse: &SamplePlane,
    area: &Area,
) -> Result<Made<()>, PyramidError> {
    let fitted = fine.size().map(|samples| samples / 2 + 1);
    let samples = continued(area, fitted, coarse.size(), |area| {
        let below = fine.read_mirrored(&HATS.support(area))?;
        let mut samples = Samples::new(area.clone(), HATS.fit(area, &below));
        below.mark_coarser_voids(&mut samples);
        Ok(samples)
    })?;
    Ok(Made::new((), [coarse.write(area, &samples)?]))
}

/// A level on the way down.
struct Settling<'a> {
    fitted: &'a SamplePlane,
    /// The coarser level's cage, as stored; none at a key level.
    parent: Option<&'a ControlPlane>,
    step: i32,
    samples: SamplePlane,
    cage: ControlPlane,
}

impl Settling<'_> {
    /// Settles the tiles of a block of samples.
    fn block(&self, own: &Area) -> Result<Made<Widths>, PyramidError> {
        let cells = |count: i64| usize::try_from(count).unwrap_or(0) / TILE_CELLS;
        let [rows, columns] = [&own.rows, &own.columns].map(|r| cells(r.start)..cells(r.end));
        let tiles = [rows.len(), columns.len()];
        // Controls are counted from lattice point −1: a tile's first from 32 times its row.
        let quads =
            |range: &std::ops::Range<usize>| range.start * TILE_QUADS..range.end * TILE_QUADS + 3;
        let controls = Area::new(quads(&rows), quads(&columns));
        let lattice = Area {
            rows: controls.rows.start - 1..controls.rows.end - 1,
            columns: controls.columns.start - 1..controls.columns.end - 1,
        };
        let fitted = self.fitted.read_mirrored(&SPLINES.support(&lattice))?;
        let mut cage = Cage::new(controls.size()[1], SPLINES.fit(&lattice, &fitted));
        let cells =
            |range: &std::ops::Range<usize>| range.start * TILE_CELLS..range.end * TILE_CELLS + 1;
        let fitted = fitted.crop(&Area::new(cells(&rows), cells(&columns)));
        let mut widths = self.quantise(&mut cage, &controls, tiles)?;
        let settled = self.settle(&fitted, &cage, tiles, &mut widths);
        let samples = self.samples.write(own, &settled)?;
        // The last tiles' controls past the tile are its own, others' the next block's.
        let end = |own_end: i64, first: usize, all: usize| {
            let end = usize::try_from(own_end).unwrap_or(0) / QUAD_SAMPLES;
            first..if end + 3 == all { all } else { end }
        };
        let [all_rows, all_columns] = self.cage.size();
        let owned = Area::new(
            end(own.rows.end, rows.start * TILE_QUADS, all_rows),
            end(own.columns.end, columns.start * TILE_QUADS, all_columns),
        );
        let cage = self.cage.put_controls(&owned, &controls, cage.controls())?;
        Ok(Made::new(widths, [samples, cage]))
    }

    fn quantise(
        &self,
        cage: &mut Cage,
        controls: &Area,
        tiles: [usize; 2],
    ) -> Result<Widths, PyramidError> {
        let parent = self.parent.map(|plane| -> Result<_, PyramidError> {
            let half = |range: &std::ops::Range<i64>| range.start / 2..(range.end + 3) / 2;
            let above = Area {
                rows: half(&controls.rows),
                columns: half(&controls.columns),
            };
            Ok(Cage::new(above.size()[1], plane.controls(&above)?))
        });
        let parent = parent.transpose()?;
        let width = quantise(cage, parent.as_ref(), self.step)?;
        let cage = match parent {
            Some(_) => width,
            None => key_width(cage, tiles, self.step),
        };
        Ok(Widths {
            cage,
            ..Widths::default()
        })
    }

    /// The heights a reader will decode.
    fn settle(
        &self,
        fitted: &Samples,
        cage: &Cage,
        [rows, columns]: [usize; 2],
        widths: &mut Widths,
    ) -> Samples {
        let mut settled = fitted.clone();
        for place in (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column])) {
            let first = place.map(|index| index * TILE_CELLS);
            let controls = cage.tile(place);
            let codes = encode_detail(&fitted.tile(first), &controls, self.step);
            let width = codes.iter().map(|code| number_bytes(*code)).max();
            widths.detail = widths.detail.max(width.unwrap_or(1));
            settled.put_tile(first, &decode_heights(&controls, &codes, self.step));
        }
        widths.voids = settled.voids.is_some();
        settled
    }
}

/// How wide the numbers of a level are, and whether it has voids.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Widths {
    cage: u8,
    detail: u8,
    voids: bool,
}

impl Default for Widths {
    fn default() -> Self {
        Self {
            cage: 1,
            detail: 1,
            voids: false,
        }
    }
}

impl Widths {
    fn join(self, other: Self) -> Self {
        Self {
            cage: self.cage.max(other.cage),
            detail: self.detail.max(other.detail),
            voids: self.voids | other.voids,
        }
    }
}

/// Tiles of a level.
pub(super) fn tile_count(grid: &Grid, level: u8) -> u64 {
    grid.tiles(level).map(u64::from).iter().product()
}
