//! What the stage `refine` is told of a feature's tables: where their parts start, and the tasks that execute them. The
//! words are drawn in the twin, `shaders/shared/refine.wgsl`; [`RefineTables`](crate::reference::refine::RefineTables)
//! packs them.

use bytemuck::{Pod, Zeroable};

/// Task: means of four points.
pub const REFINE_MEANS: u32 = 0;
/// Task: vertex points, from rings of any length.
pub const REFINE_RINGS: u32 = 1;
/// Task: points by explicit weights.
pub const REFINE_WEIGHTED: u32 = 2;
/// Words of a row of a weighted task.
pub const REFINE_WEIGHTED_WORDS: u32 = 3;
/// Words of a vertex: source, u, v, offset, `position_of`.
pub const REFINE_VERTEX_WORDS: u32 = 5;
/// In a vertex's source: the rest is where its stencil starts. Otherwise its patch.
pub const REFINE_STENCIL: u32 = 1 << 31;

/// Bytes a binding of a task is apart from the next, by WebGPU's default limits.
pub const REFINE_TASK_STRIDE: usize = 256;
/// Where parts of the tables start, and the ground under the feature.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RefineHeader {
    /// Metres a sample of the feature's cut: east, north (negative).
    pub step: [f32; 2],
    /// Samples of the cut: columns, rows.
    pub size: [f32; 2],
    /// Column and row of the cut's corner in its first tile.
    pub first: [u32; 2],
    /// Tiles under the cut: columns, rows.
    pub tiles: [u32; 2],
    /// Where patches start.
    pub patches_word: u32,
    /// Where vertices start.
    pub vertices_word: u32,
    /// Vertices.
    pub vertex_count: u32,
    /// 0.
    pub reserved: u32,
}

/// Rows of one kind, independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct RefineTask {
    /// [`REFINE_MEANS`], [`REFINE_RINGS`] or [`REFINE_WEIGHTED`].
    pub kind: u32,
    /// Rows.
    pub count: u32,
    /// Where they start.
    pub rows_word: u32,
    /// The first row's point; each row of [`REFINE_WEIGHTED`] names its own.
    pub first_point: u32,
}
