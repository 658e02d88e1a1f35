//! Grey PNG height maps of 8 or 16 bits.

use std::io::Cursor;

use ::image::codecs::png::PngDecoder;
use ::image::{ColorType, ExtendedColorType, ImageDecoder, Limits};

use super::bytes::Bytes;
use super::memory::{Memory, Parts, check_size};
use super::samples::{SampleType, Samples, Scaling};
use super::{DemError, OpenOptions, Raster, world_file};
use crate::geo::Crs;

/// The most bytes of a PNG.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// True when the bytes begin like a PNG.
pub(super) fn matches(head: &[u8]) -> bool {
    head.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// Reads a height map.
pub(super) fn open(bytes: &Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let damaged =
        |error: ::image::ImageError| DemError::format(bytes.path(), format!("PNG: {error}"));
    let file = bytes.whole(MAX_FILE_BYTES)?;
    let decoder =
        PngDecoder::with_limits(Cursor::new(file), Limits::no_limits()).map_err(damaged)?;
    let (columns, rows) = decoder.dimensions();
    let kind = match (decoder.original_color_type(), decoder.color_type()) {
        (ExtendedColorType::L8, ColorType::L8) => SampleType::U8,
        (ExtendedColorType::L16, ColorType::L16) => SampleType::U16,
        (kind, _) => {
            let what = format!("a PNG of {kind:?}; a height map is grey, of 8 or 16 bits");
            return Err(DemError::unsupported(bytes.path(), what));
        }
    };
    check_size(
        bytes.path(),
        columns.into(),
        rows.into(),
        kind.bytes().into(),
    )?;
    check_plausible(
        bytes,
        u64::from(columns) * u64::from(rows) * u64::from(kind.bytes()),
    )?;
    let mut data = vec![0; usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX)];
    decoder.read_image(&mut data).map_err(damaged)?;
    // The decoder gives numbers in this machine's byte order.
    let samples = Samples::from_bytes(&data, kind, cfg!(target_endian = "big"));
    let parts = Parts {
        columns,
        rows,
        placement: world_file::find(bytes.path())?,
        crs: Crs::unknown(),
        whole: true,
        scaling: Scaling::new(options.nodata, options.scale.unwrap_or(1.0), 0.0),
    };
    Memory::raster(bytes, options, parts, samples)
}

/// Deflate makes at most 1,032 bytes of one.
fn check_plausible(bytes: &Bytes, size: u64) -> Result<(), DemError> {
    if size / 1100 > bytes.len() {
        let what = format!("PNG: {} bytes cannot hold an image of {size}", bytes.len());
        return Err(DemError::format(bytes.path(), what));
    }
    Ok(())
}
