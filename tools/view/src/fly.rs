//! `drumlin-view fly`: a flight along a path, frame by frame, drawn into pictures and measured.

use std::{
    path::Path as FilePath,
    thread::sleep,
    time::{Duration, Instant},
};

use anyhow::{Context, Result};
use drumlin::{Headless, Offscreen, Pace, View, wgpu};
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
    start::Start,
    stopwatch::{Span, Stopwatch},
};

/// Frames after the last one in which its late numbers come back from the device.
const LATE_FRAMES: usize = 4;

/// Flies; `process_start` is where the wait for the first picture is counted from.
pub(crate) fn run(arguments: &FlyArguments, process_start: Instant) -> Result<Outcome> {
    let data = DataSet::open(&arguments.terrain.pyramid)?;
    let keys = data.keys(arguments.terrain.path.as_deref())?;
    if let Some(file) = &arguments.save_path {
        std::fs::write(file, path::to_json(&keys)?)
            .with_context(|| format!("{}: writing failed", file.display()))?;
    }
    if let Some(folder) = &arguments.depth_frames {
        make_folder(folder)?;
    }
    let path = Path::new(&keys, &data.frame())?;
    let count = frame_count(&path, arguments.fps);
    let mut flight = Flight::new(arguments, &data, count, process_start)?;
    match arguments.mode {
        Mode::Stepped => flight.stepped(&path)?,
        Mode::Paced => flight.paced(&path)?,
    }
    flight.finish(&data)
}

/// Frames of a whole path, its first and its last moment among them.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a flight of 2^32 frames is cut there"
)]
fn frame_count(path: &Path, fps: f64) -> u32 {
    (path.seconds() * fps + 1e-6) as u32 + 1
}

fn pace(arguments: &FlyArguments) -> Pace {
    match arguments.mode {
        _ if arguments.wait_for_tiles => Pace::Complete,
        Mode::Stepped => Pace::Stepped,
        Mode::Paced => Pace::Paced,
    }
}

/// A flight under way.
struct Flight<'a> {
    arguments: &'a FlyArguments,
    start: Start,
    headless: Headless,
    offscreen: Offscreen,
    scene: Scene,
    frame_count: u32,
    rows: Vec<FrameRow>,
    cameras: Cameras,
    pictures: Option<FrameWriter>,
    /// The terrain's number of each row's frame, rising.
    frame_numbers: Vec<u64>,
    bytes_read: u64,
    last_view: Option<View>,
}

