//! Directories of tags, as bytes.

use super::{Compression, GeoTiffLayout, TIFF_TILE, keys::geo_keys};
use crate::dem::tiff::tag;

const SHORT: u16 = 3;
const LONG: u16 = 4;
const ASCII: u16 = 2;
const DOUBLE: u16 = 12;
const LONG8: u16 = 16;

/// Classic TIFF or BigTIFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Classic,
    Big,
}

/// Where the numbers of a tag lie in the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) offset: u64,
}

impl Format {
    /// The one that has room for so many bytes.
    pub(super) fn for_bytes(bytes: u64) -> Self {
        if bytes < 1 << 32 {
            Self::Classic
        } else {
            Self::Big
        }
    }

    /// The file's first bytes; the first directory follows them.
    pub(super) fn header(self) -> Vec<u8> {
        match self {
            Self::Classic => [&b"II\x2a\0"[..], &8_u32.to_le_bytes()].concat(),
            Self::Big => [&b"II\x2b\0\x08\0\0\0"[..], &16_u64.to_le_bytes()].concat(),
        }
    }

    /// Offsets as they are stored.
    pub(super) fn numbers(self, numbers: impl Iterator<Item = u64>) -> Vec<u8> {
        let width = self.offset_bytes();
        numbers
            .flat_map(|number| number.to_le_bytes().into_iter().take(width))
            .collect()
    }

    const fn offset_bytes(self) -> usize {
        match self {
            Self::Classic => 4,
            Self::Big => 8,
        }
    }

    /// Bytes of a directory of so many entries.
    const fn directory_bytes(self, entries: usize) -> usize {
        match self {
            Self::Classic => 2 + 12 * entries + 4,
            Self::Big => 8 + 20 * entries + 8,
        }
    }
}

/// One directory.
pub(super) struct Directory {
    entries: Vec<Entry>,
    tile_count: usize,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    values: Values,
}

enum Values {
    Known(Vec<u8>),
    /// Filled in at the end, one offset's width a tile.
    Tiles,
}

impl Directory {
    /// The tags of an image; 0 is the raster itself, which alone says where it lies.
    pub(super) fn new(
        layout: &GeoTiffLayout<'_>,
        image: usize,
        [rows, columns]: [u32; 2],
        tile_count: usize,
    ) -> Self {
        let (compression, predictor) = match layout.compression {
            Compression::None => (1, 1),
            Compression::Zstd(_) => (50_000, 3),
        };
        let tiles = |tag| Entry {
            tag,
            kind: LONG8,
            count: tile_count,
            values: Values::Tiles,
        };
        let mut entries = vec![
            long(tag::SUBFILE_KIND, u32::from(image > 0)),
            long(tag::WIDTH, columns),
            long(tag::HEIGHT, rows),
            shorts(tag::BITS, &[32]),
            shorts(tag::COMPRESSION, &[compression]),
            shorts(tag::PHOTOMETRIC, &[1]),
            shorts(tag::SAMPLES, &[1]),
            shorts(tag::PLANAR, &[1]),
            shorts(tag::PREDICTOR, &[predictor]),
            long(tag::TILE_WIDTH, TIFF_TILE),
            long(tag::TILE_HEIGHT, TIFF_TILE),
            tiles(tag::TILE_OFFSETS),
            tiles(tag::TILE_BYTES),
            shorts(tag::SAMPLE_FORMAT, &[3]),
        ];
        if image == 0 {
            let [x, y] = layout.grid.origin;
            let [dx, dy] = layout.grid.step;
            entries.push(doubles(tag::PIXEL_SCALE, &[dx, -dy, 0.0]));
            entries.push(doubles(tag::TIE_POINTS, &[0.0, 0.0, 0.0, x, y, 0.0]));
            let keys = geo_keys(layout.crs);
            entries.push(shorts(tag::GEO_KEYS, &keys.directory));
            if !keys.doubles.is_empty() {
                entries.push(doubles(tag::GEO_DOUBLES, &keys.doubles));
            }
            if !keys.text.is_empty() {
                entries.push(text(tag::GEO_TEXT, &keys.text));
            }
        }
        if layout.voids {
            entries.push(text(tag::GDAL_NODATA, "nan"));
        }
        Self {
            entries,
            tile_count,
        }
    }

    /// Adds the directory and its values to the bytes of the file so far; where offsets and sizes of tiles belong.
    pub(super) fn write(&self, format: Format, last: bool, bytes: &mut Vec<u8>) -> [Place; 2] {
        let width = format.offset_bytes();
        // Values that do not fit into their entry lie behind the directory, at even places.
        let mut after = bytes.len() + format.directory_bytes(self.entries.len());
        let mut values = Vec::new();
        let mut places = Vec::new();
        match format {
            Format::Classic => bytes.extend(u16_of(self.entries.len()).to_le_bytes()),
            Format::Big => bytes.extend((self.entries.len() as u64).to_le_bytes()),
        }
        for entry in &self.entries {
            let (kind, mut content) = match &entry.values {
                Values::Known(known) => (entry.kind, known.clone()),
                Values::Tiles if format == Format::Classic => (LONG, vec![0; 4 * self.tile_count]),
                Values::Tiles => (LONG8, vec![0; 8 * self.tile_count]),
            };
            bytes.extend(entry.tag.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(format.numbers([entry.count as u64].into_iter()));
            let inline = content.len() <= width;
            if matches!(entry.values, Values::Tiles) {
                let offset = if inline { bytes.len() } else { after } as u64;
                places.push(Place { offset });
            }
            if inline {
                content.resize(width, 0);
                bytes.extend(content);
            } else {
                bytes.extend(format.numbers([after as u64].into_iter()));
                content.resize(content.len().next_multiple_of(8), 0);
                after += content.len();
                values.extend(content);
            }
        }
        let next = if last { 0 } else { after as u64 };
        bytes.extend(format.numbers([next].into_iter()));
        bytes.extend(values);
        [places[0], places[1]]
    }
}

fn shorts(tag: u16, values: &[u16]) -> Entry {
    known(
        tag,
        SHORT,
        values.len(),
        values.iter().flat_map(|v| v.to_le_bytes()),
    )
}

fn long(tag: u16, value: u32) -> Entry {
    known(tag, LONG, 1, value.to_le_bytes())
}

fn doubles(tag: u16, values: &[f64]) -> Entry {
    known(
        tag,
        DOUBLE,
        values.len(),
        values.iter().flat_map(|v| v.to_le_bytes()),
    )
}

/// A text with the NUL that ends it.
fn text(tag: u16, text: &str) -> Entry {
    known(tag, ASCII, text.len() + 1, text.bytes().chain([0]))
}

fn known(tag: u16, kind: u16, count: usize, bytes: impl IntoIterator<Item = u8>) -> Entry {
    Entry {
        tag,
        kind,
        count,
        values: Values::Known(bytes.into_iter().collect()),
    }
}

fn u16_of(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}
