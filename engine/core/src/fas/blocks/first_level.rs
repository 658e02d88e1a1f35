//! Level 1, which features share: its points are numbered once for all depths, and only those in use are made.
//!
//! A level-1 point is in use when it is a face, edge or vertex point around a *wanted* vertex: a corner of a face that
//! is refined. What is numbered is what would be in use if every feature were refined, so depths may change without a
//! number changing.

use super::super::{
    mesh::{Mesh, next, previous},
    patch::{child_grid, sharp_sides},
    refine::{Children, child_corners, refine},
    rows::LevelRows,
};

/// The rows of level 1, and which of them are in use.
#[derive(Clone, Debug, Default)]
pub(super) struct FirstLevel {
    /// The rows, those of all features at once.
    pub(super) rows: LevelRows,
    /// The point of every face, side and vertex of the cage.
    pub(super) children: Children,
    /// True for corners of refined faces.
    wanted: Vec<bool>,
}

impl FirstLevel {
    /// Numbers the points around all features; none is in use.
    pub(super) fn new(mesh: &Mesh) -> Self {
        let touches = |corners: &[u32; 4]| {
            let is_feature = |&corner: &u32| mesh.feature[corner as usize] != Mesh::REGULAR;
            corners.iter().any(is_feature)
        };
        let refined = mesh.corners.iter().map(touches).collect();
        let (children, rows) = refine(mesh, refined, mesh.start.len() as u32);
        Self {
            rows,
            children,
            wanted: vec![false; mesh.start.len()],
        }
    }

    /// Finds anew what is in use.
    pub(super) fn want_all(&mut self, mesh: &Mesh) {
        self.wanted.fill(false);
        for face in (0..mesh.face_count()).filter(|&face| mesh.is_refined(face, 0)) {
            for corner in mesh.corners[face] {
                self.wanted[corner as usize] = true;
            }
        }
    }

    /// Finds anew what is in use around vertices whose depth has become 0 or has been; gives the vertices that became
    /// wanted.
    pub(super) fn want_around(&mut self, mesh: &Mesh, vertices: &[u32]) -> Vec<u32> {
        let (mut ring, mut corners) = (Vec::new(), Vec::new());
        let mut found = Vec::new();
        for &vertex in vertices {
            mesh.ring(vertex, &mut ring);
            for corner in ring.iter().flat_map(|&at| mesh.corners[at as usize / 4]) {
                mesh.ring(corner, &mut corners);
                let mut faces = corners.iter().map(|&at| at as usize / 4);
                let is_wanted = faces.any(|face| mesh.is_refined(face, 0));
                let was = std::mem::replace(&mut self.wanted[corner as usize], is_wanted);
                if is_wanted && !was {
                    found.push(corner);
                }
            }
        }
        found
    }

    /// True for a row with one of these points of the cage at its centre, corners or ends.
    pub(super) fn is_used(&self, points: &[u32]) -> bool {
        points.iter().any(|&point| self.wanted[point as usize])
    }

    /// Points in use.
    pub(super) fn used_count(&self) -> u32 {
        let rows = &self.rows;
        let faces = rows.faces.iter().filter(|row| self.is_used(*row)).count();
        let edges = rows
            .edges
            .iter()
            .filter(|row| self.is_used(&row[..2]))
            .count();
        let vertex = |index: &usize| self.is_used(&rows.vertex_row(*index)[..1]);
        let vertices = (0..rows.counts().vertex as usize).filter(vertex).count();
        (faces + edges + vertices) as u32
    }

    /// The level-1 points within 2 of a feature, in the numbers of its lattice.
    pub(super) fn inner_points(
        &self,
        mesh: &Mesh,
        corners: &[u32],
        is_closed: bool,
        points: &mut Vec<u32>,
    ) {
        let Children {
            face: faces,
            side: sides,
            vertex: vertices,
            ..
        } = &self.children;
        let places = || corners.iter().map(|&at| (at as usize / 4, at as usize % 4));
        let vertex = |face: usize, corner: usize| vertices[mesh.corners[face][corner] as usize];
        if let Some((face, corner)) = places().next() {
            points.push(vertex(face, corner));
        }
        for (face, corner) in places() {
            points.extend([sides[face][corner], vertex(face, next(corner))]);
        }
        if let (false, Some((face, corner))) = (is_closed, places().next_back()) {
            points.extend([
                sides[face][previous(corner)],
                vertex(face, previous(corner)),
            ]);
        }
        for (face, corner) in places() {
            let across = (corner + 2) % 4;
            points.extend([
                faces[face],
                sides[face][next(corner)],
                sides[face][across],
                vertex(face, across),
            ]);
        }
    }

    /// The sixteen controls of a refined face's child, and its sharp sides; NONE beyond these.
    pub(super) fn patch(&self, mesh: &Mesh, face: usize, corner: usize) -> ([u32; 16], u8) {
        let own = child_corners(mesh, &self.children, face, corner);
        let sharp = sharp_sides(mesh, face) & (1 << corner | 1 << previous(corner));
        let grid = child_grid(mesh, &self.children, (face, corner), own, sharp);
        (grid, sharp)
    }

    /// Bytes of all that is kept.
    pub(super) fn byte_count(&self) -> usize {
        let children = &self.children;
        self.rows.byte_count()
            + size_of_val(children.face.as_slice())
            + size_of_val(children.side.as_slice())
            + size_of_val(children.vertex.as_slice())
            + children.refined.len()
            + self.wanted.len()
    }
}
