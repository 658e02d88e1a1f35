//! TIFF imagery: all bands of all strips or tiles, as RGB of 8 bits.

use std::io::Cursor;

use ::image::codecs::jpeg::JpegDecoder;
use ::image::{DynamicImage, ImageDecoder};

use super::super::samples::Samples;
use super::super::{DemError, bytes::Bytes, image::check_size};
use super::chunk::{Coding, JPEG};
use super::ifd::{Ifd, tag};
use super::table::Table;

/// What the bands of an image mean.
#[derive(Clone, Debug)]
enum Colors {
    /// One band, black at 0.
    Grey,
    /// One band, white at 0.
    InverseGrey,
    /// Three bands, and perhaps more that are passed over.
    Rgb,
    /// One band of indices into colours.
    Palette(Vec<[u8; 3]>),
}

/// Width, height and pixels in stored order.
pub(in super::super) fn read_picture(
    bytes: &Bytes,
    ifd: &Ifd,
) -> Result<(u32, u32, Vec<[u8; 3]>), DemError> {
    let bands = ifd.short(bytes, tag::SAMPLES, 1)?;
    let colors = read_colors(bytes, ifd, bands)?;
    let apart = bands > 1 && ifd.short(bytes, tag::PLANAR, 1)? == 2;
    let coding = Coding::read(bytes, ifd, if apart { 1 } else { bands })?;
    let jpeg = coding.compression == JPEG;
    let unsupported = if jpeg { None } else { coding.unsupported() };
    if let Some(what) = unsupported {
        return Err(DemError::unsupported(bytes.path(), what));
    }
    if coding.format != 1 || !matches!(coding.bits, 8 | 16) {
        return Err(DemError::unsupported(
            bytes.path(),
            "an image of other than 8 or 16 bits, unsigned",
        ));
    }
    if jpeg && (apart || coding.bits != 8 || !matches!(bands, 1 | 3)) {
        return Err(DemError::unsupported(
            bytes.path(),
            "JPEG compression of other than grey or YCbCr",
        ));
    }
    let table = Table::read(bytes, ifd, &coding, if apart { bands } else { 1 })?;
    check_size(bytes, table.width.into(), table.height.into())?;
    let mut picture = vec![[0; 3]; table.width as usize * table.height as usize];
    let tables = ifd.raw(bytes, tag::JPEG_TABLES)?;
    let source = Source {
        bytes,
        coding,
        table: &table,
        colors,
        apart,
    };
    for index in 0..table.plane_len() {
        if jpeg {
            source.copy_jpeg(index, tables.as_deref(), &mut picture)?;
        } else {
            source.copy(index, &mut picture)?;
        }
    }
    Ok((table.width, table.height, picture))
}

fn read_colors(bytes: &Bytes, ifd: &Ifd, bands: u16) -> Result<Colors, DemError> {
    let photometric = ifd.short(bytes, tag::PHOTOMETRIC, if bands >= 3 { 2 } else { 1 })?;
    let jpeg = ifd.short(bytes, tag::COMPRESSION, 1)? == JPEG;
    match (photometric, bands) {
        (0, 1 | 2) => Ok(Colors::InverseGrey),
        (1, 1 | 2) => Ok(Colors::Grey),
        // Many write three and more bands as "black is zero".
        (1, 3..) => Ok(Colors::Rgb),
        (2, 3..) if !jpeg => Ok(Colors::Rgb),
        (6, 3) if jpeg => Ok(Colors::Rgb),
        (3, 1) => read_palette(bytes, ifd).map(Colors::Palette),
        _ => {
            let what = format!(
                "an image of {bands} bands and photometric interpretation {photometric} (tag 262)"
            );
            Err(DemError::unsupported(bytes.path(), what))
        }
    }
}

/// All reds, then all greens, then all blues, of 16 bits each.
fn read_palette(bytes: &Bytes, ifd: &Ifd) -> Result<Vec<[u8; 3]>, DemError> {
    let values = ifd.numbers(bytes, tag::PALETTE)?.unwrap_or_default();
    let count = values.len() / 3;
    if count == 0 {
        return Err(DemError::format(
            bytes.path(),
            "palette colours without a palette (tag 320)",
        ));
    }
    let level = |value: u64| u16::try_from(value).map_or(u8::MAX, to_8_bits);
    Ok((0..count)
        .map(|index| [0, 1, 2].map(|band| level(values[band * count + index])))
        .collect())
}

