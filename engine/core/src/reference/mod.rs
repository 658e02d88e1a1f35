//! The GPU stages on the CPU: one file a stage, the same names and order of steps as its WGSL twin.

pub mod balance;
pub mod decode;
pub mod depth;
pub mod draw;
pub mod emit;
pub mod refine;
pub mod shared;
