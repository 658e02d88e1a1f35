//! All passes of a build and their tasks, known before anything is read.

use super::area::Blocks;
use super::border::plane_size;
use super::levels::{beyond, settled_size};
use super::options::Imagery;
use super::planes::{TASK_SAMPLES, TASK_SIDE};
use super::records::shards;
use super::tasks::Pass;
use super::voids::halved;
use super::{errors, read};
use crate::dem::Raster;

/// The passes, in order: names, tasks, samples.
pub(super) fn passes(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    features: bool,
) -> Vec<Pass> {
    let grid = raster.header().grid;
    let finest = grid.level_count() - 1;
    let data = [grid.rows, grid.columns].map(|count| count as usize);
    let area = |size: [usize; 2]| (size[0] * size[1]) as u64;
    let pass = |name: String, tasks: usize, samples: u64| Pass {
        name,
        tasks,
        samples,
    };
    let plane = |name: String, size: [usize; 2]| {
        pass(name, Blocks::new(size, TASK_SIDE).count(), area(size))
    };
    let bands = read::bands(&grid, raster.part_shape());
    let mut passes = vec![pass("read".into(), bands.len(), area(data))];
    let halved = halved(data, TASK_SAMPLES);
    for (number, half) in halved.iter().enumerate() {
        passes.push(plane(format!("pull-{number}"), *half));
    }
    let small = halved.last().copied().unwrap_or(data);
    passes.push(pass("gaps".into(), 1, area(small)));
    for number in (0..halved.len()).rev() {
        let size = number.checked_sub(1).map_or(data, |finer| halved[finer]);
        passes.push(plane(format!("fill-{number}"), size));
    }
    let beyond = beyond(data, plane_size(&grid, finest));
    let samples = beyond.iter().map(|part| part.count() as u64).sum();
    passes.push(pass("continue".into(), beyond.len(), samples));
    for level in (0..finest).rev() {
        passes.push(plane(format!("fit-{level}"), plane_size(&grid, level)));
    }
    for level in 0..=finest {
        passes.push(plane(format!("settle-{level}"), settled_size(&grid, level)));
    }
    let parts = errors::parts(&grid).count();
    passes.push(pass("measure".into(), parts, area(data)));
    for level in (0..=finest).rev() {
        let samples = area(settled_size(&grid, level));
        let count = shards(&grid, level).len();
        passes.push(pass(format!("write-{level}"), count, samples));
    }
    if features {
        passes.push(pass("features".into(), 1, 0));
    }
    if let Some(imagery) = imagery {
        let bytes = imagery.sources.iter().map(|source| source.bytes).sum();
        passes.push(pass("color".into(), 1, bytes));
    }
    passes
}
