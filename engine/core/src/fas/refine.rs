//! One step of sparse refinement: the faces around features that want more depth, their points, their children.
//!
//! Refined are the faces with a feature at a corner whose depth is greater than the level. For every corner of such a
//! face its vertex point, the edge points of all its edges and the face points of all its faces are made: these are the
//! controls of every patch among the children, 12 N + 1 of them around a feature of valence N that stands alone.
//!
//! Based on: M. Nießner, C. Loop, M. Meyer, T. DeRose, *Feature-adaptive GPU rendering of Catmull-Clark subdivision
//! surfaces* (2012), section 4.

use super::{
    feature::is_feature,
    mesh::{ABSENT, Mesh, narrow, next, previous},
    rows::{BlendRow, LevelRows},
};
use crate::{
    cage::NONE,
    subdiv::{VertexMask, child_sharpness, edge_mask, vertex_mask},
};

/// Points a level gives to the next: the child point of each face, side and vertex; [`NONE`] where there is none.
#[derive(Clone, Debug, Default)]
pub(super) struct Children {
    /// True for refined faces.
    pub(super) refined: Vec<bool>,
    /// Face points.
    pub(super) face: Vec<u32>,
    /// Edge points, one entry a side, equal on both sides of an edge.
    pub(super) side: Vec<[u32; 4]>,
    /// Vertex points.
    pub(super) vertex: Vec<u32>,
}

/// Which faces of a level are refined; none when no face wants it.
pub(super) fn refined_faces(mesh: &Mesh, level: u8) -> Option<Vec<bool>> {
    let refined: Vec<bool> = (0..mesh.face_count())
        .map(|face| mesh.is_refined(face, level))
        .collect();
    refined.contains(&true).then_some(refined)
}

/// Makes the points of the next level, the first of them numbered `first_point`.
pub(super) fn refine(mesh: &Mesh, refined: Vec<bool>, first_point: u32) -> (Children, LevelRows) {
    let wanted = wanted_vertices(mesh, &refined);
    let mut rows = LevelRows {
        first_point,
        ..LevelRows::default()
    };
    let face = face_rows(mesh, &wanted, &mut rows);
    let side = edge_rows(mesh, &wanted, &face, &mut rows);
    let vertex = vertex_rows(mesh, &wanted, &face, &mut rows);
    (
        Children {
            refined,
            face,
            side,
            vertex,
        },
        rows,
    )
}

/// Vertices at the corners of refined faces.
fn wanted_vertices(mesh: &Mesh, refined: &[bool]) -> Vec<bool> {
    let mut wanted = vec![false; mesh.start.len()];
    for (corners, _) in mesh
        .corners
        .iter()
        .zip(refined)
        .filter(|(_, refined)| **refined)
    {
        for &corner in corners {
            wanted[corner as usize] = true;
        }
    }
    wanted
}

fn face_rows(mesh: &Mesh, wanted: &[bool], rows: &mut LevelRows) -> Vec<u32> {
    let mut made = vec![NONE; mesh.face_count()];
    for (face, corners) in mesh.corners.iter().enumerate() {
        if corners.iter().any(|&corner| wanted[corner as usize]) {
            made[face] = rows.first_point + rows.faces.len() as u32;
            rows.faces
                .push(corners.map(|corner| mesh.first_point + corner));
        }
    }
    made
}

fn edge_rows(mesh: &Mesh, wanted: &[bool], faces: &[u32], rows: &mut LevelRows) -> Vec<[u32; 4]> {
    let first = rows.first_point + rows.faces.len() as u32;
    let mut made = vec![[NONE; 4]; mesh.face_count()];
    for face in (0..mesh.face_count()).filter(|&face| faces[face] != NONE) {
        for side in 0..4 {
            let ends = [mesh.corners[face][side], mesh.corners[face][next(side)]];
            let needed = ends.iter().any(|&end| wanted[end as usize]);
            if !needed || made[face][side] != NONE {
                continue;
            }
            let point = first + rows.edges.len() as u32;
            let across = mesh.across[face][side];
            made[face][side] = point;
            if across < ABSENT {
                made[across as usize / 4][across as usize % 4] = point;
            }
            push_edge_row(mesh, (face, side), point, faces, rows);
        }
    }
    made
}

fn push_edge_row(
    mesh: &Mesh,
    (face, side): (usize, usize),
    point: u32,
    faces: &[u32],
    rows: &mut LevelRows,
) {
    let [a, b] = [mesh.point(face, side), mesh.point(face, next(side))];
    let sharpness = f64::from(mesh.sharpness(face, side));
    if sharpness >= 1.0 {
        rows.edges.push([a, b, a, b]);
        return;
    }
    let [f, g] = [faces[face], faces[mesh.across[face][side] as usize / 4]];
    rows.edges.push([a, b, f, g]);
    if sharpness > 0.0 {
        let mask = edge_mask(sharpness);
        rows.blends.push(BlendRow {
            point,
            weights: vec![(a, mask.end), (b, mask.end), (f, mask.face), (g, mask.face)],
        });
    }
}

