//! What can be wrong with an elevation model or an image.

use std::io;
use std::path::Path;

use super::Window;

/// Why a file could not be read. Every message names the file, the place in it and, where there is one, the limit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DemError {
    /// The file could not be opened or read.
    #[error("{file}: {source}")]
    Io {
        /// File name.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// The file is damaged, or not what it claims to be.
    #[error("{file}: {what}")]
    Format {
        /// File name.
        file: String,
        /// What is wrong, and where: tag, line, strip.
        what: String,
    },
    /// The file is sound, but of a kind that is not read.
    #[error("{file}: not supported: {what}")]
    Unsupported {
        /// File name.
        file: String,
        /// What it holds that is not read.
        what: String,
    },
    /// The file asks for more than is allowed.
    #[error("{file}: {what} is over the limit of {limit}")]
    Limit {
        /// File name.
        file: String,
        /// What is too much, with its number.
        what: String,
        /// The limit, with its unit.
        limit: String,
    },
    /// Rasters or images that do not belong together.
    #[error("{first} and {second} do not fit: {what}")]
    Mismatch {
        /// File name of the one.
        first: String,
        /// File name of the other.
        second: String,
        /// In what they differ.
        what: String,
    },
    /// A window outside the grid, or a buffer of another size.
    #[error(
        "{file}: window of {rows} x {columns} samples at row {row}, column {column} does not fit {what}",
        rows = .window.rows, columns = .window.columns, row = .window.row, column = .window.column
    )]
    Window {
        /// File name.
        file: String,
        /// The window asked for.
        window: Window,
        /// What it does not fit.
        what: String,
    },
}

impl DemError {
    pub(crate) fn io(path: &Path, source: io::Error) -> Self {
        Self::Io {
            file: file_name(path),
            source,
        }
    }

    pub(crate) fn format(path: &Path, what: impl Into<String>) -> Self {
        Self::Format {
            file: file_name(path),
            what: what.into(),
        }
    }

    pub(crate) fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Self::Unsupported {
            file: file_name(path),
            what: what.into(),
        }
    }

    pub(crate) fn limit(path: &Path, what: impl Into<String>, limit: impl Into<String>) -> Self {
        Self::Limit {
            file: file_name(path),
            what: what.into(),
            limit: limit.into(),
        }
    }
}

/// The last part of a path, for messages.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}
