//! A checked cage and what is next to what in it.
//!
//! Everything is flat arrays. A *corner* is a face's place at a vertex: corner `c` of face `f` lies in
//! `face_corners(f)`, and the half-edge from it to the face's next corner has the same number. Rings run
//! counter-clockwise seen from outside:
//!
//! ```text
//!          e2                    boundary vertex: n faces, n + 1 edges
//!      f2  |  f1                 e0 and e(n) are the boundary edges
//!   e3 ----v---- e1 … e0 leaves the vertex as the side of f0 that starts there,
//!      f3  |  f0                 e1 arrives at it as the side of f0 that ends there
//!          e0                    inner vertex: n faces, n edges, f0 is the lowest-numbered
//! ```

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use std::ops::Range;

use super::CageError;
use super::faces::{Faces, Tags};

/// No such face: the second face of a boundary edge.
pub const NONE: u32 = u32::MAX;

/// Positions and topology of a control cage: manifold, consistently turned, every number finite.
#[derive(Clone, Debug)]
pub struct Cage {
    /// One position a vertex.
    positions: Vec<[f64; 3]>,
    topology: Topology,
}

/// What is next to what, and what is sharp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topology {
    pub(super) vertex_count: u32,
    pub(super) faces: Faces,
    /// Face of each corner; empty where all faces are quads.
    pub(super) corner_faces: Vec<u32>,
    /// Edge from each corner to the next of its face.
    pub(super) corner_edges: Vec<u32>,
    pub(super) edge_vertices: Vec<[u32; 2]>,
    pub(super) edge_faces: Vec<[u32; 2]>,
    pub(super) edge_sharpness: Vec<f64>,
    pub(super) vertex_sharpness: Vec<f64>,
    /// Start of each vertex's edges, and of its corners, in the two lists below.
    pub(super) ring_edge_offsets: Vec<u32>,
    pub(super) ring_corner_offsets: Vec<u32>,
    pub(super) ring_edges: Vec<u32>,
    pub(super) ring_corners: Vec<u32>,
    /// One flag a face; empty where there are no holes.
    pub(super) holes: Vec<bool>,
}

impl Cage {
    /// Checks and links a cage. Vertices of no face are kept; subdivision leaves them where they are.
    ///
    /// # Errors
    /// One [`CageError`] for the first thing that is wrong: no faces, a face of fewer than three corners or with a
    /// corner twice, a missing vertex, a repeated face, an edge of three faces, a vertex of two fans, neighbours turned
    /// opposite ways, a coordinate or a sharpness that is not finite or out of range, a tag on what is not there.
    pub fn new(positions: Vec<[f64; 3]>, faces: Faces, tags: &Tags) -> Result<Self, CageError> {
        super::build::check_positions(&positions)?;
        let topology =
            super::build::link(u32::try_from(positions.len()).unwrap_or(NONE), faces, tags)?;
        Ok(Self {
            positions,
            topology,
        })
    }

    /// The same cage with every vertex moved.
    ///
    /// # Errors
    /// [`CageError`] for a position that is not finite.
    pub fn moved(&self, to: impl Fn([f64; 3]) -> [f64; 3]) -> Result<Self, CageError> {
        let positions: Vec<_> = self
            .positions
            .iter()
            .map(|&position| to(position))
            .collect();
        super::build::check_positions(&positions)?;
        Ok(Self {
            positions,
            topology: self.topology.clone(),
        })
    }

    /// Positions, one a vertex.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// What is next to what.
    #[must_use]
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Least and greatest coordinates of all vertices.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for position in &self.positions {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(position[axis]);
                bounds[1][axis] = bounds[1][axis].max(position[axis]);
            }
        }
        bounds
    }

    /// Largest side of [`Cage::bounds`].
    #[must_use]
    pub fn extent(&self) -> f64 {
        let [low, high] = self.bounds();
        (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max)
    }
}

impl Topology {
    /// Vertices, those of no face among them.
    #[must_use]
    pub fn vertex_count(&self) -> u32 {
        self.vertex_count
    }

    /// Faces.
    #[must_use]
    pub fn face_count(&self) -> u32 {
        self.faces.count()
    }

    /// Edges.
    #[must_use]
    pub fn edge_count(&self) -> u32 {
        self.edge_vertices.len() as u32
    }

    /// Corners: the sum of all faces' sizes.
    #[must_use]
    pub fn corner_count(&self) -> u32 {
        self.corner_edges.len() as u32
    }

    /// The faces as they were given.
    #[must_use]
    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// True when every face has four corners.
    #[must_use]
    pub fn all_quads(&self) -> bool {
        self.corner_faces.is_empty()
    }

    /// Numbers of a face's corners.
    #[must_use]
    #[inline]
    pub fn face_corners(&self, face: u32) -> Range<usize> {
        self.faces.corners(face)
    }

    /// A face's vertices.
    #[must_use]
    #[inline]
    pub fn face_vertices(&self, face: u32) -> &[u32] {
        self.faces.vertices(face)
    }

