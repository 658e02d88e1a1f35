//! Where things are: tiles of a pyramid, grids of samples, coordinate systems, and the world frame.
//!
//! The bottom of the route: knows no file, no height and no screen.
//!
//! Row 0 is north and column 0 is west, everywhere. World axes are x east, y north, z up, in metres.

mod crs;
mod definition;
mod frame;
mod grid;
mod proj;
mod tile;
mod transform;

pub use crs::{Crs, CrsKind, Ellipsoid};
pub use definition::CrsError;
pub use frame::WorldFrame;
pub use grid::{Extent, Grid};
pub use tile::{
    CAGE_CONTROL_COUNT, CAGE_CONTROLS, PATCH_COUNT, QUAD_SAMPLES, TILE_CELLS, TILE_QUADS,
    TILE_SAMPLE_COUNT, TILE_SAMPLES, TileId,
};
pub use transform::{DatumShift, Transform, transform};
