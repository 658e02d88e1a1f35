//! Positions of all points: level 1 row by row, then every feature's levels one after the other.
//!
//! A feature reads level 1 and its own points only, so features run in any order on the caller's rayon pool, and a
//! feature's few kilobytes stay in a core's cache from level to level. The same bits come out for any number of threads.

use super::super::{
    execute::{Real, edge_point, execute_blends, execute_level, face_point, gather, vertex_point},
    mesh::previous,
};
use super::{Blocks, Changes};

/// Features a task.
const BLOCKS_A_TASK: usize = 64;

/// Positions of a table's points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Positions<T> {
    points: Vec<[T; 3]>,
}

impl<T: Real> Positions<T> {
    /// All points of `blocks` from the cage's; runs on the caller's rayon pool.
    ///
    /// # Panics
    /// When `cage` has fewer positions than the cage has vertices.
    #[must_use]
    pub fn new(blocks: &Blocks, cage: &[[T; 3]]) -> Self {
        let mut positions = Self { points: Vec::new() };
        positions.execute(blocks, cage);
        positions
    }

    /// Makes all points again, for a cage that has moved or other tables.
    ///
    /// # Panics
    /// As [`Positions::new`].
    pub fn execute(&mut self, blocks: &Blocks, cage: &[[T; 3]]) {
        let cage_points = blocks.mesh.start.len();
        let count = blocks.point_count() as usize;
        if self.points.capacity() < count {
            // Zeroed memory from the system costs nothing until it is touched.
            self.points = vec![[T::default(); 3]; count];
        } else {
            self.points.resize(count, [T::default(); 3]);
        }
        self.points[..cage_points].copy_from_slice(&cage[..cage_points]);
        self.make_all(blocks);
    }

    /// Makes the points that [`Blocks::set_depths`] or [`Blocks::change_depths`] changed.
    ///
    /// # Panics
    /// When the positions are not those of `blocks` before the change.
    pub fn update(&mut self, blocks: &Blocks, changes: &Changes) {
        self.points
            .resize(blocks.point_count() as usize, [T::default(); 3]);
        if changes.all {
            return self.make_all(blocks);
        }
        self.make_around(blocks, &changes.vertices);
        self.make_blocks(blocks, changes.blocks.clone());
        if changes.semi_sharp {
            self.make_lines(blocks);
        }
    }

    /// The positions, by number of the point; those not in use are of no meaning.
    #[must_use]
    pub fn points(&self) -> &[[T; 3]] {
        &self.points
    }

    /// All but the cage's.
    fn make_all(&mut self, blocks: &Blocks) {
        self.make_first_level(blocks);
        let has_points = |index: &u32| {
            let vertex = blocks.blocks[*index as usize].vertex;
            blocks.depth(vertex) > 1 && !blocks.is_on_line(vertex)
        };
        let with_points = (0..blocks.blocks.len() as u32).filter(has_points).collect();
        self.make_blocks(blocks, with_points);
        self.make_lines(blocks);
    }

    fn make_first_level(&mut self, blocks: &Blocks) {
        let (first, rows, points) = (&blocks.first, &blocks.first.rows, &mut self.points);
        let counts = rows.counts();
        let start = rows.first_point as usize;
        let edges = start + counts.face as usize;
        let vertices = edges + counts.edge as usize;
        let end = vertices + counts.vertex as usize;
        gather(points, start..edges, |points, index, target| {
            let row = &rows.faces[index];
            if first.is_used(row) {
                *target = face_point(points, row);
            }
        });
        gather(points, edges..vertices, |points, index, target| {
            let row = &rows.edges[index];
            if first.is_used(&row[..2]) {
                *target = edge_point(points, row);
            }
        });
        gather(points, vertices..end, |points, index, target| {
            let row = rows.vertex_row(index);
            if first.is_used(&row[..1]) {
                *target = vertex_point(points, row);
            }
        });
        execute_blends(rows, points);
    }

    /// Level-1 points around vertices of the cage.
    fn make_around(&mut self, blocks: &Blocks, vertices: &[u32]) {
        let (rows, children) = (&blocks.first.rows, &blocks.first.children);
        let points = &mut self.points;
        let counts = rows.counts();
        let edges = rows.first_point + counts.face;
        let vertex_rows = edges + counts.edge;
        let mut ring = Vec::new();
        for &vertex in vertices {
            blocks.mesh.ring(vertex, &mut ring);
            for face in ring.iter().map(|&at| at as usize / 4) {
                let point = children.face[face];
                let row = &rows.faces[(point - rows.first_point) as usize];
                points[point as usize] = face_point(points, row);
            }
        }
        for &vertex in vertices {
            blocks.mesh.ring(vertex, &mut ring);
            for &at in &ring {
                let (face, corner) = (at as usize / 4, at as usize % 4);
                for point in [corner, previous(corner)].map(|side| children.side[face][side]) {
                    let row = &rows.edges[(point - edges) as usize];
                    points[point as usize] = edge_point(points, row);
                }
            }
            let point = children.vertex[vertex as usize];
            let row = rows.vertex_row((point - vertex_rows) as usize);
            points[point as usize] = vertex_point(points, row);
        }
        execute_blends(rows, points);
    }

    /// Points of blocks that have some.
    fn make_blocks(&mut self, blocks: &Blocks, mut list: Vec<u32>) {
        list.sort_unstable_by_key(|&index| blocks.blocks[index as usize].first_point);
        let (above, below) = self
            .points
            .split_at_mut(blocks.first.rows.end_point() as usize);
        make_runs(blocks, &list, above, (above.len(), below));
    }

    fn make_lines(&mut self, blocks: &Blocks) {
        let tables = blocks.semi_sharp.tables.iter();
        for rows in tables.flat_map(|tables| &tables.levels) {
            execute_level(rows, &mut self.points);
        }
    }
}

/// Makes the points of blocks in the order they lie in `points`, the first of which is numbered `first`.
fn make_runs<T: Real>(
    blocks: &Blocks,
    list: &[u32],
    above: &[[T; 3]],
    (first, points): (usize, &mut [[T; 3]]),
) {
    if list.len() > BLOCKS_A_TASK {
        let (left, right) = list.split_at(list.len() / 2);
        let middle = blocks.blocks[right[0] as usize].first_point as usize;
        let (left_points, right_points) = points.split_at_mut(middle - first);
        rayon::join(
            || make_runs(blocks, left, above, (first, left_points)),
            || make_runs(blocks, right, above, (middle, right_points)),
        );
        return;
    }
    let mut inner = Vec::new();
    for &index in list {
        let block = &blocks.blocks[index as usize];
        let template = blocks.template(block);
        let start = block.first_point as usize - first;
        let length = blocks.run_length(block, blocks.depth(block.vertex)) as usize;
        let mut levels =
            points[start..start + length].chunks_exact_mut(template.lattice.points() as usize);
        inner.clear();
        inner.extend(
            blocks
                .ring(block)
                .1
                .iter()
                .map(|&point| above[point as usize]),
        );
        let Some(mut level) = levels.next() else {
            continue;
        };
        template.execute(&inner, level);
        for below in levels {
            template.execute(level, below);
            level = below;
        }
    }
}
