//! `drumlin pack` and `drumlin unpack`: a pyramid as one file, and back.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use drumlin_core::pyramid::{Pyramid, pack, unpack};
use drumlin_terminal::{outcome::Outcome, print, size, write_new};
use serde_json::json;

use crate::progress::Progress;

#[derive(Debug, Args)]
pub(crate) struct PackArguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// The archive to make: a ZIP that every verb reads as it reads the folder
    #[arg(value_name = "OUT.zip")]
    output: PathBuf,
    /// Replaces a file that is there
    #[arg(long)]
    overwrite: bool,
    /// A summary for programs on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct UnpackArguments {
    /// The archive
    #[arg(value_name = "PYRAMID.zip")]
    pyramid: PathBuf,
    /// The folder to make, which appears when it is whole
    #[arg(value_name = "OUT.zarr")]
    output: PathBuf,
    /// Replaces a pyramid that is there; never anything else
    #[arg(long)]
    overwrite: bool,
    /// A summary for programs on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run_pack(arguments: &PackArguments) -> Result<Outcome> {
    let pyramid = Pyramid::open(&arguments.pyramid)?;
    let output = &arguments.output;
    let progress = Progress::new();
    write_new(output, arguments.overwrite, |file| {
        pack(&pyramid, file, output, &mut |done, total| {
            progress.tell("packing", done, total);
        })
    })?;
    drop(progress);
    let bytes = output
        .metadata()
        .with_context(|| format!("{}: reading failed", output.display()))?
        .len();
    tell(output, bytes, arguments.json)
}

pub(crate) fn run_unpack(arguments: &UnpackArguments) -> Result<Outcome> {
    let pyramid = Pyramid::open(&arguments.pyramid)?;
    let output = &arguments.output;
    let progress = Progress::new();
    unpack(&pyramid, output, arguments.overwrite, &mut |done, total| {
        progress.tell("unpacking", done, total);
    })?;
    drop(progress);
    let bytes = pyramid.store().bytes_under("")?;
    tell(output, bytes, arguments.json)
}

fn tell(output: &Path, bytes: u64, json: bool) -> Result<Outcome> {
    print(&if json {
        format!("{:#}\n", json!({ "output": output, "bytes": bytes }))
    } else {
        format!("{}\n  {}\n", output.display(), size::display(bytes))
    })?;
    Ok(Outcome::Done)
}
