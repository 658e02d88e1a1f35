//! Large-terrain streaming for wgpu.
