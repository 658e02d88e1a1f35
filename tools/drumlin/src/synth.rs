//! `drumlin synth`: an elevation model of any size, made of a seed.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use drumlin_core::dem::{Compression, Raster, Synth, Window, write_raster};
use drumlin_terminal::{outcome::Outcome, print, size, write_new};
use serde_json::json;

use crate::progress::Progress;

/// Fast, and most of what zstd can do to heights.
const ZSTD_LEVEL: i32 = 1;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The terrain's number
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Samples a side of a square from the terrain's north-west corner
    #[arg(
        long,
        value_name = "N",
        required_unless_present = "window",
        conflicts_with = "window"
    )]
    size: Option<u32>,
    /// Any part of the terrain; parts of one seed fit together
    #[arg(long, value_name = "ROW,COLUMN,ROWS,COLUMNS", value_parser = window)]
    window: Option<Window>,
    /// The file to make: a tiled GeoTIFF of 32-bit numbers, BigTIFF where it could pass 4 GiB
    #[arg(short, long, value_name = "OUT.tif")]
    output: PathBuf,
    /// How the file's tiles are stored
    #[arg(long, value_enum, default_value_t = Packing::Zstd)]
    compress: Packing,
    /// Replaces a file that is there
    #[arg(long)]
    overwrite: bool,
    /// A summary for programs on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Packing {
    /// Plain numbers
    None,
    /// zstd, floating-point predictor
    Zstd,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let window = match (arguments.window, arguments.size.unwrap_or(0)) {
        (Some(window), _) => window,
        (None, size) => Window {
            row: 0,
            column: 0,
            rows: size,
            columns: size,
        },
    };
    let synth = Synth::new(arguments.seed, window)?;
    let compression = match arguments.compress {
        Packing::None => Compression::None,
        Packing::Zstd => Compression::Zstd(ZSTD_LEVEL),
    };
    let output = &arguments.output;
    let progress = Progress::new();
    write_new(output, arguments.overwrite, |file| {
        let tell = |done, total| progress.tell("making", done, total);
        Ok(write_raster(&synth, compression, file, output, tell)?)
    })?;
    drop(progress);
    let bytes = output
        .metadata()
        .with_context(|| format!("{}: reading failed", output.display()))?
        .len();
    let grid = &synth.header().grid;
    print(&if arguments.json {
        format!(
            "{:#}\n",
            json!({
                "output": output,
                "seed": arguments.seed,
                "rows": grid.rows,
                "columns": grid.columns,
                "spacing": grid.step[0],
                "bytes": bytes,
            })
        )
    } else {
        format!(
            "{}\n  {} x {} samples, {} m apart, {}\n",
            output.display(),
            grid.columns,
            grid.rows,
            grid.step[0],
            size::display(bytes)
        )
    })?;
    Ok(Outcome::Done)
}

/// Reads four numbers with commas between them.
fn window(text: &str) -> Result<Window, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[row, column, rows, columns]) => Ok(Window {
            row,
            column,
            rows,
            columns,
        }),
        _ => Err("expected four whole numbers as ROW,COLUMN,ROWS,COLUMNS".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_four_numbers() {
        let read = window("1, 2,3,4").unwrap();
        assert_eq!(
            (read.row, read.column, read.rows, read.columns),
            (1, 2, 3, 4)
        );
        for text in ["", "1,2,3", "1,2,3,4,5", "-1,2,3,4", "1,2,x,4"] {
            assert!(window(text).is_err(), "{text}");
        }
    }
}
