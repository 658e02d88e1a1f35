//! One strip or tile of a TIFF, from its bytes to its numbers.
//!
//! The bytes are handed to the `tiff` crate as a file of their own, a TIFF of one strip. So its decompressors and
//! predictors do the work, while many threads decode at once, and the only limits are those set here.

use std::io::Cursor;

use ::tiff::{
    TiffError,
    decoder::{Decoder, DecodingResult, Limits},
};

use super::super::samples::{SampleType, Samples};
use super::super::{DemError, bytes::Bytes};
use super::ifd::{Ifd, tag};

/// How the numbers of strips and tiles are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Coding {
    pub(super) big_endian: bool,
    /// TIFF's number of the compression.
    pub(super) compression: u16,
    /// 1 none, 2 horizontal differences, 3 floating point.
    pub(super) predictor: u16,
    pub(super) bits: u16,
    /// 1 unsigned, 2 signed, 3 floating point.
    pub(super) format: u16,
    /// Numbers of one sample that lie together: 1, or the bands of an image.
    pub(super) bands: u16,
}

pub(super) const JPEG: u16 = 7;
const NONE: u16 = 1;
const LZW: u16 = 5;
const DEFLATE: u16 = 8;
const OLD_DEFLATE: u16 = 32946;
const PACK_BITS: u16 = 32773;
const ZSTD: u16 = 50000;

impl Coding {
    /// Reads it from the tags; `bands` are the numbers of a sample that lie together.
    pub(super) fn read(bytes: &Bytes, ifd: &Ifd, bands: u16) -> Result<Self, DemError> {
        if ifd.short(bytes, tag::FILL_ORDER, 1)? != 1 {
            return Err(DemError::unsupported(
                bytes.path(),
                "reversed bits (tag 266)",
            ));
        }
        let compression = ifd.short(bytes, tag::COMPRESSION, 1)?;
        // Only these have a predictor; writers leave the tag in other files, and readers pass over it.
        let predicted = matches!(compression, LZW | DEFLATE | OLD_DEFLATE | ZSTD);
        Ok(Self {
            big_endian: ifd.big_endian,
            compression,
            predictor: if predicted {
                ifd.short(bytes, tag::PREDICTOR, 1)?
            } else {
                1
            },
            bits: ifd.short(bytes, tag::BITS, 1)?,
            // Format 4 is "undefined"; everyone reads it as unsigned.
            format: match ifd.short(bytes, tag::SAMPLE_FORMAT, 1)? {
                4 => 1,
                format => format,
            },
            bands,
        })
    }

    /// Bytes of the numbers of one sample.
    pub(super) fn bytes(&self) -> u64 {
        u64::from(self.bits / 8) * u64::from(self.bands)
    }

    /// Bytes of them in memory: halves become singles.
    pub(super) fn decoded_bytes(&self) -> u64 {
        if self.format == 3 && self.bits == 16 {
            2 * self.bytes()
        } else {
            self.bytes()
        }
    }

    /// True when the numbers are whole.
    pub(super) fn is_whole(&self) -> bool {
        self.format != 3
    }

    /// True when the numbers lie in the file as they are.
    pub(super) fn is_plain(&self) -> bool {
        self.compression == NONE && self.predictor == 1
    }

    /// What cannot be read, if anything.
    pub(super) fn unsupported(&self) -> Option<String> {
        let known = match self.format {
            1 | 2 => matches!(self.bits, 8 | 16 | 32 | 64),
            3 => matches!(self.bits, 16 | 32 | 64),
            _ => false,
        };
        if !known {
            let kind = match self.format {
                1 => "unsigned integers",
                2 => "signed integers",
                3 => "floating-point numbers",
                5 | 6 => "complex numbers",
                _ => "an unknown sample format",
            };
            return Some(format!(
                "samples of {} bits, {kind} (tags 258, 339)",
                self.bits
            ));
        }
        if !matches!(
            self.compression,
            NONE | LZW | DEFLATE | OLD_DEFLATE | PACK_BITS | ZSTD
        ) {
            let name = compression_name(self.compression);
            return Some(format!(
                "{name} compression ({}, tag 259)",
                self.compression
            ));
        }
        let predictor = match self.predictor {
            1 | 2 => true,
            3 => self.format == 3,
            _ => false,
        };
        (!predictor).then(|| format!("predictor {} (tag 317) on such samples", self.predictor))
    }

    /// The most bytes that one stored byte can become.
    fn expansion(&self) -> u64 {
        match self.compression {
            NONE => 1,
            PACK_BITS => 128,
            LZW => 4096,
            DEFLATE | OLD_DEFLATE => 1100,
            _ => 1 << 20,
        }
    }

    /// Whether so many stored bytes can hold so many numbers.
    pub(super) fn is_plausible(&self, stored_bytes: u64, sample_count: u64) -> bool {
        // A few bytes of slack: codes of a fraction of a byte, headers.
        let most = stored_bytes
            .saturating_add(16)
            .saturating_mul(self.expansion());
        sample_count.saturating_mul(self.bytes()) <= most
    }

    /// The numbers of the `rows` × `columns` samples of a strip or tile.
    pub(super) fn decode(
        &self,
        stored: Vec<u8>,
        rows: u32,
        columns: u32,
    ) -> Result<Samples, String> {
        if let Some(kind) = self.plain_type() {
            return self.decode_plain(&stored, kind, rows, columns);
        }
        let size = usize::try_from(u64::from(rows) * u64::from(columns) * self.bytes())
            .map_err(|e| e.to_string())?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = size;
        limits.intermediate_buffer_size = stored.len().max(size);
        let file = Cursor::new(self.wrap(stored, rows, columns)?);
        let decoded =
            Decoder::new(file).and_then(|decoder| decoder.with_limits(limits).read_chunk(0));
        decoded.map(from_decoded).map_err(|error| message(&error))
    }

