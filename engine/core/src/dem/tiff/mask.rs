//! The mask that some TIFFs hold beside an image: a bit a sample, 0 where there is nothing.

use std::collections::BTreeSet;

use super::super::{DemError, OpenOptions, Window, bytes::Bytes, samples::Samples};
use super::chunk::Coding;
use super::chunks::Chunks;
use super::ifd::{Ifd, tag};
use super::table::Table;

/// Directories that are looked through for a mask.
const MAX_DIRECTORIES: usize = 64;
/// "A transparency mask" among the bits of a directory's kind; and "a smaller version", which must not be set.
const IS_MASK: u64 = 4;
const IS_REDUCED: u64 = 1;
/// Bytes of decoded masks that are kept, if not one part is more.
const CACHE_BYTES: usize = 4 << 20;

/// An image's mask, eight samples a byte.
pub(super) struct Mask(Chunks);

impl Mask {
    /// The mask of the first image, if the file has one of that size.
    pub(super) fn find(
        bytes: &Bytes,
        first: &Ifd,
        image: &Table,
        options: &OpenOptions,
    ) -> Result<Option<Self>, DemError> {
        let mut seen = BTreeSet::new();
        let mut next = first.next;
        // A chain that leads nowhere, or in a circle, ends the search: the image itself is sound.
        while let Some(at) = next.filter(|&at| seen.len() < MAX_DIRECTORIES && seen.insert(at)) {
            let Ok(ifd) = first.read_at(bytes, at) else {
                break;
            };
            let kind = ifd.number(bytes, tag::SUBFILE_KIND)?.unwrap_or(0);
            let bits = ifd.short(bytes, tag::BITS, 1)?;
            if kind & IS_MASK != 0 && kind & IS_REDUCED == 0 && bits == 1 {
                return Self::read(bytes, &ifd, image, options);
            }
            next = ifd.next;
        }
        Ok(None)
    }

    fn read(
        bytes: &Bytes,
        ifd: &Ifd,
        image: &Table,
        options: &OpenOptions,
    ) -> Result<Option<Self>, DemError> {
        let coding = Coding {
            bits: 8,
            predictor: 1,
            ..Coding::read(bytes, ifd, 1)?
        };
        if let Some(what) = coding.unsupported() {
            return Err(DemError::unsupported(
                bytes.path(),
                format!("a mask with {what}"),
            ));
        }
        let table = Table::read_packed(bytes, ifd, &coding)?;
        let same_size = table.width == image.width.div_ceil(8) && table.height == image.height;
        Ok(same_size.then(|| Self(Chunks::new(coding, table, CACHE_BYTES, options))))
    }

    /// Bytes of it that are kept at most.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.0.memory_bytes()
    }

    /// Bytes that a window of so many samples takes while it is masked.
    pub(super) fn read_bytes(&self, samples: u64) -> u64 {
        // Eight samples a byte; the first and last byte of a row may be shared with what lies beside.
        self.0.read_bytes() + samples.div_ceil(4)
    }

    /// Puts `nothing` in the place of what it masks out of a stored window.
    pub(super) fn apply<T: Copy>(
        &self,
        bytes: &Bytes,
        window: Window,
        nothing: T,
        out: &mut [T],
    ) -> Result<(), DemError> {
        if window.sample_count() == 0 {
            return Ok(());
        }
        let first = window.column / 8;
        let last = (window.column + window.columns - 1) / 8;
        let packed = Window {
            column: first,
            columns: last - first + 1,
            ..window
        };
        let mut bits = vec![0; packed.rows as usize * packed.columns as usize];
        self.0.visit(bytes, packed, |run| {
            if let Some(Samples::U8(part)) = run.part {
                let count = run.in_window.len();
                bits[run.in_window].copy_from_slice(&part[run.in_part..run.in_part + count]);
            }
        })?;
        let rows = bits.chunks_exact(packed.columns as usize);
        for (bits, out) in rows.zip(out.chunks_exact_mut(window.columns as usize)) {
            for (column, sample) in (window.column - 8 * first..).zip(out) {
                if (bits[column as usize / 8] << (column % 8)) & 0x80 == 0 {
                    *sample = nothing;
                }
            }
        }
        Ok(())
    }
}
