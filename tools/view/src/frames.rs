//! Pictures of a flight: PNG files and one contact sheet, written on a thread of their own so that the flight goes on.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};

use anyhow::{Context, Result, anyhow};
use image::{
    ExtendedColorType, ImageEncoder, RgbaImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
    imageops,
};

/// Pictures waiting to be written; a slow disk then holds the flight up rather than filling the memory.
const WAITING: usize = 4;
const SHEET_COLUMNS: u32 = 4;
const SHEET_ROWS: u32 = 4;
const THUMBNAIL_WIDTH: u32 = 400;

/// What to write where.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wanted {
    /// Folder for `frame_00000.png` and on.
    pub(crate) frames: Option<PathBuf>,
    /// One picture of up to sixteen frames.
    pub(crate) contact_sheet: Option<PathBuf>,
}

impl Wanted {
    /// True when no picture is asked for.
    pub(crate) const fn is_empty(&self) -> bool {
        self.frames.is_none() && self.contact_sheet.is_none()
    }
}

/// The writing thread.
pub(crate) struct FrameWriter {
    pictures: SyncSender<(u32, RgbaImage)>,
    thread: JoinHandle<Result<()>>,
}

impl FrameWriter {
    /// Starts the thread for a flight of so many frames.
    pub(crate) fn start(wanted: Wanted, frame_count: u32) -> Result<Self> {
        if let Some(folder) = &wanted.frames {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{}: making it failed", folder.display()))?;
        }
        let (pictures, inbox) = sync_channel(WAITING);
        let thread = std::thread::Builder::new()
            .name("frame writer".into())
            .spawn(move || write_all(&inbox, &wanted, frame_count))?;
        Ok(Self { pictures, thread })
    }

    /// Hands over a frame: RGBA, 8 bits, sRGB, row by row from the top.
    pub(crate) fn write(&self, index: u32, [width, height]: [u32; 2], rgba: Vec<u8>) -> Result<()> {
        let picture =
            RgbaImage::from_raw(width, height, rgba).context("a frame of the wrong size")?;
        self.pictures
            .send((index, picture))
            .map_err(|_| anyhow!("writing pictures stopped early"))
    }

    /// Waits until all is written.
    pub(crate) fn finish(self) -> Result<()> {
        drop(self.pictures);
        self.thread
            .join()
            .map_err(|_| anyhow!("the picture thread panicked"))?
    }
}

/// Writes one picture as PNG.
pub(crate) fn write_png(file: &Path, picture: &RgbaImage) -> Result<()> {
    let write = || -> Result<()> {
        let out = std::io::BufWriter::new(std::fs::File::create(file)?);
        let encoder = PngEncoder::new_with_quality(out, CompressionType::Fast, FilterType::Sub);
        // Opaque pictures need no alpha, and viewers show them alike.
        let rgb: Vec<u8> = picture
            .pixels()
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
            .collect();
        encoder.write_image(
            &rgb,
            picture.width(),
            picture.height(),
            ExtendedColorType::Rgb8,
        )?;
        Ok(())
    };
    write().with_context(|| format!("{}: writing failed", file.display()))
}

fn write_all(inbox: &Receiver<(u32, RgbaImage)>, wanted: &Wanted, frame_count: u32) -> Result<()> {
    let chosen = chosen(frame_count);
    let mut thumbnails = Vec::new();
    for (index, picture) in inbox {
        if let Some(folder) = &wanted.frames {
            write_png(&folder.join(format!("frame_{index:05}.png")), &picture)?;
        }
        if wanted.contact_sheet.is_some() && chosen.contains(&index) {
            thumbnails.push(thumbnail(&picture));
        }
    }
    wanted
        .contact_sheet
        .as_ref()
        .map_or(Ok(()), |file| write_png(file, &contact_sheet(&thumbnails)))
}

/// Frames for the sheet, first and last among them.
fn chosen(frame_count: u32) -> Vec<u32> {
    let places = (SHEET_COLUMNS * SHEET_ROWS).min(frame_count);
    (0..places)
        .map(|place| place * (frame_count - 1) / (places - 1).max(1))
        .collect()
}

fn thumbnail(picture: &RgbaImage) -> RgbaImage {
    let height = (picture.height() * THUMBNAIL_WIDTH / picture.width().max(1)).max(1);
    imageops::thumbnail(picture, THUMBNAIL_WIDTH, height)
}

fn contact_sheet(thumbnails: &[RgbaImage]) -> RgbaImage {
    let [width, height] = thumbnails
        .first()
        .map_or([1, 1], |first| [first.width(), first.height()]);
    let count = u32::try_from(thumbnails.len()).unwrap_or(u32::MAX).max(1);
    let columns = count.min(SHEET_COLUMNS);
    let mut sheet = RgbaImage::new(columns * width, count.div_ceil(SHEET_COLUMNS) * height);
    for (place, thumbnail) in (0..count).zip(thumbnails) {
        let [x, y] = [
            place % SHEET_COLUMNS * width,
            place / SHEET_COLUMNS * height,
        ];
        imageops::replace(&mut sheet, thumbnail, x.into(), y.into());
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_shows_the_first_and_the_last_frame() {
        assert_eq!(chosen(1), [0]);
        assert_eq!(chosen(3), [0, 1, 2]);
        let many = chosen(161);
        assert_eq!((many.len(), many[0], many[15]), (16, 0, 160));
        assert!(chosen(0).is_empty());
    }

    #[test]
    fn frames_and_sheet_are_written() {
        let folder = std::env::temp_dir().join(format!("drumlin-frames-{}", std::process::id()));
        let wanted = Wanted {
            frames: Some(folder.clone()),
            contact_sheet: Some(folder.join("sheet.png")),
        };
        let writer = FrameWriter::start(wanted, 5).unwrap();
        for index in 0..5 {
            writer.write(index, [8, 4], vec![40; 8 * 4 * 4]).unwrap();
        }
        writer.finish().unwrap();
        assert_eq!(
            image::image_dimensions(folder.join("frame_00004.png")).unwrap(),
            (8, 4)
        );
        assert_eq!(
            image::image_dimensions(folder.join("sheet.png")).unwrap(),
            (1600, 400)
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}
