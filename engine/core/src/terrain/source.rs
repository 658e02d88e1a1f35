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
    pyramid::{MappedStore, Metadata, Pyramid, PyramidError, Store, StoreError, Tile},
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
