//! Where a pyramid's bytes come from: ranges of named files, behind one trait.
//!
//! Keys are paths from the pyramid's root, with slashes. A store knows no tile and checks no content: whoever reads
//! checks what comes back.

mod faults;
mod file;
mod mapped;
mod read;
mod zip;

use std::{fmt::Debug, io, ops::Range, path::Path, sync::Arc};

use super::PyramidError;

pub use faults::{FaultStore, Faults};
pub use file::FileStore;
pub use mapped::MappedStore;
pub(super) use read::StoreReader;
pub use zip::ZipStore;

/// Why a store has no bytes to give.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// There is no such file.
    #[error("{name}: is missing")]
    Missing {
        /// The file.
        name: String,
    },
    /// The file ends before the range does.
    #[error("{name}: is cut short: bytes up to {end} were asked for and there are {bytes}")]
    Short {
        /// The file.
        name: String,
        /// End of the range.
        end: u64,
        /// Size of the file.
        bytes: u64,
    },
    /// The system refused.
    #[error("{name}: reading failed: {source}")]
    Io {
        /// The file.
        name: String,
        /// What the system said.
        source: io::Error,
    },
}

impl StoreError {
    /// Wraps what the system said of a file.
    fn io(name: &str, source: io::Error) -> Self {
        let name = name.to_owned();
        match source.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => Self::Missing { name },
            _ => Self::Io { name, source },
        }
    }

    /// For whoever speaks of streams.
    fn into_io(self) -> io::Error {
        match self {
            Self::Io { source, .. } => source,
            other => io::Error::new(io::ErrorKind::UnexpectedEof, other),
        }
    }
}

/// The store of a pyramid on the disk: a folder, or a ZIP archive of uncompressed members.
///
/// # Errors
///
/// [`PyramidError::Io`] where there is nothing, [`PyramidError::Invalid`] where a file is no such archive.
pub fn open_store(path: &Path) -> Result<Box<dyn Store>, PyramidError> {
    let about = path.metadata().map_err(PyramidError::io("opening", path))?;
    if about.is_dir() {
        Ok(Box::new(MappedStore::new(path)))
    } else {
        Ok(Box::new(ZipStore::open(path)?))
    }
}

/// Named files of which ranges are read.
///
/// Only loader threads call it: a read may wait for a disk.
pub trait Store: Send + Sync + Debug {
    /// The bytes of a range, all of them.
    ///
    /// # Errors
    ///
    /// Where there is no such file, it is shorter, or it cannot be read.
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError>;

    /// The size of a file.
    ///
    /// # Errors
    ///
    /// Where there is no such file or the system refuses.
    fn size(&self, key: &str) -> Result<u64, StoreError>;

    /// Bytes of all files in a folder and below it, of all there are where it is empty; 0 where there is no such folder.
    ///
    /// # Errors
    ///
    /// Where the system refuses, or the store has no list of its files.
    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError>;

    /// What to call a file in a message: a path or an address.
    fn name(&self, key: &str) -> String;
}

/// One store for several readers.
impl<S: Store + ?Sized> Store for Arc<S> {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        (**self).read(key, range)
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        (**self).size(key)
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        (**self).bytes_under(folder)
    }

    fn name(&self, key: &str) -> String {
        (**self).name(key)
    }
}

/// Length of a range that a file of `bytes` is known to hold.
fn checked_length(
    name: impl FnOnce() -> String,
    range: &Range<u64>,
    bytes: u64,
) -> Result<usize, StoreError> {
    let short = || StoreError::Short {
        name: name(),
        end: range.end,
        bytes,
    };
    if range.start > range.end || range.end > bytes {
        return Err(short());
    }
    usize::try_from(range.end - range.start).map_err(|_| short())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn stores(folder: &Path) -> [Box<dyn Store>; 2] {
        [
            Box::new(FileStore::new(folder)),
            Box::new(MappedStore::new(folder)),
        ]
    }

    #[test]
    fn ranges_are_read_and_bad_ones_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("a")).unwrap();
        let bytes: Vec<u8> = (0..20_000_u32).flat_map(u32::to_le_bytes).collect();
        fs::write(folder.path().join("a/b"), &bytes).unwrap();
        for store in stores(folder.path()) {
            assert_eq!(store.size("a/b").unwrap(), 80_000);
            for range in [0..80_000, 5..5, 4095..4097, 79_999..80_000] {
                let (start, end) = (
                    usize::try_from(range.start).unwrap(),
                    usize::try_from(range.end).unwrap(),
                );
                assert_eq!(store.read("a/b", range).unwrap(), bytes[start..end]);
            }
            assert!(matches!(
                store.read("a/b", 0..80_001),
                Err(StoreError::Short { .. })
            ));
            assert!(matches!(
                store.read("a/b", 9..u64::MAX),
                Err(StoreError::Short { .. })
            ));
            #[expect(clippy::reversed_empty_ranges, reason = "a broken index may say so")]
            let backwards = 9..8;
            assert!(matches!(
                store.read("a/b", backwards),
                Err(StoreError::Short { .. })
            ));
            assert!(matches!(
                store.read("a/c", 0..1),
                Err(StoreError::Missing { .. })
            ));
            assert!(matches!(
                store.size("a/b/c"),
                Err(StoreError::Missing { .. })
            ));
            assert!(store.read("a", 0..1).is_err());
        }
    }

    #[test]
    fn a_file_cut_short_after_its_first_read_is_an_error_and_not_a_signal() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for store in stores(folder.path()) {
            fs::write(&path, vec![7; 100_000]).unwrap();
            assert_eq!(store.read("a", 0..10).unwrap(), [7; 10]);
            fs::File::options()
                .write(true)
                .open(&path)
                .unwrap()
                .set_len(10_000)
                .unwrap();
            assert!(store.read("a", 50_000..50_010).is_err());
            assert!(store.read("a", 99_990..100_000).is_err());
        }
    }

    #[test]
    fn an_empty_file_has_no_bytes() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), []).unwrap();
        for store in stores(folder.path()) {
            assert_eq!(store.size("a").unwrap(), 0);
            assert!(store.read("a", 0..1).is_err());
        }
    }
}
