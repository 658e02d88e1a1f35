// depth: every patch gets the least depth whose error stays within the tolerance at its distance.
// Reads: frame, tiles, pool (codes, stride errors). Writes: depths. One thread a patch; the y of the workgroup is the
// drawn tile.
// Source: the feature processing unit of Lin, Wang, Sun 2018 (Improved feature-adaptive subdivision for Catmull-Clark
// surface model), with an error in pixels in place of its area ratio.
// Twin: core/reference/depth.rs

#import constants
#import frame
#import pool
#import patch_word

@group(0) @binding(0) var<uniform> frame: Frame;
@group(2) @binding(0) var<storage, read_write> depths: array<u32>;

// 2^(n / 2): what nibble n of a patch code multiplies.
const CODE_FACTORS = array<f32, 15>(
    1.0, 1.41421356, 2.0, 2.82842712, 4.0, 5.65685425, 8.0, 11.3137085, 16.0, 22.627417, 32.0, 45.254834, 64.0,
    90.509668, 128.0);
const CODE_NEVER: u32 = 15u;
const NEVER: f32 = 3.0e38;

// Metres from the camera (the origin) to a patch's box.
fn patch_distance(tile: u32, patch_index: u32) -> f32 {
    let cell = vec2f(vec2u(patch_index % TILE_QUADS, patch_index / TILE_QUADS) * QUAD_SAMPLES);
    let near = tiles[tile].origin.xy + cell * tiles[tile].step;
    let far = near + f32(QUAD_SAMPLES) * tiles[tile].step;
    let low = vec3f(min(near, far), tiles[tile].z_min);
    let high = vec3f(max(near, far), tiles[tile].z_max);
    return length(max(max(low, -high), vec3f(0.0)));
}

// Metres a patch is off at a depth, at most.
fn patch_error(tile: u32, patch_index: u32, depth: u32, tolerance: f32) -> f32 {
    let slot = tiles[tile].slot;
    let stride_error = pool_stride_error(slot, patch_index, depth);
    if tolerance < tiles[tile].geometric_error {
        return stride_error; // a parent in its child's place: nothing is within, its own samples decide
    }
    let code = pool_code(slot, patch_index, depth);
    var bound = NEVER;
    if code != CODE_NEVER {
        bound = tiles[tile].error * CODE_FACTORS[code];
    }
    return min(bound, tiles[tile].geometric_error + stride_error);
}

// True for a patch past the data set: nothing of it is seen.
fn is_outside(tile: u32, patch_index: u32) -> bool {
    let cell = vec2f(vec2u(patch_index % TILE_QUADS, patch_index / TILE_QUADS) * QUAD_SAMPLES);
    let near = tiles[tile].origin.xy + cell * tiles[tile].step;
    let far = near + f32(QUAD_SAMPLES) * tiles[tile].step;
    return any(max(near, far) < frame.ground_min) || any(min(near, far) > frame.ground_max);
}

fn patch_depth(tile: u32, patch_index: u32) -> u32 {
    if (tiles[tile].flags & TILE_CUT) != 0u && pool_cut(tiles[tile].slot, patch_index) {
        return FINEST_DEPTH | DEPTH_CUT;
    }
    if is_outside(tile, patch_index) {
        return 0u;
    }
    if frame.uniform_depth != NONE {
        return min(frame.uniform_depth, FINEST_DEPTH);
    }
    let tolerance = frame.tolerance * patch_distance(tile, patch_index) / frame.pixels_per_radian;
    for (var depth = 0u; depth < FINEST_DEPTH; depth++) {
        if patch_error(tile, patch_index, depth, tolerance) <= tolerance {
            return depth;
        }
    }
    return FINEST_DEPTH;
}

@compute @workgroup_size(64)
fn depth(@builtin(global_invocation_id) id: vec3u) {
    let patch_index = id.x;
    let tile = id.y;
    if patch_index >= PATCH_COUNT || tile >= frame.drawn_count {
        return;
    }
    depths[tile * PATCH_COUNT + patch_index] = patch_depth(tile, patch_index);
}
