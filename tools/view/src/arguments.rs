//! The command line of `drumlin-view`.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use drumlin_terminal::{outcome::EXIT_CODES, size};
use serde::Serialize;

/// Shows terrain pyramids: a window, or a measured flight without one.
#[derive(Debug, Parser)]
#[command(name = "drumlin-view", version, after_help = EXIT_CODES, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Flies over a pyramid along a path and measures every frame; writes pictures, depths, cameras and a report
    #[command(after_help = EXIT_CODES)]
    Fly(Box<FlyArguments>),
    /// Opens a window on a pyramid
    #[command(after_help = VIEW_KEYS)]
    View(ViewArguments),
    /// Says which graphics adapter would draw
    #[command(after_help = EXIT_CODES)]
    Adapter,
}

const VIEW_KEYS: &str = "W A S D fly, Q E down and up, Shift faster; drag with the mouse to look around, wheel for speed.
P plays the path, F2 saves a screenshot, F3 wireframe, F4 colours by depth, Escape leaves.

Exit codes: 0 done, 1 invalid data or a failing device, 2 wrong usage or no display, 3 input or output failed";

/// What both verbs say of the terrain.
#[derive(Clone, Debug, Args, Serialize)]
pub(crate) struct TerrainArguments {
    /// The pyramid
    #[arg(value_name = "PYRAMID")]
    pub(crate) pyramid: PathBuf,
    /// A path: JSON with keys of time, position, look_at and fov_y; made from the terrain if not given
    #[arg(long, value_name = "FILE")]
    pub(crate) path: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(crate) size: Size,
    /// Greatest error on the screen in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1.0, value_parser = parse_error_px)]
    pub(crate) error_px: f64,
    /// Draws whole tiles at stride 1, to compare with
    #[arg(long)]
    pub(crate) uniform_depth: bool,
    /// Draws the edges of the triangles
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Colours patches by their depth
    #[arg(long)]
    pub(crate) depth_colors: bool,
    /// Memory for tiles, as 256MiB or 2GB
    #[arg(long, value_name = "BYTES", default_value = "512MiB", value_parser = size::parse)]
    pub(crate) ram_budget: u64,
    /// Graphics memory for tiles and everything else the terrain needs there
    #[arg(long, value_name = "BYTES", default_value = "512MiB", value_parser = size::parse)]
    pub(crate) vram_budget: u64,
}

#[derive(Clone, Debug, Args, Serialize)]
pub(crate) struct FlyArguments {
    #[command(flatten)]
    pub(crate) terrain: TerrainArguments,
    /// Frames a second
    #[arg(long, value_name = "RATE", default_value_t = 30.0, value_parser = parse_fps)]
    pub(crate) fps: f64,
    /// How time passes
    #[arg(long, value_enum, default_value_t = Mode::Stepped)]
    pub(crate) mode: Mode,
    /// Draws each frame only when no tile is missing; ends with code 1 where one cannot be read
    #[arg(long)]
    pub(crate) wait_for_tiles: bool,
    /// Folder for one PNG a frame
    #[arg(long, value_name = "DIR")]
    pub(crate) frames: Option<PathBuf>,
    /// Folder for one EXR a frame: channel Z, metres along the view axis, infinite where nothing is
    #[arg(long, value_name = "DIR")]
    pub(crate) depth_frames: Option<PathBuf>,
    /// JSON file for the cameras of all frames
    #[arg(long, value_name = "FILE")]
    pub(crate) cameras: Option<PathBuf>,
    /// JSON file for the report
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// PNG file with up to sixteen frames
    #[arg(long, value_name = "FILE")]
    pub(crate) contact_sheet: Option<PathBuf>,
    /// JSON file for the path flown
    #[arg(long, value_name = "FILE")]
    pub(crate) save_path: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ViewArguments {
    #[command(flatten)]
    pub(crate) terrain: TerrainArguments,
    /// Plays the path from the start
    #[arg(long)]
    pub(crate) play: bool,
    /// Leaves after so many frames
    #[arg(long, value_name = "FRAMES")]
    pub(crate) exit_after: Option<u64>,
    /// Saves the last frame before leaving
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,
}

/// How time passes in a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Mode {
    /// Every frame is 1 / fps later than the one before, however long it took
    Stepped,
    /// Frames are due by the clock; late ones are left out
    Paced,
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Size(pub(crate) [u32; 2]);

/// Sides every WebGPU device can draw.
const MOST_PIXELS: u32 = 8192;

fn parse_size(text: &str) -> Result<Size, String> {
    let side = |text: &str| {
        text.parse()
            .ok()
            .filter(|side| (1..=MOST_PIXELS).contains(side))
    };
    let size = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some([side(width)?, side(height)?]));
    size.map(Size)
        .ok_or_else(|| format!("`{text}` is not WxH with sides from 1 to {MOST_PIXELS} pixels"))
}

fn parse_error_px(text: &str) -> Result<f64, String> {
    number_in(text, 0.05, 1000.0)
}

fn parse_fps(text: &str) -> Result<f64, String> {
    number_in(text, 0.01, 10_000.0)
}

fn number_in(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("`{text}` is not a number from {least} to {most}"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_and_budgets_are_read() {
        assert_eq!(parse_size("640x360"), Ok(Size([640, 360])));
        assert!(
            ["640", "0x1", "9000x1", "-1x2", "axb"]
                .iter()
                .all(|text| parse_size(text).is_err())
        );
        assert!(
            ["", "x", "0", "3 miles", "-2"]
                .iter()
                .all(|text| size::parse(text).is_err())
        );
        assert!(parse_error_px("nan").is_err() && parse_fps("0").is_err());
    }
}
