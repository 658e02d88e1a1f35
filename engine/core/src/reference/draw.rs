//! draw: the list of indices becomes pictures. A vertex index is a drawn tile and one of its samples.
//!
//! Reads frame, tiles and pool. What a GPU does for vertices and pixels is here as functions of one vertex and one
//! pixel, and [`rasterise`] fills a small picture of distances with them.
//! A vertex is placed once, by the tile that owns it. Slopes are looked up per pixel in the samples, never taken from
//! the triangles, so that shading knows no depths.
//!
//! Twin: `shaders/stages/draw.wgsl`.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::shared::{
    DrawnTile, FEATURE_BORDER, FLAG_DEPTH_COLORS, FLAG_SRGB_OUT, FeatureVertex, Frame, SAMPLE_BITS,
    SKIRT_FIRST,
    border::{PATCH_COUNT, QUAD_SAMPLES, TILE_QUADS, TILE_SAMPLES, owned_vertex, skirt_sample},
    colors::{depth_color, encode_srgb, lit, natural_color},
    ground::{Place, ground_slope, locate},
    patch_word::word_depth,
    pool::{Pages, pool_height},
};

/// Camera-relative metres of a vertex.
#[must_use]
pub fn vertex_position(frame: &Frame, tiles: &[DrawnTile], pages: &Pages<'_>, index: u32) -> Vec3 {
    let tile = &tiles[(index >> SAMPLE_BITS) as usize];
    let sample = index & ((1 << SAMPLE_BITS) - 1);
    let (place, lower) = if sample >= SKIRT_FIRST {
        (skirt_sample(sample - SKIRT_FIRST), tile.skirt)
    } else {
        ([sample / TILE_SAMPLES, sample % TILE_SAMPLES], 0.0)
    };
    let height = pool_height(pages, tile.slot, place[0] * TILE_SAMPLES + place[1]);
    let offset = Vec2::new(place[1] as f32, place[0] as f32) * Vec2::from(tile.step);
    let rise = (height - tile.base) as f32 * frame.unit - lower;
    Vec3::from(tile.origin) + offset.extend(rise)
}

/// A feature's mesh where a frame draws it.
#[derive(Clone, Copy, Debug)]
pub struct PlacedFeature<'a> {
    /// Camera-relative metres of its origin.
    pub origin: [f32; 3],
    /// Drawn tile of each of its tiles.
    pub tiles: &'a [u32],
    /// Its vertices.
    pub vertices: &'a [FeatureVertex],
}

/// Camera-relative metres of a vertex of a feature: its own, or a sample of a tile, placed as [`vertex_position`] does.
#[must_use]
pub fn feature_position(
    frame: &Frame,
    tiles: &[DrawnTile],
    pages: &Pages<'_>,
    feature: &PlacedFeature<'_>,
    index: u32,
) -> Vec3 {
    if index & FEATURE_BORDER == 0 {
        let placed = feature.vertices[index as usize].position_of;
        let position = Vec3::from(feature.vertices[placed as usize].position);
        return Vec3::from(feature.origin) + position;
    }
    let at = index ^ FEATURE_BORDER;
    let tile = feature.tiles[(at >> SAMPLE_BITS) as usize];
    let sample = at & ((1 << SAMPLE_BITS) - 1);
    let owned = owned_vertex(tiles, tile, sample / TILE_SAMPLES, sample % TILE_SAMPLES);
    vertex_position(frame, tiles, pages, owned)
}

/// Clip coordinates of a camera-relative position; w is metres along the view axis.
#[must_use]
pub fn clip_position(frame: &Frame, position: Vec3) -> Vec4 {
    Mat4::from_cols_array_2d(&frame.clip_from_view_world) * position.extend(1.0)
}

/// The depth of the patch under a place, at shift 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place lies in 0..=128"
)]
fn patch_depth_at(patches: &[u32], here: Place) -> u32 {
    let cell = |at: f32| (at as u32 / QUAD_SAMPLES).min(TILE_QUADS - 1);
    let patch = cell(here.at.y) * TILE_QUADS + cell(here.at.x);
    word_depth(patches[(here.tile * PATCH_COUNT + patch) as usize], 0)
}

