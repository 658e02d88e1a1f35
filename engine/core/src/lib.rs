//! The half of Drumlin that needs no GPU.
//!
//! Elevation models become a pyramid on disk; the pyramid streams into a frame plan; the stages that draw the plan on
//! a GPU have their twins here.
//!
//! ```text
//! DEM file → dem → pyramid → stream (cut, cache) → cage → fas (tables) → FramePlan ‖ GPU buffers → stages → draw
//! ```
//!
//! Left of `‖` all is plain data. Modules import downward only (`ARCHITECTURE.md` has the table, a test enforces it).

pub mod cage;
pub mod dem;
pub mod fas;
pub mod geo;
pub mod pyramid;
pub mod reference;
pub mod stream;
pub mod subdiv;
pub mod terrain;
