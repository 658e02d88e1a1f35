// draw: the list of indices becomes pictures. A vertex index is a drawn tile and one of its samples.
// Reads: frame, tiles, pool, imagery; patches and the head of the list where the engine's insides are shown.
// Entry points: `vertex` (one thread a vertex), `color` and `depth_image` (one thread a pixel); the same for features:
// `feature_vertex`, `feature_color`, `feature_depth_image`. A feature's vertices are its own, but for those on the border
// of its cut, which are samples of tiles and placed as `vertex` places them. Its normals are its vertices'.
// A vertex is placed once, by the tile that owns it. Slopes are looked up per pixel in the samples, never taken from
// the triangles, so that shading knows no depths.
// Twin: core/reference/draw.rs

#import constants
#import frame
#import pool
#import border
#import ground
#import patch_word
#import draw_list
#import colors
#import feature

@group(0) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(5) var color_layers: texture_2d_array<f32>;
@group(1) @binding(6) var color_sampler: sampler;
@group(2) @binding(0) var<storage, read> patches: array<u32>;
@group(2) @binding(1) var<storage, read> draw_list: array<u32, DRAW_LIST_WORDS>;
@group(2) @binding(2) var<storage, read> feature_vertices: array<FeatureVertex>;
@group(2) @binding(3) var<storage, read> feature_place: FeaturePlace;

const COLOR_TEXELS: f32 = 256.0;    // a side of a layer; the first and last lie on the tile's border
const MOST_TAPS: f32 = 8.0;

struct Vertex {
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,   // camera-relative metres
    @location(1) view_depth: f32,   // metres along the view axis
    @location(2) @interpolate(flat) tile: u32,
    @location(3) @interpolate(flat) per_metre: vec2f,   // layer's sides a metre of the tile's imagery
}

fn vertex_position(index: u32) -> vec3f {
    let tile = index >> SAMPLE_BITS;
    let sample = index & ((1u << SAMPLE_BITS) - 1u);
    var place = vec2u(sample / TILE_SAMPLES, sample % TILE_SAMPLES);
    var lower = 0.0;
    if sample >= SKIRT_FIRST {
        place = skirt_sample(sample - SKIRT_FIRST);
        lower = tiles[tile].skirt;
    }
    let height = pool_height(tiles[tile].slot, place.x * TILE_SAMPLES + place.y);
    let offset = vec2f(place.yx) * tiles[tile].step;
    let rise = f32(height - tiles[tile].base) * frame.unit - lower;
    return tiles[tile].origin + vec3f(offset, rise);
}

fn clip_position(position: vec3f) -> vec4f {
    return frame.clip_from_view_world * vec4f(position, 1.0);
}

