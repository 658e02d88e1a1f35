//! A folder, read with positioned reads: a file that is cut short at any moment is an error.

use std::{
    fs::{self, File},
    io::ErrorKind,
    num::NonZero,
    ops::Range,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

use super::{Store, StoreError, checked_length};
use crate::pyramid::files::read_exact_at;

/// Files kept open: well under what systems allow a process.
const OPEN_FILES: NonZero<usize> = NonZero::new(64).unwrap();

/// A pyramid's folder, read with `pread`.
#[derive(Debug)]
pub struct FileStore {
    folder: PathBuf,
    open: Mutex<LruCache<String, Arc<File>>>,
}

impl FileStore {
    /// The files under a folder.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            open: Mutex::new(LruCache::new(OPEN_FILES)),
        }
    }

    /// The path of a key.
    #[must_use]
    pub fn path(&self, key: &str) -> PathBuf {
        self.folder.join(key)
    }

    fn file(&self, key: &str) -> std::io::Result<Arc<File>> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(file) = open.get(key) {
            return Ok(file.clone());
        }
        let file = Arc::new(File::open(self.path(key))?);
        open.put(key.to_owned(), file.clone());
        Ok(file)
    }
}

impl Store for FileStore {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        let wrap = |error| StoreError::io(&self.name(key), error);
        let file = self.file(key).map_err(wrap)?;
        let bytes = file.metadata().map_err(wrap)?.len();
        let mut buffer = vec![0; checked_length(|| self.name(key), &range, bytes)?];
        read_exact_at(&file, &mut buffer, range.start).map_err(wrap)?;
        Ok(buffer)
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        let metadata = Path::metadata(&self.path(key));
        Ok(metadata
            .map_err(|error| StoreError::io(&self.name(key), error))?
            .len())
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        folder_bytes(&self.path(folder)).map_err(|error| StoreError::io(&self.name(folder), error))
    }

    fn name(&self, key: &str) -> String {
        self.path(key).display().to_string()
    }
}

/// Bytes of all files in a folder; none where there is no folder.
fn folder_bytes(folder: &Path) -> std::io::Result<u64> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(0),
        entries => entries?,
    };
    let mut sum = 0;
    for entry in entries {
        let entry = entry?;
        let metadata = entry.metadata()?;
        sum += if metadata.is_dir() {
            folder_bytes(&entry.path())?
        } else {
            metadata.len()
        };
    }
    Ok(sum)
}
