//! What has been done of a build, a file a task: so that a second run goes on, and others do the rest.
//!
//! ```text
//! OUT.building/journal/PASS/N       what task N of a pass found, and sums of what it wrote
//! OUT.building/journal/PASS/all     what all of them found, for whoever needs the pass and did not do it
//! ```
//!
//! A file appears when its task is done. Neither it nor what it names is flushed: after a crash of the machine either
//! may be missing or wrong, which the sums tell, and the task is done again. Knows no heights.

use std::fs;
use std::path::PathBuf;

use serde::{Serialize, de::DeserializeOwned};

use super::scratch::Written;
use crate::pyramid::files::unique;
use crate::pyramid::{PyramidError, ShardInfo};

/// What a block, a task or a pass has made.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Made<R> {
    /// What it found.
    pub(super) found: R,
    /// What it wrote to planes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) written: Vec<Written>,
    /// The shards it wrote.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) shards: Vec<ShardInfo>,
}

impl<R> Made<R> {
    /// Something found, and what was written to planes.
    pub(super) fn new(found: R, written: impl Into<Vec<Written>>) -> Self {
        Self {
            found,
            written: written.into(),
            shards: Vec::new(),
        }
    }

    /// Both.
    pub(super) fn and(mut self, other: Self, join: impl Fn(R, R) -> R) -> Self {
        self.written.extend(other.written);
        self.shards.extend(other.shards);
        Self {
            found: join(self.found, other.found),
            ..self
        }
    }
}

/// The folder of what has been done.
#[derive(Debug)]
pub(super) struct Journal {
    folder: PathBuf,
}

impl Journal {
    pub(super) const fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// What a task, or a whole pass, is said to have made; none where nothing readable is said.
    pub(super) fn read<R: DeserializeOwned>(&self, pass: &str, entry: &str) -> Option<Made<R>> {
        let bytes = fs::read(self.folder.join(pass).join(entry)).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Says what a task, or a whole pass, has made. Two that say it at once say the same.
    pub(super) fn write<R: Serialize>(
        &self,
        pass: &str,
        entry: &str,
        made: &Made<R>,
    ) -> Result<(), PyramidError> {
        let folder = self.folder.join(pass);
        let path = folder.join(entry);
        let partial = folder.join(format!("{entry}.{}", unique()));
        fs::create_dir_all(&folder).map_err(PyramidError::io("creating", &folder))?;
        let bytes = serde_json::to_vec(made)
            .map_err(|error| PyramidError::io("writing", &path)(error.into()))?;
        fs::write(&partial, bytes).map_err(PyramidError::io("writing", &partial))?;
        fs::rename(&partial, &path).map_err(PyramidError::io("renaming", &partial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_comes_back_and_nonsense_says_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::new(folder.path().join("journal"));
        assert!(journal.read::<u64>("fit-3", "7").is_none());
        journal.write("fit-3", "7", &Made::new(41_u64, [])).unwrap();
        assert_eq!(journal.read::<u64>("fit-3", "7").unwrap().found, 41);
        fs::write(folder.path().join("journal/fit-3/7"), [0; 20]).unwrap();
        assert!(journal.read::<u64>("fit-3", "7").is_none());
    }
}
