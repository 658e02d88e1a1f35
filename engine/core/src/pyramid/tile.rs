//! One tile in memory, as read and checked.

use crate::geo::TileId;

/// What a tile says of itself, and its parent of it.
///
/// All a cut needs to know about a tile that is not loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Least height in units, of all finest samples in the tile and of its own.
    pub min: i32,
    /// Greatest height in units, likewise.
    pub max: i32,
    /// Geometric error δ in metres: the largest vertical distance between the tile's triangles at stride 1 and the
    /// finest samples, and no less than any child's.
    pub error: f32,
    /// See the constants.
    pub flags: u32,
}

impl Summary {
    /// The pyramid has this tile (children past the data's border are absent).
    pub const PRESENT: u32 = 1;
    /// Some samples are void.
    pub const VOID: u32 = 2;
    /// Every sample is void.
    pub const ALL_VOID: u32 = 4;
    /// A feature is laid into some of its patches.
    pub const FEATURE: u32 = 8;

    /// True when the pyramid has this tile.
    #[must_use]
    pub const fn is_present(&self) -> bool {
        self.flags & Self::PRESENT != 0
    }
}

/// One tile: its record, with the cage decoded.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Where it is.
    pub id: TileId,
    /// What it says of itself.
    pub summary: Summary,
    /// What it says of its children, by quadrant.
    pub children: [Summary; 4],
    /// Height units a code step at this level: q.
    pub step: i32,
    /// 35 × 35 controls in units, row by row from the north-west; lattice point (0, 0) is at (1, 1).
    pub controls: Box<[i32]>,
    /// 129 × 129 residual codes, row by row.
    pub detail: Box<[i32]>,
    /// 32 × 32 patch error codes: the low nibble for depth 0 (stride 4), the high one for depth 1 (stride 2). Nibble n
    /// says error ≤ max(δ, u) · 2^(n/2); 15 says never.
    pub patch_codes: Box<[u8]>,
    /// 129 × 129 void bits, row by row, lowest bit first; none where the level has no voids.
    pub voids: Option<Box<[u8]>>,
}

impl Tile {
    /// True when the sample of a row and column is void.
    #[must_use]
    pub fn is_void(&self, row: usize, column: usize) -> bool {
        let bit = row * crate::geo::TILE_SAMPLES + column;
        self.voids
            .as_ref()
            .is_some_and(|bits| bits[bit / 8] >> (bit % 8) & 1 == 1)
    }

    /// Bytes in memory, for budgets.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        size_of::<Self>()
            + 4 * (self.controls.len() + self.detail.len())
            + self.patch_codes.len()
            + self.voids.as_ref().map_or(0, |bits| bits.len())
    }
}
