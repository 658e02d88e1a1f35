//! All strips or tiles of one image, decoded when a window asks for them and kept for a while.

use std::ops::Range;

use super::super::{DemError, OpenOptions, Window, bytes::Bytes, cache::Cache, samples::Samples};
use super::chunk::Coding;
use super::table::Table;

/// The strips or tiles of an image, of which samples of one band or pixels are made.
pub(super) struct Chunks {
    pub(super) coding: Coding,
    pub(super) table: Table,
    /// Bytes of a strip or tile once it is decoded.
    part_bytes: u64,
    cache: Cache,
}

/// A row of samples that a window and a strip or tile share.
pub(super) struct Run<'a> {
    /// The decoded strip or tile; none where the file leaves it out.
    pub(super) part: Option<&'a Samples>,
    /// The first sample's index in it.
    pub(super) in_part: usize,
    /// The samples' indices in the window.
    pub(super) in_window: Range<usize>,
}

impl Chunks {
    /// Keeps `usual_bytes` of what is decoded, or what the options say.
    pub(super) fn new(
        coding: Coding,
        table: Table,
        usual_bytes: usize,
        options: &OpenOptions,
    ) -> Self {
        let part_bytes = table.chunk_bytes(&coding);
        Self::of_parts(coding, table, part_bytes, usual_bytes, options)
    }

    /// The same of strips or tiles that become so many bytes.
    pub(super) fn of_parts(
        coding: Coding,
        table: Table,
        part_bytes: u64,
        usual_bytes: usize,
        options: &OpenOptions,
    ) -> Self {
        let budget = options.kept_bytes(usual_bytes, part_bytes);
        Self {
            coding,
            table,
            part_bytes,
            cache: Cache::new(budget),
        }
    }

    /// Bytes of decoded strips or tiles that are kept at most.
    pub(super) fn memory_bytes(&self) -> u64 {
        let (budget, part) = (self.cache.budget_bytes() as u64, self.part_bytes);
        if part > budget {
            return 0;
        }
        budget.min(part * self.table.plane_len() as u64)
    }

    /// Bytes that a window takes while it is read: one strip or tile decoded, and what it is decoded from, twice.
    pub(super) fn read_bytes(&self) -> u64 {
        self.part_bytes + 2 * self.table.most_stored_bytes()
    }

    /// Visits every sample of a stored window once, in rows.
    pub(super) fn visit(
        &self,
        bytes: &Bytes,
        window: Window,
        visit: impl FnMut(Run<'_>),
    ) -> Result<(), DemError> {
        let decode = |index, place| self.table.decode(bytes, &self.coding, index, place);
        self.visit_decoded(window, decode, visit)
    }

    /// The same where `decode` makes a strip or tile, given its index and where it lies in the file.
    pub(super) fn visit_decoded(
        &self,
        window: Window,
        decode: impl Fn(usize, (u64, u64)) -> Result<Samples, DemError>,
        mut visit: impl FnMut(Run<'_>),
    ) -> Result<(), DemError> {
        if window.sample_count() == 0 {
            return Ok(());
        }
        let (rows, columns) = (self.table.chunk_rows, self.table.chunk_columns);
        for row in window.row / rows..=(window.row + window.rows - 1) / rows {
            for column in window.column / columns..=(window.column + window.columns - 1) / columns {
                self.visit_chunk([row, column], window, &decode, &mut visit)?;
            }
        }
        Ok(())
    }

    fn visit_chunk(
        &self,
        [row, column]: [u32; 2],
        window: Window,
        decode: impl Fn(usize, (u64, u64)) -> Result<Samples, DemError>,
        visit: &mut impl FnMut(Run<'_>),
    ) -> Result<(), DemError> {
        let (rows, columns) = (self.table.chunk_rows, self.table.chunk_columns);
        let index = row as usize * self.table.across() as usize + column as usize;
        let part = match self.table.place(index) {
            Some(place) => Some(self.cache.get(index, || decode(index, place))?),
            None => None,
        };
        let first = [
            row as usize * rows as usize,
            column as usize * columns as usize,
        ];
        let shared_rows = overlap(first[0], rows, window.row, window.rows);
        let shared_columns = overlap(first[1], columns, window.column, window.columns);
        for row in shared_rows {
            let in_window = (row - window.row as usize) * window.columns as usize
                + shared_columns.start
                - window.column as usize;
            visit(Run {
                part: part.as_deref(),
                in_part: (row - first[0]) * columns as usize + shared_columns.start - first[1],
                in_window: in_window..in_window + shared_columns.len(),
            });
        }
        Ok(())
    }
}

/// Rows (or columns) that a chunk and a window share.
fn overlap(first: usize, count: u32, window_first: u32, window_count: u32) -> Range<usize> {
    let window_first = window_first as usize;
    first.max(window_first)..(first + count as usize).min(window_first + window_count as usize)
}
