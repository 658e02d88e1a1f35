//! Which tiles a view needs, which of them are there, and what to read next.
//!
//! ```text
//! View → cut (wanted tiles) → schedule (requests) → loader threads → tree (resident tiles) → drawn (balanced cut)
//! ```
//!
//! Between the pyramid and the frame plan. Knows tiles by their address, their summary and their size in bytes; it is
//! handed a [`TileSource`] and has never heard of a file, a cage or a GPU.
//!
//! Based on: the update and loader threads and the three-level cache of layered terrain streaming, with the stored
//! geometric error of each tile in place of distance bands.

mod balance;
mod budget;
mod color;
mod cut;
mod loader;
mod mips;
mod motion;
mod neighbours;
mod residency;
mod schedule;
mod source;
#[cfg(test)]
pub(crate) mod synthetic;
mod tree;
mod view;

pub use balance::{Drawn, Leaf};
pub use budget::{Relaxation, TILE_BYTES};
pub use color::{ColorLife, ColorPool};
pub use cut::{CutLimit, CutRule, Wanted};
pub use loader::{Job, Loaded, Loader, Ticket};
pub use mips::{COLOR_BYTES, mip_chain};
pub use motion::Motion;
pub use neighbours::{Neighbours, Side, neighbours};
pub(crate) use residency::Residency;
pub use residency::SlotPool;
#[cfg(test)]
pub(crate) use schedule::mix;
pub(crate) use schedule::{PATIENCE, Requester};
pub use schedule::{Retry, Scheduler};
pub use source::TileSource;
pub use tree::{Life, NO_NODE, Node, Tree};
pub use view::{Bounds, Frustum, View};
