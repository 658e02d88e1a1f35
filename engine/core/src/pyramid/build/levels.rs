//! All levels of a pyramid while it is built: up fitting, down quantising, and the heights a reader will see.

use rayon::prelude::*;

use super::options::{Stage, Watch};
use super::quantise::{LevelCage, is_key, key_width, quantise};
use super::samples::{LevelSamples, array_size};
use super::scale::Scale;
use super::{fit, sample, voids};
use crate::dem::Raster;
use crate::geo::Grid;
use crate::pyramid::surface::{decode_heights, encode_detail};
use crate::pyramid::{Level, PyramidError, number_bytes};

/// All levels, coarsest first.
pub(super) struct Levels {
    /// What the metadata say of each.
    pub(super) levels: Vec<Level>,
    /// The samples, as stored once [`Levels::settle`] is done.
    pub(super) samples: Vec<LevelSamples>,
    /// The cages, as stored.
    pub(super) cages: Vec<LevelCage>,
}

impl Levels {
    /// Reads the finest level, fits the coarser ones and all cages, and settles what a reader will see.
    pub(super) fn new(
        raster: &dyn Raster,
        scale: &Scale,
        watch: &Watch<'_>,
    ) -> Result<Self, PyramidError> {
        let grid = raster.header().grid;
        let samples = Self::rise(raster, &grid, scale, watch)?;
        let mut levels = Self::fit(samples, &grid, scale, watch)?;
        levels.settle(watch)?;
        Ok(levels)
    }

    /// Bytes at the peak of [`Levels::new`].
    pub(super) fn memory_bytes(grid: &Grid) -> u64 {
        let count = |level: u8| {
            array_size(grid, level)
                .iter()
                .map(|side| *side as u64)
                .product::<u64>()
        };
        let finest = count(grid.level_count() - 1);
        let all: u64 = (0..grid.level_count()).map(count).sum();
        // Samples and cages of all levels; while the finest is fitted, its rows' coefficients and the result, twice.
        4 * (all + all / 15) + 4 * (finest / 2 + finest / 2)
    }

    /// The samples of all levels.
    fn rise(
        raster: &dyn Raster,
        grid: &Grid,
        scale: &Scale,
        watch: &Watch<'_>,
    ) -> Result<Vec<LevelSamples>, PyramidError> {
        let advance = watch.stage(Stage::Read, u64::from(grid.rows));
        let data = [grid.rows, grid.columns].map(|count| count as usize);
        let finest = sample::read_finest(raster, scale.unit(), &advance).and_then(|mut finest| {
            voids::fill(&mut finest, data)?;
            Ok(finest)
        });
        let mut finest = finest.map_err(|error| match error {
            PyramidError::Unfit(what) => {
                PyramidError::Unfit(format!("{}: {what}", raster.header().source.name))
            }
            other => other,
        })?;
        finest.continue_past(data);
        let advance = watch.stage(Stage::Fit, 2 * u64::from(grid.level_count()));
        advance(1)?;
        let mut samples = vec![finest];
        for level in (0..grid.level_count() - 1).rev() {
            let mut coarse = LevelSamples::new(grid, level);
            if let Some(fine) = samples.last() {
                let fitted = fit::coarsen(fine, &mut coarse);
                coarse.voids = fine.coarser_voids(&coarse);
                coarse.continue_past(fitted);
            }
            samples.push(coarse);
            advance(1)?;
        }
        samples.reverse();
        Ok(samples)
    }

    /// Fits and quantises the cages of all levels.
    fn fit(
        samples: Vec<LevelSamples>,
        grid: &Grid,
        scale: &Scale,
        watch: &Watch<'_>,
    ) -> Result<Self, PyramidError> {
        let advance = watch.stage(Stage::Encode, samples.len() as u64);
        let (mut levels, mut cages) = (Vec::new(), Vec::<LevelCage>::new());
        for (level, samples) in (0..).zip(&samples) {
            let (tiles, key) = (grid.tiles(level), is_key(level));
            let step = scale.step_at(grid.level_count() - 1 - level);
            let mut cage = LevelCage::new(tiles, fit::cage(samples, tiles));
            let parent = cages.last().filter(|_| !key);
            let width = quantise(&mut cage, parent, step)?;
            let cage_bytes = if key {
                key_width(&cage, tiles, step)
            } else {
                width
            };
            let voids = samples.voids.is_some();
            levels.push(Level {
                tiles,
                step,
                key,
                cage_bytes,
                detail_bytes: 1,
                voids,
            });
            cages.push(cage);
            advance(1)?;
        }
        Ok(Self {
            levels,
            samples,
            cages,
        })
    }

    /// Replaces every level's samples by the heights a reader will decode, and finds how wide codes are.
    ///
    /// Encoding those again gives the same codes, so neither codes nor a second array are kept.
    fn settle(&mut self, watch: &Watch<'_>) -> Result<(), PyramidError> {
        let rows = self
            .levels
            .iter()
            .map(|level| u64::from(level.tiles[0]))
            .sum();
        let advance = watch.stage(Stage::Encode, rows);
        for ((level, samples), cage) in self
            .levels
            .iter_mut()
            .zip(&mut self.samples)
            .zip(&self.cages)
        {
            for row in 0..level.tiles[0] {
                let settled: Vec<(Vec<i32>, u8)> = (0..level.tiles[1])
                    .into_par_iter()
                    .map(|column| {
                        let controls = cage.tile([row, column]);
                        let codes =
                            encode_detail(&samples.tile([row, column]), &controls, level.step);
                        let width = codes.iter().map(|code| number_bytes(*code)).max();
                        (
                            decode_heights(&controls, &codes, level.step),
                            width.unwrap_or(1),
                        )
                    })
                    .collect();
                for (column, (heights, width)) in (0..).zip(settled) {
                    samples.put_tile([row, column], &heights);
                    level.detail_bytes = level.detail_bytes.max(width);
                }
                advance(1)?;
            }
        }
        Ok(())
    }
}
