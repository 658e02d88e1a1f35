//! A terrain cage of the paper's size, along a camera path: classic refinement, a depth for every feature, and the
//! engine's own tiles.
//!
//! ```text
//! cargo run --release -p drumlin-benches --bin terrain805k -- [--dem FILE] [--json FILE] [--plot FILE.png]
//! ```
//!
//! Based on: Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark surface model* (2018), section 4
//! and figure 13; their terrain is not published, this is one of its size and kind.

#![expect(
    clippy::cast_possible_truncation,
    reason = "positions of experiments are rounded to f32 on purpose"
)]

mod equal;
mod path;
mod rows;
mod step;
mod tiles;
mod view;

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;
use drumlin_benches::{
    heights::Heights,
    measure::{self, Machine, Timing},
    terrain_cage::{CageCounts, PAPER_QUADS, cage_counts, terrain_cage},
};
use serde::Serialize;

/// Pixels that may remain, of the cage (`DepthRule::DEFAULT`) and of the tiles.
const ERROR_PX: f64 = 0.5;
/// Metres the camera steps.
const STEPS: [f64; 2] = [1.0, 100.0];

/// Classic refinement, a depth for every feature, and tiles, on a terrain cage.
#[derive(Parser)]
struct Arguments {
    /// Elevation model the cage is made of; voids are filled.
    #[arg(long, default_value = "assets/mt_rainier_90m.tif")]
    dem: PathBuf,
    /// Quads of the cage.
    #[arg(long, default_value_t = PAPER_QUADS)]
    quads: u64,
    /// Classic's depth in the comparison at equal worst error everywhere.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=6))]
    depth: u8,
    /// Stations along the camera's path.
    #[arg(long, default_value_t = 17, value_parser = clap::value_parser!(u8).range(2..))]
    stations: u8,
    /// Runs of every step; the median is printed.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..))]
    runs: u8,
    /// Writes all figures.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Draws the totals along the path as a PNG.
    #[arg(long)]
    plot: Option<PathBuf>,
}

/// Everything, as JSON.
#[derive(Serialize)]
struct Report {
    machine: Machine,
    cage: CageCounts,
    equal: equal::Equal,
    path: view::Path,
    steps: Vec<step::Steps>,
    tiles: Vec<tiles::Tiled>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let heights = Heights::read(&arguments.dem)?;
    let cage = terrain_cage(&heights, arguments.quads)?;
    let [width, height] = heights.size();
    let ground = |[x, y]: [f64; 2]| heights.at([x / width + 0.5, 0.5 - y / height]);
    let stations = path::stations(usize::from(arguments.stations), width.min(height), ground);
    let runs = usize::from(arguments.runs);
    eprintln!("at equal worst error");
    let equal = equal::measure(&cage, arguments.depth, runs)?;
    eprintln!("along the path");
    let path = view::measure(&cage, &stations, runs)?;
    let rebuilds = path
        .seen
        .iter()
        .map(|seen| seen.adaptive.one_thread.subdivision());
    let rebuild = Timing::of(rebuilds.collect()).median;
    eprintln!("steps of the camera");
    let measure_steps = |metres| step::measure(&cage, &stations, metres, rebuild);
    let steps = STEPS
        .into_iter()
        .map(measure_steps)
        .collect::<Result<_>>()?;
    eprintln!("tiles");
    let tiles = tiles::measure(&arguments.dem, &stations, ERROR_PX, runs)?;
    let report = Report {
        machine: Machine::here(),
        cage: cage_counts(&cage),
        equal,
        path,
        steps,
        tiles,
    };
    print!("{}", rows::text(&report)?);
    if let Some(file) = &arguments.json {
        measure::write_json(file, &report)?;
    }
    if let Some(file) = &arguments.plot {
        rows::plot(&report)?.write_png(file)?;
    }
    Ok(())
}
