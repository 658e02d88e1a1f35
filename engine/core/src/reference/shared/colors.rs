//! Colours: of bare ground by height and slope, of light, and of what is shown to those who look into the engine.
//!
//! All linear. Twin: `shaders/shared/colors.wgsl`.

use glam::Vec3;

const MEADOW: Vec3 = Vec3::new(0.150, 0.175, 0.075);
const FOREST: Vec3 = Vec3::new(0.045, 0.075, 0.035);
const HEATH: Vec3 = Vec3::new(0.160, 0.148, 0.100);
const ROCK: Vec3 = Vec3::new(0.205, 0.190, 0.175);
const SNOW: Vec3 = Vec3::new(0.740, 0.770, 0.820);
const SUNLIGHT: Vec3 = Vec3::new(1.280, 1.200, 1.060);
const SKYLIGHT: Vec3 = Vec3::new(0.170, 0.200, 0.250);

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Ground at a share of the data's range of heights.
///
/// Forest climbs from the valleys to heath, rock and snow; steep ground is bare; slopes away from the midday sun hold
/// trees and snow a little lower.
#[must_use]
pub fn natural_color(share: f32, normal: Vec3) -> Vec3 {
    let height = share + 0.05 * normal.y;
    let mut color = MEADOW.lerp(FOREST, smoothstep(0.04, 0.16, height));
    color = color.lerp(HEATH, smoothstep(0.34, 0.46, height));
    color = color.lerp(ROCK, smoothstep(0.44, 0.56, height));
    color = color.lerp(ROCK, 0.85 * (1.0 - smoothstep(0.70, 0.88, normal.z)));
    let snow = smoothstep(0.52, 0.66, height) * smoothstep(0.60, 0.80, normal.z);
    color.lerp(SNOW, snow)
}

/// What a colour becomes under the sun and the sky's dome.
#[must_use]
pub fn lit(color: Vec3, normal: Vec3, sun: Vec3) -> Vec3 {
    let direct = normal.dot(sun).max(0.0);
    let dome = 0.6 + 0.4 * normal.z;
    color * (direct * SUNLIGHT + dome * SKYLIGHT)
}

/// Depth 0 to 2 from blue to red, levels apart in brightness.
#[must_use]
pub fn depth_color(depth: u32, level: u32) -> Vec3 {
    let bright = if level.is_multiple_of(2) { 1.0 } else { 0.75 };
    bright
        * match depth {
            0 => Vec3::new(0.10, 0.22, 0.42),
            1 => Vec3::new(0.40, 0.38, 0.14),
            _ => Vec3::new(0.45, 0.13, 0.10),
        }
}

/// From linear to sRGB.
#[must_use]
pub fn encode_srgb(linear: Vec3) -> Vec3 {
    let encode = |x: f32| {
        if x <= 0.003_130_8 {
            12.92 * x
        } else {
            1.055 * x.max(0.0).powf(1.0 / 2.4) - 0.055
        }
    };
    Vec3::new(encode(linear.x), encode(linear.y), encode(linear.z))
}
