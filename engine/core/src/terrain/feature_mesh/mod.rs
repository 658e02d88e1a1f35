//! The mesh of a feature: an authored cage, laid into the ground of the finest level, becomes triangles.
//!
//! ```text
//! laid cage ─refine once─▶ quads ─depths of a view─▶ tables ─templates─▶ FeatureTable ─▶ device: stage `refine`
//!                                                                                 └─▶ CPU: FeatureMesh
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
mod table;
#[cfg(test)]
mod tests;

pub use shape::{CutPlace, FeatureShape};
pub use table::FeatureTable;

/// A feature as triangles, executed on the CPU.
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
    /// [`NONE`](crate::reference::shared::NONE) elsewhere.
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
}
