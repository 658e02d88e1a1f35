//! What one frame needs from the GPU, as plain data.

use std::sync::Arc;

use super::frame::point;
use crate::{
    geo::TileId,
    pyramid::Tile,
    reference::shared::{DrawnTile, Frame, TILE_VISIBLE},
    stream::{Bounds, View},
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

/// Where a drawn tile is, in world metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its address.
    pub id: TileId,
    /// Its box; sample (0, 0) is at the west and north end.
    pub bounds: Bounds,
    /// The height that the drawn tile's `base` stands for.
    pub base: f64,
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
    /// Where each drawn tile is.
    pub places: Vec<Place>,
}

impl FramePlan {
    /// Points the plan at another view of the same terrain: the camera of the frame, the origins and boxes of the drawn
    /// tiles and which of them are seen. The cut stays.
    ///
    /// So a plan made for an earlier view is drawn from where the camera is now, to the last bit as if it had been made
    /// for it.
    pub fn aim(&mut self, view: &View) {
        let frustum = view.frustum();
        for (drawn, place) in self.drawn.iter_mut().zip(&self.places) {
            let Bounds { min, max } = place.bounds;
            drawn.origin = relative([min[0], max[1], place.base], view.eye);
            drawn.z_min = relative(min, view.eye)[2];
            drawn.z_max = relative(max, view.eye)[2];
            drawn.flags &= !TILE_VISIBLE;
            if frustum.sees(&place.bounds) {
                drawn.flags |= TILE_VISIBLE;
            }
        }
        if let Some(frame) = &mut self.frame {
            point(frame, view);
        }
    }

    /// Empties it, and keeps its memory.
    pub fn clear(&mut self) {
        self.uploads.clear();
        self.color_uploads.clear();
        self.drawn.clear();
        self.places.clear();
        self.frame = None;
    }
}

/// A place seen from the eye: subtracted in `f64`, then rounded once.
#[expect(
    clippy::cast_possible_truncation,
    reason = "camera-relative metres are f32 on the GPU"
)]
fn relative(place: [f64; 3], eye: [f64; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| (place[axis] - eye[axis]) as f32)
}
