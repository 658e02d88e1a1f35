//! The pyramid on disk: what a tile is, how it is stored, built, read and checked.
//!
//! `FORMAT.md` beside this crate draws every byte. Knows files and numbers; knows no camera and no screen.

pub mod build;
mod diff;
mod error;
mod export;
pub mod feature;
mod files;
mod heights;
mod jpeg;
pub(crate) mod light;
mod manifest;
mod metadata;
mod pack;
mod patch_code;
mod reader;
mod record;
#[cfg(test)]
pub(crate) mod sample;
mod shard;
mod store;
pub mod surface;
pub mod templates;
mod tile;
mod validate;
mod writer;
mod zarr;
#[cfg(test)]
mod zarr_python;

pub use diff::{LevelDifference, diff};
pub use error::PyramidError;
pub use export::export_geotiff;
pub use feature::{FeatureGroup, FeatureMetadata};
pub use files::{write_whole, write_whole_with};
pub use heights::LevelHeights;
pub use metadata::{
    BuildMetadata, ColorCodec, ColorMetadata, Level, Metadata, SourceMetadata, VerticalReference,
};
pub use pack::{pack, unpack};
pub use patch_code::{HALF_OCTAVES, NEVER, patch_error, patch_nibble};
pub use reader::Pyramid;
pub use record::{Record, RecordLayout, RecordParts, VOID_BYTES, number_bytes};
pub use shard::{SHARD_TILES, shard_count, shard_shape};
pub use store::{
    FaultStore, Faults, FileStore, MappedStore, Store, StoreError, ZipStore, open_store,
};
pub use tile::{Summary, Tile};
pub use validate::{Finding, Report, validate};
pub use writer::{Contents, PyramidWriter, ShardInfo};

/// Texels a side of a colour tile.
pub const COLOR_TEXELS: usize = 256;