    /// The type of numbers that lie in the file as they are; the crate need not look at those.
    fn plain_type(&self) -> Option<SampleType> {
        match (self.format, self.bits) {
            _ if !self.is_plain() => None,
            (1, 8) => Some(SampleType::U8),
            (2, 8) => Some(SampleType::I8),
            (1, 16) => Some(SampleType::U16),
            (2, 16) => Some(SampleType::I16),
            (1, 32) => Some(SampleType::U32),
            (2, 32) => Some(SampleType::I32),
            (3, 32) => Some(SampleType::F32),
            (3, 64) => Some(SampleType::F64),
            _ => None,
        }
    }

    fn decode_plain(
        &self,
        stored: &[u8],
        kind: SampleType,
        rows: u32,
        columns: u32,
    ) -> Result<Samples, String> {
        let size = u64::from(rows) * u64::from(columns) * self.bytes();
        let bytes = usize::try_from(size)
            .ok()
            .and_then(|size| stored.get(..size));
        let bytes =
            bytes.ok_or_else(|| format!("{} bytes where {size} are needed", stored.len()))?;
        Ok(Samples::from_bytes(bytes, kind, self.big_endian))
    }

    /// A TIFF that holds the bytes as its only strip.
    fn wrap(&self, stored: Vec<u8>, rows: u32, columns: u32) -> Result<Vec<u8>, String> {
        let length = u32::try_from(stored.len()).map_err(|_| "longer than 4 GiB".to_owned())?;
        const TAGS: u16 = 11;
        const DATA_AT: u32 = 8 + 2 + 12 * TAGS as u32 + 4;
        // Every value is stored as a LONG; the crate takes them so.
        let tags: [(u16, u32); TAGS as usize] = [
            (256, columns),
            (257, rows),
            (258, self.bits.into()),
            (259, self.compression.into()),
            (262, 1),
            (273, DATA_AT),
            (277, self.bands.into()),
            (278, rows),
            (279, length),
            (317, self.predictor.into()),
            (339, self.format.into()),
        ];
        let put16 = |value: u16| {
            if self.big_endian {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            }
        };
        let put32 = |value: u32| {
            if self.big_endian {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            }
        };
        let mut file = Vec::with_capacity(DATA_AT as usize + stored.len());
        file.extend(if self.big_endian { *b"MM" } else { *b"II" });
        file.extend(put16(42));
        file.extend(put32(8));
        file.extend(put16(TAGS));
        for (tag, value) in tags {
            file.extend(put16(tag));
            file.extend(put16(4));
            file.extend(put32(1));
            file.extend(put32(value));
        }
        file.extend(put32(0));
        file.extend(stored);
        Ok(file)
    }
}

fn from_decoded(decoded: DecodingResult) -> Samples {
    match decoded {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::I8(v) => Samples::I8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::I16(v) => Samples::I16(v),
        DecodingResult::U32(v) => Samples::U32(v),
        DecodingResult::I32(v) => Samples::I32(v),
        DecodingResult::U64(v) => Samples::U64(v),
        DecodingResult::I64(v) => Samples::I64(v),
        DecodingResult::F16(v) => Samples::F32(v.into_iter().map(f32::from).collect()),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F64(v),
    }
}

/// What went wrong, without the crate's own words for whose fault it was.
fn message(error: &TiffError) -> String {
    match error {
        TiffError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            "its data ends too early".into()
        }
        TiffError::IoError(error) => format!("its data is damaged ({error})"),
        error => error.to_string(),
    }
}

fn compression_name(number: u16) -> &'static str {
    match number {
        2..=4 => "fax",
        6 => "old JPEG",
        7 => "JPEG",
        34887 => "LERC",
        34925 => "LZMA",
        50001 => "WebP",
        50002 => "JPEG XL",
        _ => "an unknown",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coding(compression: u16) -> Coding {
        Coding {
            big_endian: false,
            compression,
            predictor: 1,
            bits: 16,
            format: 2,
            bands: 1,
        }
    }

    #[test]
    fn a_strip_that_ends_early_is_an_error() {
        for compression in [NONE, LZW, DEFLATE, PACK_BITS, ZSTD] {
            assert!(coding(compression).decode(vec![1, 2, 3], 2, 2).is_err());
        }
    }

    #[test]
    fn half_floats_and_both_byte_orders_decode() {
        let half = Coding {
            format: 3,
            ..coding(NONE)
        };
        assert_eq!(
            half.decode(vec![0x00, 0x3c], 1, 1),
            Ok(Samples::F32(vec![1.0]))
        );
        let big = Coding {
            big_endian: true,
            ..coding(NONE)
        };
        assert_eq!(
            big.decode(vec![0xff, 0xfe], 1, 1),
            Ok(Samples::I16(vec![-2]))
        );
    }

    #[test]
    fn what_is_not_read_is_named() {
        let complex = Coding {
            format: 5,
            ..coding(NONE)
        };
        assert!(
            complex
                .unsupported()
                .is_some_and(|what| what.contains("complex"))
        );
        assert!(
            coding(34887)
                .unsupported()
                .is_some_and(|what| what.contains("LERC"))
        );
        let predictor = Coding {
            predictor: 3,
            ..coding(DEFLATE)
        };
        assert!(
            predictor
                .unsupported()
                .is_some_and(|what| what.contains("predictor 3"))
        );
    }

    #[test]
    fn a_few_bytes_cannot_hold_a_million_samples() {
        assert!(!coding(DEFLATE).is_plausible(100, 1_000_000));
        assert!(coding(DEFLATE).is_plausible(2_000, 1_000_000));
    }
}
