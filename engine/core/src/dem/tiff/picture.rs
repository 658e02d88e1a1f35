//! TIFF imagery: strips or tiles of any usual bands, as RGB and alpha of 8 bits, decoded when a window asks for them.

use std::io::Cursor;

use ::image::codecs::jpeg::JpegDecoder;
use ::image::{DynamicImage, ImageDecoder};

use super::super::image::Pixel;
use super::super::samples::Samples;
use super::super::{DemError, OpenOptions, Window, bytes::Bytes};
use super::CACHE_BYTES;
use super::chunk::{Coding, JPEG};
use super::chunks::Chunks;
use super::ifd::{Ifd, tag};
use super::mask::Mask;
use super::metadata;
use super::table::Table;

/// Bytes of a pixel as it is handed out.
const PIXEL_BYTES: u64 = size_of::<Pixel>() as u64;

/// What the bands of an image mean.
#[derive(Clone, Debug)]
enum Colors {
    /// One band, black at 0.
    Grey,
    /// One band, white at 0.
    InverseGrey,
    /// Three bands.
    Rgb,
    /// One band of indices into colours.
    Palette(Vec<[u8; 3]>),
}

/// A band that says how much there is of a pixel.
#[derive(Clone, Copy, Debug)]
struct Alpha {
    band: usize,
    /// True when the colours are multiplied with it.
    associated: bool,
}

/// An open image.
pub(in super::super) struct Picture {
    bytes: Bytes,
    chunks: Chunks,
    mask: Option<Mask>,
    bands: Bands,
    jpeg_tables: Option<Vec<u8>>,
}

/// How numbers become colours.
#[derive(Debug)]
struct Bands {
    colors: Colors,
    alpha: Option<Alpha>,
    /// The number that all colours' bands have where there is nothing.
    nothing: Option<u16>,
    /// Bands that lie apart, each in strips or tiles of its own.
    apart: bool,
}

impl Picture {
    /// Reads all but the pixels.
    pub(in super::super) fn open(
        bytes: Bytes,
        ifd: &Ifd,
        options: &OpenOptions,
    ) -> Result<Self, DemError> {
        let count = ifd.short(&bytes, tag::SAMPLES, 1)?;
        let bands = Bands::read(&bytes, ifd, count)?;
        let coding = Coding::read(&bytes, ifd, if bands.apart { 1 } else { count })?;
        check_coding(&bytes, &coding, &bands, count)?;
        let table = Table::read(&bytes, ifd, &coding, if bands.apart { count } else { 1 })?;
        let mask = Mask::find(&bytes, ifd, &table, options)?;
        let pixels = u64::from(table.chunk_rows) * u64::from(table.chunk_columns);
        let chunks = Chunks::of_parts(coding, table, pixels * PIXEL_BYTES, CACHE_BYTES, options);
        Ok(Self {
            jpeg_tables: ifd.raw(&bytes, tag::JPEG_TABLES)?,
            bytes,
            chunks,
            mask,
            bands,
        })
    }

    /// Rows and columns of pixels.
    pub(in super::super) fn size(&self) -> [u32; 2] {
        [self.chunks.table.height, self.chunks.table.width]
    }

    /// Rows and columns of a strip or tile.
    pub(in super::super) fn part_shape(&self) -> [u32; 2] {
        [
            self.chunks.table.chunk_rows,
            self.chunks.table.chunk_columns,
        ]
    }

    /// Bytes of decoded strips or tiles that are kept at most.
    pub(in super::super) fn memory_bytes(&self) -> u64 {
        let mask = self.mask.as_ref().map_or(0, Mask::memory_bytes);
        self.chunks.memory_bytes() + mask
    }

    /// Bytes that a window of so many pixels takes while it is read.
    pub(in super::super) fn read_bytes(&self, pixels: u64) -> u64 {
        // All its bands decoded, and the pixels made of them.
        let planes = if self.bands.apart { 4 } else { 1 };
        let decoded = self.chunks.table.chunk_bytes(&self.chunks.coding);
        let mask = self.mask.as_ref().map_or(0, |mask| mask.read_bytes(pixels));
        (self.chunks.read_bytes() + planes * decoded).max(mask)
    }

