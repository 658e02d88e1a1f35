//! Fills void samples smoothly from their surroundings, so that neighbours fit well: a membrane, near enough.
//!
//! Means of known samples are pulled up a pyramid of halved planes; on the way down each plane's gaps take the coarser
//! plane's heights between its cells and are relaxed by a few sweeps, first over the cells of even row and column sums,
//! then over the others, so that the order of cells within half a sweep does not matter.
//!
//! A cell depends on its plane as far as there are sweeps, and on the coarser plane: every block of a plane is filled
//! on its own, with a halo. A filled cell keeps its mark, so blocks that find a neighbour filled already start from
//! the same numbers as those that do not.
//!
//! Based on: S. Gortler, R. Grzeszczuk, R. Szeliski, M. Cohen, "The lumigraph", 1996 (pull-push); the relaxation makes
//! it a cascadic multigrid for Laplace's equation.

use std::path::Path;

use super::area::{Area, Blocks, to_signed};
use super::journal::Made;
use super::passes::in_order;
use super::planes::{SamplePlane, TASK_SIDE};
use super::samples::Samples;
use super::scratch::Written;
use super::tasks::{Job, Tasks};
use crate::pyramid::PyramidError;
use crate::pyramid::files::unique;

/// Sweeps on each plane, two halves each.
const SWEEPS: usize = 8;
/// Cells around a block that decide it: one a half sweep.
const HALO: usize = 2 * SWEEPS;

/// How gaps are filled.
pub(super) struct Gaps<'a> {
    /// Where the halved planes are made.
    pub(super) scratch: &'a Path,
    /// Samples a side of a block.
    pub(super) side: usize,
    /// Planes of more samples are halved and filled by many tasks, the others by one.
    pub(super) task_samples: u64,
    /// Does them.
    pub(super) tasks: &'a Tasks<'a>,
}

/// The sizes of the halved planes that are made by many tasks.
pub(super) fn halved(data: [usize; 2], task_samples: u64) -> Vec<[usize; 2]> {
    let sizes = std::iter::successors(Some(data), |size| Some(half(*size)));
    let large = |size: &[usize; 2]| (size[0] * size[1]) as u64 > task_samples;
    sizes.take_while(large).map(half).collect()
}

fn half(size: [usize; 2]) -> [usize; 2] {
    size.map(|count| count.div_ceil(2))
}

