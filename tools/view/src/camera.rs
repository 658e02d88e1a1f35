//! A camera in the world: metres, x east, y north, z up, right-handed.
//!
//! Axes are orthonormal with `right × forward = up`. Pixel (i, j), counted from the top left, looks through its centre
//! (i + ½, j + ½).

use glam::DVec3;

/// Where the camera is and where it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera {
    pub(crate) eye: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    /// Vertical field of view in degrees.
    pub(crate) fov_y_degrees: f64,
}

impl Camera {
    /// A camera with a level horizon, at one place and looking at another; straight up or down, the picture's right is
    /// east.
    pub(crate) fn look_at(eye: DVec3, target: DVec3, fov_y_degrees: f64) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(DVec3::Y);
        let right = forward.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            fov_y_degrees,
        }
    }

    /// A camera with a level horizon from its heading (radians from north, clockwise) and its pitch (radians, up is
    /// positive).
    pub(crate) fn from_angles(eye: DVec3, [heading, pitch]: [f64; 2], fov_y_degrees: f64) -> Self {
        let (sin, cos) = heading.sin_cos();
        let level = DVec3::new(sin, cos, 0.0);
        let right = DVec3::new(cos, -sin, 0.0);
        let forward = level * pitch.cos() + DVec3::Z * pitch.sin();
        Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            fov_y_degrees,
        }
    }

    /// Heading and pitch, as [`Camera::from_angles`] takes them.
    pub(crate) fn angles(&self) -> [f64; 2] {
        let heading = f64::atan2(-self.right.y, self.right.x);
        [heading, self.forward.z.clamp(-1.0, 1.0).asin()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_orthonormal(camera: &Camera) {
        let Camera {
            right, up, forward, ..
        } = *camera;
        assert!((right.cross(forward) - up).length() < 1e-12);
        assert!((right.length() - 1.0).abs() < 1e-12 && (up.length() - 1.0).abs() < 1e-12);
        assert!(right.dot(forward).abs() < 1e-12);
    }

    #[test]
    fn looking_north_has_east_on_the_right_and_the_sky_above() {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::new(0.0, 9.0, 0.0), 45.0);
        assert_eq!(
            (camera.right, camera.up, camera.forward),
            (DVec3::X, DVec3::Z, DVec3::Y)
        );
    }

    #[test]
    fn axes_are_orthonormal_even_straight_down() {
        for target in [
            DVec3::new(3.0, -2.0, 1.0),
            DVec3::NEG_Z,
            DVec3::Z,
            DVec3::ZERO,
        ] {
            assert_orthonormal(&Camera::look_at(DVec3::ZERO, target, 45.0));
        }
    }

    #[test]
    fn angles_invert() {
        for angles in [[0.0, 0.0], [1.0, -0.5], [-2.5, 1.2], [3.0, -1.5]] {
            let camera = Camera::from_angles(DVec3::ONE, angles, 45.0);
            assert_orthonormal(&camera);
            let back = camera.angles();
            assert!((back[0] - angles[0]).abs() < 1e-9 && (back[1] - angles[1]).abs() < 1e-9);
        }
    }
}
