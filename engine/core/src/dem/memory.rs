//! A raster whose samples are all in memory: for formats that can only be read whole.

use std::path::Path;

use super::bytes::Bytes;
use super::placement::{Flip, Placement};
use super::samples::{Samples, Scaling};
use super::{DemError, OpenOptions, Raster, RasterHeader, Window};
use crate::geo::Crs;

/// The most bytes that the samples of one file may take in memory.
const MAX_BYTES: u64 = 1 << 31;

/// A raster in memory.
pub(super) struct Memory {
    header: RasterHeader,
    samples: Samples,
    scaling: Scaling,
    flip: Flip,
}

/// What a format's reader knows of a raster, to be completed by [`Memory::raster`].
pub(super) struct Parts {
    pub(super) columns: u32,
    pub(super) rows: u32,
    /// None where the file does not say where it lies.
    pub(super) placement: Option<Placement>,
    pub(super) crs: Crs,
    /// True when the stored numbers are whole.
    pub(super) whole: bool,
    pub(super) scaling: Scaling,
}

impl Parts {
    /// The header, and how stored windows are turned.
    pub(super) fn header(
        self,
        bytes: &Bytes,
        options: &OpenOptions,
    ) -> Result<(RasterHeader, Flip), DemError> {
        let placement = self.placement.unwrap_or(Placement::unknown(options));
        let (grid, flip) = placement.grid(bytes.path(), self.columns, self.rows)?;
        let header = RasterHeader {
            grid,
            crs: self.crs,
            integer: self.whole && self.scaling.is_whole(),
            georeferenced: self.placement.is_some(),
            reading: self.scaling.label(),
            source: bytes.source(),
        };
        Ok((header, flip))
    }
}

impl Memory {
    /// A raster of samples in stored order.
    pub(super) fn raster(
        bytes: &Bytes,
        options: &OpenOptions,
        parts: Parts,
        samples: Samples,
    ) -> Result<Box<dyn Raster>, DemError> {
        let scaling = parts.scaling;
        let (header, flip) = parts.header(bytes, options)?;
        Ok(Box::new(Self {
            header,
            samples,
            scaling,
            flip,
        }))
    }
}

impl Raster for Memory {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let grid = &self.header.grid;
        let stored = self.flip.stored(window, [grid.rows, grid.columns]);
        for (row, out) in
            (stored.row as usize..).zip(out.chunks_exact_mut(stored.columns.max(1) as usize))
        {
            let first = row * grid.columns as usize + stored.column as usize;
            self.samples.heights(first, &self.scaling, out);
        }
        self.flip.turn(window, out);
        Ok(())
    }

    fn memory_bytes(&self) -> u64 {
        self.samples.byte_len() as u64
    }
}

/// Refuses rasters that would take too much memory, before any is taken.
pub(super) fn check_size(
    path: &Path,
    columns: u64,
    rows: u64,
    sample_bytes: u64,
) -> Result<(), DemError> {
    let total = columns
        .checked_mul(rows)
        .and_then(|count| count.checked_mul(sample_bytes));
    if total.is_none_or(|total| total > MAX_BYTES) {
        let what =
            format!("a raster of {columns} x {rows} samples of {sample_bytes} bytes, read whole,");
        return Err(DemError::limit(path, what, format!("{MAX_BYTES} bytes")));
    }
    Ok(())
}
