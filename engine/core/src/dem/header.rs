//! What is known of a raster before any sample is read, and how a caller helps where the file is silent.

use std::path::Path;

use super::DemError;
use crate::geo::{Crs, Grid};

/// The most samples along one side of a raster.
pub(crate) const MAX_SIDE: u32 = 1 << 26;

/// A rectangle of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First row, from the north.
    pub row: u32,
    /// First column, from the west.
    pub column: u32,
    /// Number of rows.
    pub rows: u32,
    /// Number of columns.
    pub columns: u32,
}

impl Window {
    /// All samples of a grid.
    #[must_use]
    pub fn whole(grid: &Grid) -> Self {
        Self {
            row: 0,
            column: 0,
            rows: grid.rows,
            columns: grid.columns,
        }
    }

    /// Samples in it.
    #[must_use]
    pub fn sample_count(&self) -> u64 {
        u64::from(self.rows) * u64::from(self.columns)
    }

    /// Checks it and a buffer of `len` samples against the rows and columns of what a file holds.
    pub(crate) fn check(
        self,
        [rows, columns]: [u32; 2],
        len: usize,
        file: &str,
    ) -> Result<(), DemError> {
        let what = if self.row_end() > rows.into() || self.column_end() > columns.into() {
            format!("a raster of {rows} x {columns}")
        } else if u64::try_from(len) != Ok(self.sample_count()) {
            format!("a buffer of {len} samples")
        } else {
            return Ok(());
        };
        Err(DemError::Window {
            file: file.into(),
            window: self,
            what,
        })
    }

    /// One past its last row.
    pub(crate) fn row_end(&self) -> u64 {
        u64::from(self.row) + u64::from(self.rows)
    }

    /// One past its last column.
    pub(crate) fn column_end(&self) -> u64 {
        u64::from(self.column) + u64::from(self.columns)
    }
}

/// Where a raster came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceInfo {
    /// File name, without its folder.
    pub name: String,
    /// Size of the file in bytes.
    pub bytes: u64,
}

/// What is known of a raster before any sample is read.
#[derive(Clone, Debug, PartialEq)]
pub struct RasterHeader {
    /// Points of the samples, row 0 north and column 0 west.
    pub grid: Grid,
    /// What the grid's coordinates are.
    pub crs: Crs,
    /// True when every height is a whole number of metres.
    pub integer: bool,
    /// False when the file says nothing of where it lies and the grid starts at (0, 0).
    pub georeferenced: bool,
    /// How stored numbers become heights, in one line: of two openings of a file that say the same, all heights are
    /// equal. It holds what the caller said of scale and void.
    pub reading: String,
    /// The first source; a mosaic's is the last one given.
    pub source: SourceInfo,
}

impl RasterHeader {
    /// Checks a window and a buffer against the grid.
    pub(crate) fn check(&self, window: Window, len: usize) -> Result<(), DemError> {
        let size = [self.grid.rows, self.grid.columns];
        window.check(size, len, &self.source.name)
    }
}

/// What the caller knows and the file does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// CRS units (metres, where nothing is known) from sample to sample, for files without georeferencing; 1 if none.
    pub spacing: Option<f64>,
    /// Metres a unit of the stored numbers; takes the place of what the file says. 1 if neither says.
    pub scale: Option<f64>,
    /// The stored number that means void, for files that do not declare one.
    pub nodata: Option<f64>,
    /// The most bytes of decoded strips and tiles kept for each open file. If not given, 64 MiB, or one strip or tile
    /// where that is more; never more than that, either. Where it is less than one, none is kept, and every window
    /// decodes what it needs.
    pub cache_bytes: Option<usize>,
}

impl OpenOptions {
    /// Refuses numbers that would make no grid and no heights.
    pub(crate) fn check(&self, path: &Path) -> Result<(), DemError> {
        let senseless = |what: &str, value: f64| {
            Err(DemError::format(
                path,
                format!("cannot be read with a {what} of {value}"),
            ))
        };
        match (self.spacing, self.scale) {
            (Some(spacing), _) if !(spacing.is_finite() && spacing > 0.0) => {
                senseless("spacing", spacing)
            }
            (_, Some(scale)) if !scale.is_normal() => senseless("scale", scale),
            _ => Ok(()),
        }
    }

    /// The budget for decoded parts of so many bytes, of which `usual` bytes do.
    pub(crate) fn kept_bytes(&self, usual: usize, part_bytes: u64) -> usize {
        let most = usual.max(usize::try_from(part_bytes).unwrap_or(usize::MAX));
        self.cache_bytes.map_or(most, |bytes| bytes.min(most))
    }
}
