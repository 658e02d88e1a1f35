//! Feature-adaptive subdivision: a cage and a depth for every feature become tables, and tables become patches.
//!
//! On the route between `cage` and the frame plan. Knows topology and depths, builds tables of indices and weights, and
//! executes them on any points; knows no device, no tile and no view beyond a distance.
//!
//! * *Classic*: one depth for all features. *Adaptive*: every feature its own depth d_v, also 0.
//! * Three tables: depths; the subdivision table ([`LevelRows`]: face, edge and vertex points by level); the render
//!   table ([`RenderTable`]: regular, transition and irregular patches).
//! * An untagged closed cage with F faces, I of them irregular, and S the sum of its features' valences N_v has
//!   (F − I) + (4 I − S) + Σ N_v (3 (d_v − 1) + 1) patches when all d_v ≥ 1.
//!
//! Based on: Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark surface model* (2018);
//! M. Nießner, C. Loop, M. Meyer, T. DeRose, *Feature-adaptive GPU rendering of Catmull-Clark subdivision surfaces*
//! (2012).

#![expect(
    clippy::cast_possible_truncation,
    reason = "cages have fewer than 2^32 corners (checked by `Cage::new`), corners and sides fewer than five"
)]

mod blocks;
mod cap;
mod depth;
mod evaluate;
mod execute;
mod feature;
mod mesh;
mod patch;
mod pattern;
mod refine;
mod rows;
mod stencil;
mod tables;
#[cfg(test)]
pub(crate) mod testing;
mod watch;

pub use crate::subdiv::Real;
pub use blocks::{Blocks, CapEntry, Changes, Entry, Piece, Positions};
pub use cap::{Cap, CapRing};
pub use depth::{DepthRule, Feature, Features, MAX_RULE_DEPTH};
pub use evaluate::Sample;
pub use feature::{FeatureKind, features};
pub use patch::{Patch, Place, RenderTable};
pub use pattern::PatchPattern;
pub use rows::{BlendRow, LevelRows, PointCounts};
pub use stencil::{PieceIndex, StencilTerm};
pub use tables::{MAX_DEPTH, Tables};
pub use watch::DepthWatch;
