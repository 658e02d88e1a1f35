//! What can go wrong when terrain meets a device.

use drumlin_core::pyramid::PyramidError;

/// What can go wrong when a terrain is made or drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// There is nothing to draw on.
    #[error(
        "no graphics adapter found: {0}\nhint: the software driver does; on Debian and Ubuntu: apt install mesa-vulkan-drivers"
    )]
    NoAdapter(String),
    /// The adapter is there but refuses to give a device.
    #[error("the adapter {adapter} gave no device: {what}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        what: String,
    },
    /// The device allows less than the terrain needs.
    #[error("the device's limit {limit} is {found}; a terrain needs {needed}")]
    LimitTooSmall {
        /// The limit's name in WebGPU.
        limit: &'static str,
        /// What a terrain needs.
        needed: u64,
        /// What the device allows.
        found: u64,
    },
    /// The budget holds less than the least a terrain can be drawn with.
    #[error(
        "a VRAM budget of {budget_bytes} bytes is too small; {needed_bytes} bytes is the least"
    )]
    BudgetTooSmall {
        /// What the caller allows.
        budget_bytes: u64,
        /// The least that works.
        needed_bytes: u64,
    },
    /// The device has no room.
    #[error("the device is out of memory: {0}")]
    OutOfMemory(String),
    /// The device rejected what it was asked: our bug, or a lost device.
    #[error("the device refused: {0}")]
    Device(String),
    /// The pyramid cannot be opened or read.
    #[error(transparent)]
    Pyramid(#[from] PyramidError),
}