// Sides of its layer that imagery takes a metre, east and north.
fn imagery_per_metre(tile: u32) -> vec2f {
    let texel_share = (COLOR_TEXELS - 1.0) / COLOR_TEXELS;
    return texel_share * tiles[tile].color_scale / (f32(TILE_CELLS) * tiles[tile].step);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Vertex {
    let position = vertex_position(index);
    let clip = clip_position(position);
    let tile = index >> SAMPLE_BITS;
    return Vertex(clip, position, clip.w, tile, imagery_per_metre(tile));
}

struct FeaturePoint {
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,   // camera-relative metres
    @location(1) view_depth: f32,   // metres along the view axis
    @location(2) @interpolate(flat) tile: u32,
    @location(3) @interpolate(flat) per_metre: vec2f,   // as a vertex of the ground
    @location(4) normal: vec3f,     // outward
}

@vertex
fn feature_vertex(@builtin(vertex_index) index: u32) -> FeaturePoint {
    var tile = 0u;
    var position = vec3f(0.0);
    var normal = vec3f(0.0);
    if (index & FEATURE_BORDER) != 0u {
        let at = index ^ FEATURE_BORDER;
        tile = feature_place.tiles[at >> SAMPLE_BITS];
        let sample = at & ((1u << SAMPLE_BITS) - 1u);
        let place = vec2u(sample / TILE_SAMPLES, sample % TILE_SAMPLES);
        position = vertex_position(owned_vertex(tile, place.x, place.y));
        normal = normalize(vec3f(-ground_slope(tile, vec2f(place.yx)), 1.0));
    } else {
        tile = feature_place.tiles[feature_vertices[index].tile];
        position = feature_place.origin + feature_vertices[feature_vertices[index].position_of].position;
        normal = feature_vertices[index].normal;
    }
    let clip = clip_position(position);
    return FeaturePoint(clip, position, clip.w, tile, imagery_per_metre(tile), normal);
}

// How far on the ground it is to the next pixel, metres.
struct Spread {
    right: vec2f,
    down: vec2f,
    per_metre: vec2f,               // the vertex's
}

fn spread_of(position: vec3f, per_metre: vec2f) -> Spread {
    return Spread(dpdx(position.xy), dpdy(position.xy), per_metre);
}

// Colour with premultiplied alpha, and alpha: 0 where there is no picture. Where a pixel covers more texels in one direction than
// across it, the mean of up to MOST_TAPS in a row, each as wide as the pixel is across (samplers do this too, but not all
// of them rightly).
fn imagery(here: Place, spread: Spread) -> vec4f {
    let scale = tiles[here.tile].color_scale;
    // Pixels beside a triangle, which only serve derivatives, may read zeros from buffers, and a driver may choose the
    // texels' size for four pixels by one of those: it then goes by what came with the vertex.
    let per_metre = select(spread.per_metre, imagery_per_metre(here.tile), scale > 0.0);
    let right = spread.right * per_metre;
    let down = spread.down * per_metre;
    let along = select(down, right, dot(right, right) > dot(down, down));
    let long = length(along);
    let wide = abs(right.x * down.y - right.y * down.x) / max(long, 1.0e-9);
    let taps = clamp(ceil(long / max(wide, 1.0 / COLOR_TEXELS)), 1.0, MOST_TAPS);
    let mip_level = log2(max(long / taps * COLOR_TEXELS, 1.0));
    let share = here.at / f32(TILE_CELLS) * scale + tiles[here.tile].color_offset;
    let middle = (share * (COLOR_TEXELS - 1.0) + 0.5) / COLOR_TEXELS;
    var sum = vec4f(0.0);
    for (var tap = 0.5; tap < taps; tap += 1.0) {
        let texel = middle + (tap / taps - 0.5) * along;
        sum += textureSampleLevel(color_layers, color_sampler, texel, tiles[here.tile].color_slot, mip_level);
    }
    return sum / taps;
}

// The depths of the frame were lessened by this.
fn drawn_shift() -> u32 {
    for (var shift = 0u; shift < SHIFT_COUNT; shift++) {
        if draw_list[SHIFT_COUNTS_WORD + shift] <= frame.index_capacity {
            return shift;
        }
    }
    return 0u;
}

fn patch_word_at(here: Place) -> u32 {
    let cell = min(vec2u(here.at) / QUAD_SAMPLES, vec2u(TILE_QUADS - 1u));
    return patches[here.tile * PATCH_COUNT + cell.y * TILE_QUADS + cell.x];
}

// 1 on a triangle's edge, 0 a pixel away; `per_pixel` is samples a pixel.
fn wire(here: Place, per_pixel: vec2f) -> f32 {
    let word = patch_word_at(here);
    let shift = drawn_shift();
    let depth = word_depth(word, shift);
    let count = 1u << depth;
    let in_patch = here.at / f32(QUAD_SAMPLES) - floor(here.at / f32(QUAD_SAMPLES));
    let cell = min(vec2u(in_patch * f32(count)), vec2u(count - 1u));
    let f = in_patch * f32(count) - vec2f(cell);
    let scale = per_pixel * f32(count) / f32(QUAD_SAMPLES);
    let to_side = min(f, 1.0 - f) / scale;
    let diagonal = length(scale);
    var nearest = min(min(to_side.x, to_side.y), abs(f.x - f.y) / diagonal);
    let split = outer_edges(cell.y, cell.x, count) & word_split(word, shift);
    if split != 0u {
        nearest = min(nearest, abs(f.x + f.y - 1.0) / diagonal);
        let vertical = select(EDGE_SOUTH, EDGE_NORTH, f.y < 0.5);
        let horizontal = select(EDGE_EAST, EDGE_WEST, f.x < 0.5);
        let to_middle = abs(f - 0.5) / scale;
        nearest = select(nearest, min(nearest, to_middle.x), (split & vertical) != 0u);
        nearest = select(nearest, min(nearest, to_middle.y), (split & horizontal) != 0u);
    }
    return 1.0 - smoothstep(0.4, 1.2, nearest);
}

// The ground's colour in the light, before air.
fn ground_color(here: Place, height: f32, spread: Spread) -> vec3f {
    let slope = ground_slope(here.tile, here.at);
    let normal = normalize(vec3f(-slope, 1.0));
    if (frame.flags & FLAG_DEPTH_COLORS) != 0u {
        let depth = word_depth(patch_word_at(here), drawn_shift());
        return lit(depth_color(depth, tiles[here.tile].level), normal, frame.sun);
    }
    return surface_color(here, height, normal, spread);
}

// The feature's colour in the light, before air.
fn surface_color(here: Place, height: f32, normal: vec3f, spread: Spread) -> vec3f {
    if (frame.flags & FLAG_DEPTH_COLORS) != 0u {
        return lit(depth_color(FINEST_DEPTH, tiles[here.tile].level), normal, frame.sun);
    }
    var picture = vec4f(0.0);
    if tiles[here.tile].color_slot != NONE {
        picture = imagery(here, spread);
    }
    let range = max(frame.height_range.y - frame.height_range.x, 1.0);
    let share = (height - frame.height_range.x) / range;
    let bare = lit(natural_color(share, normal), normal, frame.sun);
    return softly_lit(picture.rgb, normal, frame.sun) + (1.0 - picture.a) * bare;
}

// Tiles reach past the data set; nothing is drawn there.
fn is_outside(at: vec2f) -> bool {
    return any(at < frame.ground_min) || any(at > frame.ground_max);
}

fn through_air(surface: vec3f, position: vec3f) -> vec4f {
    var result = mix(frame.sky, surface, exp(-frame.haze * length(position)));
    if (frame.flags & FLAG_SRGB_OUT) != 0u {
        result = encode_srgb(result);
    }
    return vec4f(result, 1.0);
}

@fragment
fn feature_color(in: FeaturePoint) -> @location(0) vec4f {
    let here = locate(in.tile, in.position.xy);
    let height = in.position.z + frame.camera_height;
    let color = surface_color(here, height, normalize(in.normal), spread_of(in.position, in.per_metre));
    return through_air(color, in.position);
}

@fragment
fn feature_depth_image(in: FeaturePoint) -> @location(0) f32 {
    return in.view_depth;
}

@fragment
fn color(in: Vertex) -> @location(0) vec4f {
    let spread = spread_of(in.position, in.per_metre);
    if is_outside(in.position.xy) {
        discard;
    }
    let here = locate(in.tile, in.position.xy);
    var result = ground_color(here, in.position.z + frame.camera_height, spread);
    if (frame.flags & FLAG_WIREFRAME) != 0u {
        let per_pixel = max(abs(spread.right) + abs(spread.down), vec2f(1.0e-9));
        let edge = wire(here, per_pixel / abs(tiles[here.tile].step));
        result = mix(result, vec3f(0.01), 0.6 * edge);
    }
    return through_air(result, in.position);
}

// Metres along the view axis: clip.w of a perspective matrix whose w is the distance.
@fragment
fn depth_image(in: Vertex) -> @location(0) f32 {
    if is_outside(in.position.xy) {
        discard;
    }
    return in.view_depth;
}
