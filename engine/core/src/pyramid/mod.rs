//! The pyramid on disk: what a tile is, how it is stored, built, read and checked.
//!
//! `FORMAT.md` beside this crate draws every byte. Knows files and numbers; knows no camera and no screen.

mod error;
mod metadata;
mod record;
pub mod surface;
mod tile;

pub use error::PyramidError;
pub use metadata::{ColorMetadata, Level, Metadata, SourceMetadata, VerticalReference};
pub use record::{Record, RecordLayout, RecordParts, VOID_BYTES, number_bytes};
pub use tile::{Summary, Tile};
