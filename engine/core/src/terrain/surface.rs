//! The surface on the CPU: heights, normals and meshes for physics, from the same integers that are drawn.
//!
//! The finest samples; each cell is cut from its north-west to its south-east sample. A triangle with a void corner is
//! not there, and nothing is there outside the data set. Where a feature stands its mesh is the surface, and of places
//! above each other the highest is the height.
//!
//! Answers read tiles on the caller's thread: a place never asked for before costs a read a level (some hundred
//! microseconds each from a local disk), one asked for before a look into a small cache (under a microsecond). Reading
//! is shared with nothing: streaming does not wait for it.

use std::{
    num::NonZero,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

use super::{
    feature_mesh::CutPlace,
    feature_surface::FeatureSurface,
    tile_surface::{Collider, Plane, Spot, TileFrame, TileSurface},
};
use crate::{
    geo::{Grid, TILE_CELLS, TileId, WorldFrame},
    pyramid::{PyramidError, Summary, feature::FeatureGroup},
    stream::TileSource,
};

/// Tiles kept: about 75 kB each, and as much again for those whose heights were asked for.
const TILE_COUNT: NonZero<usize> = NonZero::new(128).unwrap();
/// Features kept, meshed.
const FEATURE_COUNT: NonZero<usize> = NonZero::new(16).unwrap();
/// Places so near to a sample's row or column, in cells, lie on it: coordinates are rounded on their way here.
const SNAP: f64 = 1e-6;

/// Answers for the surface, with the tiles it used last. Places are world metres; see [`Surface::frame`].
pub struct Surface {
    source: Arc<dyn TileSource>,
    frame: WorldFrame,
    tiles: Mutex<LruCache<TileId, Arc<TileSurface>>>,
    features: Mutex<LruCache<u32, Arc<FeatureSurface>>>,
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Surface")
            .field("frame", &self.frame)
            .finish_non_exhaustive()
    }
}

impl Surface {
    /// The surface of a source's data set.
    #[must_use]
    pub fn new(source: Arc<dyn TileSource>) -> Self {
        let frame = source.metadata().frame();
        Self {
            source,
            frame,
            tiles: Mutex::new(LruCache::new(TILE_COUNT)),
            features: Mutex::new(LruCache::new(FEATURE_COUNT)),
        }
    }

    /// The world its places are in.
    #[must_use]
    pub fn frame(&self) -> &WorldFrame {
        &self.frame
    }

