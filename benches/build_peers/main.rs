//! Building a pyramid beside GDAL's ways of it: the same raster, the same bound, processes of their own.
//!
//! ```text
//! cargo build --release -p drumlin-cli
//! cargo run --release -p drumlin-benches --bin build_peers -- [--size 16385] [--eps 0.125] [--json FILE]
//! ```
//!
//! Every contender is a command line that is run several times and measured by GNU time: processor seconds of user and
//! system, wall time, peak resident memory; then the bytes it left. On Debian and Ubuntu `apt install gdal-bin time`
//! brings what is needed.

mod contender;
mod run;

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, ensure};
use clap::Parser;
use drumlin_benches::measure::{self, Machine};
use drumlin_core::{
    dem::{Compression, Synth, Window, write_raster},
    pyramid::write_whole_with,
};
use serde::Serialize;

use self::{
    contender::{Contender, contenders},
    run::Run,
};

/// Building a pyramid beside GDAL's ways of it.
#[derive(Parser)]
struct Arguments {
    /// Samples a side of the synthetic raster
    #[arg(long, default_value_t = 4097, value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    size: u32,
    /// The raster's seed
    #[arg(long, default_value_t = 42)]
    seed: u64,
    /// Bound on the error in metres
    #[arg(long, default_value_t = 0.125)]
    eps: f64,
    /// Threads of every contender
    #[arg(long, default_value_t = 2)]
    threads: u16,
    /// Runs of every contender
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..))]
    runs: u8,
    /// Where the raster and what is built go; the raster stays for the next time
    #[arg(long, default_value = "target/build-peers")]
    folder: PathBuf,
    /// The figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

/// A contender's figures.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    command: String,
    runs: Vec<Run>,
    median: Run,
    bytes: u64,
    bits_a_sample: f64,
}

#[derive(Serialize)]
struct Figures {
    machine: Machine,
    size: u32,
    seed: u64,
    eps: f64,
    threads: u16,
    raster_bytes: u64,
    rows: Vec<Row>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let folder = &arguments.folder;
    fs::create_dir_all(folder).with_context(|| format!("{}: making failed", folder.display()))?;
    let raster = raster(&arguments)?;
    let rows: Result<Vec<Row>> = contenders(&arguments, &raster)?
        .into_iter()
        .map(|contender| row(contender, &arguments))
        .collect();
    let figures = Figures {
        machine: Machine::here(),
        size: arguments.size,
        seed: arguments.seed,
        eps: arguments.eps,
        threads: arguments.threads,
        raster_bytes: fs::metadata(&raster)?.len(),
        rows: rows?,
    };
    print(&figures);
    match &arguments.json {
        Some(path) => measure::write_json(path, &figures),
        None => Ok(()),
    }
}

/// The raster, made if it is not there.
fn raster(arguments: &Arguments) -> Result<PathBuf> {
    let Arguments { size, seed, .. } = arguments;
    let path = arguments.folder.join(format!("synth-{seed}-{size}.tif"));
    if !path.exists() {
        eprintln!("making {}", path.display());
        let window = Window {
            row: 0,
            column: 0,
            rows: *size,
            columns: *size,
        };
        let synth = Synth::new(*seed, window)?;
        write_whole_with(&path, |file: &mut File| {
            Ok(write_raster(
                &synth,
                Compression::Zstd(1),
                file,
                &path,
                |_, _| {},
            )?)
        })?;
    }
    Ok(path)
}

fn row(contender: Contender, arguments: &Arguments) -> Result<Row> {
    let mut runs = Vec::new();
    let mut bytes = 0;
    for index in 1..=arguments.runs {
        eprintln!("{}, run {index} of {}", contender.name, arguments.runs);
        contender.remove_output()?;
        runs.push(run::measured(&contender.command, &arguments.folder)?);
        bytes = contender.output_bytes()?;
    }
    // What one contender leaves may help another: GDAL uses overviews that it finds.
    contender.remove_output()?;
    let samples = f64::from(arguments.size) * f64::from(arguments.size);
    ensure!(!runs.is_empty(), "no run");
    Ok(Row {
        name: contender.name,
        command: contender.command.join(" "),
        median: run::median(&runs),
        runs,
        bytes,
        bits_a_sample: 8.0 * bytes as f64 / samples,
    })
}

fn print(figures: &Figures) {
    let Figures {
        size,
        eps,
        threads,
        raster_bytes,
        ..
    } = figures;
    println!(
        "{size} x {size} heights in {:.1} MB, bound {eps} m, {threads} threads, medians of {} runs\n",
        *raster_bytes as f64 / 1e6,
        figures.rows.first().map_or(0, |row| row.runs.len())
    );
    println!(
        "| | CPU s | CPU s a Gpixel | wall s | peak RSS, MB | output, MB | bits a finest sample |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|");
    let gigapixels = f64::from(*size) * f64::from(*size) / 1e9;
    for row in &figures.rows {
        let Run { cpu, wall, rss } = row.median;
        println!(
            "| {} | {cpu:.2} | {:.1} | {wall:.2} | {:.0} | {:.2} | {:.2} |",
            row.name,
            cpu / gigapixels,
            rss as f64 / 1e6,
            row.bytes as f64 / 1e6,
            row.bits_a_sample
        );
    }
    println!("\n{}", figures.machine.line());
}

/// Bytes of a file, or of all in a folder.
fn bytes_at(path: &Path) -> Result<u64> {
    let about = fs::metadata(path).with_context(|| format!("{}: is missing", path.display()))?;
    if !about.is_dir() {
        return Ok(about.len());
    }
    let mut sum = 0;
    for entry in fs::read_dir(path)? {
        sum += bytes_at(&entry?.path())?;
    }
    Ok(sum)
}
