//! Light, air and overlays: what colours depend on besides the ground.

use drumlin_core::{
    pyramid::Metadata,
    reference::shared::{FLAG_DEPTH_COLORS, FLAG_DRAW_VOIDS, FLAG_WIREFRAME, Frame},
};

/// How far haze lets the far corner of a data set through: e^-0.9 is two fifths.
const HAZE_ACROSS: f64 = 0.9;

/// Light, air and overlays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Towards the sun: east, north, up; any length.
    pub sun: [f32; 3],
    /// Share of the light that haze takes each metre; none: as much as suits the size of the data set; 0: clear air.
    pub haze: Option<f32>,
    /// Linear colour of the haze.
    pub sky: [f32; 3],
    /// Voids are drawn with their filled heights.
    pub draw_voids: bool,
    /// Colours say depth and level.
    pub depth_colors: bool,
    /// Edges of triangles are drawn.
    pub wireframe: bool,
}

impl Default for Look {
    /// Light from the north-west, as on maps; voids are drawn filled.
    fn default() -> Self {
        Self {
            sun: [-0.5, 0.5, 0.707],
            haze: None,
            sky: [0.35, 0.53, 0.78],
            draw_voids: true,
            depth_colors: false,
            wireframe: false,
        }
    }
}

impl Look {
    /// Puts the look into a frame.
    pub(crate) fn apply(&self, frame: &mut Frame, metadata: &Metadata) {
        let sun = glam::Vec3::from(self.sun)
            .try_normalize()
            .unwrap_or(glam::Vec3::Z);
        frame.sun = sun.into();
        frame.haze = self.haze.unwrap_or_else(|| natural_haze(metadata));
        frame.sky = self.sky;
        let flags = [
            (self.draw_voids, FLAG_DRAW_VOIDS),
            (self.depth_colors, FLAG_DEPTH_COLORS),
            (self.wireframe, FLAG_WIREFRAME),
        ];
        for (is_set, flag) in flags {
            frame.flags = if is_set {
                frame.flags | flag
            } else {
                frame.flags & !flag
            };
        }
    }
}

/// Haze by which the far side of a data set stands back from the near one.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a colour's precision is enough"
)]
fn natural_haze(metadata: &Metadata) -> f32 {
    let extent = metadata.grid.extent();
    let frame = metadata.frame();
    let (low, high) = (frame.to_world(extent.min), frame.to_world(extent.max));
    let diagonal = (high[0] - low[0]).hypot(high[1] - low[1]);
    if diagonal > 0.0 {
        (HAZE_ACROSS / diagonal) as f32
    } else {
        0.0
    }
}