    /// The height at world x and y, metres; none where the surface is void and outside the data set. Where an overhang
    /// has several, the highest.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn height_at(&self, place: [f64; 2]) -> Result<Option<f64>, PyramidError> {
        Ok(self.plane_at(place)?.map(|plane| plane.height))
    }

    /// The height at world x and y of the samples alone, metres, as if no feature stood in them: what features are laid
    /// into.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn ground_at(&self, place: [f64; 2]) -> Result<Option<f64>, PyramidError> {
        let Some(spot) = self.spot(place) else {
            return Ok(None);
        };
        let plane = self
            .tile(spot.tile)?
            .plane(&spot, &self.tile_frame(spot.tile));
        Ok(plane.map(|plane| plane.height))
    }

    /// The upward unit normal of the triangle at world x and y; none where there is no height.
    ///
    /// # Errors
    ///
    /// When a tile cannot be read.
    pub fn normal_at(&self, place: [f64; 2]) -> Result<Option<[f64; 3]>, PyramidError> {
        Ok(self.plane_at(place)?.map(|plane| plane.normal()))
    }

    /// The mesh of a tile, of every `stride`th sample (a power of two up to 128), where the data set has data. At stride 1
    /// features stand in it; otherwise it is the ground they were laid into.
    ///
    /// # Errors
    ///
    /// When there is no such tile or stride, or a tile cannot be read.
    pub fn collider(&self, id: TileId, stride: usize) -> Result<Collider, PyramidError> {
        if !stride.is_power_of_two() || stride > TILE_CELLS {
            return Err(PyramidError::Refused(format!(
                "a stride of {stride}; powers of two up to {TILE_CELLS} are meant"
            )));
        }
        if !self.grid().has(id) {
            return Err(PyramidError::Tile {
                tile: id,
                what: "the pyramid has no such tile".into(),
            });
        }
        let kept = self.tile(id)?;
        let mut collider = kept.collider(&self.tile_frame(id), stride);
        for group in kept.features.iter().filter(|_| stride == 1) {
            let place = group.tiles.iter().position(|&tile| tile == id);
            let place = place.and_then(|place| u32::try_from(place).ok());
            if let Some(place) = place {
                self.feature(group)?.add_to(&mut collider, place);
            }
        }
        Ok(collider)
    }

    pub(super) fn grid(&self) -> &Grid {
        &self.source.metadata().grid
    }

    pub(super) fn finest(&self) -> u8 {
        self.source.metadata().finest()
    }

    pub(super) fn unit(&self) -> f64 {
        self.source.metadata().unit()
    }

    /// Where a tile's samples are.
    pub(super) fn tile_frame(&self, id: TileId) -> TileFrame {
        let grid = self.grid();
        let level = grid.at_level(id.level);
        let [row, column] = [id.row, id.column].map(|at| at as usize * TILE_CELLS);
        let corner = self
            .frame
            .to_world(level.position(row as f64, column as f64));
        let left = |samples: u32, first: usize| {
            (samples as usize - 1).saturating_sub(first).min(TILE_CELLS)
        };
        TileFrame {
            corner,
            step: self.frame.step(&level),
            unit: self.unit(),
            cells: [left(level.rows, row), left(level.columns, column)],
        }
    }

    /// A tile, read with its ancestors where they are not there.
    pub(super) fn tile(&self, id: TileId) -> Result<Arc<TileSurface>, PyramidError> {
        let tiles = || self.tiles.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = tiles().get(&id) {
            return Ok(Arc::clone(kept));
        }
        let parent = id.parent().map(|parent| self.tile(parent)).transpose()?;
        let tile = self
            .source
            .load(id, parent.as_ref().map(|parent| &parent.tile))?;
        let has_features = id.level == self.finest() && tile.summary.flags & Summary::FEATURE != 0;
        let features = if has_features {
            self.source.load_features(id)?
        } else {
            Vec::new()
        };
        let kept = Arc::new(TileSurface::new(id, tile, features));
        tiles().put(id, Arc::clone(&kept));
        Ok(kept)
    }

    /// A feature's mesh.
    pub(super) fn feature(
        &self,
        group: &FeatureGroup,
    ) -> Result<Arc<FeatureSurface>, PyramidError> {
        let features = || self.features.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(feature) = features().get(&group.id) {
            return Ok(Arc::clone(feature));
        }
        let home = self.tile(group.home)?;
        let cage = home
            .features
            .iter()
            .find(|other| other.id == group.id)
            .and_then(|other| other.cage.as_ref());
        let cage = cage.ok_or_else(|| PyramidError::Tile {
            tile: group.home,
            what: format!("feature {} has no cage here", group.id),
        })?;
        let tiles = group.tiles.iter().map(|&id| self.tile(id));
        let tiles = tiles.collect::<Result<Vec<_>, _>>()?;
        let frame = self.tile_frame(TileId::new(self.finest(), 0, 0));
        let place = CutPlace::new(group.cut, frame.corner, frame.step, frame.unit);
        let feature = FeatureSurface::new(cage, place, tiles.iter().map(|kept| &kept.tile))?;
        let feature = Arc::new(feature);
        features().put(group.id, Arc::clone(&feature));
        Ok(feature)
    }

    #[cfg(test)]
    pub(super) fn kept(&self) -> usize {
        self.tiles
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .len()
    }

    fn plane_at(&self, place: [f64; 2]) -> Result<Option<Plane>, PyramidError> {
        let Some(spot) = self.spot(place) else {
            return Ok(None);
        };
        let kept = self.tile(spot.tile)?;
        if let Some(group) = kept.feature_at(&spot) {
            let hit = self.feature(group)?.height_at(place);
            return Ok(hit.map(|(height, [east, north, up])| Plane {
                height,
                slope: [-east / up, -north / up],
            }));
        }
        Ok(kept.plane(&spot, &self.tile_frame(spot.tile)))
    }

    /// Where world x and y are among the finest samples; none outside the data set.
    fn spot(&self, place: [f64; 2]) -> Option<Spot> {
        let grid = self.grid();
        let [row, column] = grid.row_column(self.frame.to_crs(place));
        let (tile_row, row, y) = locate(row, grid.rows)?;
        let (tile_column, column, x) = locate(column, grid.columns)?;
        Some(Spot {
            tile: TileId::new(self.finest(), tile_row, tile_column),
            cell: [row, column],
            part: [x, y],
        })
    }
}

/// A row or column with a fraction, as tile, cell in the tile and part of the cell; none outside the samples.
fn locate(at: f64, samples: u32) -> Option<(u32, usize, f64)> {
    let last = f64::from(samples - 1);
    if !(-SNAP..=last + SNAP).contains(&at) {
        return None;
    }
    let at = if (at - at.round()).abs() <= SNAP {
        at.round()
    } else {
        at
    };
    // The last sample is the end of the last cell.
    let cell = at.floor().min(last - 1.0).max(0.0);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "at least 0 and under `samples`"
    )]
    let index = cell as u32;
    let (tile, cell_in_tile) = (index as usize / TILE_CELLS, index as usize % TILE_CELLS);
    Some((u32::try_from(tile).ok()?, cell_in_tile, at - cell))
}
