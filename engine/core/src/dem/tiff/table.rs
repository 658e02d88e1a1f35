//! Where in a TIFF its strips or tiles lie, and which samples each holds.

use super::super::{DemError, bytes::Bytes, samples::Samples};
use super::chunk::Coding;
use super::ifd::{Ifd, tag};

/// The most bytes one strip or tile may decode to.
pub(super) const MAX_CHUNK_BYTES: u64 = 1 << 28;
/// Bytes of the tables of strips or tiles: 2²⁶ entries.
const MAX_TABLE_BYTES: u64 = 1 << 29;
/// Strips that are stored as they are, are read in parts of about this many bytes.
const PLAIN_PART_BYTES: u64 = 1 << 20;

/// Strips or tiles (here both are chunks) of an image.
#[derive(Debug)]
pub(super) struct Table {
    /// Samples of the image.
    pub(super) width: u32,
    pub(super) height: u32,
    /// Samples of a chunk.
    pub(super) chunk_columns: u32,
    pub(super) chunk_rows: u32,
    /// "strip" or "tile", for messages.
    pub(super) name: &'static str,
    tiled: bool,
    /// Bands that lie apart, each in chunks of its own; 1 where they lie together.
    planes: u16,
    /// First byte and number of bytes of every chunk.
    places: Vec<(u64, u64)>,
}

impl Table {
    /// Reads the tables (of `planes` bands that lie apart, or 1) and checks that every chunk lies in the file and may
    /// be as large as it says.
    pub(super) fn read(
        bytes: &Bytes,
        ifd: &Ifd,
        coding: &Coding,
        planes: u16,
    ) -> Result<Self, DemError> {
        Self::read_any(bytes, ifd, coding, planes, 1)
    }

    /// The same for one bit a sample; widths are then bytes.
    pub(super) fn read_packed(bytes: &Bytes, ifd: &Ifd, coding: &Coding) -> Result<Self, DemError> {
        Self::read_any(bytes, ifd, coding, 1, 8)
    }

    fn read_any(
        bytes: &Bytes,
        ifd: &Ifd,
        coding: &Coding,
        planes: u16,
        samples_a_byte: u32,
    ) -> Result<Self, DemError> {
        let [width, height] = [tag::WIDTH, tag::HEIGHT].map(|tag| require(bytes, ifd, tag));
        let (width, height) = (width?.div_ceil(samples_a_byte), height?);
        let tiled = ifd.has(tag::TILE_OFFSETS);
        let (chunk_columns, chunk_rows) = if tiled {
            (
                require(bytes, ifd, tag::TILE_WIDTH)?.div_ceil(samples_a_byte),
                require(bytes, ifd, tag::TILE_HEIGHT)?,
            )
        } else {
            let rows = ifd
                .number(bytes, tag::ROWS_PER_STRIP)?
                .unwrap_or(height.into());
            (width, u32::try_from(rows).unwrap_or(u32::MAX).min(height))
        };
        if [width, height, chunk_columns, chunk_rows].contains(&0) {
            let what = format!(
                "{width} x {height} samples in parts of {chunk_columns} x {chunk_rows} are none"
            );
            return Err(DemError::format(bytes.path(), what));
        }
        let name = if tiled { "tile" } else { "strip" };
        let mut table = Self {
            width,
            height,
            chunk_columns,
            chunk_rows,
            name,
            tiled,
            planes,
            places: Vec::new(),
        };
        table.places = table.read_places(bytes, ifd, coding)?;
        table.split_plain_strips(coding);
        table.check(bytes, coding)?;
        Ok(table)
    }

    /// Chunks from west to east.
    pub(super) fn across(&self) -> u32 {
        self.width.div_ceil(self.chunk_columns)
    }

    pub(super) fn down(&self) -> u32 {
        self.height.div_ceil(self.chunk_rows)
    }

    /// Chunks of one plane.
    pub(super) fn plane_len(&self) -> usize {
        self.across() as usize * self.down() as usize
    }

    /// Bytes of a chunk's numbers in memory.
    pub(super) fn chunk_bytes(&self, coding: &Coding) -> u64 {
        let samples = u64::from(self.chunk_columns) * u64::from(self.chunk_rows);
        samples.saturating_mul(coding.decoded_bytes())
    }

    /// Bytes of the chunk that takes most in the file.
    pub(super) fn most_stored_bytes(&self) -> u64 {
        let counts = self.places.iter().map(|&(_, count)| count);
        counts.max().unwrap_or(0)
    }

    /// First byte and number of bytes of a chunk; none when the file leaves it out.
    pub(super) fn place(&self, index: usize) -> Option<(u64, u64)> {
        self.places
            .get(index)
            .copied()
            .filter(|&(_, count)| count > 0)
    }

    /// Rows that a chunk stores: a tile's are whole, the last strip's are not.
    pub(super) fn stored_rows(&self, index: usize) -> u32 {
        let row = index % self.plane_len() / self.across() as usize;
        let first = row as u64 * u64::from(self.chunk_rows);
        let left = u64::from(self.height).saturating_sub(first);
        if self.tiled {
            self.chunk_rows
        } else {
            u32::try_from(left).unwrap_or(u32::MAX).min(self.chunk_rows)
        }
    }