impl<'a> Flight<'a> {
    fn new(
        arguments: &'a FlyArguments,
        data: &DataSet,
        frame_count: u32,
        process_start: Instant,
    ) -> Result<Self> {
        let Size(size) = arguments.terrain.size;
        let wanted = Wanted {
            frames: arguments.frames.clone(),
            contact_sheet: arguments.contact_sheet.clone(),
        };
        let (headless, start) = Start::with_device(process_start)?;
        let (device, queue) = (&headless.device, &headless.queue);
        let scene = Scene::open(
            data,
            device,
            queue,
            Offscreen::COLOR_FORMAT,
            &arguments.terrain,
            pace(arguments),
        )?;
        Ok(Self {
            offscreen: Offscreen::new(device, size),
            pictures: if wanted.is_empty() {
                None
            } else {
                Some(FrameWriter::start(wanted, frame_count)?)
            },
            frame_numbers: Vec::new(),
            bytes_read: 0,
            last_view: None,
            arguments,
            start,
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
            let seconds = f64::from(index) / self.arguments.fps;
            self.frame(index, &path.camera(seconds), seconds)?;
            // Every frame's numbers then come back with one of the next updates.
            self.headless.finish()?;
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
            drawn += 1;
            #[expect(
                clippy::cast_possible_truncation,
                reason = "at most the number of frames"
            )]
            let now = (start.elapsed().as_secs_f64() * self.arguments.fps) as u32;
            index = now.max(index) + 1;
        }
        Ok(())
    }

    /// Draws one frame.
    fn frame(&mut self, index: u32, camera: &Camera, seconds: f64) -> Result<()> {
        let size = self.offscreen.size();
        let view = self.scene.view(camera, size, seconds);
        self.last_view = Some(view);
        let mut watch = Stopwatch::start();
        self.scene
            .update(&view, Debug::of(&self.arguments.terrain))?;
        let update = watch.lap();
        self.collect();
        let commands = self.encode();
        let encode = watch.lap();
        self.headless.queue.submit([commands]);
        self.add_row(seconds, [update, encode, watch.lap()]);
        self.note_first_picture()?;
        self.cameras.push(camera, size);
        self.save(index)
    }

    fn encode(&mut self) -> wgpu::CommandBuffer {
        let Headless { device, queue, .. } = &self.headless;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.scene.prepare(device, queue, &mut encoder);
        let times = self.scene.pass_times();
        let mut pass = self
            .offscreen
            .color_pass(&mut encoder, Scene::background(), times);
        self.scene.draw(&mut pass);
        drop(pass);
        if self.arguments.depth_frames.is_some() {
            self.scene
                .draw_distances(&mut self.offscreen.distance_pass(&mut encoder));
        }
        encoder.finish()
    }

    fn add_row(&mut self, t: f64, spans: [Span; 3]) {
        let report = self.scene.report();
        let stats = &report.stats;
        self.rows.push(FrameRow {
            t,
            tiles_resident: stats.slots_used.into(),
            tiles_drawn: stats.tiles_drawn as u64,
            tiles_missing: stats.tiles_missing as u64,
            missing_share: stats.missing_share,
            bytes_read: stats.bytes_read - self.bytes_read,
            bytes_uploaded: stats.uploaded_bytes,
            ram_bytes: stats.ram_bytes,
            vram_bytes: report.vram_bytes,
            error_px: stats.tolerance_px,
            ..FrameRow::timed(spans)
        });
        self.bytes_read = stats.bytes_read;
        self.frame_numbers.push(self.scene.frame_number());
    }

    /// Waits for the first frame with terrain, once a flight, and says when it was there.
    fn note_first_picture(&mut self) -> Result<()> {
        if !self.start.is_over() && self.scene.report().stats.tiles_drawn > 0 {
            self.headless.finish()?;
            self.start.end();
        }
        Ok(())
    }

    /// Reads the pictures back, where they are wanted.
    fn save(&mut self, index: u32) -> Result<()> {
        let Headless { device, queue, .. } = &self.headless;
        let size = self.offscreen.size();
        if let Some(pictures) = &self.pictures {
            pictures.write(index, size, self.offscreen.read_color(device, queue)?)?;
        }
        if let Some(folder) = &self.arguments.depth_frames {
            let metres = self.offscreen.read_distance(device, queue)?;
            depth_frames::write(&depth_frames::file(folder, index), size, &metres)?;
        }
        Ok(())
    }

    /// Puts numbers that have come back from the device into the rows of their frames.
    fn collect(&mut self) {
        let (counts, times) = (self.scene.report().counts, self.scene.report().gpu_times);
        if let Some((counts, row)) =
            counts.and_then(|counts| Some((counts, self.row(counts.frame)?)))
        {
            row.triangles = counts.triangles.into();
            row.patches.regular = counts.regular_patches.map(u64::from);
            row.patches.transition = counts.transition_patches.map(u64::from);
        }
        if let Some((times, row)) = times.and_then(|times| Some((times, self.row(times.frame)?))) {
            let passes = [times.refine_millis, times.pass_millis];
            let passes: f64 = passes.into_iter().flatten().sum();
            row.gpu_millis = Some(times.stages_millis + passes);
            row.gpu_refine_millis = times.refine_millis;
        }
    }

    /// The row of a frame of the terrain's.
    fn row(&mut self, frame: u64) -> Option<&mut FrameRow> {
        let index = self.frame_numbers.binary_search(&frame).ok()?;
        self.rows.get_mut(index)
    }

    /// Waits for late numbers, and writes what was asked for.
    fn finish(mut self, data: &DataSet) -> Result<Outcome> {
        if let Some(view) = self.last_view {
            for _ in 0..LATE_FRAMES {
                self.headless.finish()?;
                self.scene.update(&view, Debug::default())?;
                self.collect();
                let commands = self.encode();
                self.headless.queue.submit([commands]);
            }
        }
        if let Some(pictures) = self.pictures.take() {
            pictures.finish()?;
        }
        if let Some(file) = &self.arguments.cameras {
            self.cameras.write(file)?;
        }
        let report = Report::new(self.about(data)?, self.rows)?;
        if let Some(file) = &self.arguments.report {
            report.write(file)?;
        }
        print(&report.lines())?;
        Ok(Outcome::Done)
    }

    fn about(&self, data: &DataSet) -> Result<About> {
        Ok(About {
            adapter: adapter::name(&self.headless.adapter),
            driver: adapter::driver(&self.headless.adapter),
            commit: env!("DRUMLIN_COMMIT"),
            data_set: data.describe(),
            settings: serde_json::to_value(self.arguments)?,
            start: self.start,
        })
    }
}

fn make_folder(folder: &FilePath) -> Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: making it failed", folder.display()))
}
