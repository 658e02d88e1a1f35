//! Rasters that lie in a file as rows of plain numbers: read in place, one row of a window at a time.

use super::bytes::Bytes;
use super::memory::Parts;
use super::placement::Flip;
use super::samples::{SampleType, Samples, Scaling};
use super::{DemError, OpenOptions, Raster, RasterHeader, Window};

/// Where the rows lie and what their numbers are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    /// First byte of the first row.
    pub(super) offset: u64,
    /// Bytes from row to row.
    pub(super) stride: u64,
    pub(super) kind: SampleType,
    pub(super) big_endian: bool,
}

/// A raster of plain rows.
pub(super) struct Plain {
    header: RasterHeader,
    bytes: Bytes,
    rows: Rows,
    scaling: Scaling,
    flip: Flip,
}

impl Plain {
    /// Checks that all rows lie in the file.
    pub(super) fn raster(
        bytes: Bytes,
        options: &OpenOptions,
        parts: Parts,
        rows: Rows,
    ) -> Result<Box<dyn Raster>, DemError> {
        let scaling = parts.scaling;
        let (header, flip) = parts.header(&bytes, options)?;
        let grid = &header.grid;
        let row_bytes = u64::from(grid.columns) * u64::from(rows.kind.bytes());
        let end = rows.stride.checked_mul(u64::from(grid.rows - 1));
        let end = end.and_then(|start| start.checked_add(rows.offset)?.checked_add(row_bytes));
        if end.is_none_or(|end| end > bytes.len()) {
            let what = format!(
                "truncated: {} x {} samples of {} bytes do not fit in {} bytes",
                grid.columns,
                grid.rows,
                rows.kind.bytes(),
                bytes.len()
            );
            return Err(DemError::format(bytes.path(), what));
        }
        Ok(Box::new(Self {
            header,
            bytes,
            rows,
            scaling,
            flip,
        }))
    }
}

impl Raster for Plain {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let size = [self.header.grid.rows, self.header.grid.columns];
        let stored = self.flip.stored(window, size);
        let Rows {
            offset,
            stride,
            kind,
            big_endian,
        } = self.rows;
        let size = u64::from(kind.bytes());
        for (row, out) in
            (u64::from(stored.row)..).zip(out.chunks_exact_mut(stored.columns.max(1) as usize))
        {
            let at = offset + row * stride + u64::from(stored.column) * size;
            let data = self.bytes.read(at, u64::from(stored.columns) * size, || {
                format!("row {row}")
            })?;
            Samples::from_bytes(&data, kind, big_endian).heights(0, &self.scaling, out);
        }
        self.flip.turn(window, out);
        Ok(())
    }

    fn memory_bytes(&self) -> u64 {
        0
    }

    fn read_bytes(&self, samples: u64) -> u64 {
        // A row of the window, as stored and as numbers.
        2 * samples.min(self.header.grid.columns.into()) * u64::from(self.rows.kind.bytes())
    }
}
