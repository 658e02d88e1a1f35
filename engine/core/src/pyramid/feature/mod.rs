//! Features: authored cages laid into the ground of the finest level.

use crate::{cage::Cage, geo::TileId};

/// One feature, as the records of the tiles it touches tell of it.
#[derive(Clone, Debug)]
pub struct FeatureGroup {
    /// Its number.
    pub id: u32,
    /// The tile whose record holds the cage: the first of its tiles.
    pub home: TileId,
    /// The tiles the cut has patches of, row by row.
    pub tiles: Vec<TileId>,
    /// The cut: first row, first column, row past the last, column past the last, in patches of the finest level.
    pub cut: [u32; 4],
    /// The laid cage, in the home tile's record only. x and y in finest samples east and *south* of the cut's
    /// north-west lattice point, z in height units. Faces are counter-clockwise seen from above; holes are no ground.
    pub cage: Option<Cage>,
}
