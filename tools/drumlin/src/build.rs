//! `drumlin build`: elevation models become a pyramid.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use drumlin_core::{
    cage::Placement,
    dem::{self, DemError, Image, Mosaic, OpenOptions, Raster},
    geo::CrsKind,
    pyramid::{
        ColorCodec, PyramidError, VerticalReference,
        build::{
            BuildOptions, BuildPlan, BuildReport, Imagery, Progress as Step, Stage, build, plan,
        },
        feature::FeatureInput,
    },
};
use drumlin_terminal::{outcome::Outcome, print, size};
use serde_json::{Value, json};

use crate::{cage, input_list, interrupt, progress::Progress, sources::Sources};

/// Bytes of decoded strips and tiles kept of all inputs together.
const CACHE_BYTES: u64 = 64 << 20;

#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    /// GeoTIFF, SRTM .hgt, 16-bit PNG or EXR; where several overlap, the later one wins
    #[arg(value_name = "INPUT", required_unless_present = "input_list")]
    inputs: Vec<PathBuf>,
    /// A text file that names more inputs, one a line, relative to the file; lines that start with # are left out
    #[arg(long, value_name = "FILE")]
    input_list: Option<PathBuf>,
    /// The pyramid to make: a folder, which appears when it is whole
    #[arg(short, long, value_name = "OUT.zarr")]
    pub(crate) output: PathBuf,
    /// Greatest error of the finest level in metres [default: the largest that gives whole metres back exactly; 0.1
    /// for other heights]
    #[arg(long, value_name = "METRES")]
    eps: Option<f64>,
    /// Height unit in metres, a power of two [default: the largest that is at most an eighth of eps]
    #[arg(long, value_name = "METRES")]
    unit: Option<f64>,
    /// Threads [default: all cores]; the result does not depend on it
    #[arg(short = 'j', long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Memory the build may take, as 512MiB or 4GB; refused beforehand where that is too little; the result does not
    /// depend on it
    #[arg(long, value_name = "BYTES", value_parser = size::parse)]
    memory_budget: Option<u64>,
    /// CRS units from sample to sample, for files that do not say where they lie
    #[arg(long, value_name = "UNITS")]
    spacing: Option<f64>,
    /// Metres a unit of the stored numbers
    #[arg(long, value_name = "METRES")]
    scale: Option<f64>,
    /// Pictures to lay over the terrain (PNG, JPEG, TIFF): of the same CRS, or of none and then stretched; where several
    /// overlap, the later one wins; where one has alpha, a mask or a value for nothing, what is under it shows
    #[arg(long, value_name = "IMG", num_args = 1..)]
    imagery: Vec<PathBuf>,
    /// How pictures are stored: without loss, or as JPEG of a quality from 1 to 100
    #[arg(long, value_name = "zstd|jpeg[:QUALITY]", value_parser = color_codec, default_value = "zstd")]
    imagery_codec: ColorCodec,
    /// Cages to lay into the finest level: OBJ with tags and a line "# drumlin position X Y Z"
    #[arg(long, value_name = "FILE", num_args = 1..)]
    features: Vec<PathBuf>,
    /// Zero of the heights, where known
    #[arg(long, value_enum, default_value_t = Vertical::Unknown)]
    vertical: Vertical,
    /// Replaces a pyramid that is there; never anything else
    #[arg(long)]
    overwrite: bool,
    /// Prints what would be done (tasks, tiles, bytes, time, from three small windows) and builds nothing; the rest of
    /// the input, features and imagery are not tried
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// A summary for programs on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Vertical {
    Ellipsoidal,
    Orthometric,
    Unknown,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let cancel = interrupt::flag()?;
    with_inputs(arguments, &mut Sources::default(), |inputs| {
        let Inputs {
            raster,
            imagery,
            options,
        } = inputs;
        if arguments.dry_run {
            let plan = plan(raster, imagery, options, &cancel)?;
            print(&if arguments.json {
                format!("{:#}\n", serde_json::to_value(&plan)?)
            } else {
                plan_lines(arguments, &plan)
            })?;
            return Ok(());
        }
        let progress = Progress::new();
        let tell = |step: Step| {
            if step.stage == Stage::StartOver {
                progress.say(&format!(
                    "{}: an earlier run left a build of other inputs or options, or by another version; starting over",
                    arguments.output.display()
                ));
            }
            progress.tell(step.stage.label(), step.done, step.total);
        };
        let report = build(raster, imagery, options, &tell, &cancel)?;
        drop(progress);
        print_report(arguments, &report)
    })?;
    Ok(Outcome::Done)
}

