//! The pyramid on disk: what a tile is, how it is stored, built, read and checked.
//!
//! `FORMAT.md` beside this crate draws every byte. Knows files and numbers; knows no camera and no screen.

pub mod build;
mod error;
mod files;
mod metadata;
mod patch_code;
mod record;
#[cfg(test)]
pub(crate) mod sample;
mod shard;
pub mod surface;
pub mod templates;
mod tile;
mod writer;
mod zarr;

pub use error::PyramidError;
pub use metadata::{ColorMetadata, Level, Metadata, SourceMetadata, VerticalReference};
pub use patch_code::{HALF_OCTAVES, NEVER, patch_error, patch_nibble};
pub use record::{Record, RecordLayout, RecordParts, VOID_BYTES, number_bytes};
pub use shard::{SHARD_TILES, shard_count, shard_shape};
pub use tile::{Summary, Tile};
pub use writer::{PyramidWriter, ShardInfo};

/// Texels a side of a colour tile.
pub const COLOR_TEXELS: usize = 256;
