//! Elevation models and imagery: files in, heights in metres out.
//!
//! The start of the route. Knows places (`geo`) and file formats, and nothing of pyramids, tiles or screens.
//!
//! Every format becomes a [`Raster`]: a header, and windows of heights read on demand from many threads. [`open`]
//! looks at what a file holds rather than at its name. Row 0 is north and column 0 is west whatever the file says;
//! void is NaN; whole numbers of metres come out exactly.

mod ascii;
mod bytes;
mod cache;
mod dted;
mod error;
mod exr;
mod geotiff;
mod header;
mod hgt;
mod image;
mod memory;
mod mosaic;
mod placement;
mod plain;
mod png;
mod projection;
mod raw;
mod samples;
mod synth;
#[cfg(test)]
mod tests;
mod tiff;
mod units;
mod usgs;
mod wkt;
mod world_file;

use std::path::Path;

use self::bytes::Bytes;
use self::tiff::{Ifd, Tiff};
pub use error::DemError;
pub use geotiff::{Compression, GeoTiffLayout, GeoTiffWriter, TIFF_TILE, write_raster};
pub use header::{OpenOptions, RasterHeader, SourceInfo, Window};
pub use image::{Image, Pixel, open_image};
pub use mosaic::Mosaic;
pub use synth::{SPACING as SYNTH_SPACING, Synth};

/// Samples of heights, read by window; void is NaN.
pub trait Raster: Send + Sync {
    /// Where the samples are and what is known of them.
    fn header(&self) -> &RasterHeader;

    /// Reads the heights of a window in metres, row by row, north first; NaN where void.
    ///
    /// # Errors
    /// [`DemError::Window`] when the window leaves the grid or `out.len()` is not rows × columns; else what is wrong
    /// with the file at that place.
    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError>;

    /// Rows and columns of the parts that the samples are stored in: windows of whole parts read each but once.
    fn part_shape(&self) -> [u32; 2] {
        [1, self.header().grid.columns]
    }

    /// Bytes it keeps in memory at most, besides a few a part.
    fn memory_bytes(&self) -> u64;

    /// Bytes that one call of [`Self::read`] takes at most while it runs, for a window of so many samples.
    fn read_bytes(&self, _samples: u64) -> u64 {
        0
    }
}

/// Opens an elevation model of any known format, told by its content.
///
/// # Errors
/// [`DemError`], naming the file, the place in it and the limit.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    options.check(path)?;
    let bytes = Bytes::open(path)?;
    let head = bytes.head(1024)?;
    if Ifd::matches(&head) {
        return Ok(Box::new(Tiff::open(bytes, options)?));
    }
    if png::matches(&head) {
        return png::open(&bytes, options);
    }
    if exr::matches(&head) {
        return exr::open(&bytes, options);
    }
    if dted::matches(&head) {
        return dted::open(&bytes, options);
    }
    if ascii::matches(&head) {
        return ascii::open(&bytes, options);
    }
    if usgs::matches(&head) {
        return usgs::open(&bytes, options);
    }
    // These have nothing to be told by but their names and what lies beside them.
    if path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("hgt"))
    {
        return hgt::open(bytes, options);
    }
    if let Some(header) = raw::header_beside(path) {
        return raw::open(bytes, &header, options);
    }
    let known = "GeoTIFF, SRTM (.hgt), PNG, EXR, DTED, ESRI ASCII grid, USGS DEM, or .flt and .bil with .hdr";
    Err(DemError::format(
        path,
        format!("not an elevation model of a known format ({known})"),
    ))
}