/// What a build is made of.
pub(crate) struct Inputs<'a> {
    pub(crate) raster: &'a dyn Raster,
    pub(crate) imagery: Option<&'a Imagery<'a>>,
    pub(crate) options: &'a BuildOptions,
}

/// Opens all that a build is made of.
pub(crate) fn with_inputs<T>(
    arguments: &Arguments,
    sources: &mut Sources,
    act: impl FnOnce(Inputs<'_>) -> Result<T>,
) -> Result<T> {
    let mut arguments = arguments.clone();
    if let Some(list) = &arguments.input_list {
        arguments.inputs.extend(input_list::read(list)?);
    }
    let arguments = &arguments;
    sources.look(&arguments.inputs)?;
    sources.look(&arguments.imagery)?;
    let raster = open(arguments)?;
    let images = arguments.imagery.iter();
    let images: Vec<Image> = images
        .map(|file| open_imagery(arguments, file, &*raster))
        .collect::<Result<_>>()?;
    let imagery = if images.is_empty() {
        None
    } else {
        Some(Imagery {
            images: &images,
            codec: arguments.imagery_codec,
            sources: sources.describe(&arguments.imagery)?,
        })
    };
    act(Inputs {
        raster: &*raster,
        imagery: imagery.as_ref(),
        options: &options(arguments, sources)?,
    })
}

/// A codec as it is typed.
fn color_codec(text: &str) -> Result<ColorCodec, String> {
    let quality = match text.split_once(':') {
        None if text == "zstd" => return Ok(ColorCodec::Zstd),
        None if text == "jpeg" => ColorCodec::QUALITY,
        Some(("jpeg", quality)) => quality.parse().unwrap_or(0),
        _ => return Err("zstd, jpeg and jpeg:QUALITY are known".into()),
    };
    if (1..=100).contains(&quality) {
        Ok(ColorCodec::Jpeg { quality })
    } else {
        Err("a quality is a number from 1 to 100".into())
    }
}

/// Says what was made, or that it was there.
pub(crate) fn print_report(arguments: &Arguments, report: &BuildReport) -> Result<()> {
    if report.unchanged {
        eprintln!(
            "drumlin: {}: is there already, of the same inputs and options; nothing was done",
            arguments.output.display()
        );
    }
    print(&if arguments.json {
        format!("{:#}\n", json(arguments, report)?)
    } else {
        lines(arguments, report)
    })?;
    Ok(())
}

fn options(arguments: &Arguments, sources: &mut Sources) -> Result<BuildOptions> {
    Ok(BuildOptions {
        output: arguments.output.clone(),
        overwrite: arguments.overwrite,
        eps: arguments.eps,
        unit: arguments.unit,
        threads: arguments.jobs.map(usize::from),
        memory_budget: arguments.memory_budget,
        vertical: match arguments.vertical {
            Vertical::Ellipsoidal => VerticalReference::Ellipsoidal,
            Vertical::Orthometric => VerticalReference::Orthometric,
            Vertical::Unknown => VerticalReference::Unknown,
        },
        features: arguments
            .features
            .iter()
            .map(|file| feature(file))
            .collect::<Result<_>>()?,
        sources: sources.describe(&arguments.inputs)?,
        inputs: sources.stamps(),
    })
}

/// Reads a cage and where it stands.
fn feature(file: &Path) -> Result<FeatureInput> {
    let text = cage::bytes(file)?;
    let placement = Placement::read(&text).with_context(|| file.display().to_string())?;
    Ok(FeatureInput {
        name: file
            .file_name()
            .unwrap_or(file.as_os_str())
            .to_string_lossy()
            .into_owned(),
        cage: cage::parse(file, &text)?,
        placement,
    })
}

/// Opens the inputs, as a mosaic where there are several.
fn open(arguments: &Arguments) -> Result<Box<dyn Raster>> {
    let options = OpenOptions {
        spacing: arguments.spacing,
        scale: arguments.scale,
        cache_bytes: cache_bytes(arguments, arguments.inputs.len()),
        ..OpenOptions::default()
    };
    let mut rasters = Vec::new();
    for file in &arguments.inputs {
        let raster = dem::open(file, &options)?;
        let header = raster.header();
        if header.crs.kind == CrsKind::Unknown {
            let [x, y] = header.grid.step;
            eprintln!(
                "drumlin: {}: no coordinate system; taken as plane metres, {x} x {} a sample",
                file.display(),
                y.abs()
            );
        }
        rasters.push(raster);
    }
    if rasters.len() > 1 {
        return Ok(Box::new(Mosaic::new(rasters)?));
    }
    rasters
        .pop()
        .ok_or_else(|| PyramidError::Refused("no input".into()).into())
}

/// Bytes of decoded parts kept for each of `count` inputs: together no more than a quarter of the budget; of several
/// inputs, no more than one has as a rule.
fn cache_bytes(arguments: &Arguments, count: usize) -> Option<usize> {
    let quarter = arguments.memory_budget.map(|budget| budget / 4);
    let each = if count > 1 {
        Some(quarter.unwrap_or(CACHE_BYTES).min(CACHE_BYTES) / count as u64)
    } else {
        quarter
    };
    each.map(|bytes| usize::try_from(bytes).unwrap_or(usize::MAX))
}

/// Opens a picture; one that says where it lies must say so in the terrain's CRS.
fn open_imagery(arguments: &Arguments, file: &Path, raster: &dyn Raster) -> Result<Image> {
    let options = OpenOptions {
        cache_bytes: cache_bytes(arguments, arguments.imagery.len()),
        ..OpenOptions::default()
    };
    let image = dem::open_image(file, &options)?;
    let crs = &raster.header().crs;
    let known = image.extent.is_some() && image.crs.kind != CrsKind::Unknown;
    if known && !image.crs.same_as(crs) {
        let what = format!(
            "their coordinate systems are {} and {}",
            crs.label(),
            image.crs.label()
        );
        let first = raster.header().source.name.clone();
        let second = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        return Err(DemError::Mismatch {
            first,
            second,
            what,
        }
        .into());
    }
    Ok(image)
}

fn json(arguments: &Arguments, report: &BuildReport) -> Result<Value> {
    let mut value = serde_json::to_value(report)?;
    value["output"] = json!(arguments.output);
    Ok(value)
}

fn lines(arguments: &Arguments, report: &BuildReport) -> String {
    let [rows, columns] = report.samples;
    let mut text = format!("{}\n", arguments.output.display());
    text += &format!(
        "  {columns} x {rows} samples, {} void\n",
        report.void_samples
    );
    text += &format!(
        "  {} levels, {} tiles, error at most {} m\n",
        report.levels, report.tiles, report.eps
    );
    text += &format!(
        "  {} of heights from {} of input",
        size::display(report.height_bytes),
        size::display(report.source_bytes)
    );
    if report.features > 0 {
        text += &format!(
            ", {} of {} features",
            size::display(report.feature_bytes),
            report.features
        );
    }
    if report.color_levels > 0 {
        text += &format!(
            ", {} of imagery ({})",
            size::display(report.color_bytes),
            arguments.imagery_codec
        );
    }
    if report.unchanged {
        return text + "\n";
    }
    if report.kept_tasks > 0 {
        text += &format!("\n  {} tasks kept of an earlier run", report.kept_tasks);
    }
    let samples = f64::from(rows) * f64::from(columns) / report.seconds.max(1e-9) / 1e6;
    text + &format!(
        "\n  {:.1} s, {samples:.1} million samples a second\n",
        report.seconds
    )
}

fn plan_lines(arguments: &Arguments, plan: &BuildPlan) -> String {
    let [rows, columns] = plan.samples;
    let mut text = format!("{}, as planned\n", arguments.output.display());
    text += &format!(
        "  {columns} x {rows} samples, {} levels, {} tiles\n",
        plan.levels, plan.tiles
    );
    text += &format!(
        "  {} threads, blocks of {side} x {side} tiles, at most {} of memory, {} of scratch files\n",
        plan.threads,
        size::display(plan.memory_bytes),
        size::display(plan.scratch_bytes),
        side = plan.block_tiles
    );
    for pass in &plan.passes {
        text += &format!(
            "  {:<10} {:>8} tasks, {:>10} tiles\n",
            pass.name, pass.tasks, pass.tiles
        );
    }
    match (plan.height_bytes, plan.seconds) {
        (Some(bytes), Some(seconds)) => {
            text + &format!(
                "  about {} of heights in about {seconds:.0} s\n",
                size::display(bytes)
            )
        }
        _ => text + "  bytes and time unknown: the windows that were tried are void\n",
    }
}
