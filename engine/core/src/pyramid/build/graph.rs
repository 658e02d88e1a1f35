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

/// The passes, in order.
pub(super) fn passes(
    raster: &dyn Raster,
    imagery: Option<&Imagery<'_>>,
    features: bool,
) -> Vec<Pass> {
    let grid = raster.header().grid;
    let finest = grid.level_count() - 1;
    let data = [grid.rows, grid.columns].map(|count| count as usize);
    let finest_plane = format!("fitted-{finest}");
    let mut list = List(Vec::new());
    let bands = read::bands(&grid, raster.part_shape()).len();
    list.pass("read", bands, area(data), &["inputs"], &[&finest_plane]);

    let halved = halved(data, TASK_SAMPLES);
    // What is filled from the plane of a number, or is halved to it.
    let finer = |number: usize| match number.checked_sub(1) {
        Some(finer) => (format!("void-{finer}"), halved[finer]),
        None => (finest_plane.clone(), data),
    };
    for (number, half) in halved.iter().enumerate() {
        let own = format!("void-{number}");
        list.plane(
            &format!("pull-{number}"),
            *half,
            &[&finer(number).0],
            &[&own],
        );
    }
    let (small, size) = finer(halved.len());
    list.pass("gaps", 1, area(size), &[&small], &[&small]);
    for number in (0..halved.len()).rev() {
        let (fine, size) = finer(number);
        let own = format!("void-{number}");
        list.plane(&format!("fill-{number}"), size, &[&own, &fine], &[&fine]);
    }

    let beyond = beyond(data, plane_size(&grid, finest));
    let samples = beyond.iter().map(|part| part.count() as u64).sum();
    let plane = [finest_plane.as_str()];
    list.pass("continue", beyond.len(), samples, &plane, &plane);
    for level in (0..finest).rev() {
        let [fine, own] = [level + 1, level].map(|level| format!("fitted-{level}"));
        let size = plane_size(&grid, level);
        list.plane(&format!("fit-{level}"), size, &[&fine], &[&own]);
    }
    for level in 0..=finest {
        let [fitted, samples, cage] =
            ["fitted", "settled", "cage"].map(|what| format!("{what}-{level}"));
        let parent = level.checked_sub(1).map(|level| format!("cage-{level}"));
        let reads: Vec<&str> = [Some(fitted.as_str()), parent.as_deref()]
            .into_iter()
            .flatten()
            .collect();
        let size = settled_size(&grid, level);
        list.plane(&format!("settle-{level}"), size, &reads, &[&samples, &cage]);
    }

    let all = |what: &str, levels: std::ops::Range<u8>| -> Vec<String> {
        levels.map(|level| format!("{what}-{level}")).collect()
    };
    let (settled, errors) = (all("settled", 0..finest + 1), all("errors", 0..finest));
    let parts = errors::parts(&grid).count();
    list.pass("measure", parts, area(data), &settled, &errors);
    for level in (0..=finest).rev() {
        let name = |what: &str, level: u8| format!("{what}-{level}");
        let mut reads = vec![name("settled", level), name("cage", level)];
        if level > 0 {
            reads.push(name("cage", level - 1));
        }
        if level < finest {
            reads.extend([name("errors", level), name("summary", level + 1)]);
        }
        let samples = area(settled_size(&grid, level));
        let count = shards(&grid, level).len();
        let own = [name("summary", level)];
        list.pass(&name("write", level), count, samples, &reads, &own);
    }
    if features {
        let reads = [
            finest_plane.replace("fitted", "settled"),
            format!("cage-{finest}"),
        ];
        list.pass("features", 1, 0, &reads, &["feature"]);
    }
    if let Some(imagery) = imagery {
        let bytes = imagery.sources.iter().map(|source| source.bytes).sum();
        list.pass("color", 1, bytes, &["imagery"], &["color"]);
    }
    list.0
}

/// About how long a sample of a pass takes: nanoseconds of one thread of a machine of 2020.
pub(super) fn nanos(pass: &str) -> u64 {
    let kind = pass.split('-').next().unwrap_or(pass);
    match kind {
        "read" => 40,
        "fit" => 60,
        "settle" => 90,
        "measure" => 60,
        "write" => 60,
        _ => 10,
    }
}

/// Passes, one after another.
struct List(Vec<Pass>);

impl List {
    fn pass(
        &mut self,
        name: &str,
        tasks: usize,
        samples: u64,
        reads: &[impl ToString],
        writes: &[impl ToString],
    ) {
        self.0.push(Pass {
            name: name.to_owned(),
            tasks,
            samples,
            reads: reads.iter().map(ToString::to_string).collect(),
            writes: writes.iter().map(ToString::to_string).collect(),
        });
    }

    /// A pass over a plane, a task for every file of it.
    fn plane(&mut self, name: &str, size: [usize; 2], reads: &[&str], writes: &[&str]) {
        let tasks = Blocks::new(size, TASK_SIDE).count();
        self.pass(name, tasks, area(size), reads, writes);
    }
}

fn area(size: [usize; 2]) -> u64 {
    (size[0] * size[1]) as u64
}
