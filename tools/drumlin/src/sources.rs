//! What a pyramid remembers of the files it was built from, and what they were like when it was asked.

use std::{
    collections::HashMap,
    fs::File,
    io,
    path::{Path, PathBuf},
    time::SystemTime,
};

use anyhow::{Context, Result};
use drumlin_core::pyramid::{PyramidError, SourceMetadata, build::InputStamp};
use serde::{Deserialize, Serialize};

/// Input files: as they are, or as a plan knows them.
#[derive(Debug, Default)]
pub(crate) struct Sources {
    planned: HashMap<PathBuf, Source>,
    stamps: HashMap<PathBuf, InputStamp>,
    /// All that were described.
    pub(crate) found: Vec<Source>,
}

/// An input file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Source {
    /// Where it is.
    path: PathBuf,
    /// When it was last written, in nanoseconds since 1970.
    modified: u64,
    /// What the pyramid says of it.
    #[serde(flatten)]
    metadata: SourceMetadata,
}

impl Sources {
    /// Files that a plan has seen; they are not read again where size and time are the same.
    pub(crate) fn planned(sources: Vec<Source>) -> Self {
        let planned = sources
            .into_iter()
            .map(|source| (source.path.clone(), source));
        Self {
            planned: planned.collect(),
            ..Self::default()
        }
    }

    /// Notes what files are like before any of them is read: what changes from now on shows.
    pub(crate) fn look(&mut self, files: &[PathBuf]) -> Result<()> {
        for file in files {
            self.stamps.insert(file.clone(), InputStamp::of(file)?);
        }
        Ok(())
    }

    /// Name, size and BLAKE3 of files that were looked at.
    pub(crate) fn describe(&mut self, files: &[PathBuf]) -> Result<Vec<SourceMetadata>> {
        files.iter().map(|file| self.describe_one(file)).collect()
    }

    fn describe_one(&mut self, file: &Path) -> Result<SourceMetadata> {
        let stamp = self.stamps.get(file);
        let modified = stamp.map(|stamp| nanos(stamp.modified));
        let planned = self.planned.get(file);
        let metadata = match (planned, stamp) {
            (Some(planned), Some(stamp))
                if planned.metadata.bytes == stamp.bytes && Some(planned.modified) == modified =>
            {
                planned.metadata.clone()
            }
            _ => hash(file)?,
        };
        if planned.is_some_and(|planned| planned.metadata != metadata) {
            return Err(PyramidError::Changed(file.to_owned()).into());
        }
        self.found.push(Source {
            path: file.to_owned(),
            modified: modified.unwrap_or(0),
            metadata: metadata.clone(),
        });
        Ok(metadata)
    }

    /// What the files were like.
    pub(crate) fn stamps(&self) -> Vec<InputStamp> {
        self.stamps.values().cloned().collect()
    }
}

/// Times before 1970 are as good as 1970, and those after 2554 as that.
fn nanos(time: SystemTime) -> u64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    })
}

/// Name, size and BLAKE3 of a file.
fn hash(file: &Path) -> Result<SourceMetadata> {
    let hash = || -> io::Result<_> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(File::open(file)?)?;
        Ok((hasher.count(), hasher.finalize()))
    };
    let (bytes, hash) = hash().with_context(|| format!("{}: reading failed", file.display()))?;
    let name = file
        .file_name()
        .unwrap_or(file.as_os_str())
        .to_string_lossy()
        .into_owned();
    Ok(SourceMetadata {
        name,
        bytes,
        blake3: hash.to_hex().to_string(),
    })
}
