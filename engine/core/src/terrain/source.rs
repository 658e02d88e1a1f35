//! A pyramid as a source of tiles, with its reads counted.

use std::{
    ops::Range,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use crate::{
    geo::TileId,
    pyramid::{
        Metadata, Pyramid, PyramidError, Store, StoreError, Tile, feature::FeatureGroup, open_store,
    },
    stream::TileSource,
};

/// A pyramid that tiles are streamed from.
#[derive(Debug)]
pub struct PyramidSource {
    pyramid: Arc<Pyramid>,
    bytes_read: Arc<AtomicU64>,
}

impl PyramidSource {
    /// Opens a folder or a ZIP archive, to be read through memory maps.
    ///
    /// # Errors
    ///
    /// Where it is no finished pyramid.
    pub fn open(path: &Path) -> Result<Self, PyramidError> {
        Self::with_store(open_store(path)?)
    }

    /// Opens whatever a store holds.
    ///
    /// # Errors
    ///
    /// As [`PyramidSource::open`].
    pub fn with_store(store: Box<dyn Store>) -> Result<Self, PyramidError> {
        let bytes_read = Arc::default();
        let store = CountingStore {
            store,
            bytes_read: Arc::clone(&bytes_read),
        };
        Ok(Self {
            pyramid: Arc::new(Pyramid::with_store(Box::new(store))?),
            bytes_read,
        })
    }

    /// The pyramid.
    #[must_use]
    pub fn pyramid(&self) -> &Arc<Pyramid> {
        &self.pyramid
    }
}

impl TileSource for PyramidSource {
    fn metadata(&self) -> &Metadata {
        self.pyramid.metadata()
    }

    fn load(&self, id: TileId, parent: Option<&Tile>) -> Result<Tile, PyramidError> {
        self.pyramid
            .read_tile(id, parent.map(|parent| &*parent.controls))
    }

    fn load_color(&self, id: TileId) -> Result<Option<Arc<[u8]>>, PyramidError> {
        Ok(self.pyramid.read_color(id)?.map(Into::into))
    }

    fn has_features(&self) -> bool {
        self.metadata().features.is_some()
    }

    fn load_features(&self, id: TileId) -> Result<Vec<FeatureGroup>, PyramidError> {
        self.pyramid.read_features(id)
    }

    fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }
}

/// A store that counts what is read from it.
#[derive(Debug)]
struct CountingStore {
    store: Box<dyn Store>,
    bytes_read: Arc<AtomicU64>,
}

impl Store for CountingStore {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        let bytes = self.store.read(key, range)?;
        self.bytes_read
            .fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(bytes)
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        self.store.size(key)
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        self.store.bytes_under(folder)
    }

    fn name(&self, key: &str) -> String {
        self.store.name(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        pyramid::sample,
        stream::View,
        terrain::{Planner, PlannerDescriptor, Surface},
    };

    fn source(folder: &tempfile::TempDir, rows: u32, columns: u32) -> Arc<PyramidSource> {
        let path = folder.path().join("out.zarr");
        sample::write(&path, rows, columns);
        Arc::new(PyramidSource::open(&path).unwrap())
    }

    #[test]
    fn a_pyramid_on_disk_flies() {
        let folder = tempfile::tempdir().unwrap();
        let wait = PlannerDescriptor {
            wait_for_tiles: true,
            error_px: 0.1,
            ..PlannerDescriptor::default()
        };
        let mut planner = Planner::new(source(&folder, 700, 500), wait).unwrap();
        let view = View::looking_at([0.0, 0.0, 300.0], [500.0, 0.0, 0.0], 1.0, [640, 480]);
        let (plan, stats) = planner.plan(&view);
        assert_eq!((stats.tiles_missing, stats.failures), (0, 0));
        assert!(plan.drawn.len() > 4 && plan.uploads.len() > plan.drawn.len());
        assert!(stats.bytes_read > 0);
    }

    /// The height in units at a row and column of finest samples.
    fn at(surface: &Surface, row: f64, column: f64) -> Option<f64> {
        let grid = surface.grid();
        let place = surface.frame().to_world(grid.position(row, column));
        let height = surface.height_at(place).unwrap();
        height.map(|metres| metres / surface.unit())
    }

    #[test]
    fn samples_have_their_stored_heights_and_voids_have_none() {
        let folder = tempfile::tempdir().unwrap();
        let surface = Surface::new(source(&folder, 300, 200));
        // The finest level's codes are of three units.
        let half_step = 1.0;
        for row in (0..300).step_by(23).chain([127, 128, 129, 299]) {
            for column in (0..200).step_by(17).chain([127, 128, 129, 199]) {
                let want =
                    (!sample::is_void(row, column)).then(|| f64::from(sample::height(row, column)));
                let got = at(&surface, row as f64, column as f64);
                assert_eq!(got.is_some(), want.is_some(), "{row} {column}");
                // Coordinates were rounded on their way: to a millionth of a cell, whose slopes are below 100 units.
                let near = half_step + 1e-4;
                assert!(
                    got.zip(want)
                        .is_none_or(|(got, want)| (got - want).abs() <= near),
                    "{row} {column}"
                );
            }
        }
    }

    #[test]
    fn one_sample_and_one_row_have_heights() {
        let folder = tempfile::tempdir().unwrap();
        let one = Surface::new(source(&folder, 1, 1));
        assert!(at(&one, 0.0, 0.0).is_some() && at(&one, 0.5, 0.0).is_none());
        let folder = tempfile::tempdir().unwrap();
        let row = Surface::new(source(&folder, 1, 140));
        assert!(at(&row, 0.0, 139.0).is_some() && at(&row, 0.0, 130.5).is_some());
    }

    #[test]
    fn a_triangle_with_a_void_corner_is_void_and_its_neighbour_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let surface = Surface::new(source(&folder, 300, 200));
        // The hole's westernmost sample of row 120 is column 31; north-west of it all is there.
        assert!(sample::is_void(120, 31) && !sample::is_void(120, 30) && !sample::is_void(119, 30));
        assert_eq!(at(&surface, 119.9, 30.5), None);
        assert!(at(&surface, 120.0, 30.0).is_some());
    }
}
