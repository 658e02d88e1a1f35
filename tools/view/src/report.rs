//! The report of a flight: what it was, every frame, and of every number its spread.

use std::{collections::BTreeMap, path::Path};

use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::Value;

use crate::{
    start::Start,
    stopwatch::{Span, millis},
};

/// Said once a flight.
#[derive(Debug, Serialize)]
pub(crate) struct About {
    /// Adapter's name, backend and kind.
    pub(crate) adapter: String,
    /// The adapter's driver and its version.
    pub(crate) driver: String,
    /// The commit this program was built from, where known.
    pub(crate) commit: &'static str,
    /// The pyramid.
    pub(crate) data_set: Value,
    /// What was asked for.
    pub(crate) settings: Value,
    /// How it began.
    pub(crate) start: Start,
}

/// Patches drawn, by depth; `regular` have no finer neighbour, `transition` have.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct PatchCounts {
    pub(crate) regular: [u64; 3],
    pub(crate) transition: [u64; 3],
}

/// One frame.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct FrameRow {
    /// Seconds after the first key.
    pub(crate) t: f64,
    /// Work of the frame's own thread.
    pub(crate) cpu_update_millis: f64,
    pub(crate) cpu_encode_millis: f64,
    pub(crate) cpu_submit_millis: f64,
    pub(crate) cpu_total_millis: f64,
    /// The same by the clock on the wall: with the turns of other threads, a software driver's among them.
    pub(crate) wall_update_millis: f64,
    pub(crate) wall_encode_millis: f64,
    pub(crate) wall_submit_millis: f64,
    pub(crate) wall_total_millis: f64,
    /// Null where the adapter has no timestamps.
    pub(crate) gpu_millis: Option<f64>,
    /// The part of it in which tables of features are executed; null where none arrived.
    pub(crate) gpu_refine_millis: Option<f64>,
    /// Tiles in the pool, ready to be drawn.
    pub(crate) tiles_resident: u64,
    pub(crate) tiles_drawn: u64,
    pub(crate) patches: PatchCounts,
    pub(crate) triangles: u64,
    pub(crate) tiles_missing: u64,
    /// Part of the screen, 0 to 1, covered by parents that stand in for missing tiles.
    pub(crate) missing_share: f64,
    pub(crate) bytes_read: u64,
    pub(crate) bytes_uploaded: u64,
    pub(crate) ram_bytes: u64,
    pub(crate) vram_bytes: u64,
    /// Pixels of error the frame was drawn with; above what was asked for when a budget is short.
    pub(crate) error_px: f64,
}

/// How a number spreads over the frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Spread {
    pub(crate) p50: f64,
    pub(crate) p95: f64,
    pub(crate) p99: f64,
    pub(crate) max: f64,
}

/// A whole flight.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    about: About,
    frame_count: usize,
    summary: BTreeMap<String, Spread>,
    /// Sums over the flight.
    total: Totals,
    frames: Vec<FrameRow>,
}

#[derive(Debug, Serialize)]
struct Totals {
    triangles: u64,
    bytes_read: u64,
    bytes_uploaded: u64,
}

impl FrameRow {
    /// The row of a frame whose update, encoding and submission took so long.
    pub(crate) fn timed(spans: [Span; 3]) -> Self {
        let [update, encode, submit] = spans;
        let total: Span = spans.into_iter().sum();
        Self {
            cpu_update_millis: millis(update.cpu),
            cpu_encode_millis: millis(encode.cpu),
            cpu_submit_millis: millis(submit.cpu),
            cpu_total_millis: millis(total.cpu),
            wall_update_millis: millis(update.wall),
            wall_encode_millis: millis(encode.wall),
            wall_submit_millis: millis(submit.wall),
            wall_total_millis: millis(total.wall),
            ..Self::default()
        }
    }
}

impl Report {
    /// Works the frames up.
    pub(crate) fn new(about: About, frames: Vec<FrameRow>) -> Result<Self> {
        let sum = |count: fn(&FrameRow) -> u64| frames.iter().map(count).sum();
        let total = Totals {
            triangles: sum(|row| row.triangles),
            bytes_read: sum(|row| row.bytes_read),
            bytes_uploaded: sum(|row| row.bytes_uploaded),
        };
        Ok(Self {
            about,
            frame_count: frames.len(),
            summary: summary(&frames)?,
            total,
            frames,
        })
    }