    /// A face's edges, the first from its first to its second vertex.
    #[must_use]
    #[inline]
    pub fn face_edges(&self, face: u32) -> &[u32] {
        &self.corner_edges[self.face_corners(face)]
    }

    /// The face of a corner.
    #[must_use]
    #[inline]
    pub fn corner_face(&self, corner: u32) -> u32 {
        if self.all_quads() {
            corner / 4
        } else {
            self.corner_faces[corner as usize]
        }
    }

    /// The vertex of a corner.
    #[must_use]
    #[inline]
    pub fn corner_vertex(&self, corner: u32) -> u32 {
        self.faces.list()[corner as usize]
    }

    /// A corner's place in its face, from 0.
    #[must_use]
    #[inline]
    pub fn corner_place(&self, corner: u32) -> usize {
        corner as usize - self.face_corners(self.corner_face(corner)).start
    }

    /// An edge's two ends, in the direction its first face walks it.
    #[must_use]
    #[inline]
    pub fn edge_vertices(&self, edge: u32) -> [u32; 2] {
        self.edge_vertices[edge as usize]
    }

    /// An edge's faces; the second is [`NONE`] on a boundary.
    #[must_use]
    #[inline]
    pub fn edge_faces(&self, edge: u32) -> [u32; 2] {
        self.edge_faces[edge as usize]
    }

    /// The other end of an edge.
    #[must_use]
    #[inline]
    pub fn edge_end(&self, edge: u32, vertex: u32) -> u32 {
        let [a, b] = self.edge_vertices(edge);
        if a == vertex { b } else { a }
    }

    /// True for an edge of one face.
    #[must_use]
    #[inline]
    pub fn is_boundary_edge(&self, edge: u32) -> bool {
        self.edge_faces(edge)[1] == NONE
    }

    /// An edge's sharpness: 0 smooth, infinite on boundaries and from 10 on.
    #[must_use]
    #[inline]
    pub fn edge_sharpness(&self, edge: u32) -> f64 {
        self.edge_sharpness[edge as usize]
    }

    /// A vertex's own sharpness; infinite for boundary vertices of one face.
    #[must_use]
    #[inline]
    pub fn vertex_sharpness(&self, vertex: u32) -> f64 {
        self.vertex_sharpness[vertex as usize]
    }

    /// A vertex's edges, counter-clockwise.
    #[must_use]
    #[inline]
    pub fn vertex_edges(&self, vertex: u32) -> &[u32] {
        range(&self.ring_edges, &self.ring_edge_offsets, vertex)
    }

    /// A vertex's corners, one a face, counter-clockwise; the `i`-th lies between edges `i` and `i + 1`.
    #[must_use]
    #[inline]
    pub fn vertex_corners(&self, vertex: u32) -> &[u32] {
        range(&self.ring_corners, &self.ring_corner_offsets, vertex)
    }

    /// A vertex's faces, counter-clockwise.
    pub fn vertex_faces(&self, vertex: u32) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.vertex_corners(vertex)
            .iter()
            .map(|&corner| self.corner_face(corner))
    }

    /// Edges at a vertex.
    #[must_use]
    pub fn valence(&self, vertex: u32) -> usize {
        self.vertex_edges(vertex).len()
    }

    /// True for a vertex with boundary edges.
    #[must_use]
    #[inline]
    pub fn is_boundary_vertex(&self, vertex: u32) -> bool {
        self.vertex_edges(vertex).len() != self.vertex_corners(vertex).len()
    }

    /// True for a vertex that stays irregular at every depth by topology alone: of inner valence other than 4, or of more
    /// than two boundary faces.
    #[must_use]
    pub fn is_extraordinary(&self, vertex: u32) -> bool {
        let faces = self.vertex_corners(vertex).len();
        if self.is_boundary_vertex(vertex) {
            faces > 2
        } else {
            faces != 4 && faces != 0
        }
    }

    /// True for a face that is subdivided but not part of the surface.
    #[must_use]
    pub fn is_hole(&self, face: u32) -> bool {
        self.holes.get(face as usize).copied().unwrap_or(false)
    }

    /// Bytes of all lists.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        let words = self.corner_faces.len()
            + self.corner_edges.len()
            + self.ring_edge_offsets.len()
            + self.ring_corner_offsets.len()
            + self.ring_edges.len()
            + self.ring_corners.len();
        self.faces.byte_count()
            + 4 * words
            + 8 * (self.edge_vertices.len() + self.edge_faces.len())
            + 8 * (self.edge_sharpness.len() + self.vertex_sharpness.len())
            + self.holes.len()
    }

    /// The edge between two vertices.
    #[must_use]
    pub fn edge_between(&self, a: u32, b: u32) -> Option<u32> {
        let from = if self.valence(a) <= self.valence(b) {
            a
        } else {
            b
        };
        let to = if from == a { b } else { a };
        self.vertex_edges(from)
            .iter()
            .copied()
            .find(|&edge| self.edge_end(edge, from) == to)
    }
}

fn range<'a>(list: &'a [u32], offsets: &[u32], index: u32) -> &'a [u32] {
    &list[offsets[index as usize] as usize..offsets[index as usize + 1] as usize]
}
