//! A file that many threads read at once, every read checked against its length before memory is taken for it.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::{DemError, SourceInfo, error::file_name};

/// An open file and its length.
#[derive(Debug)]
pub(super) struct Bytes {
    file: File,
    path: PathBuf,
    len: u64,
}

impl Bytes {
    /// Opens a file of at least one byte.
    pub(super) fn open(path: &Path) -> Result<Self, DemError> {
        // Looked at before it is opened: opening a pipe would wait for a writer.
        let info = fs::metadata(path).map_err(|error| DemError::io(path, error))?;
        if !info.is_file() {
            return Err(DemError::format(path, "is not a regular file"));
        }
        if info.len() == 0 {
            return Err(DemError::format(path, "the file is empty"));
        }
        let file = File::open(path).map_err(|error| DemError::io(path, error))?;
        Ok(Self {
            file,
            path: path.to_owned(),
            len: info.len(),
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn len(&self) -> u64 {
        self.len
    }

    /// What headers say of the file.
    pub(super) fn source(&self) -> SourceInfo {
        SourceInfo {
            name: file_name(&self.path),
            bytes: self.len,
        }
    }

    /// Up to `count` bytes from the start.
    pub(super) fn head(&self, count: u64) -> Result<Vec<u8>, DemError> {
        self.read(0, count.min(self.len), || "the start".into())
    }

    /// All bytes of a file of at most `limit`.
    pub(super) fn whole(&self, limit: u64) -> Result<Vec<u8>, DemError> {
        if self.len > limit {
            let what = format!("a file of {} bytes that must be read whole", self.len);
            return Err(DemError::limit(&self.path, what, format!("{limit} bytes")));
        }
        self.head(limit)
    }

    /// `count` bytes at `offset`; `what` names them in errors.
    pub(super) fn read(
        &self,
        offset: u64,
        count: u64,
        what: impl Fn() -> String,
    ) -> Result<Vec<u8>, DemError> {
        let end = offset.checked_add(count).filter(|&end| end <= self.len);
        let (Some(_), Ok(count)) = (end, usize::try_from(count)) else {
            let what = format!(
                "{} takes {count} bytes at byte {offset}, past the end of the file at byte {}",
                what(),
                self.len
            );
            return Err(DemError::format(&self.path, what));
        };
        let mut bytes = vec![0; count];
        read_exact_at(&self.file, &mut bytes, offset)
            .map_err(|error| DemError::io(&self.path, error))?;
        Ok(bytes)
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        let count = std::os::windows::fs::FileExt::seek_read(file, bytes, offset)?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes = &mut bytes[count..];
        offset += count as u64;
    }
    Ok(())
}
