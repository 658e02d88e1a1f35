//! What executing tables takes on a graphics device: the bytes it moves, known without one, and the times of one.

use std::time::Instant;

use anyhow::{Context as _, Result, ensure};
use drumlin::{Headless, Refine, wgpu};
use drumlin_core::{
    cage::Cage,
    fas::{PieceIndex, Tables},
    reference::{
        refine::{RefineGround, RefineSite, RefineTables, bytes_by_level},
        shared::FeatureVertex,
    },
};
use serde::Serialize;

use crate::{
    measure::{Timing, thousands, three_digits},
    scheme::drawn_places,
};

/// Bytes of the buffers that are copied to see how fast the device copies.
const COPIED: u64 = 1 << 26;
/// Copies of one run.
const COPIES: u32 = 16;

/// No ground: a cage by itself.
const GROUND: RefineGround = RefineGround {
    step: [1.0, -1.0],
    size: [128, 128],
    first: [0, 0],
    tiles: [1, 1],
};

/// A device, and how fast it is at the least that can be asked.
pub struct Device {
    headless: Headless,
    refine: Refine,
    queries: wgpu::QuerySet,
    /// Bytes read and written a second by copying buffers.
    copy_rate: f64,
}

/// Tables as a device executes them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Execution {
    /// Points made.
    pub points: u64,
    /// Bytes of rows, gathered points and written points.
    pub bytes: u64,
    /// Where a device was asked and they fit into its bindings.
    pub times: Option<Times>,
}

/// Times of a device, by its own timestamps.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Times {
    /// Points of all levels.
    pub points: Timing,
    /// Points, and position and normal at all places that are drawn, where those fit.
    pub all: Option<Timing>,
}

/// What a device is, for the table.
#[derive(Clone, Debug, Serialize)]
pub struct About {
    /// Its name, as its driver says.
    pub name: String,
    /// The processor plays the device.
    pub is_software: bool,
    /// Bytes read and written a second by copying buffers.
    pub copy_rate: f64,
}

/// What tables of a cage at these depths move; timed where there is a device.
///
/// # Errors
/// When the depths do not fit the cage, or the device fails.
pub fn execution(
    cage: &Cage,
    depths: &[u8],
    device: Option<&Device>,
    runs: usize,
) -> Result<Execution> {
    let tables = Tables::adaptive(cage.topology(), depths).map_err(anyhow::Error::msg)?;
    let levels = bytes_by_level(&tables);
    let times = device.map(|device| device.times(&tables, cage, runs));
    Ok(Execution {
        points: levels.iter().map(|level| level.points).sum(),
        bytes: levels.iter().map(|level| level.total()).sum(),
        times: times.transpose()?.flatten(),
    })
}

/// The columns of [`row`].
pub const COLUMNS: [&str; 7] = [
    "on a device",
    "points made",
    "bytes moved, MB",
    "points, ms",
    "GB/s",
    "of copying, %",
    "points and vertices, ms",
];

/// A table's row of an execution.
#[must_use]
pub fn row(name: &str, execution: &Execution, device: Option<&About>) -> [String; 7] {
    let none = || "-".to_owned();
    let times = execution.times.zip(device);
    let rate = |times: Times| execution.bytes as f64 / times.points.median;
    [
        name.to_owned(),
        thousands(execution.points),
        three_digits(1e-6 * execution.bytes as f64),
        times.map_or_else(none, |(times, _)| three_digits(times.points.millis())),
        times.map_or_else(none, |(times, _)| three_digits(1e-9 * rate(times))),
        times.map_or_else(none, |(times, device)| {
            three_digits(100.0 * rate(times) / device.copy_rate)
        }),
        times
            .and_then(|(times, _)| times.all)
            .map_or_else(none, |all| three_digits(all.millis())),
    ]
}

/// A line that says which device it is.
#[must_use]
pub fn line(device: Option<&About>) -> String {
    device.map_or_else(
        || "No device was asked (--gpu); what it would move:".into(),
        |device| {
            let rate = three_digits(1e-9 * device.copy_rate);
            let software = if device.is_software {
                " (the processor plays the device: no figures of a GPU)"
            } else {
                ""
            };
            format!(
                "{}{software}, copies {rate} GB/s (read and written):",
                device.name
            )
        },
    )
}

