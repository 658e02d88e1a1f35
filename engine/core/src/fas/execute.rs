//! Executing the subdivision table: positions of all points from the cage's.
//!
//! Gathers only, level by level and kind by kind, so that rows of one kind may run in any order; the stage
//! `refine` does the same in f32.

use std::ops::Range;

use rayon::prelude::*;

use super::{LevelRows, Tables};
pub(super) use crate::subdiv::Real;

/// Rows a task: large enough to be worth one, small enough to share.
const ROWS_A_TASK: usize = 4096;

impl Tables {
    /// Positions of all points, the cage's first; runs on the caller's rayon pool.
    ///
    /// # Panics
    /// When `cage` has fewer positions than the table's cage has points.
    #[must_use]
    pub fn execute<T: Real>(&self, cage: &[[T; 3]]) -> Vec<[T; 3]> {
        let mut points = vec![[T::default(); 3]; self.point_count() as usize];
        points[..self.cage_points as usize].copy_from_slice(&cage[..self.cage_points as usize]);
        execute_phantoms(&self.base, &mut points);
        for rows in &self.levels {
            execute_level(rows, &mut points);
        }
        points
    }
}

/// Makes a level's points; those before it are there.
pub(super) fn execute_level<T: Real>(rows: &LevelRows, points: &mut [[T; 3]]) {
    let first = rows.first_point as usize;
    let edges = first + rows.faces.len();
    let vertices = edges + rows.edges.len();
    let end = vertices + rows.counts().vertex as usize;
    gather(points, first..edges, |points, index, target| {
        *target = face_point(points, &rows.faces[index]);
    });
    gather(points, edges..vertices, |points, index, target| {
        *target = edge_point(points, &rows.edges[index]);
    });
    gather(points, vertices..end, |points, index, target| {
        *target = vertex_point(points, rows.vertex_row(index));
    });
    execute_blends(rows, points);
    execute_phantoms(rows, points);
}

/// Fills a range of points by a function of the points before it and the index in the range.
pub(super) fn gather<T: Real>(
    points: &mut [[T; 3]],
    range: Range<usize>,
    fill: impl Fn(&[[T; 3]], usize, &mut [T; 3]) + Sync,
) {
    let (before, rest) = points.split_at_mut(range.start);
    let before = &*before;
    rest[..range.len()]
        .par_chunks_mut(ROWS_A_TASK)
        .enumerate()
        .for_each(|(task, chunk)| {
            for (offset, target) in chunk.iter_mut().enumerate() {
                fill(before, task * ROWS_A_TASK + offset, target);
            }
        });
}

/// The point of a face row.
pub(super) fn face_point<T: Real>(points: &[[T; 3]], row: &[u32; 4]) -> [T; 3] {
    mean(row.map(|point| points[point as usize]))
}

/// The point of an edge row.
pub(super) fn edge_point<T: Real>(points: &[[T; 3]], row: &[u32; 4]) -> [T; 3] {
    let [a, b, f, g] = row.map(|point| points[point as usize]);
    mean([a, f, b, g])
}

/// The point of a vertex row.
pub(super) fn vertex_point<T: Real>(points: &[[T; 3]], row: &[u32]) -> [T; 3] {
    let at = |index: usize| points[row[index] as usize];
    match row.len() {
        1 => at(0),
        3 => crease_point(at(0), [at(1), at(2)]),
        length => smooth_point(at(0), length / 2, |i| at(1 + 2 * i), |i| at(2 + 2 * i)),
    }
}

/// The mean of four points around something; the same bits wherever the walk around it begins and whichever way it
/// goes, so that copies of a point are equal.
pub(super) fn mean<T: Real>([a, b, c, d]: [[T; 3]; 4]) -> [T; 3] {
    scale(T::of(0.25), add(add(a, c), add(b, d)))
}

/// The vertex point on a crease that runs to two ends.
pub(super) fn crease_point<T: Real>(vertex: [T; 3], [a, b]: [[T; 3]; 2]) -> [T; 3] {
    add(scale(T::of(0.75), vertex), scale(T::of(0.125), add(a, b)))
}

/// The smooth vertex point of a vertex with `valence` ends of edges and face points in ring order.
pub(super) fn smooth_point<T: Real>(
    vertex: [T; 3],
    valence: usize,
    end: impl Fn(usize) -> [T; 3],
    face: impl Fn(usize) -> [T; 3],
) -> [T; 3] {
    let n = valence as f64;
    let ring = add(ring_sum(valence, end), ring_sum(valence, face));
    add(
        scale(T::of((n - 2.0) / n), vertex),
        scale(T::of(1.0 / (n * n)), ring),
    )
}

/// The sum of what lies around a vertex; of four, the same bits wherever the ring begins.
fn ring_sum<T: Real>(valence: usize, at: impl Fn(usize) -> [T; 3]) -> [T; 3] {
    if valence == 4 {
        return add(add(at(0), at(2)), add(at(1), at(3)));
    }
    (0..valence).fold([T::default(); 3], |sum, index| add(sum, at(index)))
}

/// Makes the points that are gathered by explicit weights. They gather none of each other.
pub(super) fn execute_blends<T: Real>(rows: &LevelRows, points: &mut [[T; 3]]) {
    for row in &rows.blends {
        let zero = [T::default(); 3];
        points[row.point as usize] = row.weights.iter().fold(zero, |sum, &(point, weight)| {
            add(sum, scale(T::of(weight), points[point as usize]))
        });
    }
}

fn execute_phantoms<T: Real>(rows: &LevelRows, points: &mut [[T; 3]]) {
    let first = rows.first_point + rows.counts().total();
    for (&[border, within], point) in rows.phantoms.iter().zip(first..) {
        let [border, within] = [points[border as usize], points[within as usize]];
        points[point as usize] = [0, 1, 2].map(|axis| border[axis] + border[axis] - within[axis]);
    }
}

pub(super) fn add<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scale<T: Real>(factor: T, a: [T; 3]) -> [T; 3] {
    [factor * a[0], factor * a[1], factor * a[2]]
}
