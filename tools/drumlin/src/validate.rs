//! `drumlin validate`: are all files there and whole, and with `--deep` every tile.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use drumlin_core::pyramid::{Report, validate};
use drumlin_terminal::{outcome::Outcome, print, size};

use crate::progress::Progress;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// Reads and checks every tile, and that neighbours agree
    #[arg(long)]
    deep: bool,
    /// A report for programs on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let progress = Progress::new();
    let report = validate(&arguments.pyramid, arguments.deep, &mut |done, total| {
        progress.tell("checking", done, total);
    })?;
    drop(progress);
    if arguments.json {
        print(&(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    tell(&report, arguments)?;
    Ok(if report.is_valid() {
        Outcome::Done
    } else {
        Outcome::InvalidData
    })
}

fn tell(report: &Report, arguments: &Arguments) -> Result<()> {
    for finding in &report.findings {
        eprintln!("drumlin: {finding}");
    }
    let pyramid = arguments.pyramid.display();
    if !report.is_valid() {
        eprintln!(
            "drumlin: {pyramid}: invalid, {} findings",
            report.finding_count
        );
    } else if !arguments.json {
        let tiles = if report.deep {
            format!(", {} tiles", report.tile_count)
        } else {
            String::new()
        };
        let bytes = size::display(report.shard_bytes);
        print(&format!(
            "{pyramid}: valid; {} shards{tiles}, {bytes}\n",
            report.shard_count
        ))?;
    }
    Ok(())
}