impl Device {
    /// The machine's first.
    ///
    /// # Errors
    /// When there is none, or it has no timestamps.
    pub fn new() -> Result<Self> {
        let headless = Headless::new()?;
        let device = &headless.device;
        ensure!(
            device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
            "{} has no timestamps; STRICT_WEBGPU_COMPLIANCE hides them",
            headless.adapter.name
        );
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let refine = Refine::new(device);
        let copy_rate = copy_rate(&headless)?;
        Ok(Self {
            headless,
            refine,
            queries,
            copy_rate,
        })
    }

    /// What it is.
    #[must_use]
    pub fn about(&self) -> About {
        let adapter = &self.headless.adapter;
        About {
            name: adapter.name.clone(),
            is_software: adapter.device_type == wgpu::DeviceType::Cpu,
            copy_rate: self.copy_rate,
        }
    }

    /// None where a buffer is larger than a binding may be.
    fn times(&self, tables: &Tables, cage: &Cage, runs: usize) -> Result<Option<Times>> {
        let limit = self
            .headless
            .device
            .limits()
            .max_storage_buffer_binding_size;
        let time = |sites: &[RefineSite]| -> Result<Option<Timing>> {
            let packed = RefineTables::new(tables, cage.positions(), &GROUND, sites);
            let fits = packed.largest_buffer_bytes() <= limit;
            fits.then(|| self.time(&packed, runs)).transpose()
        };
        let vertices = place_count(tables) * size_of::<FeatureVertex>() as u64;
        let Some(points) = time(&[])? else {
            return Ok(None);
        };
        let all = (vertices <= limit).then(|| time(&sites(tables)));
        Ok(Some(Times {
            points,
            all: all.transpose()?.flatten(),
        }))
    }

    fn time(&self, tables: &RefineTables, runs: usize) -> Result<Timing> {
        let Headless { device, queue, .. } = &self.headless;
        let buffers = self.refine.upload(device, queue, tables);
        // The first is not counted.
        let seconds =
            (0..=runs.max(1)).map(|_| self.timed(|pass| self.refine.dispatch(pass, &buffers)));
        let seconds: Vec<f64> = seconds.collect::<Result<_>>()?;
        Ok(Timing::of(seconds[1..].to_vec()))
    }

    /// Seconds of one compute pass.
    fn timed(&self, dispatch: impl FnOnce(&mut wgpu::ComputePass<'_>)) -> Result<f64> {
        let Headless { device, queue, .. } = &self.headless;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 16,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        let read = buffer(wgpu::BufferUsages::MAP_READ);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        dispatch(
            &mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: &self.queries,
                    beginning_of_pass_write_index: Some(0),
                    end_of_pass_write_index: Some(1),
                }),
            }),
        );
        encoder.resolve_query_set(&self.queries, 0..2, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &read, 0, 16);
        queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |_| ());
        self.headless.finish()?;
        let bytes = read
            .get_mapped_range(..)
            .context("the times cannot be read")?;
        let stamps: [u64; 2] = bytemuck::pod_read_unaligned(&bytes);
        Ok(stamps[1].saturating_sub(stamps[0]) as f64
            * 1e-9
            * f64::from(queue.get_timestamp_period()))
    }
}

/// How many places are drawn.
fn place_count(tables: &Tables) -> u64 {
    let pieces = tables.render.patches.len() + tables.render.caps.len();
    (pieces * drawn_places().len()) as u64
}

/// All places that are drawn.
fn sites(tables: &Tables) -> Vec<RefineSite> {
    let patches = (0..)
        .zip(&tables.render.patches)
        .map(|(at, _)| PieceIndex::Patch(at));
    let caps = (0..)
        .zip(&tables.render.caps)
        .map(|(at, _)| PieceIndex::Cap(at));
    let places = drawn_places();
    let all = patches
        .chain(caps)
        .flat_map(|piece| places.iter().map(move |&uv| (piece, uv)));
    let site = |(position_of, (piece, uv))| RefineSite {
        piece,
        uv,
        offset: None,
        position_of,
    };
    (0..).zip(all).map(site).collect()
}

/// Bytes a second, of the fastest of some runs by the clock on the wall.
fn copy_rate(headless: &Headless) -> Result<f64> {
    let Headless { device, queue, .. } = headless;
    let [from, to] = [wgpu::BufferUsages::COPY_SRC, wgpu::BufferUsages::COPY_DST].map(|usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: COPIED,
            usage,
            mapped_at_creation: false,
        })
    });
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for _ in 0..COPIES {
            encoder.copy_buffer_to_buffer(&from, 0, &to, 0, COPIED);
        }
        let commands = encoder.finish();
        let start = Instant::now();
        queue.submit([commands]);
        headless.finish()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(2.0 * COPIED as f64 * f64::from(COPIES) / best)
}
