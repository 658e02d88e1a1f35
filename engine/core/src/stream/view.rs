//! A camera: where it is, which way it looks, how large a radian is on its screen.
//!
//! Plain arrays of `f64` outside, glam inside.

use glam::DVec3;

/// A pinhole camera in world metres. `right`, `up` and `forward` are orthonormal, right × forward = up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the camera is.
    pub eye: [f64; 3],
    /// Towards the right edge of the picture.
    pub right: [f64; 3],
    /// Towards the top of the picture.
    pub up: [f64; 3],
    /// Into the picture.
    pub forward: [f64; 3],
    /// Angle from the bottom to the top of the picture.
    pub fov_y: f64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Distance of the near plane.
    pub near: f64,
    /// When, in seconds on any clock; motion is measured by it.
    pub time: f64,
}

impl View {
    /// The usual distance of the near plane: reversed depth loses nothing by a small one.
    pub const NEAR: f64 = 0.1;

    /// A camera at `eye` that looks at `target`, upright; looking straight up or down, north is at the top.
    #[must_use]
    pub fn looking_at(
        eye: [f64; 3],
        target: [f64; 3],
        fov_y: f64,
        [width, height]: [u32; 2],
    ) -> Self {
        let forward = (DVec3::from(target) - DVec3::from(eye))
            .try_normalize()
            .unwrap_or(DVec3::Y);
        let side = forward.cross(DVec3::Z);
        let right = if side.length() < 1e-9 {
            DVec3::X
        } else {
            side.normalize()
        };
        let up = right.cross(forward);
        Self {
            eye,
            right: right.into(),
            up: up.into(),
            forward: forward.into(),
            fov_y,
            width,
            height,
            near: Self::NEAR,
            time: 0.0,
        }
    }

    /// K: pixels of a radian in the middle of the picture, and of a metre at one metre.
    #[must_use]
    pub fn pixels_per_radian(&self) -> f64 {
        f64::from(self.height.max(1)) / (2.0 * (0.5 * self.fov_y).tan())
    }

    /// Width over height.
    #[must_use]
    pub fn aspect(&self) -> f64 {
        f64::from(self.width.max(1)) / f64::from(self.height.max(1))
    }

    /// What the camera can see.
    #[must_use]
    pub fn frustum(&self) -> Frustum {
        let [right, up, forward] = [self.right, self.up, self.forward].map(DVec3::from);
        let tan_y = (0.5 * self.fov_y).tan();
        let tan_x = tan_y * self.aspect();
        Frustum {
            eye: self.eye.into(),
            planes: [
                right + tan_x * forward,
                -right + tan_x * forward,
                up + tan_y * forward,
                -up + tan_y * forward,
            ],
        }
    }

    /// True when the numbers make a camera: finite, with an opening angle and a screen.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let numbers = [self.eye, self.right, self.up, self.forward].concat();
        numbers.iter().all(|number| number.is_finite())
            && self.fov_y > 0.0
            && self.fov_y < std::f64::consts::PI
            && self.width > 0
            && self.height > 0
            && self.near > 0.0
    }
}

/// The pyramid of space a camera sees: four planes through the eye, normals inward, no far end.
///
/// No near plane: the four half spaces have nothing behind the eye in common.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    eye: DVec3,
    planes: [DVec3; 4],
}

impl Frustum {
    /// False only when the box is wholly outside; a few boxes near the edges are let through.
    #[must_use]
    pub fn sees(&self, bounds: &Bounds) -> bool {
        let (low, high) = (
            DVec3::from(bounds.min) - self.eye,
            DVec3::from(bounds.max) - self.eye,
        );
        self.planes
            .iter()
            .all(|plane| plane.dot(DVec3::select(plane.cmpge(DVec3::ZERO), high, low)) >= 0.0)
    }
}

/// A box in world metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// West, south, bottom.
    pub min: [f64; 3],
    /// East, north, top.
    pub max: [f64; 3],
}

impl Bounds {
    /// Metres from a point to the nearest point of the box; 0 inside.
    #[must_use]
    pub fn distance(&self, point: [f64; 3]) -> f64 {
        let point = DVec3::from(point);
        (DVec3::from(self.min) - point)
            .max(point - DVec3::from(self.max))
            .max(DVec3::ZERO)
            .length()
    }

    /// Pixels of the rectangle around the box on the screen, cut at the screen's edges; the whole screen when the box
    /// reaches behind the camera.
    #[must_use]
    pub fn screen_area(&self, view: &View) -> f64 {
        let [eye, right, up, forward] =
            [view.eye, view.right, view.up, view.forward].map(DVec3::from);
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for corner in 0..8 {
            let pick = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            };
            let ray = DVec3::new(pick(0), pick(1), pick(2)) - eye;
            let depth = ray.dot(forward);
            if depth <= view.near {
                return width * height;
            }
            let scale = view.pixels_per_radian() / depth;
            let place = [
                0.5 * width + ray.dot(right) * scale,
                0.5 * height - ray.dot(up) * scale,
            ];
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        let side = |axis: usize, size: f64| (high[axis].min(size) - low[axis].max(0.0)).max(0.0);
        side(0, width) * side(1, height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(centre: [f64; 3]) -> Bounds {
        Bounds {
            min: centre.map(|at| at - 1.0),
            max: centre.map(|at| at + 1.0),
        }
    }

    #[test]
    fn right_cross_forward_is_up() {
        for target in [[5.0, 1.0, 0.0], [0.0, 0.0, -9.0], [-1.0, -2.0, 3.0]] {
            let view = View::looking_at([0.0; 3], target, 1.0, [640, 480]);
            let cross = DVec3::from(view.right).cross(view.forward.into());
            assert!((cross - DVec3::from(view.up)).length() < 1e-12);
            assert!(view.is_valid());
        }
    }

    #[test]
    fn what_is_in_front_is_seen_and_what_is_behind_is_not() {
        let frustum = View::looking_at([0.0; 3], [0.0, 1.0, 0.0], 1.0, [100, 100]).frustum();
        assert!(frustum.sees(&cube([0.0, 50.0, 0.0])));
        assert!(frustum.sees(&cube([0.0, 0.0, 0.0])));
        assert!(!frustum.sees(&cube([0.0, -50.0, 0.0])));
        assert!(!frustum.sees(&cube([60.0, 50.0, 0.0])));
        assert!(!frustum.sees(&cube([0.0, 50.0, -60.0])));
    }

    #[test]
    fn distance_is_to_the_nearest_point() {
        assert_eq!(cube([0.0; 3]).distance([4.0, 5.0, 0.5]), 5.0);
        assert_eq!(cube([0.0; 3]).distance([0.5, 0.0, -1.0]), 0.0);
    }

    #[test]
    fn a_box_covers_its_rectangle() {
        let view = View::looking_at(
            [0.0; 3],
            [0.0, 1.0, 0.0],
            std::f64::consts::FRAC_PI_2,
            [200, 200],
        );
        let area = cube([0.0, 11.0, 0.0]).screen_area(&view);
        assert!((area - 400.0).abs() < 1e-9);
    }
}
