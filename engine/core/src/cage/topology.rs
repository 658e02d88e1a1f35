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

use std::ops::Range;

use super::CageError;
use super::build::{Faces, Tags};

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

    /// True for a face that is subdivided but not part of the surface.
    #[must_use]
    pub fn is_hole(&self, face: u32) -> bool {
        self.holes.get(face as usize).copied().unwrap_or(false)
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

#[cfg(test)]
mod tests {
    use super::super::{Crease, read_obj};
    use super::*;

    fn grid(columns: u32, rows: u32) -> (Vec<[f64; 3]>, Faces) {
        let at = |x: u32, y: u32| y * (columns + 1) + x;
        let positions =
            (0..=rows).flat_map(|y| (0..=columns).map(move |x| [f64::from(x), f64::from(y), 0.0]));
        let quad = |x, y| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
        let faces = (0..rows).flat_map(|y| (0..columns).map(move |x| quad(x, y)));
        (positions.collect(), faces.collect())
    }

    fn link(vertex_count: usize, faces: &[&[u32]]) -> Result<Cage, CageError> {
        Cage::new(
            vec![[0.0; 3]; vertex_count],
            faces.iter().collect(),
            &Tags::default(),
        )
    }

    #[test]
    fn a_grid_has_the_edges_and_rings_it_should() {
        let (positions, faces) = grid(3, 2);
        let cage = Cage::new(positions, faces, &Tags::default()).unwrap();
        let topology = cage.topology();
        assert_eq!(
            (
                topology.vertex_count(),
                topology.edge_count(),
                topology.face_count()
            ),
            (12, 17, 6)
        );
        assert_eq!(
            (topology.valence(5), topology.vertex_corners(5).len()),
            (4, 4)
        );
        assert!(topology.is_boundary_vertex(4) && !topology.is_boundary_vertex(5));
        assert_eq!(topology.vertex_sharpness(0), f64::INFINITY);
        assert_eq!(topology.vertex_sharpness(1), 0.0);
        assert_eq!(cage.extent(), 3.0);
    }

    #[test]
    fn rings_turn_counter_clockwise_face_between_its_two_edges() {
        let (positions, faces) = grid(4, 4);
        let cage = Cage::new(positions, faces, &Tags::default()).unwrap();
        let topology = cage.topology();
        for vertex in 0..topology.vertex_count() {
            let edges = topology.vertex_edges(vertex);
            for (i, &corner) in topology.vertex_corners(vertex).iter().enumerate() {
                assert_eq!(topology.corner_vertex(corner), vertex);
                let leaving = topology.corner_edges[corner as usize];
                let arriving = topology.corner_edges[topology.previous_corner(corner) as usize];
                assert_eq!(
                    [leaving, arriving],
                    [edges[i], edges[(i + 1) % edges.len()]]
                );
            }
        }
    }

    #[test]
    fn a_triangle_and_its_back_are_a_closed_cage_of_valence_two() {
        let cage = link(3, &[&[0, 1, 2], &[0, 2, 1]]).unwrap();
        assert_eq!(cage.topology().edge_count(), 3);
        assert!((0..3).all(|vertex| cage.topology().valence(vertex) == 2));
    }

    #[test]
    fn what_is_wrong_is_named() {
        type E = CageError;
        assert!(matches!(link(3, &[]), Err(E::Empty)));
        assert!(matches!(
            link(3, &[&[0, 1]]),
            Err(E::DegenerateFace {
                face: 0,
                corners: 2
            })
        ));
        assert!(matches!(
            link(3, &[&[0, 1, 3]]),
            Err(E::MissingVertex {
                vertex: 3,
                vertex_count: 3,
                ..
            })
        ));
        assert!(matches!(
            link(4, &[&[0, 1, 2, 1]]),
            Err(E::RepeatedCorner { vertex: 1, .. })
        ));
        assert!(matches!(
            link(5, &[&[0, 1, 2, 3, 0]]),
            Err(E::RepeatedCorner { vertex: 0, .. })
        ));
        assert!(matches!(
            link(3, &[&[0, 1, 2], &[1, 2, 0]]),
            Err(E::RepeatedFace { face: 1, first: 0 })
        ));
        assert!(matches!(
            link(4, &[&[0, 1, 2], &[0, 1, 3]]),
            Err(E::Orientation { faces: [0, 1], .. })
        ));
        let three = link(5, &[&[0, 1, 2], &[1, 0, 3], &[0, 1, 4]]);
        assert!(matches!(
            three,
            Err(E::NonManifoldEdge { face_count: 3, .. })
        ));
        let fans = link(5, &[&[0, 1, 2], &[0, 3, 4]]);
        assert!(matches!(
            fans,
            Err(E::NonManifoldVertex { vertex: 0, face: 1 })
        ));
    }

    #[test]
    fn two_closed_fans_at_one_vertex_are_refused() {
        let tetrahedron = |a: u32, b: u32, c: u32| [[0, a, b], [0, b, c], [0, c, a], [c, b, a]];
        let faces: Faces = tetrahedron(1, 2, 3)
            .into_iter()
            .chain(tetrahedron(4, 5, 6))
            .collect();
        let cage = Cage::new(vec![[0.0; 3]; 7], faces, &Tags::default());
        assert!(matches!(
            cage,
            Err(CageError::NonManifoldVertex {
                vertex: 0,
                face: 4..=6
            })
        ));
    }

    #[test]
    fn numbers_and_tags_are_checked() {
        let new = |position: f64, tags: &Tags| {
            Cage::new(
                vec![[0.0; 3], [1.0; 3], [position; 3], [3.0; 3]],
                Faces::quads(&[[0, 1, 2, 3]]),
                tags,
            )
        };
        let crease = |vertices, sharpness| Tags {
            creases: vec![Crease {
                vertices,
                sharpness,
            }],
            ..Tags::default()
        };
        assert!(matches!(
            new(f64::NAN, &Tags::default()),
            Err(CageError::NotFinite { vertex: 2, .. })
        ));
        assert!(matches!(
            new(1e300, &Tags::default()),
            Err(CageError::NotFinite { vertex: 2, .. })
        ));
        for bad in [-0.5, f64::NAN] {
            assert!(matches!(
                new(0.0, &crease([0, 1], bad)),
                Err(CageError::Sharpness { .. })
            ));
        }
        assert!(matches!(
            new(0.0, &crease([0, 2], 1.0)),
            Err(CageError::MissingEdge { vertices: [0, 2] })
        ));
        assert!(matches!(
            new(0.0, &crease([0, 9], 1.0)),
            Err(CageError::MissingTagged { index: 9, .. })
        ));
        let hole = Tags {
            holes: vec![1],
            ..Tags::default()
        };
        assert!(matches!(
            new(0.0, &hole),
            Err(CageError::MissingTagged {
                what: "face",
                index: 1,
                count: 1
            })
        ));
    }

    #[test]
    fn every_named_cage_reads_or_is_refused_with_a_reason() {
        let folder =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cages");
        if !folder.is_dir() {
            assert_ne!(
                std::env::var("CI").as_deref(),
                Ok("true"),
                "no ../shared/data/cages in CI"
            );
            println!("skipped: no ../shared/data/cages");
            return;
        }
        let mut read = 0;
        for entry in std::fs::read_dir(folder)
            .unwrap()
            .map(Result::unwrap)
            .filter(|entry| entry.path().is_file())
        {
            let name = entry.file_name().into_string().unwrap();
            match read_obj(
                &std::fs::read(entry.path()).unwrap(),
                super::super::CageBudget::default(),
            ) {
                Ok(_) => read += 1,
                Err(error) => println!("{name}: {error}"),
            }
        }
        assert!(read >= 65, "{read} read");
    }
}
