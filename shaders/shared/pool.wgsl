// The drawn tiles and the pool that holds their data: pages of slots, a slot a tile.
// Twin: core/reference/shared/pool.rs

#import constants
#import tile

@group(1) @binding(0) var<storage, read> tiles: array<DrawnTile>;
@group(1) @binding(1) var<storage, read> page_0: array<u32>;
@group(1) @binding(2) var<storage, read> page_1: array<u32>;
@group(1) @binding(3) var<storage, read> page_2: array<u32>;
@group(1) @binding(4) var<storage, read> page_3: array<u32>;

// A word of a slot.
fn pool(slot: u32, word: u32) -> u32 {
    let at = (slot % SLOTS_PER_PAGE) * SLOT_WORDS + word;
    switch slot / SLOTS_PER_PAGE {
        case 0u: { return page_0[at]; }
        case 1u: { return page_1[at]; }
        case 2u: { return page_2[at]; }
        default: { return page_3[at]; }
    }
}

fn pool_height(slot: u32, sample: u32) -> i32 {
    return bitcast<i32>(pool(slot, HEIGHTS_WORD + sample));
}

// Metres a metre: towards the east, towards the north.
fn pool_slope(slot: u32, sample: u32) -> vec2f {
    return unpack2x16float(pool(slot, SLOPES_WORD + sample));
}

fn pool_void(slot: u32, sample: u32) -> bool {
    return ((pool(slot, VOIDS_WORD + sample / 32u) >> (sample % 32u)) & 1u) != 0u;
}

// Metres: stride 4 (depth 0) and stride 2 (depth 1) against stride 1.
fn pool_stride_error(slot: u32, patch_index: u32, depth: u32) -> f32 {
    return bitcast<f32>(pool(slot, STRIDE_ERRORS_WORD + patch_index * 2u + depth));
}

// True when a feature stands in the place of a patch.
fn pool_cut(slot: u32, patch_index: u32) -> bool {
    return ((pool(slot, CUT_WORD + patch_index / 32u) >> (patch_index % 32u)) & 1u) != 0u;
}

// The nibble of depth 0 or 1.
fn pool_code(slot: u32, patch_index: u32, depth: u32) -> u32 {
    return (pool(slot, CODES_WORD + patch_index / 4u) >> (patch_index % 4u * 8u + depth * 4u)) & 15u;
}
