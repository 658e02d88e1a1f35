//! The GPU stages on the CPU: one file a stage, the same names and order of steps as its WGSL twin.

pub mod shared;
