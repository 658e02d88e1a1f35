//! GeoTIFF and BigTIFF elevation models, read strip by strip or tile by tile.

mod chunk;
mod chunks;
mod geokeys;
mod georef;
mod ifd;
mod mask;
mod metadata;
mod picture;
mod table;

use self::chunk::Coding;
use self::chunks::Chunks;
pub(super) use self::geokeys::geo_key;
pub(super) use self::georef::Georef;
pub(super) use self::ifd::Ifd;
pub(super) use self::ifd::tag;
use self::mask::Mask;
use self::metadata::BandMetadata;
pub(super) use self::picture::Picture;
use self::table::Table;
use super::bytes::Bytes;
use super::placement::{Flip, Placement};
use super::samples::Scaling;
use super::{DemError, OpenOptions, Raster, RasterHeader, Window};

/// Void in 16-bit models that declare none: no place known lies so deep.
const UNDECLARED_VOID: f64 = -32768.0;

/// Bytes of decoded strips or tiles that are kept, if not one is more.
const CACHE_BYTES: usize = 64 << 20;

/// An open TIFF.
pub(super) struct Tiff {
    header: RasterHeader,
    bytes: Bytes,
    chunks: Chunks,
    mask: Option<Mask>,
    scaling: Scaling,
    flip: Flip,
}

impl Tiff {
    /// Reads all but the samples.
    pub(super) fn open(bytes: Bytes, options: &OpenOptions) -> Result<Self, DemError> {
        let ifd = Ifd::read(&bytes)?;
        let coding = read_coding(&bytes, &ifd)?;
        let table = Table::read(&bytes, &ifd, &coding, 1)?;
        let georef = Georef::read(&bytes, &ifd)?;
        let scaling = read_scaling(&bytes, &ifd, &coding, georef.vertical_unit, options)?;
        let placement = georef.placement.unwrap_or(Placement::unknown(options));
        let (grid, flip) = placement.grid(bytes.path(), table.width, table.height)?;
        let header = RasterHeader {
            grid,
            crs: georef.crs,
            integer: coding.is_whole() && scaling.is_whole(),
            georeferenced: georef.placement.is_some(),
            reading: scaling.label(),
            source: bytes.source(),
        };
        let mask = Mask::find(&bytes, &ifd, &table, options)?;
        let chunks = Chunks::new(coding, table, CACHE_BYTES, options);
        Ok(Self {
            header,
            bytes,
            chunks,
            mask,
            scaling,
            flip,
        })
    }
}

impl Raster for Tiff {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let size = [self.header.grid.rows, self.header.grid.columns];
        let stored = self.flip.stored(window, size);
        self.chunks.visit(&self.bytes, stored, |run| {
            let out = &mut out[run.in_window];
            match run.part {
                Some(part) => part.heights(run.in_part, &self.scaling, out),
                None => out.fill(f64::NAN),
            }
        })?;
        if let Some(mask) = &self.mask {
            mask.apply(&self.bytes, stored, f64::NAN, out)?;
        }
        self.flip.turn(window, out);
        Ok(())
    }

    fn part_shape(&self) -> [u32; 2] {
        let table = &self.chunks.table;
        [table.chunk_rows, table.chunk_columns]
    }

    fn memory_bytes(&self) -> u64 {
        let mask = self.mask.as_ref().map_or(0, Mask::memory_bytes);
        self.chunks.memory_bytes() + mask
    }

    fn read_bytes(&self, samples: u64) -> u64 {
        let mask = self
            .mask
            .as_ref()
            .map_or(0, |mask| mask.read_bytes(samples));
        self.chunks.read_bytes().max(mask)
    }
}

/// The coding of an elevation model, or why there are no heights to read.
fn read_coding(bytes: &Bytes, ifd: &Ifd) -> Result<Coding, DemError> {
    let bands = ifd.short(bytes, tag::SAMPLES, 1)?;
    if bands != 1 {
        let what = format!("{bands} bands (tag 277); an elevation model has one");
        return Err(DemError::unsupported(bytes.path(), what));
    }
    if ifd.short(bytes, tag::PHOTOMETRIC, 1)? == 3 {
        return Err(DemError::unsupported(
            bytes.path(),
            "palette colours (tag 262); heights are needed",
        ));
    }
    let coding = Coding::read(bytes, ifd, 1)?;
    match coding.unsupported() {
        Some(what) => Err(DemError::unsupported(bytes.path(), what)),
        None => Ok(coding),
    }
}

fn read_scaling(
    bytes: &Bytes,
    ifd: &Ifd,
    coding: &Coding,
    vertical_unit: Option<f64>,
    options: &OpenOptions,
) -> Result<Scaling, DemError> {
    let metadata = ifd
        .text(bytes, tag::GDAL_METADATA)?
        .map(|text| BandMetadata::parse(&text))
        .unwrap_or_default();
    let declared = ifd.text(bytes, tag::GDAL_NODATA)?;
    let undeclared = (coding.bits == 16 && coding.format == 2).then_some(UNDECLARED_VOID);
    let nodata = match &declared {
        Some(text) => metadata::nodata(text),
        None => undeclared,
    };
    let unit = metadata.unit.or(vertical_unit).unwrap_or(1.0);
    let nodata = options.nodata.or(nodata);
    let scale = metadata.scale.filter(|&scale| scale != 0.0).unwrap_or(1.0) * unit;
    let offset = metadata.offset.unwrap_or(0.0) * unit;
    Ok(Scaling::new(nodata, options.scale.unwrap_or(scale), offset))
}
