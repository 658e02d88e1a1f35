//! `drumlin feature`: makes the cage of a landform along a path, to be laid into a terrain by `build --features`.

use std::{cell::RefCell, path::PathBuf, sync::Arc};

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, Subcommand};
use drumlin_core::{
    cage::{
        Cage, CageError, Placement,
        generate::{Arch, Cliff, GroundHeight, Path, Road, arch, cliff, flat, road},
        write_obj,
    },
    geo::Crs,
    terrain::{PyramidSource, Surface},
};
use drumlin_terminal::{outcome::Outcome, print, write};

use crate::arguments::coordinates;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    shape: Shape,
}

#[derive(Debug, Subcommand)]
enum Shape {
    /// A cliff whose face leans out over its foot, on the right of the path
    Cliff {
        #[command(flatten)]
        site: Site,
        /// From foot to brink [default: an eighth of the path]
        #[arg(long, value_name = "METRES")]
        height: Option<f64>,
        /// From the back's rim to the foot [default: 1.5 heights]
        #[arg(long, value_name = "METRES")]
        width: Option<f64>,
        /// How far the brink stands out over the foot [default: 0.3 heights]
        #[arg(long, value_name = "METRES")]
        overhang: Option<f64>,
    },
    /// A rock arch from one end of the path to the other, with daylight under it
    Arch {
        #[command(flatten)]
        site: Site,
        /// From the ground to the middle of the crown [default: half the path]
        #[arg(long, value_name = "METRES")]
        height: Option<f64>,
        /// Thickness at the feet [default: a sixth of the path]
        #[arg(long, value_name = "METRES")]
        width: Option<f64>,
    },
    /// A road cut: a bed with creased edges, and banks up to the ground
    Road {
        #[command(flatten)]
        site: Site,
        /// From edge to edge of the bed
        #[arg(long, value_name = "METRES", default_value_t = 12.0)]
        width: f64,
        /// How deep the bed lies under the ground [default: half the width]
        #[arg(long, value_name = "METRES")]
        height: Option<f64>,
        /// Width of each bank [default: 1.5 depths]
        #[arg(long, value_name = "METRES")]
        bank: Option<f64>,
    },
}

/// Where it is to stand, and where the cage goes.
#[derive(Debug, Args)]
struct Site {
    /// The path in the terrain's coordinates: places X,Y with spaces between
    #[arg(long, value_name = "\"X,Y X,Y ...\"", allow_hyphen_values = true)]
    along: String,
    /// A pyramid of the terrain: the cage follows its ground, and coordinates are its
    #[arg(long, value_name = "PYRAMID")]
    ground: Option<PathBuf>,
    /// Without a pyramid: coordinates are degrees of longitude and latitude, not metres
    #[arg(long, conflicts_with = "ground")]
    geographic: bool,
    /// The file to write [default: standard output]
    #[arg(short, long, value_name = "OUT.obj")]
    output: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    match &arguments.shape {
        Shape::Cliff {
            site,
            height,
            width,
            overhang,
        } => site.make("cliff", |path, ground| {
            let height = height.unwrap_or(path.length() / 8.0);
            let lengths = Cliff {
                height,
                overhang: overhang.unwrap_or(0.3 * height),
                width: width.unwrap_or(1.5 * height),
            };
            cliff(path, &lengths, ground)
        }),
        Shape::Arch {
            site,
            height,
            width,
        } => site.make("arch", |path, ground| {
            let lengths = Arch {
                height: height.unwrap_or(path.length() / 2.0),
                width: width.unwrap_or(path.length() / 6.0),
            };
            arch(path, &lengths, ground)
        }),
        Shape::Road {
            site,
            width,
            height,
            bank,
        } => site.make("road", |path, ground| {
            let depth = height.unwrap_or(0.5 * width);
            let lengths = Road {
                width: *width,
                depth,
                bank: bank.unwrap_or(1.5 * depth),
            };
            road(path, &lengths, ground)
        }),
    }?;
    Ok(Outcome::Done)
}

impl Site {
    /// Makes a cage and writes it.
    fn make(
        &self,
        name: &str,
        shape: impl FnOnce(&Path, GroundHeight<'_>) -> Result<Cage, CageError>,
    ) -> Result<()> {
        let places = self.places()?;
        let middle = middle(&places);
        let cage = match &self.ground {
            Some(pyramid) => on_ground(pyramid, &places, middle, shape)?,
            None => {
                let scale = if self.geographic {
                    Crs::wgs84().ellipsoid.metres_per_degree(middle[1])
                } else {
                    [1.0; 2]
                };
                let metres = |place: [f64; 2]| [place[0] * scale[0], place[1] * scale[1]];
                shape(&path(&places, metres, metres(middle))?, &flat)?
            }
        };
        let placement = Placement::on_ground(middle);
        let text = format!(
            "# {name} along {}\n{placement}{}",
            self.along,
            write_obj(&cage)
        );
        match &self.output {
            None => print(&text)?,
            Some(file) => write(file, text.as_bytes())?,
        }
        Ok(())
    }

    fn places(&self) -> Result<Vec<[f64; 2]>> {
        let places: Option<Vec<_>> = self.along.split_whitespace().map(coordinates).collect();
        match places {
            Some(places) if places.len() >= 2 => Ok(places),
            _ => bail!(
                "--along: expected two places or more, as \"X,Y X,Y\", and not {:?}",
                self.along
            ),
        }
    }
}

/// Makes a cage that follows a pyramid's ground, from the ground at its middle.
fn on_ground(
    pyramid: &std::path::Path,
    places: &[[f64; 2]],
    middle: [f64; 2],
    shape: impl FnOnce(&Path, GroundHeight<'_>) -> Result<Cage, CageError>,
) -> Result<Cage> {
    let source = PyramidSource::open(pyramid).with_context(|| pyramid.display().to_string())?;
    let surface = Surface::new(Arc::new(source));
    let origin = surface.frame().to_world(middle);
    let path = path(places, |place| surface.frame().to_world(place), origin)?;
    let height = |[x, y]: [f64; 2]| -> Result<f64> {
        let place = [x + origin[0], y + origin[1]];
        surface.ground_at(place)?.ok_or_else(|| {
            let [x, y] = surface.frame().to_crs(place);
            anyhow!("there is no ground at {x}, {y}")
        })
    };
    // A generator asks for heights and knows no errors: the first is kept, and told at the end.
    let base = height([0.0; 2])?;
    let failed = RefCell::new(None);
    let ground = |place| match height(place) {
        Ok(height) => height - base,
        Err(error) => {
            failed.borrow_mut().get_or_insert(error);
            0.0
        }
    };
    let cage = shape(&path, &ground)?;
    match failed.into_inner() {
        Some(error) => Err(error),
        None => Ok(cage),
    }
}

/// The path in metres from an origin.
fn path(
    places: &[[f64; 2]],
    metres: impl Fn([f64; 2]) -> [f64; 2],
    origin: [f64; 2],
) -> Result<Path, CageError> {
    let relative = |&place: &[f64; 2]| {
        let [x, y] = metres(place);
        [x - origin[0], y - origin[1]]
    };
    Path::new(places.iter().map(relative).collect())
}

/// The middle of the box around places.
fn middle(places: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let along = places.iter().map(|place| place[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        0.5 * (low + high)
    })
}