impl Gaps<'_> {
    /// Fills the void samples of the first rows and columns of a plane, of which some are known, if there are any.
    pub(super) fn fill(
        &self,
        finest: &SamplePlane,
        data: [usize; 2],
        gaps: bool,
    ) -> Result<(), PyramidError> {
        // Of each plane that is to be filled its size, and whether it has gaps.
        let mut fine = vec![(data, gaps)];
        let mut planes = Vec::<SamplePlane>::new();
        for (number, half) in halved(data, self.task_samples).into_iter().enumerate() {
            let (size, gaps) = fine[number];
            let coarse = SamplePlane::create(self.scratch, &format!("void-{number}"), half)?;
            let pass = format!("pull-{number}");
            let left = self.pass(&pass, half, self.side / 2, (&coarse, gaps), |area| {
                self.pull(planes.last().unwrap_or(finest), size, &coarse, area)
            })?;
            planes.push(coarse);
            fine.push((half, left));
        }
        let top = planes.last().unwrap_or(finest);
        if let Some((size, gaps)) = fine.pop() {
            self.fill_small(top, size, gaps)?;
        }
        while let (Some(coarser), Some((size, gaps))) = (planes.pop(), fine.pop()) {
            let plane = planes.last().unwrap_or(finest);
            let pass = format!("fill-{}", planes.len());
            self.pass(&pass, size, self.side, (plane, gaps), |area| {
                self.push(plane, size, &coarser, area)
            })?;
        }
        Ok(())
    }

    /// A pass over a plane, or nothing where there are no gaps. True where gaps are left.
    fn pass(
        &self,
        name: &str,
        size: [usize; 2],
        side: usize,
        (plane, gaps): (&SamplePlane, bool),
        work: impl Fn(&Area) -> Result<Made<bool>, PyramidError> + Sync,
    ) -> Result<bool, PyramidError> {
        let job = Job {
            pass: name,
            planes: &[plane],
            in_turn: false,
            advance: &|_| Ok(()),
        };
        let parts = Blocks::new(size, TASK_SIDE);
        let blocks = |task| {
            if gaps {
                parts.area(task).blocks(side)
            } else {
                Vec::new()
            }
        };
        let made = self
            .tasks
            .run(&job, blocks, |area| work(&area), |a, b| a | b)?;
        Ok(made.found)
    }

    /// Fills a plane that is one task.
    fn fill_small(
        &self,
        plane: &SamplePlane,
        size: [usize; 2],
        gaps: bool,
    ) -> Result<(), PyramidError> {
        let job = Job {
            pass: "gaps",
            planes: &[plane],
            in_turn: false,
            advance: &|_| Ok(()),
        };
        let once = |_| if gaps { vec![()] } else { Vec::new() };
        let work = |()| Ok(Made::new((), self.fill_alone(plane, size)?));
        self.tasks.run(&job, once, work, |(), ()| ())?;
        Ok(())
    }

    /// The same for any plane, by itself.
    fn fill_alone(
        &self,
        finest: &SamplePlane,
        data: [usize; 2],
    ) -> Result<Vec<Written>, PyramidError> {
        // Another process may do the same.
        let own = unique();
        let mut planes = Vec::<SamplePlane>::new();
        let mut size = data;
        loop {
            let name = format!("gaps-{own}-{}", planes.len());
            let coarse = SamplePlane::create(self.scratch, &name, half(size))?;
            let gaps = self.each(half(size), self.side / 2, |area| {
                self.pull(planes.last().unwrap_or(finest), size, &coarse, area)
            })?;
            planes.push(coarse);
            size = half(size);
            if !gaps.found {
                break;
            }
        }
        let mut written = Vec::new();
        while let Some(coarser) = planes.pop() {
            let (plane, size) = match planes.last() {
                Some(plane) => (plane, plane.size()),
                None => (finest, data),
            };
            written = self
                .each(size, self.side, |area| {
                    self.push(plane, size, &coarser, area)
                })?
                .written;
            coarser.remove()?;
        }
        Ok(written)
    }

    /// Does all blocks of a plane.
    fn each(
        &self,
        size: [usize; 2],
        side: usize,
        work: impl Fn(&Area) -> Result<Made<bool>, PyramidError> + Sync + Send,
    ) -> Result<Made<bool>, PyramidError> {
        let blocks = Blocks::new(size, side);
        let block = |index| {
            self.tasks.watch.check()?;
            work(&blocks.area(index))
        };
        in_order(blocks.count(), block, |a, b| a.and(b, |a, b| a | b))
    }

    /// Halves a plane: the mean of the known finer cells, a gap where no finer cell is known. True where gaps are left.
    fn pull(
        &self,
        fine: &SamplePlane,
        fine_size: [usize; 2],
        coarse: &SamplePlane,
        area: &Area,
    ) -> Result<Made<bool>, PyramidError> {
        let double = |range: &std::ops::Range<i64>| 2 * range.start..2 * range.end;
        let below = Area {
            rows: double(&area.rows),
            columns: double(&area.columns),
        };
        let mean = mean_of_known(&fine.read(&below.and(&Area::whole(fine_size)))?, area);
        let written = coarse.write_unfilled(&mean)?;
        Ok(Made::new(mean.voids.is_some(), [written]))
    }

    /// Fills the gaps of a block of a plane's first rows and columns from a filled coarser plane.
    fn push(
        &self,
        plane: &SamplePlane,
        size: [usize; 2],
        coarser: &SamplePlane,
        area: &Area,
    ) -> Result<Made<bool>, PyramidError> {
        if plane.read(area)?.voids.is_none() {
            return Ok(Made::default());
        }
        let halo = area.grown([HALO, HALO]).and(&Area::whole(size));
        let mut window = plane.read(&halo)?;
        let half = |range: &std::ops::Range<i64>| range.start / 2..(range.end - 1) / 2 + 1;
        let above = Area {
            rows: half(&halo.rows),
            columns: half(&halo.columns),
        };
        let above = above.grown([1, 1]).and(&Area::whole(coarser.size()));
        start(&mut window, &coarser.read(&above)?);
        relax(&mut window);
        Ok(Made::new(false, [plane.write(area, &window)?]))
    }
}

