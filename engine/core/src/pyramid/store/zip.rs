//! A ZIP archive of uncompressed members, read through one memory map.
//!
//! The archive's directory is read and checked when it is opened; a member is then a range of the file. Whoever wants
//! to stream members from elsewhere needs the directory alone. The `zip` crate knows directories, ZIP64 among them;
//! without its codecs it is two seconds of building.

use std::{
    collections::HashMap,
    fs::File,
    io::BufReader,
    ops::Range,
    path::{Path, PathBuf},
};

use zip::{CompressionMethod, ZipArchive};

use super::{MappedStore, Store, StoreError, checked_length};
use crate::pyramid::PyramidError;

/// The members of one archive.
#[derive(Debug)]
pub struct ZipStore {
    path: PathBuf,
    /// The archive's folder, and its name there.
    folder: MappedStore,
    name: String,
    members: HashMap<String, Range<u64>>,
}

impl ZipStore {
    /// Opens an archive.
    ///
    /// # Errors
    ///
    /// [`PyramidError::Io`] where the file cannot be read, [`PyramidError::Invalid`] where it is no ZIP, damaged, or has
    /// a member that is compressed, encrypted or not inside the file.
    pub fn open(path: &Path) -> Result<Self, PyramidError> {
        let invalid = |what: String| PyramidError::Invalid {
            path: path.into(),
            what,
        };
        let file = File::open(path).map_err(PyramidError::io("opening", path))?;
        let bytes = file
            .metadata()
            .map_err(PyramidError::io("opening", path))?
            .len();
        let damaged = |error: zip::result::ZipError| match error {
            zip::result::ZipError::Io(source) if source.raw_os_error().is_some() => {
                PyramidError::io("reading", path)(source)
            }
            error => invalid(format!(
                "neither a pyramid's folder nor a whole ZIP archive of one: {error}"
            )),
        };
        let mut archive = ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
        let mut members = HashMap::with_capacity(archive.len());
        for index in 0..archive.len() {
            let member = archive.by_index_raw(index).map_err(damaged)?;
            if member.is_dir() {
                continue;
            }
            let name = member.name().to_owned();
            if member.compression() != CompressionMethod::Stored || member.encrypted() {
                return Err(invalid(format!(
                    "its member {name:?} is compressed or encrypted; `drumlin pack` stores members as they are"
                )));
            }
            let start = member.data_start();
            let end = start.checked_add(member.size()).filter(|&end| end <= bytes);
            let Some(end) = end else {
                return Err(invalid(format!(
                    "its member {name:?} is said to have {} bytes at byte {start}; the file has {bytes}",
                    member.size()
                )));
            };
            members.insert(name, start..end);
        }
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| invalid("its name is not plain Unicode".into()))?;
        Ok(Self {
            path: path.into(),
            folder: MappedStore::new(path.parent().unwrap_or(Path::new(""))),
            name: name.into(),
            members,
        })
    }

    fn member(&self, key: &str) -> Result<&Range<u64>, StoreError> {
        self.members.get(key).ok_or_else(|| StoreError::Missing {
            name: self.name(key),
        })
    }
}

impl Store for ZipStore {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        let member = self.member(key)?;
        checked_length(|| self.name(key), &range, member.end - member.start)?;
        self.folder.read(
            &self.name,
            member.start + range.start..member.start + range.end,
        )
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        self.member(key).map(|member| member.end - member.start)
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        let inside = |key: &str| {
            folder.is_empty()
                || key
                    .strip_prefix(folder)
                    .is_some_and(|rest| rest.starts_with('/'))
        };
        let members = self.members.iter().filter(|(key, _)| inside(key));
        Ok(members.map(|(_, range)| range.end - range.start).sum())
    }

    fn name(&self, key: &str) -> String {
        format!("{}/{key}", self.path.display())
    }
}

#[cfg(test)]
mod tests;
