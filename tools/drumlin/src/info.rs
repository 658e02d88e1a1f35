//! `drumlin info`: what a pyramid holds.

use std::{fmt::Write, path::PathBuf};

use anyhow::Result;
use clap::Args;
use drumlin_core::pyramid::{Metadata, Pyramid};
use drumlin_terminal::{outcome::Outcome, print, size};
use serde_json::{Value, json};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// All of it for programs, on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let pyramid = Pyramid::open(&arguments.pyramid)?;
    let metadata = pyramid.metadata();
    let bytes = Bytes::count(&pyramid)?;
    let text = if arguments.json {
        format!("{:#}\n", json(metadata, &bytes)?)
    } else {
        format!(
            "{}\n{}",
            arguments.pyramid.display(),
            lines(metadata, &bytes)?
        )
    };
    print(&text)?;
    Ok(Outcome::Done)
}

/// Bytes on disk.
struct Bytes {
    /// Heights, by level.
    levels: Vec<u64>,
    color: u64,
    all: u64,
}

impl Bytes {
    fn count(pyramid: &Pyramid) -> Result<Self> {
        let count = |folder: &str| pyramid.store().bytes_under(folder);
        let levels = 0..pyramid.metadata().levels.len();
        Ok(Self {
            levels: levels
                .map(|level| count(&format!("tile/{level}")))
                .collect::<Result<_, _>>()?,
            color: count("color")? + count("alpha")?,
            all: count("")?,
        })
    }
}

fn json(metadata: &Metadata, bytes: &Bytes) -> Result<Value> {
    let mut value = serde_json::to_value(metadata)?;
    let extent = metadata.grid.extent();
    value["extent"] = json!({ "min": extent.min, "max": extent.max });
    value["unit"] = json!(metadata.unit());
    value["height_range_metres"] = json!(height_range(metadata));
    value["world_from_crs"] = json!(metadata.frame().world_from_crs);
    value["tile_count"] = json!(tile_count(metadata));
    value["bytes"] = json!({ "levels": bytes.levels, "color": bytes.color, "all": bytes.all });
    Ok(value)
}

fn lines(metadata: &Metadata, bytes: &Bytes) -> Result<String> {
    let grid = &metadata.grid;
    let extent = grid.extent();
    let ([west, south], [east, north]) = (extent.min, extent.max);
    let [low, high] = height_range(metadata);
    let name = metadata
        .crs
        .name
        .as_deref()
        .map_or(String::new(), |name| format!(" ({name})"));
    let mut text = String::new();
    writeln!(
        text,
        "  samples   {} x {}, {} x {} apart",
        grid.columns,
        grid.rows,
        grid.step[0],
        grid.step[1].abs()
    )?;
    writeln!(text, "  CRS       {}{name}", metadata.crs.label())?;
    writeln!(text, "  extent    x {west} to {east}, y {south} to {north}")?;
    writeln!(
        text,
        "  heights   {low} to {high} m, {:?} reference",
        metadata.vertical
    )?;
    writeln!(
        text,
        "  error     at most {} m, stored in units of {} m",
        metadata.eps,
        metadata.unit()
    )?;
    writeln!(
        text,
        "  size      {} in {} tiles",
        size::display(bytes.all),
        tile_count(metadata)
    )?;
    for (index, (level, bytes)) in metadata.levels.iter().zip(&bytes.levels).enumerate() {
        let [rows, columns] = level.tiles;
        let step = f64::from(level.step) * metadata.unit();
        let notes = [(level.key, ", key"), (level.voids, ", voids")];
        let notes: String = notes
            .iter()
            .filter(|note| note.0)
            .map(|note| note.1)
            .collect();
        let bytes = size::display(*bytes);
        writeln!(
            text,
            "  level {index:<3} {columns} x {rows} tiles, {bytes}, code step {step} m{notes}"
        )?;
    }
    if let Some(color) = &metadata.color {
        let bytes = size::display(bytes.color);
        writeln!(
            text,
            "  imagery   {} levels of {} texels a tile, {bytes}, {}",
            color.levels, color.texels, color.codec
        )?;
    }
    let color = metadata.color.iter().flat_map(|color| &color.sources);
    for source in metadata.sources.iter().chain(color) {
        writeln!(
            text,
            "  source    {}, {}",
            source.name,
            size::display(source.bytes)
        )?;
    }
    Ok(text)
}

fn height_range(metadata: &Metadata) -> [f64; 2] {
    metadata
        .height_range
        .map(|height| f64::from(height) * metadata.unit())
}

fn tile_count(metadata: &Metadata) -> u64 {
    metadata
        .levels
        .iter()
        .map(|level| u64::from(level.tiles[0]) * u64::from(level.tiles[1]))
        .sum()
}
