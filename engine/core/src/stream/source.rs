//! Where tiles come from.

use std::sync::Arc;

use crate::{
    geo::TileId,
    pyramid::{Metadata, PyramidError, Tile, feature::FeatureGroup},
};

/// Something that hands out tiles: a pyramid on disk, one far away, or one that a test made up.
///
/// Called from loader threads only, several at once.
pub trait TileSource: Send + Sync {
    /// What the data set says of itself.
    fn metadata(&self) -> &Metadata;

    /// Reads, checks and decodes one tile; `parent` is its parent tile, absent for the root alone.
    ///
    /// # Errors
    ///
    /// What went wrong with this tile; the next try may succeed.
    fn load(&self, id: TileId, parent: Option<&Tile>) -> Result<Tile, PyramidError>;

    /// Reads the imagery of one tile: 256 × 256 RGBA, sRGB, alpha not multiplied in; none where there is no imagery.
    ///
    /// # Errors
    ///
    /// What went wrong with this tile; the next try may succeed.
    fn load_color(&self, id: TileId) -> Result<Option<Arc<[u8]>>, PyramidError> {
        let _ = id;
        Ok(None)
    }

    /// True when some finest tiles have features.
    fn has_features(&self) -> bool {
        false
    }

    /// Reads the features that stand in the place of patches of a finest tile.
    ///
    /// # Errors
    ///
    /// What went wrong with this tile; the next try may succeed.
    fn load_features(&self, id: TileId) -> Result<Vec<FeatureGroup>, PyramidError> {
        let _ = id;
        Ok(Vec::new())
    }

    /// Bytes read so far, as stored; 0 where nobody counts.
    fn bytes_read(&self) -> u64 {
        0
    }
}
