//! `drumlin height`: heights of places, of the finest surface there is: its samples, and the features that stand in them.

use std::{path::PathBuf, sync::Arc};

use anyhow::Result;
use clap::Args;
use drumlin_core::{
    geo::Extent,
    stream::TileSource,
    terrain::{PyramidSource, Surface},
};
use drumlin_terminal::{outcome::Outcome, print};
use serde::Serialize;

use crate::arguments::coordinates;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pyramid: PathBuf,
    /// A place in CRS coordinates; more may follow
    #[arg(long, value_name = "X,Y", required = true, allow_hyphen_values = true, value_parser = place)]
    at: Vec<Place>,
    /// A list for programs: [{"x", "y", "height"}], null where void or outside
    #[arg(long)]
    json: bool,
}

/// A place, and the height found there.
#[derive(Clone, Copy, Debug, Serialize)]
struct Place {
    x: f64,
    y: f64,
    height: Option<f64>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    let source = PyramidSource::open(&arguments.pyramid)?;
    let extent = source.metadata().grid.extent();
    let surface = Surface::new(Arc::new(source));
    let mut places = arguments.at.clone();
    for place in &mut places {
        let world = surface.frame().to_world([place.x, place.y]);
        place.height = surface.height_at(world)?;
    }
    let text = if arguments.json {
        serde_json::to_string_pretty(&places)? + "\n"
    } else {
        table(&places, &extent)
    };
    print(&text)?;
    Ok(Outcome::Done)
}

fn place(text: &str) -> Result<Place, String> {
    let [x, y] = coordinates(text).ok_or("expected two numbers as X,Y")?;
    Ok(Place { x, y, height: None })
}

fn table(places: &[Place], extent: &Extent) -> String {
    let row = |place: &Place| {
        let height = match place.height {
            Some(height) => format!("{height:.3}"),
            None if extent.contains([place.x, place.y]) => "void".into(),
            None => "outside".into(),
        };
        format!("{:>16} {:>16} {height:>12}\n", place.x, place.y)
    };
    format!("{:>16} {:>16} {:>12}\n", "x", "y", "height, m")
        + &places.iter().map(row).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn void_and_outside_are_told_apart() {
        let extent = Extent {
            min: [0.0, 0.0],
            max: [1.0, 1.0],
        };
        let places = [(0.5, Some(12.5)), (0.25, None), (7.0, None)].map(|(x, height)| Place {
            x,
            y: 0.5,
            height,
        });
        let table = table(&places, &extent);
        let ends: Vec<_> = table
            .lines()
            .map(|line| line.split_whitespace().next_back().unwrap())
            .collect();
        assert_eq!(ends, ["m", "12.500", "void", "outside"]);
    }

    #[test]
    fn json_has_null_where_nothing_is() {
        let text = serde_json::to_string(&[Place {
            x: -1.5,
            y: 2.0,
            height: None,
        }])
        .unwrap();
        assert_eq!(text, r#"[{"x":-1.5,"y":2.0,"height":null}]"#);
    }
}