    /// Reads a window of pixels as they are stored; alpha is 0 where the file leaves a part out.
    pub(in super::super) fn read(&self, window: Window, out: &mut [Pixel]) -> Result<(), DemError> {
        let decode = |index, place| self.decode(index, place);
        self.chunks.visit_decoded(window, decode, |run| {
            let out = &mut out[run.in_window];
            match run.part {
                Some(Samples::U8(part)) => {
                    let (pixels, _) = part.as_chunks();
                    out.copy_from_slice(&pixels[run.in_part..run.in_part + out.len()]);
                }
                _ => out.fill(Pixel::default()),
            }
        })?;
        match &self.mask {
            Some(mask) => mask.apply(&self.bytes, window, Pixel::default(), out),
            None => Ok(()),
        }
    }

    /// The pixels of a strip or tile, four bytes each.
    fn decode(&self, index: usize, place: (u64, u64)) -> Result<Samples, DemError> {
        if self.chunks.coding.compression == JPEG {
            return self.decode_jpeg(index, place);
        }
        let table = &self.chunks.table;
        let mut planes = Vec::new();
        for plane in self.bands.planes() {
            let index = plane * table.plane_len() + index;
            let place = table.place(index).ok_or_else(|| {
                table.damaged(
                    &self.bytes,
                    index,
                    "is left out, but not those of other bands",
                )
            })?;
            planes.push(table.decode(&self.bytes, &self.chunks.coding, index, place)?);
        }
        let count = table.stored_rows(index) as usize * table.chunk_columns as usize;
        let bands = usize::from(self.chunks.coding.bands);
        let (pixels, planes) = (0..count, &planes);
        let pixels: Vec<Pixel> = match &planes[0] {
            Samples::U8(_) => {
                let number = |band: usize, at: usize| match planes.get(band) {
                    Some(Samples::U8(plane)) => plane.get(at).copied().unwrap_or(0).into(),
                    _ => 0,
                };
                let level = |number: u16| u8::try_from(number).unwrap_or(u8::MAX);
                pixels
                    .map(|at| self.bands.pixel(at, bands, number, level))
                    .collect()
            }
            _ => {
                let number = |band: usize, at: usize| match planes.get(band) {
                    Some(Samples::U16(plane)) => plane.get(at).copied().unwrap_or(0),
                    _ => 0,
                };
                pixels
                    .map(|at| self.bands.pixel(at, bands, number, to_8_bits))
                    .collect()
            }
        };
        Ok(Samples::U8(pixels.into_flattened()))
    }

    fn decode_jpeg(&self, index: usize, place: (u64, u64)) -> Result<Samples, DemError> {
        let table = &self.chunks.table;
        let stored = table.stored(&self.bytes, &self.chunks.coding, index, place)?;
        let damaged = |what: &str| table.damaged(&self.bytes, index, what);
        let file = match self.jpeg_tables.as_deref() {
            // Both are whole JPEG files: the end mark of one and the start mark of the other go.
            Some([tables @ .., _, _]) => [tables, stored.get(2..).unwrap_or_default()].concat(),
            _ => stored,
        };
        let decoder =
            JpegDecoder::new(Cursor::new(file)).map_err(|error| damaged(&error.to_string()))?;
        let (width, height) = decoder.dimensions();
        if width != table.chunk_columns
            || height < table.stored_rows(index)
            || height > table.chunk_rows
        {
            return Err(damaged(&format!("a JPEG of {width} x {height} pixels")));
        }
        let decoded =
            DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error.to_string()))?;
        let mut pixels = decoded.into_rgba8().into_raw();
        if matches!(self.bands.colors, Colors::InverseGrey) {
            for [red, green, blue, _] in pixels.as_chunks_mut().0 {
                [red, green, blue]
                    .into_iter()
                    .for_each(|level| *level = !*level);
            }
        }
        Ok(Samples::U8(pixels))
    }
}

