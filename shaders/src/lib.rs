//! The WGSL of the stages.
