//! GeoTIFF and BigTIFF elevation models, read strip by strip or tile by tile.

mod chunk;
mod geokeys;
mod georef;
mod ifd;
mod metadata;
mod picture;
mod table;

use self::chunk::Coding;
pub(super) use self::georef::Georef;
pub(super) use self::ifd::Ifd;
use self::ifd::tag;
use self::metadata::BandMetadata;
pub(super) use self::picture::read_picture;
use self::table::Table;
use super::bytes::Bytes;
use super::cache::Cache;
use super::placement::{Flip, Placement};
use super::samples::Scaling;
use super::{DemError, OpenOptions, Raster, RasterHeader, Window};

/// Void in 16-bit models that declare none: no place known lies so deep.
const UNDECLARED_VOID: f64 = -32768.0;

/// An open TIFF.
pub(super) struct Tiff {
    header: RasterHeader,
    bytes: Bytes,
    coding: Coding,
    table: Table,
    scaling: Scaling,
    flip: Flip,
    cache: Cache,
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
            source: bytes.source(),
        };
        Ok(Self {
            header,
            bytes,
            coding,
            table,
            scaling,
            flip,
            cache: Cache::new(options.cache_bytes()),
        })
    }

    /// Copies what one strip or tile has of a stored window.
    fn copy(&self, chunk: [u32; 2], window: Window, out: &mut [f64]) -> Result<(), DemError> {
        let [chunk_row, chunk_column] = chunk;
        let (rows, columns) = (self.table.chunk_rows, self.table.chunk_columns);
        let index = chunk_row as usize * self.table.across() as usize + chunk_column as usize;
        let part = match self.table.place(index) {
            Some(place) => Some(self.cache.get(index, || {
                self.table.decode(&self.bytes, &self.coding, index, place)
            })?),
            None => None,
        };
        let first = [
            u64::from(chunk_row) * u64::from(rows),
            u64::from(chunk_column) * u64::from(columns),
        ];
        let shared_rows = overlap(first[0], rows, window.row, window.rows);
        let shared_columns = overlap(first[1], columns, window.column, window.columns);
        for row in shared_rows {
            let in_window = to_usize(row - u64::from(window.row)) * window.columns as usize
                + to_usize(shared_columns.start - u64::from(window.column));
            let count = to_usize(shared_columns.end - shared_columns.start);
            let out = &mut out[in_window..in_window + count];
            let in_chunk = to_usize(row - first[0]) * columns as usize
                + to_usize(shared_columns.start - first[1]);
            match &part {
                Some(part) => part.heights(in_chunk, &self.scaling, out),
                None => out.fill(f64::NAN),
            }
        }
        Ok(())
    }
}

impl Raster for Tiff {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        if window.sample_count() == 0 {
            return Ok(());
        }
        let stored = self.flip.stored(window, &self.header.grid);
        let rows = stored.row / self.table.chunk_rows
            ..=(stored.row + stored.rows - 1) / self.table.chunk_rows;
        let first = stored.column / self.table.chunk_columns;
        let last = (stored.column + stored.columns - 1) / self.table.chunk_columns;
        for row in rows {
            for column in first..=last {
                self.copy([row, column], stored, out)?;
            }
        }
        self.flip.turn(window, out);
        Ok(())
    }
}

/// Rows (or columns) that a chunk and a window share.
fn overlap(first: u64, count: u32, window_first: u32, window_count: u32) -> std::ops::Range<u64> {
    let window_first = u64::from(window_first);
    first.max(window_first)..(first + u64::from(count)).min(window_first + u64::from(window_count))
}

/// Of numbers that are bounded by a chunk's or a buffer's length.
fn to_usize(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
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
