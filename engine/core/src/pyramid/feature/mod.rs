//! Features: authored cages (cliffs, arches, roads) laid into the ground of the finest level.
//!
//! ```text
//! cage + placement ─lay─▶ LaidFeature: a cut of whole patches, and the cage that fills it ─record─▶ feature/<L>
//!
//!   ghost ring   outside the cut; holes, there for their controls        plan of a cut, from outside to inside
//!   rings 1, 2   lattice quads with the stored controls
//!   lattice      more of them, where the authored rim is far
//!   zipper       triangles and quads between the lattice and the rim
//!   authored     what was drawn, with its tags; its rim put on the ground
//! ```
//!
//! What lies under a cut is stored as if there were none: it is drawn until the feature is ready, and from afar.
//! Knows cages and a ground that answers for controls and heights; knows no file and no screen.

mod lay;
mod plan;
mod record;
mod region;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod zipper;

pub use lay::lay;
pub(in crate::pyramid) use record::{decode, encode};

use serde::{Deserialize, Serialize};

use super::PyramidError;
use crate::cage::{Cage, Placement};
use crate::geo::{Crs, Grid, TILE_QUADS, TileId};

/// Faces an authored cage may have.
pub const FEATURE_FACE_LIMIT: u32 = 1_000_000;
/// Patches a cut may have.
pub const CUT_PATCH_LIMIT: u64 = 65_536;

/// What the metadata say of features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FeatureMetadata {
    /// The level they are laid into: the finest.
    pub level: u8,
    /// Bytes of every record: the longest's.
    pub record_bytes: u32,
    /// How many features there are; they are numbered from 0.
    pub groups: u32,
}

/// A cage to lay into the ground.
#[derive(Clone, Debug)]
pub struct FeatureInput {
    /// What to call it in messages: its file's name.
    pub name: String,
    /// The cage: metres east, north and up of its position, before scale and rotation.
    pub cage: Cage,
    /// Where it stands.
    pub placement: Placement,
}

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

/// A feature laid into the ground.
#[derive(Clone, Debug)]
pub struct LaidFeature {
    /// As [`FeatureGroup::cut`].
    pub cut: [u32; 4],
    /// As [`FeatureGroup::cage`].
    pub cage: Cage,
    /// The greatest vertical distance of a vertex inside the cut from the finest samples under or over it, metres.
    pub error: f64,
    /// Least and greatest z of vertices inside the cut, in units.
    pub range: [f64; 2],
}

/// What a feature is laid into.
pub trait Ground {
    /// The control of a lattice point of the finest level, in units; points from −1 to one past the last patch's.
    fn control(&self, row: i64, column: i64) -> i32;

    /// The stored height of a finest sample, in units.
    fn sample(&self, row: u32, column: u32) -> i32;

    /// True for a finest sample that is void.
    fn is_void(&self, row: u32, column: u32) -> bool;
}

/// Where features are laid.
#[derive(Clone, Copy)]
pub struct Site<'a> {
    /// The finest samples.
    pub grid: &'a Grid,
    /// Their coordinates.
    pub crs: &'a Crs,
    /// One height unit in metres.
    pub unit: f64,
    /// Controls and heights.
    pub ground: &'a dyn Ground,
}

impl Site<'_> {
    /// The height of the ground in units at a row and column of finest samples, those outside taken to the border:
    /// linear on the triangles that are drawn, each cell cut from north-west to south-east.
    #[must_use]
    pub fn height(&self, row: f64, column: f64) -> f64 {
        let ([north, south], down) = cell(row, self.grid.rows);
        let ([west, east], right) = cell(column, self.grid.columns);
        let sample = |row, column| f64::from(self.ground.sample(row, column));
        let [nw, se] = [sample(north, west), sample(south, east)];
        if down >= right {
            let sw = sample(south, west);
            nw + (sw - nw) * down + (se - sw) * right
        } else {
            let ne = sample(north, east);
            nw + (ne - nw) * right + (se - ne) * down
        }
    }

    /// True where a void sample has a part in the height at a row and column of finest samples.
    #[must_use]
    pub fn is_void(&self, row: f64, column: f64) -> bool {
        let (rows, down) = cell(row, self.grid.rows);
        let (columns, right) = cell(column, self.grid.columns);
        let (south, east) = (usize::from(down > 0.0), usize::from(right > 0.0));
        rows[..=south].iter().any(|&row| {
            let mut columns = columns[..=east].iter();
            columns.any(|&column| self.ground.is_void(row, column))
        })
    }
}

/// The samples on both sides of a place, and how far it is from the first.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the samples there are"
)]
fn cell(at: f64, count: u32) -> ([u32; 2], f64) {
    let last = count.saturating_sub(1);
    let at = at.clamp(0.0, f64::from(last));
    let first = at.floor() as u32;
    ([first, (first + 1).min(last)], at - f64::from(first))
}

/// Lays all features, and refuses cuts that meet.
///
/// # Errors
/// As [`lay`]; [`PyramidError::Unfit`] where two cuts have a patch or a border in common.
pub(in crate::pyramid) fn lay_all(
    inputs: &[FeatureInput],
    site: &Site<'_>,
) -> Result<Vec<LaidFeature>, PyramidError> {
    let mut laid: Vec<LaidFeature> = Vec::with_capacity(inputs.len());
    for input in inputs {
        let feature = lay(input, site)?;
        if let Some(other) = laid.iter().position(|other| meet(other.cut, feature.cut)) {
            return Err(PyramidError::Unfit(format!(
                "features {} and {} are laid on one spot: with the ground around them they take patches {} and {}, \
                 which overlap or touch",
                inputs[other].name,
                input.name,
                shown(laid[other].cut),
                shown(feature.cut)
            )));
        }
        laid.push(feature);
    }
    Ok(laid)
}

/// True for cuts that have a patch, a side or a corner in common.
pub(super) fn meet(a: [u32; 4], b: [u32; 4]) -> bool {
    (0..2).all(|axis| a[axis] <= b[axis + 2] && b[axis] <= a[axis + 2])
}

/// A cut in words.
pub(super) fn shown([row0, column0, row1, column1]: [u32; 4]) -> String {
    format!(
        "[rows {row0} to {}, columns {column0} to {}]",
        row1 - 1,
        column1 - 1
    )
}

/// The tiles a cut has patches of, row by row.
pub(in crate::pyramid) fn tiles_of(
    level: u8,
    [row0, column0, row1, column1]: [u32; 4],
) -> Vec<TileId> {
    #[expect(clippy::cast_possible_truncation, reason = "32")]
    let quads = TILE_QUADS as u32;
    let span = |first: u32, end: u32| first / quads..end.saturating_sub(1) / quads + 1;
    span(row0, row1)
        .flat_map(|row| span(column0, column1).map(move |column| TileId::new(level, row, column)))
        .collect()
}
