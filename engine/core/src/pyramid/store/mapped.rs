//! A folder, read through memory maps: the one file of this crate with `unsafe` in it.
//!
//! Pages are brought in by the kernel (`MADV_POPULATE_READ`) before they are touched, so that a file that was cut short
//! before the read is an error. One cut short *during* the read is a signal: read folders that others write to with
//! [`FileStore`]. Where the system has no such call, `pread` is used.

use std::{
    fs::File,
    num::NonZero,
    ops::Range,
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;
use memmap2::Mmap;

use super::{FileStore, Store, StoreError, checked_length};

/// Files kept mapped: far under the number of mappings a process may have (65,530 on Linux).
const MAPPED_FILES: NonZero<usize> = NonZero::new(1024).unwrap();

/// A pyramid's folder, read through memory maps.
#[derive(Debug)]
pub struct MappedStore {
    files: FileStore,
    maps: Mutex<LruCache<String, Arc<Mmap>>>,
}

impl MappedStore {
    /// The files under a folder.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            files: FileStore::new(folder),
            maps: Mutex::new(LruCache::new(MAPPED_FILES)),
        }
    }

    fn map(&self, key: &str) -> std::io::Result<Arc<Mmap>> {
        let mut maps = self.maps.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(map) = maps.get(key) {
            return Ok(map.clone());
        }
        let file = File::open(self.files.path(key))?;
        // SAFETY: The map is private to this file, and its bytes leave it only as copies, so no reference into it
        // outlives a `read`. The writer of pyramids never changes a file in place: it writes a new one and renames it.
        // Should another program change the bytes all the same, a read copies some mixture of old and new bytes, which
        // its checksum refuses; should it cut the file short, `populate` fails before a page is touched.
        #[expect(
            unsafe_code,
            reason = "mapping memory has no safe form; the argument is above"
        )]
        let map = Arc::new(unsafe { Mmap::map(&file) }?);
        maps.put(key.to_owned(), map.clone());
        Ok(map)
    }
}

impl Store for MappedStore {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        if !cfg!(target_os = "linux") {
            return self.files.read(key, range);
        }
        let map = self
            .map(key)
            .map_err(|error| StoreError::io(&self.name(key), error))?;
        let length = checked_length(|| self.name(key), &range, map.len() as u64)?;
        let Ok(start) = usize::try_from(range.start) else {
            return self.files.read(key, range);
        };
        match populate(&map, start, length) {
            Ok(()) => Ok(map[start..start + length].to_vec()),
            // An old kernel, or a file that is shorter now: `pread` reads or says what is wrong.
            Err(_) => self.files.read(key, range),
        }
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        self.files.size(key)
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        self.files.bytes_under(folder)
    }

    fn name(&self, key: &str) -> String {
        self.files.name(key)
    }
}

/// Brings pages in; an error where the file does not reach them any more.
#[cfg(target_os = "linux")]
fn populate(map: &Mmap, start: usize, length: usize) -> std::io::Result<()> {
    if length == 0 {
        return Ok(());
    }
    map.advise_range(memmap2::Advice::PopulateRead, start, length)
}

#[cfg(not(target_os = "linux"))]
fn populate(_: &Mmap, _: usize, _: usize) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}
