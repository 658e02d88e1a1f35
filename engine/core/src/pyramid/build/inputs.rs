//! Input files as they were when a build began: what it reads must be what it says it was built from.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::pyramid::PyramidError;

/// A file's size and time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputStamp {
    /// The file.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// When it was last written.
    pub modified: SystemTime,
}

impl InputStamp {
    /// A file as it is now.
    ///
    /// # Errors
    /// [`PyramidError::Io`] where it cannot be looked at.
    pub fn of(path: &Path) -> Result<Self, PyramidError> {
        let about = fs::metadata(path).map_err(PyramidError::io("looking at", path))?;
        Ok(Self {
            path: path.to_owned(),
            bytes: about.len(),
            modified: about
                .modified()
                .map_err(PyramidError::io("looking at", path))?,
        })
    }
}

/// Says which file is not what it was.
pub(super) fn check(inputs: &[InputStamp]) -> Result<(), PyramidError> {
    for input in inputs {
        if InputStamp::of(&input.path)? != *input {
            return Err(PyramidError::Changed(input.path.clone()));
        }
    }
    Ok(())
}
