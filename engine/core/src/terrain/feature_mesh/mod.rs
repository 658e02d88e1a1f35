//! The mesh of a feature: an authored cage, laid into the ground of the finest level, becomes triangles.
//!
//! ```text
//! laid cage ─refine once─▶ quads ─depths of a view─▶ tables ─execute─▶ patches ─templates─▶ FeatureMesh
//!
//!   cut border   vertices are the terrain's own samples, at stride 1
//!   ring 1       limit surface, and the border's residual fading to nothing over one patch
//!   inside       limit surface
//! ```
//!
//! Between the pyramid's feature records and the frame plan. Knows cages, tables and one cut of the ground; knows no file,
//! no budget and no GPU. A vertex has one key (a vertex, a place on an edge, a place in a face of the cage) and is
//! evaluated once, so neighbouring patches of any levels share it and no gap can open.
//!
//! Based on: M. Nießner, C. Loop, M. Meyer, T. DeRose, *Feature-adaptive GPU rendering of Catmull-Clark subdivision
//! surfaces* (2012), section 4.

mod border;
mod build;
mod shape;
pub mod synthetic;
#[cfg(test)]
mod tests;

pub use shape::{CutPlace, FeatureShape};

use crate::reference::shared::{FEATURE_BORDER, FeatureVertex, NONE};

/// A feature as triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureMesh {
    /// World metres that positions are relative to: the cut's north-west lattice point, at a height near the ground's.
    pub origin: [f64; 3],
    /// Metres east, north and up of the origin.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, outward; where the surface is infinitely sharp, vertices of either side have their own.
    pub normals: Vec<[f32; 3]>,
    /// Three a triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
    /// For every vertex: the group's tile (its place in the group's list) `<< 15 |` the sample it is, on the cut's border;
    /// [`NONE`] elsewhere.
    pub border: Vec<u32>,
    /// For every vertex: the group's tile under it.
    pub tiles: Vec<u32>,
}

impl FeatureMesh {
    /// Bytes in memory, for budgets.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        (self.positions.len() * (12 + 12 + 4 + 4) + self.indices.len() * 4) as u64
    }

    /// Bytes on the GPU.
    #[must_use]
    pub fn gpu_byte_count(&self) -> u64 {
        (self.positions.len() * size_of::<FeatureVertex>() + self.indices.len() * 4) as u64
    }

    /// The vertices as the GPU gets them.
    #[must_use]
    pub fn vertices(&self) -> Vec<FeatureVertex> {
        let parts = self.positions.iter().zip(&self.normals).zip(&self.tiles);
        parts
            .map(|((&position, &normal), &tile)| FeatureVertex {
                position,
                tile,
                normal,
                reserved: 0,
            })
            .collect()
    }

    /// The indices as the GPU gets them: border vertices are samples of tiles.
    #[must_use]
    pub fn draw_indices(&self) -> Vec<u32> {
        let draw_index = |&index: &u32| match self.border[index as usize] {
            NONE => index,
            sample => FEATURE_BORDER | sample,
        };
        self.indices.iter().map(draw_index).collect()
    }
}