fn mean_of_known(fine: &Samples, area: &Area) -> Samples {
    let mut coarse = Samples::new(area.clone(), vec![0; area.count()]);
    let [rows, columns] = area.size();
    for row in 0..rows {
        for column in 0..columns {
            let (mut sum, mut count) = (0, 0);
            for row in 2 * row..(2 * row + 2).min(fine.rows) {
                for column in 2 * column..(2 * column + 2).min(fine.columns) {
                    if !fine.is_void(row, column) {
                        sum += i64::from(fine.values[row * fine.columns + column]);
                        count += 1;
                    }
                }
            }
            if count == 0 {
                coarse.set_void(row, column);
            } else {
                coarse.values[row * columns + column] = mean(sum, count);
            }
        }
    }
    coarse
}

/// Gives every gap the coarser plane's height there.
fn start(window: &mut Samples, coarser: &Samples) {
    let columns = window.columns;
    for (row, at) in window.area.rows.clone().enumerate() {
        for (column, place) in window.area.columns.clone().enumerate() {
            if window.is_void(row, column) {
                window.values[row * columns + column] = between(coarser, at, place);
            }
        }
    }
}

/// The coarser plane's height at a finer cell, linear between its cells.
fn between(coarser: &Samples, row: i64, column: i64) -> i32 {
    let near = |fine: i64, range: &std::ops::Range<i64>| {
        let cell = fine.div_euclid(2);
        let other = cell + 2 * fine.rem_euclid(2) - 1;
        [cell, other.clamp(range.start, range.end - 1)]
            .map(|at| usize::try_from(at - range.start).unwrap_or(0))
    };
    let rows = near(row, &coarser.area.rows);
    let columns = near(column, &coarser.area.columns);
    let at = |row: usize, column: usize| i64::from(coarser.values[row * coarser.columns + column]);
    let line = |row: usize| 3 * at(row, columns[0]) + at(row, columns[1]);
    mean(3 * line(rows[0]) + line(rows[1]), 16)
}

/// Relaxes the gaps: each becomes the mean of its neighbours.
fn relax(window: &mut Samples) {
    let (rows, columns) = (window.rows, window.columns);
    let gaps: Vec<[usize; 2]> = (0..rows)
        .flat_map(|row| (0..columns).map(move |column| [row, column]))
        .filter(|[row, column]| window.is_void(*row, *column))
        .collect();
    let [first_row, first_column] = [window.area.rows.start, window.area.columns.start];
    let parity = |[row, column]: &[usize; 2]| {
        (first_row + to_signed(*row) + first_column + to_signed(*column)).rem_euclid(2)
    };
    for half in 0..HALO {
        let turn = to_signed(half % 2);
        for &[row, column] in gaps.iter().filter(|gap| parity(gap) == turn) {
            let values = &window.values;
            let at = row * columns + column;
            let around = [
                (row > 0).then(|| at - columns),
                (row + 1 < rows).then_some(at + columns),
                (column > 0).then(|| at - 1),
                (column + 1 < columns).then_some(at + 1),
            ];
            let (sum, count) = around.iter().flatten().fold((0, 0), |(sum, count), at| {
                (sum + i64::from(values[*at]), count + 1)
            });
            window.values[at] = mean(sum, count.max(1));
        }
    }
}

