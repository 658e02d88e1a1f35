//! `drumlin export`: a pyramid for other programs.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use drumlin_core::{
    dem::Compression,
    pyramid::{Pyramid, export_geotiff},
};
use drumlin_terminal::{outcome::Outcome, print, size, write_new};
use serde_json::json;

use crate::progress::Progress;

/// Small, and not slow.
const ZSTD_LEVEL: i32 = 9;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// What to make
    #[arg(long, value_enum)]
    to: Kind,
    /// The file to make
    #[arg(short, long, value_name = "OUT")]
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
enum Kind {
    /// A cloud-optimised GeoTIFF of 32-bit numbers with overviews
    Cog,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Packing {
    /// Plain numbers
    None,
    /// zstd, floating-point predictor
    Zstd,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let pyramid = Pyramid::open(&arguments.pyramid)?;
    let output = &arguments.output;
    let compression = match arguments.compress {
        Packing::None => Compression::None,
        Packing::Zstd => Compression::Zstd(ZSTD_LEVEL),
    };
    let progress = Progress::new();
    let Kind::Cog = arguments.to;
    write_new(output, arguments.overwrite, |file| {
        export_geotiff(&pyramid, compression, file, output, &mut |done, total| {
            progress.tell("exporting", done, total);
        })
    })?;
    drop(progress);
    let bytes = output
        .metadata()
        .with_context(|| format!("{}: reading failed", output.display()))?
        .len();
    print(&if arguments.json {
        format!("{:#}\n", json!({ "output": output, "bytes": bytes }))
    } else {
        format!("{}\n  {}\n", output.display(), size::display(bytes))
    })?;
    Ok(Outcome::Done)
}
