//! What one frame needs from the GPU, as plain data.

use std::sync::Arc;

use crate::{
    pyramid::Tile,
    reference::shared::{DrawnTile, Frame},
};

/// A tile to be put into a slot of the pool and decoded there before anything is drawn.
#[derive(Clone, Debug)]
pub struct Upload {
    /// Slot of the pool.
    pub slot: u32,
    /// The tile.
    pub tile: Arc<Tile>,
    /// Metres a column (east) and a row (north, negative) of the tile's samples.
    pub step: [f32; 2],
}

/// Imagery to be put into a layer of the colour pool.
#[derive(Clone, Debug)]
pub struct ColorUpload {
    /// Layer of the colour pool.
    pub layer: u32,
    /// 256 × 256 RGBA, sRGB.
    pub texels: Arc<[u8]>,
}

/// One frame: uploads first, then stages over the drawn list, then one indirect draw.
#[derive(Clone, Debug, Default)]
pub struct FramePlan {
    /// Tiles that arrived; at most the upload budget.
    pub uploads: Vec<Upload>,
    /// Imagery that arrived.
    pub color_uploads: Vec<ColorUpload>,
    /// The view.
    pub frame: Option<Frame>,
    /// The cut over resident tiles: covers the data set, neighbours (also across corners) differ by at most one level.
    pub drawn: Vec<DrawnTile>,
}
