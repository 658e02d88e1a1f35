//! OpenEXR height maps: metres in one channel, as half, float or 32-bit whole numbers.

use std::io::Cursor;

use ::exr::error::Error;
use ::exr::image::FlatSamples;
use ::exr::meta::{MetaData, header::Header};
use ::exr::prelude::{ReadChannels, ReadLayers, read};

use super::bytes::Bytes;
use super::memory::{Memory, Parts, check_size};
use super::samples::{Samples, Scaling};
use super::{DemError, OpenOptions, Raster, world_file};
use crate::geo::Crs;

/// The most bytes of an EXR file.
const MAX_FILE_BYTES: u64 = 1 << 31;
/// The most bytes that one stored byte can become.
const MAX_EXPANSION: u64 = 4096;
/// Channels that may hold heights, in order of preference; another name is taken where it is the only channel.
const CHANNELS: [&str; 5] = ["Y", "R", "Z", "height", "elevation"];

/// True when the bytes begin like an EXR.
pub(super) fn matches(head: &[u8]) -> bool {
    head.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Reads a height map.
pub(super) fn open(bytes: &Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let damaged = |error: Error| DemError::format(bytes.path(), format!("EXR: {error}"));
    let file = bytes.whole(MAX_FILE_BYTES)?;
    let meta = MetaData::read_from_buffered(Cursor::new(&file), false).map_err(damaged)?;
    let header = meta
        .headers
        .first()
        .ok_or_else(|| DemError::format(bytes.path(), "EXR: no layer"))?;
    check(bytes, header)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes();
    let image = image
        .non_parallel()
        .from_buffered(Cursor::new(&file))
        .map_err(damaged)?;
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list;
    let named = |name: &str| channels.iter().position(|channel| channel.name.eq(name));
    let only = (channels.len() == 1).then_some(0);
    let Some(index) = CHANNELS.iter().find_map(|name| named(name)).or(only) else {
        let what = format!("EXR of {} channels, none named Y, R or Z", channels.len());
        return Err(DemError::unsupported(bytes.path(), what));
    };
    let (samples, whole) = match channels
        .into_iter()
        .nth(index)
        .map(|channel| channel.sample_data)
    {
        Some(FlatSamples::F16(v)) => (
            Samples::F32(v.into_iter().map(|x| x.to_f32()).collect()),
            false,
        ),
        Some(FlatSamples::F32(v)) => (Samples::F32(v), false),
        Some(FlatSamples::U32(v)) => (Samples::U32(v), true),
        None => return Err(DemError::format(bytes.path(), "EXR: no samples")),
    };
    let side = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    let parts = Parts {
        columns: side(size.width()),
        rows: side(size.height()),
        placement: world_file::find(bytes.path())?,
        crs: Crs::unknown(),
        whole,
        scaling: Scaling::new(options.nodata, options.scale.unwrap_or(1.0), 0.0),
    };
    Memory::raster(bytes, options, parts, samples)
}

/// Refuses a data window that the file cannot fill or memory cannot hold, before any is taken.
fn check(bytes: &Bytes, header: &Header) -> Result<(), DemError> {
    let size = header.layer_size;
    let [columns, rows] = [size.width(), size.height()].map(|count| count as u64);
    let pixel_bytes = header.channels.bytes_per_pixel as u64;
    check_size(bytes.path(), columns, rows, pixel_bytes.max(4))?;
    if columns * rows * pixel_bytes / MAX_EXPANSION > bytes.len() {
        let what = format!(
            "EXR: a data window of {columns} x {rows} in a file of {} bytes",
            bytes.len()
        );
        return Err(DemError::format(bytes.path(), what));
    }
    if header
        .channels
        .list
        .iter()
        .any(|channel| channel.sampling.0 != 1 || channel.sampling.1 != 1)
    {
        return Err(DemError::unsupported(
            bytes.path(),
            "EXR: subsampled channels",
        ));
    }
    Ok(())
}