impl Bands {
    fn read(bytes: &Bytes, ifd: &Ifd, count: u16) -> Result<Self, DemError> {
        let colors = read_colors(bytes, ifd, count)?;
        let extra = ifd.numbers(bytes, tag::EXTRA_SAMPLES)?.unwrap_or_default();
        let first = usize::from(count).saturating_sub(extra.len());
        let alpha = extra.iter().position(|kind| matches!(kind, 1 | 2));
        let alpha = alpha.map(|at| Alpha {
            band: first + at,
            associated: extra[at] == 1,
        });
        let nothing = ifd.text(bytes, tag::GDAL_NODATA)?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "compared with what it was"
        )]
        let whole = |value: f64| Some(value as u16).filter(|number| f64::from(*number) == value);
        Ok(Self {
            colors,
            alpha: alpha.filter(|alpha| alpha.band > 0),
            nothing: nothing
                .and_then(|text| metadata::nodata(&text))
                .and_then(whole),
            apart: count > 1 && ifd.short(bytes, tag::PLANAR, 1)? == 2,
        })
    }

    /// The bands that are read.
    fn color_count(&self) -> usize {
        if matches!(self.colors, Colors::Rgb) {
            3
        } else {
            1
        }
    }

    /// The planes that are decoded: all bands' together, or each colour's and then alpha's.
    fn planes(&self) -> impl Iterator<Item = usize> {
        let colors = if self.apart { self.color_count() } else { 1 };
        let alpha = self.alpha.filter(|_| self.apart).map(|alpha| alpha.band);
        (0..colors).chain(alpha)
    }

    /// The pixel at a place, of which `number` gives what lies in a plane at an index.
    fn pixel(
        &self,
        at: usize,
        bands: usize,
        number: impl Fn(usize, usize) -> u16,
        level: impl Fn(u16) -> u8,
    ) -> Pixel {
        let colors = self.color_count();
        let band = |band: usize| {
            if self.apart {
                number(band, at)
            } else {
                number(0, at * bands + band)
            }
        };
        let numbers = if colors == 3 {
            [band(0), band(1), band(2)]
        } else {
            [band(0); 3]
        };
        let is_nothing = self.nothing.is_some_and(|nothing| numbers == [nothing; 3]);
        let alpha = match self.alpha {
            _ if is_nothing => return Pixel::default(),
            Some(_) if self.apart => level(band(colors)),
            Some(alpha) => level(band(alpha.band)),
            None => u8::MAX,
        };
        if alpha == 0 {
            return Pixel::default();
        }
        let [mut red, mut green, mut blue] = match &self.colors {
            Colors::Grey | Colors::Rgb => numbers.map(level),
            Colors::InverseGrey => numbers.map(|number| !level(number)),
            Colors::Palette(palette) => palette
                .get(usize::from(numbers[0]))
                .copied()
                .unwrap_or_default(),
        };
        if self.alpha.is_some_and(|alpha| alpha.associated) {
            let whole = |level: u8| {
                let whole = (u32::from(level) * 255 + u32::from(alpha) / 2) / u32::from(alpha);
                u8::try_from(whole).unwrap_or(u8::MAX)
            };
            [red, green, blue] = [red, green, blue].map(whole);
        }
        [red, green, blue, alpha]
    }
}

/// Refuses what cannot be read.
fn check_coding(bytes: &Bytes, coding: &Coding, bands: &Bands, count: u16) -> Result<(), DemError> {
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
    if jpeg && (bands.apart || coding.bits != 8 || !matches!(count, 1 | 3)) {
        return Err(DemError::unsupported(
            bytes.path(),
            "JPEG compression of other than grey or YCbCr",
        ));
    }
    Ok(())
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

/// A level of 16 bits as the nearest of 8.
fn to_8_bits(level: u16) -> u8 {
    u8::try_from((u32::from(level) + 128) / 257).unwrap_or(u8::MAX)
}
