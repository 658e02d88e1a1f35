//! depth: every patch gets the least depth whose error stays within the tolerance at its distance.
//!
//! Reads frame, tiles and pool (codes, stride errors), writes depths.
//!
//! Twin: `shaders/stages/depth.wgsl`.
//! Based on: the feature processing unit of Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark
//! surface model*, 2018, with an error in pixels in place of its area ratio.

use glam::{Vec2, Vec3};

use super::shared::{
    DrawnTile, Frame, NONE,
    border::{PATCH_COUNT, QUAD_SAMPLES, TILE_QUADS},
    patch_word::FINEST_DEPTH,
    pool::{Pages, pool_code, pool_stride_error},
};

/// 2^(n / 2): what nibble n of a patch code multiplies.
const CODE_FACTORS: [f32; 15] = [
    1.0, 1.414_213_56, 2.0, 2.828_427_12, 4.0, 5.656_854_25, 8.0, 11.313_708_5, 16.0, 22.627_417, 32.0, 45.254_834,
    64.0, 90.509_668, 128.0,
];
const CODE_NEVER: u32 = 15;
const NEVER: f32 = 3.0e38;

/// Metres from the camera (the origin) to a patch's box.
fn patch_distance(tile: &DrawnTile, patch: u32) -> f32 {
    let cell = [patch % TILE_QUADS * QUAD_SAMPLES, patch / TILE_QUADS * QUAD_SAMPLES];
    let step = Vec2::from(tile.step);
    let near = Vec2::new(tile.origin[0], tile.origin[1]) + Vec2::new(cell[0] as f32, cell[1] as f32) * step;
    let far = near + QUAD_SAMPLES as f32 * step;
    let low = near.min(far).extend(tile.z_min);
    let high = near.max(far).extend(tile.z_max);
    low.max(-high).max(Vec3::ZERO).length()
}

/// Metres a patch is off at a depth, at most.
fn patch_error(tile: &DrawnTile, pages: &Pages<'_>, patch: u32, depth: u32, tolerance: f32) -> f32 {
    let stride_error = pool_stride_error(pages, tile.slot, patch, depth);
    if tolerance < tile.geometric_error {
        return stride_error; // a parent in its child's place: nothing is within, its own samples decide
    }
    let code = pool_code(pages, tile.slot, patch, depth);
    let bound = if code == CODE_NEVER { NEVER } else { tile.error * CODE_FACTORS[code as usize] };
    bound.min(tile.geometric_error + stride_error)
}

fn patch_depth(frame: &Frame, tile: &DrawnTile, pages: &Pages<'_>, patch: u32) -> u32 {
    if frame.uniform_depth != NONE {
        return frame.uniform_depth.min(FINEST_DEPTH);
    }
    let tolerance = frame.tolerance * patch_distance(tile, patch) / frame.pixels_per_radian;
    for depth in 0..FINEST_DEPTH {
        if patch_error(tile, pages, patch, depth, tolerance) <= tolerance {
            return depth;
        }
    }
    FINEST_DEPTH
}

/// Depths of all patches of all drawn tiles.
pub fn depth(frame: &Frame, tiles: &[DrawnTile], pages: &Pages<'_>, depths: &mut [u32]) {
    for (tile, drawn) in tiles.iter().enumerate().take(frame.drawn_count as usize) {
        for patch in 0..PATCH_COUNT {
            depths[tile * PATCH_COUNT as usize + patch as usize] = patch_depth(frame, drawn, pages, patch);
        }
    }
}
