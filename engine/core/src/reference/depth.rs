//! depth: every patch gets the least depth whose error stays within the tolerance at its distance.
//!
//! Reads frame, tiles and pool (codes, stride errors), writes depths.
//!
//! Twin: `shaders/stages/depth.wgsl`.
//! Based on: the feature processing unit of Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark
//! surface model*, 2018, with an error in pixels in place of its area ratio.

use std::f32::consts::SQRT_2;

use glam::{Vec2, Vec3};

use super::shared::{
    DrawnTile, Frame, NONE, TILE_CUT,
    border::{PATCH_COUNT, QUAD_SAMPLES, TILE_QUADS},
    patch_word::{DEPTH_CUT, FINEST_DEPTH},
    pool::{Pages, pool_code, pool_cut, pool_stride_error},
};

/// 2^(n / 2): what nibble n of a patch code multiplies.
const CODE_FACTORS: [f32; 15] = [
    1.0,
    SQRT_2,
    2.0,
    2.0 * SQRT_2,
    4.0,
    4.0 * SQRT_2,
    8.0,
    8.0 * SQRT_2,
    16.0,
    16.0 * SQRT_2,
    32.0,
    32.0 * SQRT_2,
    64.0,
    64.0 * SQRT_2,
    128.0,
];
const CODE_NEVER: u32 = 15;
const NEVER: f32 = 3.0e38;

/// Metres from the camera (the origin) to a patch's box.
fn patch_distance(tile: &DrawnTile, patch: u32) -> f32 {
    let cell = [
        patch % TILE_QUADS * QUAD_SAMPLES,
        patch / TILE_QUADS * QUAD_SAMPLES,
    ];
    let step = Vec2::from(tile.step);
    let near = Vec2::new(tile.origin[0], tile.origin[1])
        + Vec2::new(cell[0] as f32, cell[1] as f32) * step;
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
    let bound = if code == CODE_NEVER {
        NEVER
    } else {
        tile.error * CODE_FACTORS[code as usize]
    };
    bound.min(tile.geometric_error + stride_error)
}

/// True for a patch past the data set: nothing of it is seen.
fn is_outside(frame: &Frame, tile: &DrawnTile, patch: u32) -> bool {
    let cell = [
        patch % TILE_QUADS * QUAD_SAMPLES,
        patch / TILE_QUADS * QUAD_SAMPLES,
    ];
    let step = Vec2::from(tile.step);
    let near = Vec2::new(tile.origin[0], tile.origin[1])
        + Vec2::new(cell[0] as f32, cell[1] as f32) * step;
    let far = near + QUAD_SAMPLES as f32 * step;
    let (low, high) = (Vec2::from(frame.ground_min), Vec2::from(frame.ground_max));
    near.max(far).cmplt(low).any() || near.min(far).cmpgt(high).any()
}

fn patch_depth(frame: &Frame, tile: &DrawnTile, pages: &Pages<'_>, patch: u32) -> u32 {
    if tile.flags & TILE_CUT != 0 && pool_cut(pages, tile.slot, patch) {
        return FINEST_DEPTH | DEPTH_CUT;
    }
    if is_outside(frame, tile, patch) {
        return 0;
    }
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
            depths[tile * PATCH_COUNT as usize + patch as usize] =
                patch_depth(frame, drawn, pages, patch);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geo::TileId,
        reference::shared::{
            CODES_WORD, SLOT_WORDS, STRIDE_ERRORS_WORD,
            synthetic::{frame, scene},
        },
    };

    /// Depth of patch 0, seen from straight above its corner, with stride errors and codes of its two depths.
    fn depth_at(
        distance: f32,
        stride_errors: [f32; 2],
        codes: [u32; 2],
        geometric_error: f32,
    ) -> u32 {
        let mut tile = scene(&[TileId::ROOT], 1.0, &|_, _| 0.0).tiles[0];
        (tile.z_min, tile.z_max) = (-distance - 10.0, -distance);
        (tile.geometric_error, tile.error) = (geometric_error, geometric_error.max(0.0625));
        let mut page = vec![0; SLOT_WORDS];
        page[STRIDE_ERRORS_WORD] = stride_errors[0].to_bits();
        page[STRIDE_ERRORS_WORD + 1] = stride_errors[1].to_bits();
        page[CODES_WORD] = codes[0] | codes[1] << 4;
        let mut depths = vec![9; 1_024];
        // K = 64 and a pixel: the tolerance is a 64th of the distance.
        depth(&frame(1), &[tile], &[&page, &[], &[], &[]], &mut depths);
        depths[0]
    }

    #[test]
    fn a_patch_takes_the_least_depth_within_the_tolerance() {
        for (distance, want) in [
            (64.0 * 5.0, 0),
            (64.0 * 4.9, 1),
            (64.0 * 3.0, 1),
            (64.0 * 2.9, 2),
        ] {
            assert_eq!(
                depth_at(distance, [4.0, 2.0], [15, 15], 1.0),
                want,
                "{distance}"
            );
        }
    }

    #[test]
    fn a_code_says_more_than_the_stride_error_where_it_is_less() {
        // Nibble 2 doubles: 2 m at most, where stride error and the tile's own come to 5.
        assert_eq!(depth_at(64.0 * 2.0, [4.0, 4.0], [2, 0], 1.0), 0);
        assert_eq!(depth_at(64.0 * 1.9, [4.0, 4.0], [2, 0], 1.0), 1);
        assert_eq!(depth_at(64.0 * 1.9, [4.0, 4.0], [2, 15], 1.0), 2);
    }

    #[test]
    fn a_parent_in_its_childs_place_is_drawn_as_true_as_its_samples() {
        assert_eq!(depth_at(64.0 * 0.5, [0.4, 0.2], [0, 0], 1.0), 0);
        assert_eq!(depth_at(64.0 * 0.3, [0.4, 0.2], [0, 0], 1.0), 1);
        assert_eq!(depth_at(64.0 * 0.1, [0.4, 0.2], [0, 0], 1.0), 2);
    }

    #[test]
    fn distance_is_to_the_nearest_point_of_the_box() {
        let mut tile = scene(&[TileId::ROOT], 1.0, &|_, _| 0.0).tiles[0];
        (tile.z_min, tile.z_max) = (-5.0, 5.0);
        assert_eq!(patch_distance(&tile, 0), 0.0);
        tile.origin = [3.0, -4.0, 0.0];
        assert_eq!(patch_distance(&tile, 0), 5.0);
        // Patch (1, 1) begins four samples east and south.
        assert_eq!(patch_distance(&tile, 33), Vec2::new(7.0, 8.0).length());
    }
}
