//! Imagery: PNG, JPEG and TIFF as RGB pixels, with the place they show where the file says it.

use std::io::Cursor;
use std::path::Path;

use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, guess_format};

use super::DemError;
use super::bytes::Bytes;
use super::tiff::{Georef, Ifd, read_picture};
use super::world_file;
use crate::geo::{Crs, Extent};

/// The most pixels along one side of an image.
const MAX_SIDE: u64 = 1 << 17;
/// The most bytes of an image file, and of its decoded pixels.
const MAX_BYTES: u64 = 1 << 31;
/// The most bytes that one stored byte can become in the formats read.
const MAX_EXPANSION: u64 = 4096;

/// A picture of the ground, in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels from west to east.
    pub width: u32,
    /// Pixels from north to south.
    pub height: u32,
    /// Red, green and blue of every pixel, row by row, north first, as stored (sRGB as a rule).
    pub rgb: Vec<[u8; 3]>,
    /// The box around all pixels (their outer edges) in CRS coordinates, where the file says.
    pub extent: Option<Extent>,
    /// What the extent's coordinates are.
    pub crs: Crs,
}

/// Reads an image whole: PNG, JPEG or TIFF, grey or RGB, of 8 or 16 bits; 16 bits are rounded to 8, alpha is dropped.
///
/// # Errors
/// [`DemError`], naming the file and the limit.
pub fn open_image(path: &Path) -> Result<Image, DemError> {
    let bytes = Bytes::open(path)?;
    let format = guess_format(&bytes.head(32)?).ok();
    let format = match format {
        Some(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tiff)) => format,
        _ if Ifd::matches(&bytes.head(8)?) => ImageFormat::Tiff,
        _ => {
            return Err(DemError::format(
                path,
                "not an image: neither PNG nor JPEG nor TIFF",
            ));
        }
    };
    let (georef, (width, height, mut rgb)) = if format == ImageFormat::Tiff {
        let ifd = Ifd::read(&bytes)?;
        (Georef::read(&bytes, &ifd)?, read_picture(&bytes, &ifd)?)
    } else {
        let placement = world_file::find(path)?;
        (
            Georef {
                placement,
                crs: Crs::unknown(),
                vertical_unit: None,
            },
            decode(&bytes, format)?,
        )
    };
    let mut extent = None;
    if let Some(placement) = georef.placement {
        let (grid, flip) = placement.grid(path, width, height)?;
        flip.turn_pixels(width, &mut rgb);
        let half = grid.step.map(|step| 0.5 * step.abs());
        let Extent { min, max } = grid.extent();
        extent = Some(Extent {
            min: [min[0] - half[0], min[1] - half[1]],
            max: [max[0] + half[0], max[1] + half[1]],
        });
    }
    Ok(Image {
        width,
        height,
        rgb,
        extent,
        crs: georef.crs,
    })
}

/// Width, height and pixels of a PNG or JPEG.
fn decode(bytes: &Bytes, format: ImageFormat) -> Result<(u32, u32, Vec<[u8; 3]>), DemError> {
    let damaged = |error: ::image::ImageError| DemError::format(bytes.path(), error.to_string());
    let mut reader = ImageReader::with_format(Cursor::new(bytes.whole(MAX_BYTES)?), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_size(bytes, width.into(), height.into())?;
    let pixels = DynamicImage::from_decoder(decoder)
        .map_err(damaged)?
        .into_rgb8();
    Ok((width, height, pixels.into_raw().as_chunks().0.to_vec()))
}

/// Refuses images that are too large, or larger than their file can be, before memory is taken.
pub(super) fn check_size(bytes: &Bytes, width: u64, height: u64) -> Result<(), DemError> {
    if width.max(height) > MAX_SIDE {
        let what = format!("an image of {width} x {height} pixels");
        return Err(DemError::limit(
            bytes.path(),
            what,
            format!("{MAX_SIDE} pixels a side"),
        ));
    }
    let size = width * height * 3;
    if size > MAX_BYTES {
        let what = format!("an image of {width} x {height} pixels, {size} bytes,");
        return Err(DemError::limit(
            bytes.path(),
            what,
            format!("{MAX_BYTES} bytes"),
        ));
    }
    if size / MAX_EXPANSION > bytes.len() {
        let what = format!(
            "{} bytes cannot hold {width} x {height} pixels",
            bytes.len()
        );
        return Err(DemError::format(bytes.path(), what));
    }
    Ok(())
}
