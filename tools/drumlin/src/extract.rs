//! `drumlin extract`: a box of a level, as a GeoTIFF.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use drumlin_core::{
    dem::{Compression, Crop, Raster, Window, write_raster},
    geo::{Extent, Grid},
    pyramid::{LevelHeights, Pyramid},
};
use drumlin_terminal::{outcome::Outcome, print, write_new};
use serde_json::json;

use crate::progress::Progress;

/// Small, and not slow.
const ZSTD_LEVEL: i32 = 9;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// Two opposite corners in CRS coordinates; samples on the box's sides belong to it
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true, value_parser = extent)]
    bbox: Extent,
    /// The level to cut from, 0 the coarsest [default: the finest]
    #[arg(long, value_name = "L")]
    level: Option<u8>,
    /// The file to make: a tiled GeoTIFF of 32-bit numbers, NaN where void
    #[arg(short, long, value_name = "OUT.tif")]
    output: PathBuf,
    /// Replaces a file that is there
    #[arg(long)]
    overwrite: bool,
    /// A summary for programs on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let pyramid = Pyramid::open(&arguments.pyramid)?;
    let level = arguments.level.unwrap_or(pyramid.metadata().finest());
    let heights = LevelHeights::new(&pyramid, level)?;
    let Some(window) = window(&heights.header().grid, &arguments.bbox) else {
        let Extent { min, max } = heights.header().grid.extent();
        bail!(
            "the box holds no sample of level {level}, which lies within x {} to {}, y {} to {}",
            min[0],
            max[0],
            min[1],
            max[1]
        );
    };
    let crop = Crop::new(&heights, window)?;
    let output = &arguments.output;
    let progress = Progress::new();
    write_new(output, arguments.overwrite, |file| {
        let tell = |done, total| progress.tell("extracting", done, total);
        let compression = Compression::Zstd(ZSTD_LEVEL);
        Ok(write_raster(&crop, compression, file, output, tell)?)
    })?;
    drop(progress);
    let Extent { min, max } = crop.header().grid.extent();
    print(&if arguments.json {
        format!(
            "{:#}\n",
            json!({
                "output": output,
                "level": level,
                "rows": window.rows,
                "columns": window.columns,
                "extent": { "min": min, "max": max },
            })
        )
    } else {
        format!(
            "{}\n  {} x {} samples of level {level}\n",
            output.display(),
            window.columns,
            window.rows
        )
    })?;
    Ok(Outcome::Done)
}

/// The samples of a grid that lie in a box.
fn window(grid: &Grid, bbox: &Extent) -> Option<Window> {
    let [south, west] = grid.row_column(bbox.min);
    let [north, east] = grid.row_column(bbox.max);
    // A corner that was typed with fewer digits than it has still finds its sample.
    const NEAR: f64 = 1e-6;
    let span = |low: f64, high: f64, count: u32| {
        let low = (low - NEAR).ceil().max(0.0);
        let high = (high + NEAR).floor().min(f64::from(count) - 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the grid"
        )]
        (low <= high).then(|| (low as u32, (high - low) as u32 + 1))
    };
    let (row, rows) = span(north, south, grid.rows)?;
    let (column, columns) = span(west, east, grid.columns)?;
    Some(Window {
        row,
        column,
        rows,
        columns,
    })
}

/// Reads two corners.
fn extent(text: &str) -> Result<Extent, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) if [x0, y0, x1, y1].iter().all(|v| v.is_finite()) => Ok(Extent {
            min: [x0.min(x1), y0.min(y1)],
            max: [x0.max(x1), y0.max(y1)],
        }),
        _ => Err("expected four numbers as X0,Y0,X1,Y1".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_takes_the_samples_on_its_sides_and_none_past_the_grid() {
        let grid = Grid {
            columns: 11,
            rows: 21,
            origin: [100.0, 500.0],
            step: [10.0, -10.0],
        };
        let cut = |text: &str| {
            window(&grid, &extent(text).unwrap())
                .map(|found| [found.row, found.column, found.rows, found.columns])
        };
        assert_eq!(cut("120,480,150,460"), Some([2, 2, 3, 4]));
        assert_eq!(cut("121,479,149,461"), Some([3, 3, 1, 2]));
        assert_eq!(cut("-1e9,-1e9,1e9,1e9"), Some([0, 0, 21, 11]));
        assert_eq!(cut("121,479,129,471"), None);
        assert_eq!(cut("900,0,901,1"), None);
        assert!(extent("1,2,3").is_err() && extent("1,2,3,nan").is_err());
    }
}