fn vertex_rows(mesh: &Mesh, wanted: &[bool], faces: &[u32], rows: &mut LevelRows) -> Vec<u32> {
    let first = rows.first_point + (rows.faces.len() + rows.edges.len()) as u32;
    let mut made = vec![NONE; mesh.start.len()];
    let mut ring = Ring::default();
    rows.vertex_offsets.push(0);
    for vertex in (0..mesh.start.len()).filter(|&vertex| wanted[vertex]) {
        made[vertex] = first + (rows.vertex_offsets.len() - 1) as u32;
        ring.read(mesh, vertex as u32, faces);
        push_vertex_row(&ring, mesh.first_point + vertex as u32, made[vertex], rows);
        rows.vertex_offsets.push(rows.vertex_points.len() as u32);
    }
    made
}

fn push_vertex_row(ring: &Ring, vertex: u32, point: u32, rows: &mut LevelRows) {
    let mask = vertex_mask(ring.own_sharpness, ring.sharpness.iter().copied());
    let n = ring.ends.len();
    let pairs = || {
        ring.ends
            .iter()
            .zip(&ring.face_points)
            .flat_map(|(&end, &face)| [end, face])
    };
    rows.vertex_points.push(vertex);
    if mask == VertexMask::CORNER {
        return;
    }
    if mask == VertexMask::crease(mask.crease_edges) {
        rows.vertex_points
            .extend(mask.crease_edges.map(|edge| ring.ends[edge]));
        return;
    }
    if mask == VertexMask::smooth(n) && ring.closed {
        rows.vertex_points.extend(pairs());
        return;
    }
    let mut weights = vec![(vertex, mask.vertex)];
    if mask.edge != 0.0 || mask.face != 0.0 {
        weights.extend(ring.ends.iter().map(|&end| (end, mask.edge)));
        weights.extend(ring.face_points.iter().map(|&face| (face, mask.face)));
    }
    if mask.crease != 0.0 {
        weights.extend(mask.crease_edges.map(|edge| (ring.ends[edge], mask.crease)));
    }
    rows.blends.push(BlendRow { point, weights });
}

/// What lies around a vertex: far ends of its edges with their sharpness, face points of its faces.
#[derive(Default)]
struct Ring {
    corners: Vec<u32>,
    closed: bool,
    own_sharpness: f64,
    ends: Vec<u32>,
    sharpness: Vec<f64>,
    face_points: Vec<u32>,
}

impl Ring {
    fn read(&mut self, mesh: &Mesh, vertex: u32, faces: &[u32]) {
        self.closed = mesh.ring(vertex, &mut self.corners);
        self.own_sharpness = f64::from(mesh.vertex_sharpness(vertex));
        self.ends.clear();
        self.sharpness.clear();
        self.face_points.clear();
        for &corner in &self.corners {
            let (face, side) = (corner as usize / 4, corner as usize % 4);
            self.ends.push(mesh.point(face, next(side)));
            self.sharpness.push(f64::from(mesh.sharpness(face, side)));
            self.face_points.push(faces[face]);
        }
        if let (false, Some(&last)) = (self.closed, self.corners.last()) {
            let (face, side) = (last as usize / 4, previous(last as usize % 4));
            self.ends.push(mesh.point(face, side));
            self.sharpness.push(f64::from(mesh.sharpness(face, side)));
        }
    }
}

/// The children of refined faces as the mesh of the next level.
pub(super) fn child_mesh(mesh: &Mesh, children: &Children, rows: &LevelRows) -> Mesh {
    let counts = rows.counts();
    let mut first_child = vec![NONE; mesh.face_count()];
    let mut child = Mesh {
        first_point: rows.first_point,
        feature: vec![Mesh::REGULAR; counts.total() as usize],
        extraordinary: vec![false; counts.total() as usize],
        start: vec![NONE; counts.total() as usize],
        ..Mesh::default()
    };
    for face in (0..mesh.face_count()).filter(|&face| children.refined[face]) {
        first_child[face] = child.corners.len() as u32;
        for corner in 0..4 {
            child.corners.push(
                child_corners(mesh, children, face, corner).map(|point| point - rows.first_point),
            );
            child.parents.push((face as u32, corner as u8));
        }
    }
    child.across = child_sides(mesh, children, &first_child);
    child_tags(mesh, children, &mut child);
    child_features(mesh, children, &mut child);
    child_starts(&mut child);
    child
}

/// Points of child `corner`: the parent's vertex point at the same corner, then counter-clockwise.
pub(super) fn child_corners(
    mesh: &Mesh,
    children: &Children,
    face: usize,
    corner: usize,
) -> [u32; 4] {
    let mut points = [0; 4];
    points[corner] = children.vertex[mesh.corners[face][corner] as usize];
    points[next(corner)] = children.side[face][corner];
    points[(corner + 2) % 4] = children.face[face];
    points[previous(corner)] = children.side[face][previous(corner)];
    points
}

