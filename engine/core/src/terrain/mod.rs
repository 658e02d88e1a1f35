//! Wires the rest: a view and a pyramid become a frame plan.

mod frame_plan;

pub use frame_plan::{ColorUpload, FramePlan, Upload};
