//! `drumlin diff`: do two pyramids hold the same heights.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use drumlin_core::pyramid::{LevelDifference, Pyramid, diff};
use drumlin_terminal::{outcome::Outcome, print};
use serde_json::json;

use crate::progress::Progress;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The one
    #[arg(value_name = "A")]
    a: PathBuf,
    /// The other, on the same grid
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Heights may differ by so much
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = tolerance)]
    tolerance: f64,
    /// The differences for programs on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let [a, b] = [&arguments.a, &arguments.b].map(|path| Pyramid::open(path));
    let progress = Progress::new();
    let levels = diff(&a?, &b?, &|done, total| {
        progress.tell("comparing", done, total);
    })?;
    drop(progress);
    let differ = levels.iter().any(|level| level.passes(arguments.tolerance));
    print(&if arguments.json {
        format!("{:#}\n", json!({ "differ": differ, "levels": levels }))
    } else {
        table(&levels)
    })?;
    Ok(if differ {
        Outcome::InvalidData
    } else {
        Outcome::Done
    })
}

fn table(levels: &[LevelDifference]) -> String {
    let row = |level: &LevelDifference| {
        let place = level.place.map_or("-".into(), |[x, y]| format!("{x}, {y}"));
        format!(
            "{:>5} {:>12} {:>12} {:>10} {:>12.6} {:>12.6}   {place}\n",
            level.level,
            level.sample_count,
            level.differing_count,
            level.void_count,
            level.mean,
            level.max
        )
    };
    format!(
        "{:>5} {:>12} {:>12} {:>10} {:>12} {:>12}   {}\n",
        "level", "samples", "differ", "voids", "mean, m", "max, m", "at x, y"
    ) + &levels.iter().map(row).collect::<String>()
}

fn tolerance(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|metres| (0.0..f64::INFINITY).contains(metres))
        .ok_or_else(|| format!("`{text}` is no number of metres from 0 up"))
}
