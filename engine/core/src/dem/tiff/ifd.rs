//! The first directory of a TIFF: its tags, read on demand and checked against the file's length.
//!
//! The `tiff` crate has a reader of its own, but one that fixes its limits before we can set them, refuses sparse
//! files, and reads through one shared position; here every read is positioned, so that many threads may.
//!
//! Based on: TIFF 6.0 (Adobe, 1992), the BigTIFF design (Joris Van Damme, 2007).

use std::collections::BTreeMap;

use super::super::{DemError, bytes::Bytes};

/// Entries a directory may have.
const MAX_ENTRIES: u64 = 4096;
/// Bytes a value may take, tables of strips aside.
const MAX_VALUE_BYTES: u64 = 1 << 20;

/// Tags that are read.
pub(crate) mod tag {
    pub(crate) const SUBFILE_KIND: u16 = 254;
    pub(crate) const WIDTH: u16 = 256;
    pub(crate) const HEIGHT: u16 = 257;
    pub(crate) const BITS: u16 = 258;
    pub(crate) const COMPRESSION: u16 = 259;
    pub(crate) const PHOTOMETRIC: u16 = 262;
    pub(crate) const FILL_ORDER: u16 = 266;
    pub(crate) const STRIP_OFFSETS: u16 = 273;
    pub(crate) const SAMPLES: u16 = 277;
    pub(crate) const ROWS_PER_STRIP: u16 = 278;
    pub(crate) const STRIP_BYTES: u16 = 279;
    pub(crate) const PLANAR: u16 = 284;
    pub(crate) const PREDICTOR: u16 = 317;
    pub(crate) const PALETTE: u16 = 320;
    pub(crate) const TILE_WIDTH: u16 = 322;
    pub(crate) const TILE_HEIGHT: u16 = 323;
    pub(crate) const TILE_OFFSETS: u16 = 324;
    pub(crate) const TILE_BYTES: u16 = 325;
    pub(crate) const EXTRA_SAMPLES: u16 = 338;
    pub(crate) const SAMPLE_FORMAT: u16 = 339;
    pub(crate) const JPEG_TABLES: u16 = 347;
    pub(crate) const PIXEL_SCALE: u16 = 33550;
    pub(crate) const TIE_POINTS: u16 = 33922;
    pub(crate) const TRANSFORMATION: u16 = 34264;
    pub(crate) const GEO_KEYS: u16 = 34735;
    pub(crate) const GEO_DOUBLES: u16 = 34736;
    pub(crate) const GEO_TEXT: u16 = 34737;
    pub(crate) const GDAL_METADATA: u16 = 42112;
    pub(crate) const GDAL_NODATA: u16 = 42113;
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    kind: u16,
    count: u64,
    /// Where the values lie in the file.
    offset: u64,
}

/// A directory of tags.
#[derive(Debug)]
pub(crate) struct Ifd {
    pub(crate) big_endian: bool,
    /// Where the next directory is said to lie.
    pub(crate) next: Option<u64>,
    big: bool,
    entries: BTreeMap<u16, Entry>,
}

/// Numbers in a file's byte order.
#[derive(Clone, Copy)]
struct Order {
    big_endian: bool,
}

impl Order {
    /// An unsigned number of 1 to 8 bytes.
    fn unsigned(self, bytes: &[u8]) -> u64 {
        let push = |number: u64, byte: &u8| (number << 8) | u64::from(*byte);
        if self.big_endian {
            bytes.iter().fold(0, push)
        } else {
            bytes.iter().rev().fold(0, push)
        }
    }
}

/// Bytes of one value of a TIFF type, 0 for unknown types.
const fn type_bytes(kind: u16) -> u64 {
    match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 0,
    }
}

