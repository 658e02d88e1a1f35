//! Imagery: PNG, JPEG and TIFF as pixels of RGB and alpha, with the place they show where the file says it.

use std::io::Cursor;
use std::path::Path;

use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, guess_format};

use super::bytes::Bytes;
use super::placement::{Flip, Placement};
use super::tiff::{Georef, Ifd, Picture};
use super::{DemError, OpenOptions, Window, world_file};
use crate::geo::{Crs, Extent};

/// The most pixels along one side of an image that is read whole.
const MAX_SIDE: u64 = 1 << 17;
/// The most bytes of an image file, and of its decoded pixels.
const MAX_BYTES: u64 = 1 << 31;
/// The most bytes that one stored byte can become in the formats read.
const MAX_EXPANSION: u64 = 4096;

/// A picture of the ground, read by window from any number of threads.
pub struct Image {
    /// Pixels from west to east.
    pub width: u32,
    /// Pixels from north to south.
    pub height: u32,
    /// The box around all pixels (their outer edges) in CRS coordinates, where the file says.
    pub extent: Option<Extent>,
    /// What the extent's coordinates are.
    pub crs: Crs,
    name: String,
    pixels: Pixels,
}

/// A pixel as it is stored: red, green, blue (sRGB as a rule, not multiplied with alpha), and alpha, 0 where there is
/// nothing.
pub type Pixel = [u8; 4];

/// Where the pixels are.
enum Pixels {
    /// In memory, row by row, north first.
    Memory(Vec<Pixel>),
    /// In a TIFF, which is read strip by strip or tile by tile.
    Tiff(Box<Picture>, Flip),
}

impl Image {
    /// A picture in memory, its pixels row by row, north first; without an extent it says nothing of where it lies.
    ///
    /// # Errors
    /// [`DemError::Unsupported`] unless there are `width` × `height` pixels, one at least.
    pub fn from_pixels(
        width: u32,
        height: u32,
        pixels: Vec<Pixel>,
        extent: Option<Extent>,
    ) -> Result<Self, DemError> {
        let name = "a picture in memory";
        if pixels.is_empty() || pixels.len() as u64 != u64::from(width) * u64::from(height) {
            let what = format!("{} pixels for {width} x {height}", pixels.len());
            return Err(DemError::unsupported(Path::new(name), what));
        }
        Ok(Self {
            width,
            height,
            extent,
            crs: Crs::unknown(),
            name: name.into(),
            pixels: Pixels::Memory(pixels),
        })
    }

    /// Reads a window's pixels, row by row, north first.
    ///
    /// # Errors
    /// [`DemError::Window`] when the window leaves the picture or `out.len()` is not rows × columns; else what is wrong
    /// with the file at that place.
    pub fn read(&self, window: Window, out: &mut [Pixel]) -> Result<(), DemError> {
        window.check([self.height, self.width], out.len(), &self.name)?;
        match &self.pixels {
            Pixels::Memory(pixels) => {
                let columns = window.columns as usize;
                for (row, line) in (window.row as usize..).zip(out.chunks_exact_mut(columns.max(1)))
                {
                    let first = row * self.width as usize + window.column as usize;
                    line.copy_from_slice(&pixels[first..first + columns]);
                }
                Ok(())
            }
            Pixels::Tiff(picture, flip) => {
                picture.read(flip.stored(window, [self.height, self.width]), out)?;
                flip.turn(window, out);
                Ok(())
            }
        }
    }

    /// Rows and columns of the parts that the pixels are stored in.
    #[must_use]
    pub fn part_shape(&self) -> [u32; 2] {
        match &self.pixels {
            Pixels::Memory(_) => [1, 1],
            Pixels::Tiff(picture, _) => picture.part_shape(),
        }
    }

    /// Bytes it keeps in memory at most, besides a few a part.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        match &self.pixels {
            Pixels::Memory(pixels) => size_of_val(&**pixels) as u64,
            Pixels::Tiff(picture, _) => picture.memory_bytes(),
        }
    }

    /// Bytes that one call of [`Self::read`] takes at most while it runs, for a window of so many pixels.
    #[must_use]
    pub fn read_bytes(&self, pixels: u64) -> u64 {
        match &self.pixels {
            Pixels::Memory(_) => 0,
            Pixels::Tiff(picture, _) => picture.read_bytes(pixels),
        }
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            width,
            height,
            name,
            ..
        } = self;
        write!(f, "Image({name}, {width} x {height})")
    }
}

/// Opens an image: PNG, JPEG or TIFF, grey or RGB, of 8 or 16 bits; 16 bits are rounded to 8.
///
/// A TIFF's strips or tiles are read when a window asks for them, the others are read whole. Of the options, only
/// `cache_bytes` matters here. Where a TIFF has a mask or says which value means nothing, alpha is 0 there.
///
/// # Errors
/// [`DemError`], naming the file and the limit.
pub fn open_image(path: &Path, options: &OpenOptions) -> Result<Image, DemError> {
    let bytes = Bytes::open(path)?;
    let name = bytes.source().name;
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
    if format == ImageFormat::Tiff {
        let ifd = Ifd::read(&bytes)?;
        let georef = Georef::read(&bytes, &ifd)?;
        let picture = Picture::open(bytes, &ifd, options)?;
        let [height, width] = picture.size();
        let (extent, flip) = place(path, georef.placement, [height, width])?;
        return Ok(Image {
            width,
            height,
            extent,
            crs: georef.crs,
            name,
            pixels: Pixels::Tiff(picture.into(), flip),
        });
    }
    let (width, height, mut pixels) = decode(&bytes, format)?;
    let (extent, flip) = place(path, world_file::find(path)?, [height, width])?;
    let whole = Window {
        row: 0,
        column: 0,
        rows: height,
        columns: width,
    };
    flip.turn(whole, &mut pixels);
    Ok(Image {
        width,
        height,
        extent,
        crs: Crs::unknown(),
        name,
        pixels: Pixels::Memory(pixels),
    })
}

/// The box around all pixels, where the file says it, and how they are stored.
fn place(
    path: &Path,
    placement: Option<Placement>,
    [height, width]: [u32; 2],
) -> Result<(Option<Extent>, Flip), DemError> {
    let Some(placement) = placement else {
        return Ok((None, Flip::default()));
    };
    let (grid, flip) = placement.grid(path, width, height)?;
    let half = grid.step.map(|step| 0.5 * step.abs());
    let Extent { min, max } = grid.extent();
    let extent = Extent {
        min: [min[0] - half[0], min[1] - half[1]],
        max: [max[0] + half[0], max[1] + half[1]],
    };
    Ok((Some(extent), flip))
}

/// Width, height and pixels of a PNG or JPEG.
fn decode(bytes: &Bytes, format: ImageFormat) -> Result<(u32, u32, Vec<Pixel>), DemError> {
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
        .into_rgba8();
    Ok((width, height, pixels.into_raw().as_chunks().0.to_vec()))
}

/// Refuses images that are too large, or larger than their file can be, before memory is taken.
fn check_size(bytes: &Bytes, width: u64, height: u64) -> Result<(), DemError> {
    if width.max(height) > MAX_SIDE {
        let what = format!("an image of {width} x {height} pixels");
        return Err(DemError::limit(
            bytes.path(),
            what,
            format!("{MAX_SIDE} pixels a side"),
        ));
    }
    let size = width * height * size_of::<Pixel>() as u64;
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
