//! What can go wrong with a pyramid.

use std::path::PathBuf;

use crate::{dem::DemError, geo::TileId};

/// What can go wrong when a pyramid is built, opened, read or checked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PyramidError {
    /// The operating system refused.
    #[error("{path}: {action} failed: {source}", path = path.display())]
    Io {
        /// What was being done, as "reading" or "renaming".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The bytes are not what the format says.
    #[error("{path}: {what}", path = path.display())]
    Invalid {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and which limit was passed.
        what: String,
    },
    /// A tile cannot be read.
    #[error("{tile}: {what}")]
    Tile {
        /// Which tile.
        tile: TileId,
        /// What is wrong, and in which file.
        what: String,
    },
    /// An input cannot be read.
    #[error(transparent)]
    Dem(#[from] DemError),
    /// What was given cannot become a pyramid: no height at all, heights over a limit, features that do not fit.
    #[error("{0}")]
    Unfit(String),
    /// What was asked for cannot be done.
    #[error("{0}")]
    Refused(String),
    /// An input is not what it was when the build began.
    #[error("{path}: changed while it was read; a second run builds from what it is now", path = .0.display())]
    Changed(PathBuf),
    /// The caller asked to stop.
    #[error("interrupted; a second run completes the build")]
    Interrupted,
}

impl PyramidError {
    /// Wraps what the system said about a path.
    pub fn io(
        action: &'static str,
        path: impl Into<PathBuf>,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io {
            action,
            path,
            source,
        }
    }
}
