//! The view as the GPU gets it.

use glam::{DMat4, DVec3};

use super::PoolSizes;
use crate::{
    pyramid::Metadata,
    reference::shared::{Frame, NONE},
    stream::View,
};

/// What of a frame does not depend on its camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameBase {
    unit: f32,
    height_range: [f32; 2],
    index_capacity: u32,
    uniform_depth: u32,
}

impl FrameBase {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "heights and units are f32 on the GPU"
    )]
    pub(super) fn new(metadata: &Metadata, pool: &PoolSizes, uniform_depth: Option<u32>) -> Self {
        let unit = metadata.unit();
        Self {
            unit: unit as f32,
            height_range: metadata
                .height_range
                .map(|height| (f64::from(height) * unit) as f32),
            index_capacity: pool.index_capacity,
            uniform_depth: uniform_depth.unwrap_or(NONE),
        }
    }

    /// A frame of a view, lit from the north-west as maps are, without haze: looks are the caller's.
    #[expect(clippy::cast_possible_truncation, reason = "pixels are f32 on the GPU")]
    pub(super) fn frame(&self, view: &View, tolerance: f64, drawn_count: usize) -> Frame {
        let mut frame = Frame {
            clip_from_view_world: [[0.0; 4]; 4],
            viewport: [0.0; 2],
            pixels_per_radian: 0.0,
            tolerance: tolerance as f32,
            unit: self.unit,
            drawn_count: drawn_count as u32,
            index_capacity: self.index_capacity,
            uniform_depth: self.uniform_depth,
            sun: DVec3::new(-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2)
                .as_vec3()
                .to_array(),
            haze: 0.0,
            sky: [0.35, 0.53, 0.78],
            flags: 0,
            height_range: self.height_range,
            camera_height: 0.0,
            color_fade: 0.0,
        };
        point(&mut frame, view);
        frame
    }
}

/// Sets all that depends on the camera.
#[expect(
    clippy::cast_possible_truncation,
    reason = "pixels and metres are f32 on the GPU"
)]
pub(super) fn point(frame: &mut Frame, view: &View) {
    frame.clip_from_view_world = clip_from_view_world(view);
    frame.viewport = [view.width as f32, view.height as f32];
    frame.pixels_per_radian = view.pixels_per_radian() as f32;
    frame.camera_height = view.eye[2] as f32;
}

/// Camera-relative world metres to clip space: depth 1 at the near plane, 0 at infinity.
fn clip_from_view_world(view: &View) -> [[f32; 4]; 4] {
    let [right, up, forward] = [view.right, view.up, view.forward].map(DVec3::from);
    let scale_y = 1.0 / (0.5 * view.fov_y).tan();
    let rows = DMat4::from_cols(
        (scale_y / view.aspect() * right).extend(0.0),
        (scale_y * up).extend(0.0),
        DVec3::ZERO.extend(view.near),
        forward.extend(0.0),
    );
    rows.transpose().as_mat4().to_cols_array_2d()
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3};

    use super::*;

    #[test]
    fn near_is_one_far_is_zero_and_the_edges_are_where_the_angles_say() {
        let view = View::looking_at([5.0, 6.0, 7.0], [5.0, 9.0, 3.0], 1.2, [800, 600]);
        let clip = Mat4::from_cols_array_2d(&clip_from_view_world(&view));
        let [right, up, forward] =
            [view.right, view.up, view.forward].map(|axis| DVec3::from(axis).as_vec3());
        let tan = 0.6f32.tan();
        let near = clip.project_point3(forward * 0.1);
        assert!((near - Vec3::Z).length() < 1e-5);
        let corner = clip.project_point3(forward * 1e6 + 1e6 * tan * (up + right * 4.0 / 3.0));
        assert!((corner - Vec3::new(1.0, 1.0, 0.0)).length() < 1e-4);
    }
}
