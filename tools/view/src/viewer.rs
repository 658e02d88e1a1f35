//! What happens in the window: the camera moves, the terrain is drawn, keys do things.

use std::{
    path::{Path as FilePath, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, Result};
use drumlin::{Pace, wgpu};
use image::RgbaImage;
use winit::{keyboard::KeyCode, window::Window};

use crate::{
    arguments::ViewArguments,
    camera::Camera,
    controls::Controls,
    data_set::DataSet,
    frames::write_png,
    path::Path,
    scene::{Debug, Scene},
    screen::Screen,
    view::Command,
};

/// The title is rewritten so often.
const TITLE_INTERVAL: Duration = Duration::from_millis(250);
/// A frame that took longer, as after a pause, moves the camera no further.
const LONGEST_STEP: f64 = 0.1;

/// A window on a terrain.
pub(crate) struct Viewer {
    screen: Screen,
    scene: Scene,
    arguments: ViewArguments,
    path: Path,
    camera: Camera,
    controls: Controls,
    debug: Debug,
    /// Seconds into the path, while it plays.
    playing: Option<f64>,
    dragging: bool,
    done: bool,
    screenshot_wanted: bool,
    clock: Clock,
}

/// Frames and their time.
struct Clock {
    start: Instant,
    last: Instant,
    frames: u64,
    /// Mean milliseconds a frame, of late.
    millis: f64,
    titled: Instant,
}

impl Viewer {
    pub(crate) fn new(screen: Screen, arguments: ViewArguments) -> Result<Self> {
        let data = DataSet::open(&arguments.terrain.pyramid)?;
        let path = Path::new(
            &data.keys(arguments.terrain.path.as_deref())?,
            &data.frame(),
        )?;
        let scene = Scene::open(
            &data,
            &screen.device,
            &screen.queue,
            screen.format(),
            &arguments.terrain,
            Pace::Paced,
        )?;
        let now = Instant::now();
        Ok(Self {
            camera: path.camera(0.0),
            controls: Controls::new(data.size_metres()),
            debug: Debug::of(&arguments.terrain),
            playing: arguments.play.then_some(0.0),
            dragging: false,
            done: false,
            screenshot_wanted: false,
            clock: Clock {
                start: now,
                last: now,
                frames: 0,
                millis: 0.0,
                titled: now,
            },
            screen,
            scene,
            arguments,
            path,
        })
    }

    pub(crate) fn window(&self) -> &Window {
        &self.screen.window
    }

    pub(crate) fn is_done(&self) -> bool {
        self.done
    }

    pub(crate) fn leave(&mut self) {
        self.done = true;
    }

    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        self.screen.resize(width, height);
    }

    pub(crate) fn release(&mut self) {
        self.controls.release();
        self.dragging = false;
    }

    pub(crate) fn drag(&mut self, on: bool) {
        self.dragging = on;
    }

    pub(crate) fn mouse_moved(&mut self, by: [f64; 2]) {
        if self.dragging {
            self.playing = None;
            self.camera = Controls::look(&self.camera, by);
        }
    }

    pub(crate) fn wheel(&mut self, notches: f64) {
        self.controls.wheel(notches);
    }

    pub(crate) fn key(&mut self, key: KeyCode, down: bool, repeat: bool) {
        if self.controls.key(key, down) {
            self.playing = self.playing.filter(|_| !down);
            return;
        }
        match Command::of(key).filter(|_| down && !repeat) {
            Some(Command::Leave) => self.done = true,
            Some(Command::Play) => {
                self.playing = if self.playing.is_some() {
                    None
                } else {
                    Some(0.0)
                }
            }
            Some(Command::Screenshot) => self.screenshot_wanted = true,
            Some(Command::Wireframe) => self.debug.wireframe ^= true,
            Some(Command::DepthColors) => self.debug.depth_colors ^= true,
            None => {}
        }
    }

    /// Draws a frame.
    pub(crate) fn frame(&mut self) -> Result<()> {
        self.advance();
        let Some(texture) = self.screen.acquire()? else {
            return Ok(());
        };
        let view = self.scene.view(
            &self.camera,
            self.screen.size(),
            self.clock.start.elapsed().as_secs_f64(),
        );
        self.scene.update(&view, self.debug)?;
        let last = self
            .arguments
            .exit_after
            .is_some_and(|count| self.clock.frames >= count);
        let picture = (self.screenshot_wanted || last).then(|| self.screen.readable_picture());
        self.draw(&texture.texture, picture.as_ref());
        self.screen.window.pre_present_notify();
        self.screen.queue.present(texture);
        if let Some(picture) = picture {
            self.save(&picture, last)?;
        }
        self.done |= last;
        self.title();
        Ok(())
    }

    fn draw(&mut self, window: &wgpu::Texture, picture: Option<&wgpu::Texture>) {
        let mut encoder = self
            .screen
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.scene
            .prepare(&self.screen.device, &self.screen.queue, &mut encoder);
        for target in [Some(window), picture].into_iter().flatten() {
            let mut pass = self.screen.pass(&mut encoder, target, Scene::background());
            self.scene.draw(&mut pass);
        }
        self.screen.queue.submit([encoder.finish()]);
    }

    /// Moves the camera by the time that has passed.
    fn advance(&mut self) {
        let seconds = self.clock.tick();
        self.camera = match &mut self.playing {
            Some(at) => {
                *at += seconds;
                self.path.camera(*at)
            }
            None => self.controls.step(&self.camera, seconds.min(LONGEST_STEP)),
        };
        self.playing = self.playing.filter(|&at| at < self.path.seconds());
    }

    fn save(&mut self, picture: &wgpu::Texture, last: bool) -> Result<()> {
        let [width, height] = self.screen.size();
        let named = self.arguments.screenshot.clone().filter(|_| last);
        if named.is_none() && !self.screenshot_wanted {
            return Ok(());
        }
        self.screenshot_wanted = false;
        let pixels = RgbaImage::from_raw(width, height, self.screen.read(picture)?)
            .context("a short picture")?;
        let file = named.unwrap_or_else(free_name);
        write_png(&file, &pixels)?;
        eprintln!("drumlin-view: wrote {}", file.display());
        Ok(())
    }

    fn title(&mut self) {
        if self.clock.titled.elapsed() < TITLE_INTERVAL {
            return;
        }
        self.clock.titled = Instant::now();
        let name = self
            .arguments
            .terrain
            .pyramid
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let report = self.scene.report();
        let triangles = report.counts.map_or(0, |counts| counts.triangles);
        let stats = &report.stats;
        let tiles = stats.tiles_drawn;
        let missing = match stats.tiles_missing {
            0 => String::new(),
            missing => format!(", {missing} missing"),
        };
        let millis = self.clock.millis;
        let speed = self.controls.speed();
        self.screen.window.set_title(&format!(
            "{name}: {millis:.1} ms, {triangles} triangles in {tiles} tiles{missing}, {speed:.0} m/s"
        ));
    }
}

impl Clock {
    /// Counts a frame; gives the seconds since the one before.
    fn tick(&mut self) -> f64 {
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        self.frames += 1;
        let weight = if self.frames < 10 { 0.5 } else { 0.1 };
        self.millis += weight * (1000.0 * seconds - self.millis);
        seconds
    }
}

/// A file name that is not taken.
fn free_name() -> PathBuf {
    let name = |number: u32| PathBuf::from(format!("drumlin_{number:04}.png"));
    (1..9999)
        .map(name)
        .find(|file: &PathBuf| !FilePath::exists(file))
        .unwrap_or_else(|| name(9999))
}
