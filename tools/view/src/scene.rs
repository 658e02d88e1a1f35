//! A terrain on a device, with the looks this program gives it: sky, haze, and what the debug keys show.

use std::path::PathBuf;

use anyhow::Result;
use drumlin::{
    FrameReport, Look, Pace, TargetFormats, Terrain, TerrainDescriptor, TerrainSource, View, wgpu,
};
use drumlin_core::pyramid::PyramidError;

use crate::{arguments::TerrainArguments, camera::Camera, data_set::DataSet, sky::Sky};

/// The colour of the sky at the horizon, and of haze: linear red, green, blue.
pub(crate) const SKY: [f32; 3] = [0.47, 0.63, 0.83];
/// Near planes are this much of the data set's size.
const NEAR: f64 = 1e-6;

/// What debug keys turn on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Debug {
    pub(crate) wireframe: bool,
    pub(crate) depth_colors: bool,
}

impl Debug {
    /// What the command line turns on.
    pub(crate) const fn of(arguments: &TerrainArguments) -> Self {
        Self {
            wireframe: arguments.wireframe,
            depth_colors: arguments.depth_colors,
        }
    }
}

/// A terrain on a device.
pub(crate) struct Scene {
    terrain: Terrain,
    report: FrameReport,
    sky: Sky,
    view: Option<View>,
    size: f64,
    frames: u64,
    pyramid: PathBuf,
    is_complete: bool,
}

impl Scene {
    /// Opens a terrain that draws into pictures of a format, beside a depth buffer.
    pub(crate) fn open(
        data: &DataSet,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        color: wgpu::TextureFormat,
        arguments: &TerrainArguments,
        pace: Pace,
    ) -> Result<Self> {
        let depth = wgpu::TextureFormat::Depth32Float;
        let descriptor = TerrainDescriptor {
            formats: TargetFormats {
                color,
                depth,
                ..TargetFormats::default()
            },
            ram_budget_bytes: arguments.ram_budget,
            vram_budget_bytes: arguments.vram_budget,
            error_px: arguments.error_px,
            uniform_depth: arguments.uniform_depth.then_some(2),
            pace,
            ..TerrainDescriptor::with_source(TerrainSource::Tiles(data.source.clone()))
        };
        Ok(Self {
            terrain: Terrain::new(device, queue, descriptor)?,
            report: FrameReport::default(),
            sky: Sky::new(device, color),
            view: None,
            size: data.size_metres(),
            frames: 0,
            pyramid: arguments.pyramid.clone(),
            is_complete: pace == Pace::Complete,
        })
    }

    /// The camera as the terrain takes it, at a moment in seconds.
    pub(crate) fn view(&self, camera: &Camera, [width, height]: [u32; 2], seconds: f64) -> View {
        View {
            eye: camera.eye.into(),
            right: camera.right.into(),
            up: camera.up.into(),
            forward: camera.forward.into(),
            fov_y: camera.fov_y_degrees.to_radians(),
            width,
            height,
            near: (NEAR * self.size).clamp(1e-3, 1.0),
            time: seconds,
        }
    }

    /// Chooses what is drawn for a view, and tells what went wrong.
    ///
    /// # Errors
    /// Where every frame shall be complete and this one cannot be: a tile or its picture could not be read, time and
    /// again, or a feature has no mesh.
    pub(crate) fn update(&mut self, view: &View, debug: Debug) -> Result<(), PyramidError> {
        let Debug {
            wireframe,
            depth_colors,
        } = debug;
        self.terrain.set_look(Look {
            sky: SKY,
            draw_voids: true,
            wireframe,
            depth_colors,
            ..Look::default()
        });
        self.view = Some(*view);
        self.report = self.terrain.update(view);
        let FrameReport { stats, errors, .. } = &self.report;
        if self.is_complete && stats.given_up + stats.features_refused > 0 {
            return Err(PyramidError::Invalid {
                path: self.pyramid.clone(),
                what: format!("a frame must go without: {}", errors.join("; ")),
            });
        }
        for error in errors {
            eprintln!("drumlin-view: {error}");
        }
        Ok(())
    }

    /// Encodes the update's uploads and stages.
    pub(crate) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        if let Some(view) = &self.view {
            self.sky.prepare(queue, view);
        }
        self.terrain.prepare(device, queue, encoder);
        self.frames += 1;
    }

    /// Draws into a pass of the formats it was opened for.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.terrain.draw(pass);
        self.sky.draw(pass);
    }

    /// Draws distances along the view axis.
    pub(crate) fn draw_distances(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.terrain.draw_distances(pass);
    }

    /// What the pass that draws may write its times to.
    pub(crate) fn pass_times(&mut self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.terrain.pass_times()
    }

    /// What is behind the terrain: linear red, green, blue, and 1.
    pub(crate) fn background() -> [f64; 4] {
        let [r, g, b] = SKY.map(f64::from);
        [r, g, b, 1.0]
    }

    /// What the last update came to, with numbers of earlier frames that have come back from the device.
    pub(crate) fn report(&self) -> &FrameReport {
        &self.report
    }

    /// Frames prepared so far: the terrain's number of the latest.
    pub(crate) fn frame_number(&self) -> u64 {
        self.frames
    }
}