impl Ifd {
    /// True when the bytes begin like a TIFF or BigTIFF.
    pub(crate) fn matches(head: &[u8]) -> bool {
        matches!(
            head,
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..]
        )
    }

    /// Reads the first directory.
    pub(crate) fn read(bytes: &Bytes) -> Result<Self, DemError> {
        let head = bytes.head(16)?;
        if !Self::matches(&head) {
            return Err(DemError::format(
                bytes.path(),
                "not a TIFF: it does not begin with II or MM and 42 or 43",
            ));
        }
        let order = Order {
            big_endian: head[0] == b'M',
        };
        let big = head.contains(&43) && order.unsigned(&head[2..4]) == 43;
        let needed = if big { 16 } else { 8 };
        if head.len() < needed {
            return Err(DemError::format(bytes.path(), "the TIFF header is cut off"));
        }
        if big && order.unsigned(&head[4..6]) != 8 {
            return Err(DemError::format(
                bytes.path(),
                "the BigTIFF header asks for offsets of other than 8 bytes",
            ));
        }
        let first = order.unsigned(if big { &head[8..16] } else { &head[4..8] });
        if first < needed as u64 {
            let what =
                format!("the first directory is said to lie at byte {first}, inside the header");
            return Err(DemError::format(bytes.path(), what));
        }
        Self::read_directory(bytes, order, big, first)
    }

    /// Another directory of the same file.
    pub(crate) fn read_at(&self, bytes: &Bytes, at: u64) -> Result<Self, DemError> {
        Self::read_directory(bytes, self.order(), self.big, at)
    }

    fn read_directory(bytes: &Bytes, order: Order, big: bool, at: u64) -> Result<Self, DemError> {
        let (entries, end) = read_entries(bytes, order, big, at)?;
        // Some files end before the pointer to the next directory; then there is none.
        let pointer = bytes.read(end, if big { 8 } else { 4 }, || "the next directory".into());
        let next = pointer
            .ok()
            .map(|pointer| order.unsigned(&pointer))
            .filter(|&next| next != 0);
        Ok(Self {
            big_endian: order.big_endian,
            next,
            big,
            entries,
        })
    }

    pub(crate) fn has(&self, tag: u16) -> bool {
        self.entries.contains_key(&tag)
    }

    fn order(&self) -> Order {
        Order {
            big_endian: self.big_endian,
        }
    }

    /// The bytes of a tag's values and the size of one.
    fn values(
        &self,
        bytes: &Bytes,
        tag: u16,
        max_bytes: u64,
    ) -> Result<Option<(Entry, Vec<u8>)>, DemError> {
        let Some(&entry) = self.entries.get(&tag) else {
            return Ok(None);
        };
        let size = type_bytes(entry.kind);
        let total = entry
            .count
            .checked_mul(size)
            .filter(|&total| total <= max_bytes);
        let Some(total) = total else {
            let what = format!("tag {tag} with {} values", entry.count);
            return Err(DemError::limit(
                bytes.path(),
                what,
                format!("{max_bytes} bytes"),
            ));
        };
        let data = bytes.read(entry.offset, total, || format!("tag {tag}"))?;
        Ok(Some((entry, data)))
    }

    /// The whole numbers of a tag.
    pub(crate) fn numbers(&self, bytes: &Bytes, tag: u16) -> Result<Option<Vec<u64>>, DemError> {
        self.table(bytes, tag, MAX_VALUE_BYTES)
    }

    /// The whole numbers of a tag that may be long.
    pub(crate) fn table(
        &self,
        bytes: &Bytes,
        tag: u16,
        max_bytes: u64,
    ) -> Result<Option<Vec<u64>>, DemError> {
        let Some((entry, data)) = self.values(bytes, tag, max_bytes)? else {
            return Ok(None);
        };
        if !matches!(entry.kind, 1 | 3 | 4 | 13 | 16 | 18) {
            let what = format!("tag {tag} is of type {}, not of whole numbers", entry.kind);
            return Err(DemError::format(bytes.path(), what));
        }
        let order = self.order();
        let size = usize::try_from(type_bytes(entry.kind)).unwrap_or(1);
        Ok(Some(
            data.chunks_exact(size)
                .map(|value| order.unsigned(value))
                .collect(),
        ))
    }

    /// The first whole number of a tag.
    pub(crate) fn number(&self, bytes: &Bytes, tag: u16) -> Result<Option<u64>, DemError> {
        Ok(self
            .numbers(bytes, tag)?
            .and_then(|values| values.first().copied()))
    }

    /// The first number of a tag, of at most 16 bits, or what stands for it where it is missing.
    pub(crate) fn short(&self, bytes: &Bytes, tag: u16, default: u16) -> Result<u16, DemError> {
        let value = self.number(bytes, tag)?.unwrap_or(default.into());
        u16::try_from(value)
            .map_err(|_| DemError::format(bytes.path(), format!("{value} in tag {tag}")))
    }

    /// The floating-point numbers of a tag.
    pub(crate) fn doubles(&self, bytes: &Bytes, tag: u16) -> Result<Option<Vec<f64>>, DemError> {
        let Some((entry, data)) = self.values(bytes, tag, MAX_VALUE_BYTES)? else {
            return Ok(None);
        };
        let order = self.order();
        match entry.kind {
            12 => {
                let value = |value: &[u8]| f64::from_bits(order.unsigned(value));
                Ok(Some(data.chunks_exact(8).map(value).collect()))
            }
            kind => {
                let what = format!("tag {tag} is of type {kind}, not of double-precision numbers");
                Err(DemError::format(bytes.path(), what))
            }
        }
    }

    /// The bytes of a tag, whatever they mean.
    pub(crate) fn raw(&self, bytes: &Bytes, tag: u16) -> Result<Option<Vec<u8>>, DemError> {
        Ok(self
            .values(bytes, tag, MAX_VALUE_BYTES)?
            .map(|(_, data)| data))
    }

    /// The text of a tag, up to its first NUL; a character a byte, so that offsets into it hold.
    pub(crate) fn text(&self, bytes: &Bytes, tag: u16) -> Result<Option<String>, DemError> {
        let Some((_, data)) = self.values(bytes, tag, MAX_VALUE_BYTES)? else {
            return Ok(None);
        };
        let end = data
            .iter()
            .position(|&byte| byte == 0)
            .unwrap_or(data.len());
        let character = |&byte: &u8| {
            if byte.is_ascii() {
                char::from(byte)
            } else {
                '?'
            }
        };
        Ok(Some(data[..end].iter().map(character).collect()))
    }
}

