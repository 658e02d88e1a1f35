//! The cameras of a flight, for whoever wants to measure its pictures.
//!
//! JSON: `{"world_from_crs": [[a, b, c], [d, e, f]], "frames": [{"eye": [x, y, z], "right": [..], "up": [..],
//! "forward": [..], "fov_y": degrees, "width": px, "height": px}]}`, f64 in full.

use std::path::Path;

use anyhow::{Context, Result};
use drumlin_core::geo::WorldFrame;
use serde::Serialize;

use crate::camera::Camera;

/// The cameras of a flight, frame by frame.
#[derive(Debug, Serialize)]
pub(crate) struct Cameras {
    world_from_crs: [[f64; 3]; 2],
    frames: Vec<CameraRow>,
}

#[derive(Debug, Serialize)]
struct CameraRow {
    eye: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    forward: [f64; 3],
    fov_y: f64,
    width: u32,
    height: u32,
}

impl Cameras {
    /// No frames yet.
    pub(crate) fn new(frame: &WorldFrame) -> Self {
        Self {
            world_from_crs: frame.world_from_crs,
            frames: Vec::new(),
        }
    }

    /// Adds a frame.
    pub(crate) fn push(&mut self, camera: &Camera, [width, height]: [u32; 2]) {
        self.frames.push(CameraRow {
            eye: camera.eye.to_array(),
            right: camera.right.to_array(),
            up: camera.up.to_array(),
            forward: camera.forward.to_array(),
            fov_y: camera.fov_y_degrees,
            width,
            height,
        });
    }

    /// Writes the file.
    pub(crate) fn write(&self, file: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        std::fs::write(file, text).with_context(|| format!("{}: writing failed", file.display()))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn a_frame_is_written_as_documented() {
        let frame = WorldFrame {
            world_from_crs: [[2.0, 0.0, 1.0], [0.0, 3.0, 4.0]],
        };
        let mut cameras = Cameras::new(&frame);
        cameras.push(&Camera::look_at(DVec3::ZERO, DVec3::Y, 45.0), [640, 360]);
        let value: Value = serde_json::to_value(&cameras).unwrap();
        let expected = json!({
            "world_from_crs": [[2.0, 0.0, 1.0], [0.0, 3.0, 4.0]],
            "frames": [{
                "eye": [0.0, 0.0, 0.0], "right": [1.0, 0.0, 0.0], "up": [0.0, 0.0, 1.0], "forward": [0.0, 1.0, 0.0],
                "fov_y": 45.0, "width": 640, "height": 360,
            }],
        });
        assert_eq!(value, expected);
    }
}
