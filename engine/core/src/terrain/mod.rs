//! Wires the rest: a view and a pyramid become a frame plan.
//!
//! ```text
//! View → Updater (a thread of its own, or none) → Planner → FramePlan ‖ GPU
//! height_at, normal_at, raycast → Surface: the same integers on the CPU
//! ```

mod descriptor;
pub mod feature_mesh;
mod feature_surface;
mod features;
mod frame;
mod frame_plan;
mod list;
mod mesher;
mod planner;
mod pool;
mod raycast;
mod source;
mod stats;
mod surface;
mod tile_surface;
mod update;

pub use descriptor::PlannerDescriptor;
pub use frame_plan::{ColorUpload, FeatureDraw, FeatureUpload, FramePlan, Place, Upload};
pub use planner::Planner;
pub use pool::PoolSizes;
pub use raycast::Hit;
pub use source::PyramidSource;
pub use stats::FrameStats;
pub use surface::Surface;
pub use tile_surface::Collider;
pub use update::{Planned, Updater};
