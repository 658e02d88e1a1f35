//! refine: a feature's tables become its points, and its points the vertices of its mesh.
//!
//! Reads header, tasks, tables. Writes points (whose first are the cage's) and vertices. Gathers only: a level's tasks run
//! one after the other, a task's rows in any order. A vertex is evaluated once; one that only shades differently names
//! another, whose position it has.
//!
//! Twin: `shaders/stages/refine.wgsl`.
//!
//! Based on: M. Nießner, C. Loop, M. Meyer, T. DeRose, *Feature-adaptive GPU rendering of Catmull-Clark subdivision
//! surfaces* (2012), section 4.

mod pack;

use glam::{Vec2, Vec3, Vec4};

pub use self::pack::{LevelBytes, RefineGround, RefineSite, RefineTables, bytes_by_level};

use super::shared::{
    FeatureVertex, NONE,
    border::TILE_CELLS,
    refine::{
        REFINE_MEANS, REFINE_RINGS, REFINE_STENCIL, REFINE_VERTEX_WORDS, REFINE_WEIGHTED_WORDS,
        RefineHeader, RefineTask,
    },
};

/// Least square of the sine between du and dv: below it they say nothing of a plane.
pub(crate) const LEAST_SINE_SQUARE: f32 = 1.0e-8;

#[derive(Clone, Copy, Default)]
struct Sample {
    position: Vec3,
    du: Vec3,
    dv: Vec3,
}

/// The stage: all points, then the vertices.
#[must_use]
pub fn refine(tables: &RefineTables) -> (Vec<Vec3>, Vec<FeatureVertex>) {
    let mut points: Vec<Vec3> = tables.cage.iter().copied().map(Vec3::from).collect();
    points.resize(tables.point_count as usize, Vec3::ZERO);
    for task in &tables.tasks {
        points_of_level(task, &tables.words, &mut points);
    }
    let vertices = vertices(&tables.header, &tables.words, &points);
    (points, vertices)
}

fn number(tables: &[u32], word: u32) -> f32 {
    f32::from_bits(tables[word as usize])
}

fn sum_of(tables: &[u32], points: &[Vec3], first: u32, end: u32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for word in first..end {
        sum += points[tables[word as usize] as usize];
    }
    sum
}

/// Row: the vertex; along a crease two ends, smooth as many ends as face points.
fn ring_point(tables: &[u32], points: &[Vec3], first: u32, end: u32) -> Vec3 {
    let vertex = points[tables[first as usize] as usize];
    let around = sum_of(tables, points, first + 1, end);
    match end - first {
        1 => vertex,
        3 => 0.75 * vertex + 0.125 * around,
        _ => {
            let n = ((end - first) / 2) as f32;
            (n - 2.0) / n * vertex + around / (n * n)
        }
    }
}

fn weighted_point(tables: &[u32], points: &[Vec3], first: u32, count: u32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for term in 0..count {
        let word = first + 2 * term;
        sum += number(tables, word + 1) * points[tables[word as usize] as usize];
    }
    sum
}

fn points_of_level(task: &RefineTask, tables: &[u32], points: &mut [Vec3]) {
    for row in 0..task.count {
        let mut target_point = task.first_point + row;
        let position = match task.kind {
            REFINE_MEANS => {
                let word = task.rows_word + 4 * row;
                0.25 * sum_of(tables, points, word, word + 4)
            }
            REFINE_RINGS => {
                let word = (task.rows_word + row) as usize;
                ring_point(tables, points, tables[word], tables[word + 1])
            }
            _ => {
                let word = (task.rows_word + REFINE_WEIGHTED_WORDS * row) as usize;
                target_point = tables[word];
                weighted_point(tables, points, tables[word + 1], tables[word + 2])
            }
        };
        points[target_point as usize] = position;
    }
}

fn basis(t: f32) -> Vec4 {
    let s = 1.0 - t;
    Vec4::new(
        s * s * s,
        4.0 - 6.0 * t * t + 3.0 * t * t * t,
        4.0 - 6.0 * s * s + 3.0 * s * s * s,
        t * t * t,
    ) / 6.0
}

fn basis_derivative(t: f32) -> Vec4 {
    let s = 1.0 - t;
    Vec4::new(
        -0.5 * s * s,
        1.5 * t * t - 2.0 * t,
        2.0 * s - 1.5 * s * s,
        0.5 * t * t,
    )
}

fn patch_sample(
    header: &RefineHeader,
    tables: &[u32],
    points: &[Vec3],
    index: u32,
    uv: Vec2,
) -> Sample {
    let column_weights = basis(uv.x);
    let row_weights = basis(uv.y);
    let column_slopes = basis_derivative(uv.x);
    let row_slopes = basis_derivative(uv.y);
    let mut sample = Sample::default();
    for control in 0..16 {
        let at =
            points[tables[header.patches_word as usize + 16 * index as usize + control] as usize];
        let column = control % 4;
        let row = control / 4;
        sample.position += column_weights[column] * row_weights[row] * at;
        sample.du += column_slopes[column] * row_weights[row] * at;
        sample.dv += column_weights[column] * row_slopes[row] * at;
    }
    sample
}

fn stencil_sample(tables: &[u32], points: &[Vec3], first: u32) -> Sample {
    let mut sample = Sample::default();
    for term in 0..tables[first as usize] {
        let word = first + 1 + 4 * term;
        let at = points[tables[word as usize] as usize];
        sample.position += number(tables, word + 1) * at;
        sample.du += number(tables, word + 2) * at;
        sample.dv += number(tables, word + 3) * at;
    }
    sample
}

/// Upward where the surface has no tangent plane.
fn unit_normal(sample: &Sample) -> Vec3 {
    let area = sample.du.cross(sample.dv);
    let lengths = sample.du.length_squared() * sample.dv.length_squared();
    if area.length_squared() <= LEAST_SINE_SQUARE * lengths {
        return Vec3::Z;
    }
    area.normalize()
}

/// The feature's tile under a position; the nearest of them where an overhang reaches past the cut.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the cut, whose samples fit 32 bits"
)]
fn tile_under(header: &RefineHeader, position: Vec3) -> u32 {
    let at =
        (position.truncate() / Vec2::from(header.step)).clamp(Vec2::ZERO, Vec2::from(header.size));
    let tile = |axis: usize| {
        ((header.first[axis] + at[axis] as u32) / TILE_CELLS).min(header.tiles[axis] - 1)
    };
    tile(1) * header.tiles[0] + tile(0)
}

fn vertices(header: &RefineHeader, tables: &[u32], points: &[Vec3]) -> Vec<FeatureVertex> {
    let mut vertices = Vec::with_capacity(header.vertex_count as usize);
    for vertex in 0..header.vertex_count {
        let word = header.vertices_word + REFINE_VERTEX_WORDS * vertex;
        let source = tables[word as usize];
        let offset = tables[word as usize + 3];
        let mut sample = if source & REFINE_STENCIL != 0 {
            stencil_sample(tables, points, source ^ REFINE_STENCIL)
        } else {
            let uv = Vec2::new(number(tables, word + 1), number(tables, word + 2));
            patch_sample(header, tables, points, source, uv)
        };
        if offset != NONE {
            sample.position.z += number(tables, offset);
            sample.du.z += number(tables, offset + 1);
            sample.dv.z += number(tables, offset + 2);
        }
        vertices.push(FeatureVertex {
            position: sample.position.into(),
            tile: tile_under(header, sample.position),
            normal: unit_normal(&sample).into(),
            position_of: tables[word as usize + 4],
        });
    }
    vertices
}

#[cfg(test)]
mod tests;
