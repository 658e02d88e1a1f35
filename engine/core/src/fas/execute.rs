//! Executing the subdivision table: positions of all points from the cage's.
//!
//! Gathers only, level by level and kind by kind, so that rows of one kind may run in any order; the twin of the GPU's
//! points stage.

use std::ops::Range;

use rayon::prelude::*;

use super::{LevelRows, Tables};
use crate::subdiv::Real;

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
fn execute_level<T: Real>(rows: &LevelRows, points: &mut [[T; 3]]) {
    let quarter = T::of(0.25);
    let first = rows.first_point as usize;
    let edges = first + rows.faces.len();
    let vertices = edges + rows.edges.len();
    let end = vertices + rows.counts().vertex as usize;
    let mean = |points: &[[T; 3]], row: &[u32; 4]| scale(quarter, sum(points, row));
    gather(points, first..edges, |points, index| {
        mean(points, &rows.faces[index])
    });
    gather(points, edges..vertices, |points, index| {
        mean(points, &rows.edges[index])
    });
    execute_blends(rows, first..vertices, points);
    gather(points, vertices..end, |points, index| {
        vertex_point(points, rows.vertex_row(index))
    });
    execute_blends(rows, vertices..end, points);
    execute_phantoms(rows, points);
}

/// Fills a range of points by a function of the points before it and the index in the range.
fn gather<T: Real>(
    points: &mut [[T; 3]],
    range: Range<usize>,
    point: impl Fn(&[[T; 3]], usize) -> [T; 3] + Sync,
) {
    let (before, rest) = points.split_at_mut(range.start);
    let before = &*before;
    rest[..range.len()]
        .par_chunks_mut(ROWS_A_TASK)
        .enumerate()
        .for_each(|(task, chunk)| {
            for (offset, target) in chunk.iter_mut().enumerate() {
                *target = point(before, task * ROWS_A_TASK + offset);
            }
        });
}

fn vertex_point<T: Real>(points: &[[T; 3]], row: &[u32]) -> [T; 3] {
    let vertex = points[row[0] as usize];
    match row.len() {
        1 => vertex,
        3 => add(
            scale(T::of(0.75), vertex),
            scale(T::of(0.125), sum(points, &row[1..])),
        ),
        length => {
            let n = (length / 2) as f64;
            add(
                scale(T::of((n - 2.0) / n), vertex),
                scale(T::of(1.0 / (n * n)), sum(points, &row[1..])),
            )
        }
    }
}

fn execute_blends<T: Real>(rows: &LevelRows, range: Range<usize>, points: &mut [[T; 3]]) {
    for row in rows
        .blends
        .iter()
        .filter(|row| range.contains(&(row.point as usize)))
    {
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

fn sum<T: Real>(points: &[[T; 3]], row: &[u32]) -> [T; 3] {
    row.iter().fold([T::default(); 3], |sum, &point| {
        add(sum, points[point as usize])
    })
}

pub(super) fn add<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scale<T: Real>(factor: T, a: [T; 3]) -> [T; 3] {
    [factor * a[0], factor * a[1], factor * a[2]]
}