/// The tags of a directory, and where they end.
fn read_entries(
    bytes: &Bytes,
    order: Order,
    big: bool,
    at: u64,
) -> Result<(BTreeMap<u16, Entry>, u64), DemError> {
    let (count_bytes, entry_bytes, count_at, inline) =
        if big { (8, 20, 4, 8) } else { (2, 12, 4, 4) };
    let count = order.unsigned(&bytes.read(at, count_bytes, || "a directory".into())?);
    if count > MAX_ENTRIES {
        let what = format!("a directory of {count} tags");
        return Err(DemError::limit(
            bytes.path(),
            what,
            format!("{MAX_ENTRIES} tags"),
        ));
    }
    let table_at = at + count_bytes;
    let table = bytes.read(table_at, count * entry_bytes, || {
        format!("the directory of {count} tags")
    })?;
    let mut entries = BTreeMap::new();
    let size = if big { 20 } else { 12 };
    for (index, raw) in (0u64..).zip(table.chunks_exact(size)) {
        let kind_bytes = [order.unsigned(&raw[..2]), order.unsigned(&raw[2..4])];
        let [Ok(tag), Ok(kind)] = kind_bytes.map(u16::try_from) else {
            continue;
        };
        let count = order.unsigned(&raw[count_at..count_at + inline]);
        let value_at = count_at + inline;
        let fits = count
            .checked_mul(type_bytes(kind))
            .is_some_and(|total| total <= inline as u64);
        let offset = if fits {
            table_at + index * entry_bytes + value_at as u64
        } else {
            order.unsigned(&raw[value_at..])
        };
        entries.entry(tag).or_insert(Entry {
            kind,
            count,
            offset,
        });
    }
    Ok((entries, table_at + count * entry_bytes))
}
