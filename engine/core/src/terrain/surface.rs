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
    sync::{Arc, Mutex, OnceLock, PoisonError},
};

use lru::LruCache;

use super::{feature_mesh::CutPlace, feature_surface::FeatureSurface, features::cut_bits};
use crate::{
    geo::{Grid, QUAD_SAMPLES, TILE_CELLS, TILE_QUADS, TILE_SAMPLES, TileId, WorldFrame},
    pyramid::{PyramidError, Summary, Tile, feature::FeatureGroup, surface},
    stream::TileSource,
};

/// Tiles kept: about 75 kB each, and as much again for those whose heights were asked for.
const TILE_COUNT: NonZero<usize> = NonZero::new(128).unwrap();
/// Features kept, meshed.
const FEATURE_COUNT: NonZero<usize> = NonZero::new(16).unwrap();
/// Cells a side of a block: the least part of a tile that has its own box.
pub(super) const BLOCK_CELLS: usize = 8;
/// Blocks a side of a tile.
pub(super) const BLOCKS: usize = TILE_CELLS / BLOCK_CELLS;
/// Places so near to a sample's row or column, in cells, lie on it: coordinates are rounded on their way here.
const SNAP: f64 = 1e-6;

/// Answers for the surface, with the tiles it used last. Places are world metres; see [`Surface::frame`].
pub struct Surface {
    source: Arc<dyn TileSource>,
    frame: WorldFrame,
    tiles: Mutex<LruCache<TileId, Arc<Kept>>>,
    features: Mutex<LruCache<u32, Arc<FeatureSurface>>>,
}

/// A triangle mesh of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collider {
    /// World metres that positions are relative to.
    pub origin: [f64; 3],
    /// Metres east, north and up of the origin.
    pub positions: Vec<[f32; 3]>,
    /// Three a triangle, counter-clockwise seen from above.
    pub indices: Vec<u32>,
}

/// A tile that is kept, and its heights once they are asked for.
pub(super) struct Kept {
    pub(super) tile: Tile,
    /// Features that stand in the place of some of its patches, and a bit for every such patch.
    pub(super) features: Vec<FeatureGroup>,
    cut: Option<Box<[u32; 32]>>,
    heights: OnceLock<Heights>,
}

/// Heights of a tile, and the least and greatest of every block.
pub(super) struct Heights {
    pub(super) samples: Vec<i32>,
    pub(super) blocks: Vec<[i32; 2]>,
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
        let mut collider = collider(&kept, &self.tile_frame(id), stride);
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
    pub(super) fn tile(&self, id: TileId) -> Result<Arc<Kept>, PyramidError> {
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
        let kept = Arc::new(Kept {
            cut: cut_bits(id, &features),
            features,
            tile,
            heights: OnceLock::new(),
        });
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
        let at = |axis: usize, patch: u32| {
            frame.corner[axis] + f64::from(patch) * QUAD_SAMPLES as f64 * frame.step[axis]
        };
        let place = CutPlace {
            cut: group.cut,
            corner: [at(0, group.cut[1]), at(1, group.cut[0])],
            step: frame.step,
            unit: frame.unit,
        };
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

/// A place among the finest samples.
struct Spot {
    tile: TileId,
    /// Row and column of its cell in the tile.
    cell: [usize; 2],
    /// Where in the cell: x east, y south, 0 to 1.
    part: [f64; 2],
}

/// Where the samples of a tile are in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct TileFrame {
    /// World x and y of sample (0, 0).
    pub(super) corner: [f64; 2],
    /// Metres a column and a row.
    pub(super) step: [f64; 2],
    /// Metres a unit.
    pub(super) unit: f64,
    /// Rows and columns of cells that lie in the data set.
    pub(super) cells: [usize; 2],
}

/// A place on a triangle: its height, and the slopes there.
struct Plane {
    height: f64,
    slope: [f64; 2],
}

impl Plane {
    fn normal(&self) -> [f64; 3] {
        let [east, north] = self.slope;
        let length = (east * east + north * north + 1.0).sqrt();
        [-east / length, -north / length, 1.0 / length]
    }
}

impl Kept {
    pub(super) fn heights(&self) -> &Heights {
        self.heights.get_or_init(|| {
            let samples =
                surface::decode_heights(&self.tile.controls, &self.tile.detail, self.tile.step);
            let blocks = (0..BLOCKS * BLOCKS)
                .map(|block| range(&samples, block))
                .collect();
            Heights { samples, blocks }
        })
    }

    /// True for a cell that a feature stands in the place of.
    fn is_cut(&self, row: usize, column: usize) -> bool {
        let [row, column] = [row, column].map(|cell| cell / QUAD_SAMPLES);
        self.cut
            .as_ref()
            .is_some_and(|bits| bits[row] >> column & 1 != 0)
    }

