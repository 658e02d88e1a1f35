//! The experiments behind every published figure, and what they share.
//!
//! One binary an experiment; each prints a table and, with `--json FILE`, writes the same numbers. Above everything
//! else: nothing imports this crate.

#![expect(
    clippy::cast_possible_truncation,
    reason = "cages of experiments are numbered in 32 bits by the core"
)]

pub mod cap_errors;
pub mod errors;
pub mod heights;
pub mod measure;
pub mod peer;
pub mod picture;
pub mod plot;
pub mod quadtree;
pub mod scheme;
pub mod terrain_cage;