    /// Writes the file.
    pub(crate) fn write(&self, file: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        std::fs::write(file, text).with_context(|| format!("{}: writing failed", file.display()))
    }

    /// A few lines for the terminal.
    pub(crate) fn lines(&self) -> String {
        let line = |(name, title): (&str, &str)| {
            let spread = self.summary.get(name)?;
            let [p50, p95, p99, max] = [spread.p50, spread.p95, spread.p99, spread.max].map(short);
            Some(format!("{title:<26}{p50:>12}{p95:>12}{p99:>12}{max:>12}\n"))
        };
        let rows = [
            ("cpu_update_millis", "CPU update, ms"),
            ("cpu_encode_millis", "CPU encode, ms"),
            ("cpu_submit_millis", "CPU submit, ms"),
            ("cpu_total_millis", "CPU total, ms"),
            ("wall_total_millis", "the same by the clock, ms"),
            ("gpu_millis", "GPU, ms"),
            ("gpu_refine_millis", "GPU refine, ms"),
            ("tiles_resident", "tiles resident"),
            ("tiles_drawn", "tiles drawn"),
            ("triangles", "triangles"),
            ("tiles_missing", "tiles missing"),
            ("vram_bytes", "VRAM, bytes"),
        ];
        let head = format!(
            "{:<26}{:>12}{:>12}{:>12}{:>12}\n",
            "", "p50", "p95", "p99", "max"
        );
        head + &rows.into_iter().filter_map(line).collect::<String>() + &self.about.start.line()
    }
}

impl Spread {
    /// The spread of some numbers, by nearest rank; none of no numbers.
    fn new(mut numbers: Vec<f64>) -> Option<Self> {
        numbers.sort_by(f64::total_cmp);
        let rank = |percent: usize| {
            let rank = (numbers.len() * percent).div_ceil(100).max(1);
            numbers.get(rank - 1).copied()
        };
        Some(Self {
            p50: rank(50)?,
            p95: rank(95)?,
            p99: rank(99)?,
            max: rank(100)?,
        })
    }
}

fn short(number: f64) -> String {
    if number.fract() == 0.0 {
        format!("{number:.0}")
    } else {
        format!("{number:.3}")
    }
}

/// The spread of every number of a frame, by its name; parts of parts are named with dots.
fn summary(frames: &[FrameRow]) -> Result<BTreeMap<String, Spread>> {
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for frame in frames {
        collect("", &serde_json::to_value(frame)?, &mut columns);
    }
    columns.remove("t");
    let spreads = columns
        .into_iter()
        .filter_map(|(name, numbers)| Some((name, Spread::new(numbers)?)));
    Ok(spreads.collect())
}

fn collect(name: &str, value: &Value, columns: &mut BTreeMap<String, Vec<f64>>) {
    let inner = |key: &str| {
        if name.is_empty() {
            key.to_owned()
        } else {
            format!("{name}.{key}")
        }
    };
    match value {
        Value::Number(number) => columns
            .entry(name.to_owned())
            .or_default()
            .extend(number.as_f64()),
        Value::Object(parts) => parts
            .iter()
            .for_each(|(key, part)| collect(&inner(key), part, columns)),
        Value::Array(parts) => {
            let named = parts.iter().enumerate();
            named
                .for_each(|(depth, part)| collect(&inner(&format!("depth{depth}")), part, columns));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_is_by_nearest_rank() {
        let spread = Spread::new((1..=200).rev().map(f64::from).collect()).unwrap();
        assert_eq!(
            spread,
            Spread {
                p50: 100.0,
                p95: 190.0,
                p99: 198.0,
                max: 200.0
            }
        );
        assert_eq!(Spread::new(vec![7.0]).unwrap().p99, 7.0);
        assert_eq!(Spread::new(vec![]), None);
    }

    #[test]
    fn every_number_is_summed_up_and_missing_gpu_times_are_not() {
        let mut row = FrameRow {
            triangles: 5,
            ..FrameRow::default()
        };
        row.patches.transition[2] = 9;
        let summary = summary(&[FrameRow::default(), row]).unwrap();
        assert_eq!(summary["triangles"].max, 5.0);
        assert_eq!(summary["patches.transition.depth2"].max, 9.0);
        assert!(!summary.contains_key("gpu_millis") && !summary.contains_key("t"));
    }
}