    fn read_places(
        &self,
        bytes: &Bytes,
        ifd: &Ifd,
        coding: &Coding,
    ) -> Result<Vec<(u64, u64)>, DemError> {
        let tags = if self.tiled {
            [tag::TILE_OFFSETS, tag::TILE_BYTES]
        } else {
            [tag::STRIP_OFFSETS, tag::STRIP_BYTES]
        };
        let wanted = u64::from(self.across()) * u64::from(self.down()) * u64::from(self.planes);
        let offsets = ifd
            .table(bytes, tags[0], MAX_TABLE_BYTES)?
            .ok_or_else(|| missing(bytes, tags[0]))?;
        let counts = match ifd.table(bytes, tags[1], MAX_TABLE_BYTES)? {
            Some(counts) => counts,
            // Old writers left it out where it can be computed.
            None if coding.is_plain() && !self.tiled => (0..offsets.len())
                .map(|i| self.plain_bytes(i, coding))
                .collect(),
            None => return Err(missing(bytes, tags[1])),
        };
        for (tag, len) in tags.into_iter().zip([offsets.len(), counts.len()]) {
            if (len as u64) < wanted {
                let what = format!(
                    "{} x {} samples need {wanted} {}s, tag {tag} lists {len}",
                    self.width, self.height, self.name
                );
                return Err(DemError::format(bytes.path(), what));
            }
        }
        let wanted = usize::try_from(wanted).unwrap_or(usize::MAX);
        Ok(offsets.into_iter().zip(counts).take(wanted).collect())
    }

    fn plain_bytes(&self, index: usize, coding: &Coding) -> u64 {
        u64::from(self.stored_rows(index)) * self.row_bytes(coding)
    }

    fn row_bytes(&self, coding: &Coding) -> u64 {
        u64::from(self.chunk_columns) * coding.bytes()
    }

    /// Splits strips of plain numbers into smaller ones, so that no window need read a large one whole.
    fn split_plain_strips(&mut self, coding: &Coding) {
        let most = (PLAIN_PART_BYTES / self.row_bytes(coding)).max(1);
        let most = u32::try_from(most).unwrap_or(u32::MAX);
        let is_enough =
            |(index, &(_, count)): (usize, &(u64, u64))| count >= self.plain_bytes(index, coding);
        let splittable = !self.tiled && self.planes == 1 && coding.is_plain();
        if !splittable || self.chunk_rows <= most || !self.places.iter().enumerate().all(is_enough)
        {
            return;
        }
        // All parts but the last of all must be equal.
        let rows = if self.places.len() == 1 {
            most
        } else {
            largest_divisor(self.chunk_rows, most)
        };
        let part_bytes = u64::from(rows) * self.row_bytes(coding);
        let mut parts = Vec::new();
        for (index, &(offset, _)) in self.places.iter().enumerate() {
            let stored = self.stored_rows(index);
            for (part, first) in (0u64..).zip((0..stored).step_by(rows as usize)) {
                let count = u64::from(rows.min(stored - first)) * self.row_bytes(coding);
                parts.push((offset.saturating_add(part * part_bytes), count));
            }
        }
        self.chunk_rows = rows;
        self.places = parts;
    }

    /// The stored bytes of a chunk, if they can hold its samples.
    pub(super) fn stored(
        &self,
        bytes: &Bytes,
        coding: &Coding,
        index: usize,
        (offset, count): (u64, u64),
    ) -> Result<Vec<u8>, DemError> {
        let (rows, columns) = (self.stored_rows(index), self.chunk_columns);
        if !coding.is_plausible(count, u64::from(rows) * u64::from(columns)) {
            let what = format!("{count} bytes cannot hold {rows} x {columns} samples");
            return Err(self.damaged(bytes, index, &what));
        }
        bytes.read(offset, count, || format!("{} {index}", self.name))
    }

    /// The numbers of a chunk.
    pub(super) fn decode(
        &self,
        bytes: &Bytes,
        coding: &Coding,
        index: usize,
        place: (u64, u64),
    ) -> Result<Samples, DemError> {
        let stored = self.stored(bytes, coding, index, place)?;
        let decoded = coding.decode(stored, self.stored_rows(index), self.chunk_columns);
        decoded.map_err(|what| self.damaged(bytes, index, &what))
    }

    /// An error in a chunk.
    pub(super) fn damaged(&self, bytes: &Bytes, index: usize, what: &str) -> DemError {
        DemError::format(bytes.path(), format!("{} {index}: {what}", self.name))
    }

    fn check(&self, bytes: &Bytes, coding: &Coding) -> Result<(), DemError> {
        if self.chunk_bytes(coding) > MAX_CHUNK_BYTES {
            let what = format!(
                "a {} of {} x {} samples",
                self.name, self.chunk_columns, self.chunk_rows
            );
            return Err(DemError::limit(
                bytes.path(),
                what,
                format!("{MAX_CHUNK_BYTES} bytes"),
            ));
        }
        for (index, &(offset, count)) in self.places.iter().enumerate() {
            if count > 0
                && offset
                    .checked_add(count)
                    .is_none_or(|end| end > bytes.len())
            {
                let what = format!(
                    "truncated: {} {index} takes {count} bytes at byte {offset}, the file ends at byte {}",
                    self.name,
                    bytes.len()
                );
                return Err(DemError::format(bytes.path(), what));
            }
        }
        Ok(())
    }
}

fn require(bytes: &Bytes, ifd: &Ifd, tag: u16) -> Result<u32, DemError> {
    let value = ifd.number(bytes, tag)?.ok_or_else(|| missing(bytes, tag))?;
    u32::try_from(value)
        .map_err(|_| DemError::limit(bytes.path(), format!("{value} in tag {tag}"), "32 bits"))
}

fn missing(bytes: &Bytes, tag: u16) -> DemError {
    DemError::format(bytes.path(), format!("tag {tag} is missing"))
}

fn largest_divisor(number: u32, most: u32) -> u32 {
    (1..=most)
        .rev()
        .find(|part| number.is_multiple_of(*part))
        .unwrap_or(1)
}