fn child_sides(mesh: &Mesh, children: &Children, first_child: &[u32]) -> Vec<[u32; 4]> {
    let mut sides = Vec::new();
    for face in (0..mesh.face_count()).filter(|&face| children.refined[face]) {
        let first = first_child[face];
        for corner in 0..4 {
            let mut across = [NONE; 4];
            across[next(corner)] = (first + next(corner) as u32) * 4 + previous(corner) as u32;
            across[(corner + 2) % 4] = (first + previous(corner) as u32) * 4 + corner as u32;
            // The first half of side `corner`, and the second half of the side before it.
            for (side, second) in [(corner, false), (previous(corner), true)] {
                across[side] = child_across(mesh.across[face][side], second, first_child);
            }
            sides.push(across);
        }
    }
    sides
}

/// The child's side across half of a side: the neighbour walks it the other way.
fn child_across(across: u32, second_half: bool, first_child: &[u32]) -> u32 {
    if across >= ABSENT {
        return across;
    }
    let (face, side) = (across as usize / 4, across as usize % 4);
    if first_child[face] == NONE {
        return ABSENT;
    }
    let child = if second_half { side } else { next(side) };
    (first_child[face] + child as u32) * 4 + side as u32
}

fn child_tags(mesh: &Mesh, children: &Children, child: &mut Mesh) {
    if !mesh.sharpness.is_empty() {
        child.sharpness = child
            .parents
            .iter()
            .map(|&(face, corner)| {
                let (face, corner) = (face as usize, corner as usize);
                let mut sides = [0.0; 4];
                for side in [corner, previous(corner)] {
                    sides[side] = mesh.child_side_sharpness(face, side);
                }
                sides
            })
            .collect();
    }
    if !mesh.vertex_sharpness.is_empty() {
        child.vertex_sharpness = vec![0.0; child.feature.len()];
        for (vertex, &point) in children
            .vertex
            .iter()
            .enumerate()
            .filter(|(_, point)| **point != NONE)
        {
            let sharpness = child_sharpness(f64::from(mesh.vertex_sharpness[vertex]));
            child.vertex_sharpness[(point - child.first_point) as usize] = narrow(sharpness);
        }
    }
    if !mesh.holes.is_empty() {
        child.holes = child
            .parents
            .iter()
            .map(|&(face, _)| mesh.holes[face as usize])
            .collect();
    }
}

/// Features of the children: a feature's vertex point while it still is one, and edge points of sides that stay
/// semi-sharp, with the lesser depth of the side's ends.
fn child_features(mesh: &Mesh, children: &Children, child: &mut Mesh) {
    let tagged = !mesh.sharpness.is_empty() || !mesh.vertex_sharpness.is_empty();
    let mut ring = Vec::new();
    for (vertex, &point) in children
        .vertex
        .iter()
        .enumerate()
        .filter(|(_, point)| **point != NONE)
    {
        let stays = !tagged || is_still_feature(mesh, vertex as u32, &mut ring);
        let at = (point - child.first_point) as usize;
        child.extraordinary[at] = mesh.extraordinary[vertex];
        if stays {
            child.feature[at] = mesh.feature[vertex];
        }
    }
    for face in (0..mesh.face_count()).filter(|_| !mesh.sharpness.is_empty()) {
        for side in 0..4 {
            let point = children.side[face][side];
            let sharpness = mesh.child_side_sharpness(face, side);
            if point != NONE && sharpness > 0.0 && sharpness.is_finite() {
                let ends =
                    [side, next(side)].map(|end| mesh.feature[mesh.corners[face][end] as usize]);
                child.feature[(point - child.first_point) as usize] = ends[0].min(ends[1]);
            }
        }
    }
}

/// True when a feature's vertex point is a feature with what its sharpness has become.
pub(super) fn is_still_feature(mesh: &Mesh, vertex: u32, ring: &mut Vec<u32>) -> bool {
    if mesh.feature[vertex as usize] == Mesh::REGULAR {
        return false;
    }
    let closed = mesh.ring(vertex, ring);
    let mut sharpness: Vec<f32> = ring
        .iter()
        .map(|&side| mesh.child_side_sharpness(side as usize / 4, side as usize % 4))
        .collect();
    if let (false, Some(&last)) = (closed, ring.last()) {
        sharpness.push(mesh.child_side_sharpness(last as usize / 4, previous(last as usize % 4)));
    }
    let own = narrow(child_sharpness(f64::from(mesh.vertex_sharpness(vertex))));
    is_feature(own, &sharpness, closed)
}

/// One corner a vertex; for boundary vertices the one whose own side is the boundary, where the ring begins.
fn child_starts(child: &mut Mesh) {
    for face in 0..child.face_count() {
        for corner in 0..4 {
            let vertex = child.corners[face][corner] as usize;
            let here = (face * 4 + corner) as u32;
            if child.start[vertex] == NONE || child.across[face][corner] >= ABSENT {
                child.start[vertex] = here;
            }
        }
    }
}
