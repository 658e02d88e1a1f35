//! `drumlin-view fly`: a flight along a path, frame by frame, drawn into pictures and measured.

use std::{
    path::Path as FilePath,
    thread::sleep,
    time::{Duration, Instant},
};

use anyhow::{Context, Result};
use drumlin::{Headless, Offscreen, wgpu};
use drumlin_terminal::{outcome::Outcome, print};

use crate::{
    adapter,
    arguments::{FlyArguments, Mode, Size},
    camera::Camera,
    cameras::Cameras,
    data_set::DataSet,
    depth_frames,
    frames::{FrameWriter, Wanted},
    path::{self, Path},
    report::{About, FrameRow, Report},
    scene::{Debug, Scene},
};

/// Frames after the last one in which its late numbers come back from the device.
const LATE_FRAMES: usize = 3;

pub(crate) fn run(arguments: &FlyArguments) -> Result<Outcome> {
    let data = DataSet::open(&arguments.terrain.pyramid)?;
    let keys = data.keys(arguments.terrain.path.as_deref())?;
    if let Some(file) = &arguments.save_path {
        std::fs::write(file, path::to_json(&keys)?).with_context(|| format!("{}: writing failed", file.display()))?;
    }
    let path = Path::new(&keys, &data.frame())?;
    let mut flight = Flight::new(arguments, &data, frame_count(&path, arguments.fps))?;
    match arguments.mode {
        Mode::Stepped => flight.stepped(&path)?,
        Mode::Paced => flight.paced(&path)?,
    }
    flight.finish(&data)
}

/// Frames of a whole path, its first and its last moment among them.
#[expect(clippy::cast_possible_truncation, reason = "a flight of 2^32 frames is cut there")]
fn frame_count(path: &Path, fps: f64) -> u32 {
    (path.seconds() * fps + 1e-6) as u32 + 1
}

/// A flight under way.
struct Flight<'a> {
    arguments: &'a FlyArguments,
    headless: Headless,
    offscreen: Offscreen,
    scene: Scene,
    frame_count: u32,
    rows: Vec<FrameRow>,
    cameras: Cameras,
    pictures: Option<FrameWriter>,
    /// Number of the terrain's frame that the first row is.
    first_frame: u64,
    bytes_read: u64,
}

impl<'a> Flight<'a> {
    fn new(arguments: &'a FlyArguments, data: &DataSet, frame_count: u32) -> Result<Self> {
        if let Some(folder) = &arguments.depth_frames {
            make_folder(folder)?;
        }
        let Size(size) = arguments.terrain.size;
        let wanted =
            Wanted { frames: arguments.frames.clone(), contact_sheet: arguments.contact_sheet.clone() };
        let headless = Headless::new()?;
        let (device, queue) = (&headless.device, &headless.queue);
        let scene = Scene::open(data, device, queue, Offscreen::COLOR_FORMAT, &arguments.terrain, arguments.wait_for_tiles)?;
        Ok(Self {
            offscreen: Offscreen::new(device, size),
            pictures: if wanted.is_empty() { None } else { Some(FrameWriter::start(wanted, frame_count)?) },
            first_frame: scene.frame_number() + 1,
            bytes_read: 0,
            arguments,
            headless,
            scene,
            frame_count,
            rows: Vec::new(),
            cameras: Cameras::new(&data.frame()),
        })
    }

    /// Every frame is 1 / fps later than the one before, however long it took.
    fn stepped(&mut self, path: &Path) -> Result<()> {
        for index in 0..self.frame_count {
            self.frame(index, &path.camera(f64::from(index) / self.arguments.fps), f64::from(index) / self.arguments.fps)?;
            self.collect_waiting()?;
        }
        Ok(())
    }

    /// Frames are due by the clock; late ones are left out.
    fn paced(&mut self, path: &Path) -> Result<()> {
        let start = Instant::now();
        let (mut index, mut drawn) = (0, 0);
        while index < self.frame_count {
            let due = Duration::from_secs_f64(f64::from(index) / self.arguments.fps);
            sleep(due.saturating_sub(start.elapsed()));
            let seconds = start.elapsed().as_secs_f64().min(path.seconds());
            self.frame(drawn, &path.camera(seconds), seconds)?;
            self.headless.device.poll(wgpu::PollType::Poll)?;
            self.collect();
            drawn += 1;
            #[expect(clippy::cast_possible_truncation, reason = "at most the number of frames")]
            let now = (start.elapsed().as_secs_f64() * self.arguments.fps) as u32;
            index = now.max(index) + 1;
        }
        Ok(())
    }

    /// Draws one frame.
    fn frame(&mut self, index: u32, camera: &Camera, seconds: f64) -> Result<()> {
        let size = self.offscreen.size();
        let view = Scene::view(camera, size, seconds);
        let start = Instant::now();
        self.scene.update(&view, Debug::default());
        let updated = start.elapsed();
        let mut encoder = self.encode();
        self.headless.queue.submit([encoder_finish(&mut encoder)]);
        let encoded = start.elapsed();
        self.push_row(seconds, [updated, encoded]);
        self.cameras.push(camera, size);
        self.save(index)
    }
}