    /// The feature that stands in the place of a place's cell.
    fn feature_at(&self, spot: &Spot) -> Option<&FeatureGroup> {
        let tile = [spot.tile.row, spot.tile.column];
        let [row, column] =
            [0, 1].map(|axis| tile[axis] as usize * TILE_QUADS + spot.cell[axis] / QUAD_SAMPLES);
        self.features.iter().find(|group| {
            let [row0, column0, row1, column1] = group.cut.map(|patch| patch as usize);
            (row0..row1).contains(&row) && (column0..column1).contains(&column)
        })
    }

    /// True when a triangle of a cell is there: no feature is in its place, and it has no void corner.
    pub(super) fn has_triangle(&self, row: usize, column: usize, lower: bool) -> bool {
        !self.is_cut(row, column)
            && corners(row, column, lower)
                .iter()
                .all(|&[row, column]| !self.tile.is_void(row, column))
    }

    /// The plane of the samples at a place. Corners without weight have no say, so that edges and samples belong to
    /// whichever triangle is there.
    fn plane(&self, spot: &Spot, frame: &TileFrame) -> Option<Plane> {
        let ([row, column], [x, y]) = (spot.cell, spot.part);
        let lower = y >= x;
        let weights = if lower {
            [1.0 - y, y - x, x]
        } else {
            [1.0 - x, y, x - y]
        };
        let mut corners = corners(row, column, lower).into_iter().zip(weights);
        if corners.any(|([row, column], weight)| weight > 0.0 && self.tile.is_void(row, column)) {
            return None;
        }
        let (height, slope) = self.units(row, column, lower, [x, y]);
        let slope = [
            slope[0] * frame.unit / frame.step[0],
            slope[1] * frame.unit / frame.step[1],
        ];
        Some(Plane {
            height: height * frame.unit,
            slope,
        })
    }

    /// Height and slopes a column and a row of a triangle's plane, in units.
    pub(super) fn units(
        &self,
        row: usize,
        column: usize,
        lower: bool,
        [x, y]: [f64; 2],
    ) -> (f64, [f64; 2]) {
        let samples = &self.heights().samples;
        let at = |down: usize, right: usize| {
            f64::from(samples[(row + down) * TILE_SAMPLES + column + right])
        };
        let (nw, se) = (at(0, 0), at(1, 1));
        let slope = if lower {
            [se - at(1, 0), at(1, 0) - nw]
        } else {
            [at(0, 1) - nw, se - at(0, 1)]
        };
        (nw + x * slope[0] + y * slope[1], slope)
    }
}

/// The corners of a triangle of a cell, as row, column: the lower one is NW, SW, SE, the upper one NW, SE, NE.
fn corners(row: usize, column: usize, lower: bool) -> [[usize; 2]; 3] {
    let third = if lower {
        [row + 1, column]
    } else {
        [row, column + 1]
    };
    let (first, diagonal) = ([row, column], [row + 1, column + 1]);
    if lower {
        [first, third, diagonal]
    } else {
        [first, diagonal, third]
    }
}

/// Least and greatest sample of a block.
fn range(samples: &[i32], block: usize) -> [i32; 2] {
    let (row, column) = (block / BLOCKS * BLOCK_CELLS, block % BLOCKS * BLOCK_CELLS);
    let rows = samples
        .chunks_exact(TILE_SAMPLES)
        .skip(row)
        .take(BLOCK_CELLS + 1);
    let within = rows.flat_map(|row| &row[column..=column + BLOCK_CELLS]);
    within.fold([i32::MAX, i32::MIN], |[low, high], &height| {
        [low.min(height), high.max(height)]
    })
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

#[expect(
    clippy::cast_possible_truncation,
    reason = "positions in a tile are f32"
)]
fn collider(kept: &Kept, frame: &TileFrame, stride: usize) -> Collider {
    let heights = kept.heights();
    let side = TILE_CELLS / stride + 1;
    let base = f64::from(kept.tile.summary.min) * frame.unit;
    let position = |at: usize| {
        let (row, column) = (at / side * stride, at % side * stride);
        let height = f64::from(heights.samples[row * TILE_SAMPLES + column]) * frame.unit - base;
        [
            (column as f64 * frame.step[0]) as f32,
            (row as f64 * frame.step[1]) as f32,
            height as f32,
        ]
    };
    let mut indices = Vec::new();
    #[expect(
        clippy::cast_possible_truncation,
        reason = "at most 129 × 129 vertices"
    )]
    let vertex = |[row, column]: [usize; 2]| (row * side + column) as u32;
    for (row, column) in
        (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| (row, column)))
    {
        let is_outside =
            (row + 1) * stride > frame.cells[0] || (column + 1) * stride > frame.cells[1];
        if is_outside || stride == 1 && kept.is_cut(row, column) {
            continue;
        }
        for triangle in [true, false].map(|lower| corners(row, column, lower)) {
            if triangle
                .iter()
                .all(|&[row, column]| !kept.tile.is_void(row * stride, column * stride))
            {
                indices.extend(triangle.map(vertex));
            }
        }
    }
    let origin = [frame.corner[0], frame.corner[1], base];
    Collider {
        origin,
        positions: (0..side * side).map(position).collect(),
        indices,
    }
}