/// The upward unit normal of the ground under a camera-relative position.
#[must_use]
pub fn ground_normal(tiles: &[DrawnTile], pages: &Pages<'_>, here: Place) -> Vec3 {
    let slope = ground_slope(tiles, pages, here);
    Vec3::new(-slope.x, -slope.y, 1.0).normalize()
}

/// The colour of a pixel at a camera-relative position of a triangle of a drawn tile; without imagery and wireframe.
#[must_use]
pub fn shade(
    frame: &Frame,
    tiles: &[DrawnTile],
    pages: &Pages<'_>,
    patches: &[u32],
    tile: u32,
    position: Vec3,
) -> Vec3 {
    let here = locate(tiles, tile, position.truncate());
    let normal = ground_normal(tiles, pages, here);
    let sun = Vec3::from(frame.sun);
    let ground = if frame.flags & FLAG_DEPTH_COLORS != 0 {
        let depth = patch_depth_at(patches, here);
        lit(
            depth_color(depth, tiles[here.tile as usize].level),
            normal,
            sun,
        )
    } else {
        let range = (frame.height_range[1] - frame.height_range[0]).max(1.0);
        let share = (position.z + frame.camera_height - frame.height_range[0]) / range;
        lit(natural_color(share, normal), normal, sun)
    };
    let color = Vec3::from(frame.sky).lerp(ground, (-frame.haze * position.length()).exp());
    if frame.flags & FLAG_SRGB_OUT != 0 {
        encode_srgb(color)
    } else {
        color
    }
}

/// Metres along the view axis for every pixel, row by row from the top left; infinite where nothing is.
///
/// Triangles that reach behind the eye are left out: pictures of tests look at ground that lies before it.
#[must_use]
pub fn rasterise(
    frame: &Frame,
    tiles: &[DrawnTile],
    pages: &Pages<'_>,
    indices: &[u32],
    size: [usize; 2],
) -> Vec<f32> {
    let mut image = vec![f32::INFINITY; size[0] * size[1]];
    for triangle in indices.chunks_exact(3) {
        let clip = [0, 1, 2]
            .map(|i| clip_position(frame, vertex_position(frame, tiles, pages, triangle[i])));
        if clip.iter().all(|corner| corner.w > 1.0e-6) {
            fill(&mut image, size, clip);
        }
    }
    image
}

/// Where a clip position lies in pixels from the top left.
fn pixel(clip: Vec4, size: [usize; 2]) -> Vec2 {
    let ndc = clip.truncate().truncate() / clip.w;
    Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) * 0.5 * Vec2::new(size[0] as f32, size[1] as f32)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the picture before"
)]
fn fill(image: &mut [f32], size: [usize; 2], clip: [Vec4; 3]) {
    let corner = clip.map(|clip| pixel(clip, size));
    let low = corner[0].min(corner[1]).min(corner[2]).max(Vec2::ZERO);
    let high = corner[0]
        .max(corner[1])
        .max(corner[2])
        .min(Vec2::new(size[0] as f32, size[1] as f32));
    let area = (corner[1] - corner[0]).perp_dot(corner[2] - corner[0]);
    if area == 0.0 || low.x >= high.x || low.y >= high.y {
        return;
    }
    for y in low.y as usize..high.y.ceil() as usize {
        for x in low.x as usize..high.x.ceil() as usize {
            let centre = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let share =
                |i: usize, j: usize| (corner[i] - centre).perp_dot(corner[j] - centre) / area;
            let weights = [share(1, 2), share(2, 0), share(0, 1)];
            if weights.iter().all(|&weight| weight >= 0.0) {
                // 1 / w is linear on the screen.
                let inverse: f32 = (0..3).map(|i| weights[i] / clip[i].w).sum();
                let place = &mut image[y * size[0] + x];
                *place = place.min(1.0 / inverse);
            }
        }
    }
}

#[cfg(test)]
mod tests;
