//! The camera's path: stations over the ground, high, low and high again, at 1080p.

use drumlin_core::stream::View;
use glam::DVec3;

/// Pixels of the picture.
pub(crate) const SIZE: [u32; 2] = [1920, 1080];
const FOV_Y: f64 = 45.0 / 180.0 * std::f64::consts::PI;

/// Places of the path in widths of the ground from its middle, and metres above the ground in widths too.
const KEYS: [[f64; 3]; 5] = [
    [-0.35, -0.35, 0.03],
    [-0.10, -0.05, 0.004],
    [0.05, 0.10, 0.001],
    [0.20, 0.15, 0.006],
    [0.35, 0.35, 0.05],
];

/// Where the camera is, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    /// Share of the path that is behind.
    pub(crate) along: f64,
    pub(crate) eye: [f64; 3],
    /// Unit vector, level.
    pub(crate) heading: [f64; 3],
}

impl Station {
    /// The camera, looking ahead and somewhat down.
    pub(crate) fn view(&self) -> View {
        let ahead = DVec3::from(self.heading) - 0.3 * DVec3::Z;
        let target = DVec3::from(self.eye) + ahead;
        View::looking_at(self.eye, target.to_array(), FOV_Y, SIZE)
    }
}

/// Pixels a radian at the picture's middle.
pub(crate) fn pixels_per_radian() -> f64 {
    f64::from(SIZE[1]) / (2.0 * (0.5 * FOV_Y).tan())
}

/// So many stations at equal shares of the path, at least two, over ground `width` metres wide whose height is `ground`.
pub(crate) fn stations(count: usize, width: f64, ground: impl Fn([f64; 2]) -> f64) -> Vec<Station> {
    let station = |index: usize| {
        let along = index as f64 / (count.max(2) - 1) as f64;
        let at = along * (KEYS.len() - 1) as f64;
        let first = (at as usize).min(KEYS.len() - 2);
        let [from, to] = [KEYS[first], KEYS[first + 1]];
        let share = at - first as f64;
        let [x, y] = [0, 1].map(|axis| width * (from[axis] + share * (to[axis] - from[axis])));
        // Heights change by equal factors, so that low flight lasts.
        let above = width * from[2] * (to[2] / from[2]).powf(share);
        Station {
            along,
            eye: [x, y, ground([x, y]) + above],
            heading: DVec3::new(to[0] - from[0], to[1] - from[1], 0.0)
                .normalize()
                .to_array(),
        }
    };
    (0..count.max(2)).map(station).collect()
}
