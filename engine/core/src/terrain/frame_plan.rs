//! What one frame needs from the GPU, as plain data.

use std::sync::Arc;

use super::frame::point;
use crate::{
    geo::TileId,
    pyramid::Tile,
    reference::{
        refine::RefineTables,
        shared::{DrawnTile, Frame, TILE_VISIBLE},
    },
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
    /// A bit for every patch that a feature stands in for, lowest first; none where there is no feature.
    pub cut: Option<Box<[u32; 32]>>,
}

/// The mesh of a feature, to be put up in place of the one it had.
#[derive(Clone, Debug)]
pub struct FeatureUpload {
    /// Which feature.
    pub feature: u32,
    /// What its vertices are made from.
    pub tables: Arc<RefineTables>,
    /// Three a triangle: vertices, or samples of its tiles on the border of its cut; see
    /// [`FEATURE_BORDER`](crate::reference::shared::FEATURE_BORDER).
    pub indices: Arc<[u32]>,
}

/// A feature to draw, in place of the cut patches of its tiles.
#[derive(Clone, Debug)]
pub struct FeatureDraw {
    /// Which feature; its mesh is up.
    pub feature: u32,
    /// World metres of its origin.
    pub place: [f64; 3],
    /// Camera-relative metres of its origin.
    pub origin: [f32; 3],
    /// Drawn tiles that it lies in, in its own order.
    pub tiles: Vec<u32>,
}

/// Imagery to be put into a layer of the colour pool.
#[derive(Clone, Debug)]
pub struct ColorUpload {
    /// Layer of the colour pool.
    pub layer: u32,
    /// 256 × 256 RGBA and all mip levels, as [`mip_chain`](crate::stream::mip_chain) makes them.
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

/// One frame: uploads first, then stages over the drawn list, then one indirect draw for the ground and one a feature.
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
    /// South-west and north-east corner of the data set in world metres; tiles reach past it, what is drawn does not.
    pub ground: [[f64; 2]; 2],
    /// Meshes of features that are new.
    pub feature_uploads: Vec<FeatureUpload>,
    /// Features whose meshes are no longer needed.
    pub feature_frees: Vec<u32>,
    /// The features to draw.
    pub features: Vec<FeatureDraw>,
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
        for feature in &mut self.features {
            feature.origin = relative(feature.place, view.eye);
        }
        if let Some(frame) = &mut self.frame {
            point(frame, view, self.ground);
        }
    }

    /// Empties it, and keeps its memory.
    pub fn clear(&mut self) {
        self.uploads.clear();
        self.color_uploads.clear();
        self.drawn.clear();
        self.places.clear();
        self.feature_uploads.clear();
        self.feature_frees.clear();
        self.features.clear();
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
