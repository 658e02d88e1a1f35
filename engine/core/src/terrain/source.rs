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
        MappedStore, Metadata, Pyramid, PyramidError, Store, StoreError, Tile,
        feature::FeatureGroup,
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
    /// Opens a folder, to be read through memory maps.
    ///
    /// # Errors
    ///
    /// Where it is no finished pyramid.
    pub fn open(path: &Path) -> Result<Self, PyramidError> {
        path.metadata().map_err(PyramidError::io("opening", path))?;
        Self::with_store(Box::new(MappedStore::new(path)))
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

    fn name(&self, key: &str) -> String {
        self.store.name(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        pyramid::{Heights, sample},
        stream::View,
        terrain::{Planner, PlannerDescriptor, Surface},
    };

    fn source(folder: &tempfile::TempDir) -> Arc<PyramidSource> {
        let path = folder.path().join("out.zarr");
        sample::write(&path, 700, 500);
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
        let mut planner = Planner::new(source(&folder), wait).unwrap();
        let view = View::looking_at([0.0, 0.0, 300.0], [500.0, 0.0, 0.0], 1.0, [640, 480]);
        let (plan, stats) = planner.plan(&view);
        assert_eq!((stats.tiles_missing, stats.failures), (0, 0));
        assert!(plan.drawn.len() > 4 && plan.uploads.len() > plan.drawn.len());
        assert!(stats.bytes_read > 0);
    }

    #[test]
    fn the_surface_is_what_the_pyramid_says() {
        let folder = tempfile::tempdir().unwrap();
        let source = source(&folder);
        let (heights, surface) = (
            Heights::new(Arc::clone(source.pyramid())),
            Surface::new(source),
        );
        for index in 0..500 {
            let place = [
                -2500.0 + 10.3 * f64::from(index),
                3400.0 - 13.7 * f64::from(index),
            ];
            let stored = heights.height_at(surface.frame().to_crs(place)).unwrap();
            let drawn = surface.height_at(place).unwrap();
            assert_eq!(stored.is_some(), drawn.is_some());
            assert!(stored.zip(drawn).is_none_or(|(a, b)| (a - b).abs() < 1e-6));
        }
    }
}