/// An open image.
struct Source<'a> {
    bytes: &'a Bytes,
    coding: Coding,
    table: &'a Table,
    colors: Colors,
    apart: bool,
}

/// The part of an image that a strip or tile holds.
struct Place {
    row: usize,
    column: usize,
    rows: usize,
    columns: usize,
}

impl Source<'_> {
    fn place(&self, index: usize) -> Place {
        let table = self.table;
        let across = table.across() as usize;
        let (row, column) = (
            index / across * table.chunk_rows as usize,
            index % across * table.chunk_columns as usize,
        );
        Place {
            row,
            column,
            rows: (table.chunk_rows as usize).min(table.height as usize - row),
            columns: (table.chunk_columns as usize).min(table.width as usize - column),
        }
    }

    /// Copies pixels into the picture; `pixel` is given row and column in the strip or tile.
    fn put(&self, index: usize, picture: &mut [[u8; 3]], pixel: impl Fn(usize, usize) -> [u8; 3]) {
        let place = self.place(index);
        for row in 0..place.rows {
            let first = (place.row + row) * self.table.width as usize + place.column;
            for (column, out) in picture[first..first + place.columns].iter_mut().enumerate() {
                *out = pixel(row, column);
            }
        }
    }

    fn copy(&self, index: usize, picture: &mut [[u8; 3]]) -> Result<(), DemError> {
        let plane_count = if self.apart { 3 } else { 1 };
        let mut planes = Vec::new();
        for plane in 0..plane_count {
            let index = plane * self.table.plane_len() + index;
            // A part that the file leaves out stays black.
            let Some(place) = self.table.place(index) else {
                return Ok(());
            };
            planes.push(self.table.decode(self.bytes, &self.coding, index, place)?);
        }
        let columns = self.table.chunk_columns as usize;
        let bands = usize::from(self.coding.bands);
        let band = |row: usize, column: usize, band: usize| {
            let (plane, first) = if self.apart { (band, 0) } else { (0, band) };
            level(&planes[plane], (row * columns + column) * bands + first)
        };
        self.put(index, picture, |row, column| match &self.colors {
            Colors::Grey => [band(row, column, 0).0; 3],
            Colors::InverseGrey => [!band(row, column, 0).0; 3],
            Colors::Rgb => [0, 1, 2].map(|b| band(row, column, b).0),
            Colors::Palette(palette) => palette
                .get(usize::from(band(row, column, 0).1))
                .copied()
                .unwrap_or_default(),
        });
        Ok(())
    }

    fn copy_jpeg(
        &self,
        index: usize,
        tables: Option<&[u8]>,
        picture: &mut [[u8; 3]],
    ) -> Result<(), DemError> {
        let Some(place) = self.table.place(index) else {
            return Ok(());
        };
        let stored = self.table.stored(self.bytes, &self.coding, index, place)?;
        let damaged = |what: &str| self.table.damaged(self.bytes, index, what);
        let (wanted, columns) = (self.place(index), self.table.chunk_columns as usize);
        let file = match tables {
            // Both are whole JPEG files: the end mark of one and the start mark of the other go.
            Some([tables @ .., _, _]) => [tables, stored.get(2..).unwrap_or_default()].concat(),
            _ => stored,
        };
        let decoder =
            JpegDecoder::new(Cursor::new(file)).map_err(|error| damaged(&error.to_string()))?;
        let (width, height) = decoder.dimensions();
        if width as usize != columns
            || (height as usize) < wanted.rows
            || height > self.table.chunk_rows
        {
            return Err(damaged(&format!("a JPEG of {width} x {height} pixels")));
        }
        let decoded =
            DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error.to_string()))?;
        let pixels = decoded.into_rgb8();
        let inverse = matches!(self.colors, Colors::InverseGrey);
        self.put(index, picture, |row, column| {
            let pixel = pixels.as_raw().as_chunks::<3>().0[row * columns + column];
            if inverse {
                pixel.map(|level| !level)
            } else {
                pixel
            }
        });
        Ok(())
    }
}

/// A number as a level of 8 bits, and as it is.
fn level(samples: &Samples, index: usize) -> (u8, u16) {
    match samples {
        Samples::U8(v) => (v[index], v[index].into()),
        Samples::U16(v) => (to_8_bits(v[index]), v[index]),
        _ => (0, 0),
    }
}

/// A level of 16 bits as the nearest of 8.
fn to_8_bits(level: u16) -> u8 {
    u8::try_from((u32::from(level) + 128) / 257).unwrap_or(u8::MAX)
}
