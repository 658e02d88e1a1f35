//! What a plan cost and what it lacks.

use serde::{Deserialize, Serialize};

/// One plan in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameStats {
    /// Tiles of the drawn cut.
    pub tiles_drawn: usize,
    /// Those of them that the view sees.
    pub tiles_visible: usize,
    /// Tiles of the wanted cut and their ancestors.
    pub tiles_wanted: usize,
    /// Wanted tiles that are not in the pool.
    pub tiles_missing: usize,
    /// Share of the screen where a coarser tile is drawn than wanted, 0 to 1, by the tiles' rectangles.
    pub missing_share: f64,
    /// Pictures wanted and not in their layer.
    pub colors_missing: usize,
    /// The screen-space error aimed at, pixels: the caller's, or more while over budget.
    pub tolerance_px: f64,
    /// Bytes read from the store for all plans so far.
    pub bytes_read: u64,
    /// Bytes this plan uploads: tiles and pictures within the upload budget, and the tables of one feature, however large
    /// (of all new ones where the plan waits).
    pub uploaded_bytes: u64,
    /// Bytes of tiles and pictures in RAM, with what is set aside for those under way.
    pub ram_bytes: u64,
    /// Bytes of pool slots and colour layers in use.
    pub vram_bytes: u64,
    /// Slots in use.
    pub slots_used: u32,
    /// Colour layers in use.
    pub color_layers_used: u32,
    /// Requests under way.
    pub in_flight: usize,
    /// Reads that failed so far.
    pub failures: u64,
    /// Wanted tiles and pictures that failed eight times: plans that wait go on without them. They are tried again, ever
    /// more rarely.
    pub given_up: usize,
    /// Features drawn in place of the ground they were laid into.
    pub features_drawn: usize,
    /// Features whose tiles are all drawn at the finest level, and whose ground is drawn because their mesh cannot be made
    /// or does not fit the budgets.
    pub features_refused: usize,
    /// Bytes of features' meshes in GPU memory, with the tables they were made from there, and of both in RAM.
    pub feature_bytes: [u64; 2],
    /// Time the plan took, milliseconds.
    pub update_millis: f64,
}