/// A mean of heights, rounded half up.
fn mean(sum: i64, count: i64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "a mean of i32 is an i32")]
    let mean = (sum + count / 2).div_euclid(count) as i32;
    mean
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::super::options::Watch;
    use super::super::tasks::Pass;
    use super::*;

    fn filled(side: usize, block: usize, height: impl Fn(usize, usize) -> Option<i32>) -> Samples {
        let folder = tempfile::tempdir().unwrap();
        let all = Area::whole([side, side]);
        let plane = SamplePlane::create(folder.path(), "a", [side, side]).unwrap();
        let mut samples = Samples::new(all.clone(), vec![0; side * side]);
        for (row, column) in (0..side).flat_map(|row| (0..side).map(move |c| (row, c))) {
            match height(row, column) {
                Some(height) => samples.values[row * side + column] = height,
                None => samples.set_void(row, column),
            }
        }
        plane.write(&all, &samples).unwrap();
        fill(&plane, folder.path(), [block, side * side], false).unwrap();
        plane.read(&all).unwrap()
    }

    /// Fills a plane in blocks of a side, planes of more than some samples by a pass of their own.
    fn fill(
        plane: &SamplePlane,
        folder: &Path,
        [side, task_samples]: [usize; 2],
        cancel: bool,
    ) -> Result<(), PyramidError> {
        let cancel = AtomicBool::new(cancel);
        let watch = Watch::new(&|_| (), &cancel);
        let mut tasks = Tasks::of_pass("gaps", 1, folder, &watch);
        for number in 0..20 {
            tasks.passes.extend(["pull", "fill"].map(|what| Pass {
                name: format!("{what}-{number}"),
                tasks: 1,
                samples: 0,
                reads: Vec::new(),
                writes: Vec::new(),
            }));
        }
        let gaps = Gaps {
            scratch: folder,
            side,
            task_samples: task_samples as u64,
            tasks: &tasks,
        };
        gaps.fill(plane, plane.size(), true)
    }

    fn slope(row: usize, column: usize) -> i32 {
        i32::try_from(40 * row + 24 * column).unwrap()
    }

    fn hole(row: usize, column: usize) -> bool {
        row.abs_diff(60) < 20 && column.abs_diff(50) < 12 || row > 100 && column > 110
    }

    #[test]
    fn a_hole_in_a_slope_is_filled_with_the_slope() {
        let level = filled(129, 64, |row, column| {
            (row > 100 || !hole(row, column)).then(|| slope(row, column))
        });
        for row in 0..129 {
            for column in 0..129 {
                let error = (level.values[row * 129 + column] - slope(row, column)).abs();
                // A membrane over a plane is the plane. The coarsest filled plane, of cells of 16 samples, may be off by
                // half a cell each way, 8 · (40 + 24) units, where a cell's known samples lie to one side; sweeps on
                // four finer planes are to leave less of that than half a sample's rise.
                let limit = if row <= 100 && hole(row, column) {
                    20
                } else {
                    0
                };
                assert!(error <= limit, "{row} {column} {error}");
            }
        }
    }

    #[test]
    fn blocks_of_any_side_fill_the_same() {
        let sides = [16, 64, 1024].map(|block| {
            filled(129, block, |row, column| {
                (!hole(row, column)).then(|| slope(row * row % 97, column))
            })
        });
        assert!(sides[0] == sides[1] && sides[1] == sides[2]);
    }

    #[test]
    fn passes_and_one_task_fill_the_same_and_go_on_with_what_is_filled() {
        let folder = tempfile::tempdir().unwrap();
        let rough = |row: i32, column: i32| row * row % 97 + 3 * column;
        let mut samples = Samples::new(Area::whole([129, 129]), vec![0; 129 * 129]);
        for (row, column) in (0..129).flat_map(|row| (0..129).map(move |c| (row, c))) {
            if hole(row, column) {
                samples.set_void(row, column);
            } else {
                let [row, column] = [row, column].map(|at| i32::try_from(at).unwrap());
                samples.values[samples.columns * row.unsigned_abs() as usize
                    + column.unsigned_abs() as usize] = rough(row, column);
            }
        }
        let filled = [129 * 129, 1000, 1].map(|task_samples| {
            let folder = folder.path().join(task_samples.to_string());
            let plane = SamplePlane::create(&folder, "a", [129, 129]).unwrap();
            plane.write(&samples.area, &samples).unwrap();
            // What was filled before is started from again.
            for _ in 0..2 {
                fill(&plane, &folder, [32, task_samples], false).unwrap();
            }
            std::fs::remove_dir_all(folder.join("journal")).unwrap();
            fill(&plane, &folder, [32, task_samples], false).unwrap();
            plane.read(&samples.area).unwrap()
        });
        assert!(filled[0] == filled[1] && filled[1] == filled[2] && filled[0] != samples);
    }

    #[test]
    fn whoever_cancels_is_heard_before_the_first_block() {
        let folder = tempfile::tempdir().unwrap();
        let plane = SamplePlane::create(folder.path(), "never written", [9, 9]).unwrap();
        let stopped = fill(&plane, folder.path(), [4, 1], true);
        assert!(matches!(stopped, Err(PyramidError::Interrupted)));
    }

    #[test]
    fn one_known_sample_fills_all() {
        let level = filled(100, 32, |row, column| {
            (row == 3 && column == 99).then_some(41)
        });
        assert!(level.values.iter().all(|height| *height == 41));
    }
}
