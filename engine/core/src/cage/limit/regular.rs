//! Regular faces: sixteen control numbers each, found once, so that evaluating them looks at no neighbour.

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use glam::DVec3;

use super::super::topology::Topology;
use super::patch::Patch;

/// Controls of all regular faces.
#[derive(Debug)]
pub(super) struct RegularFaces {
    /// Row of each face in `controls`, or [`NO_ROW`].
    rows: Vec<u32>,
    controls: Vec<[u32; 16]>,
}

const NO_ROW: u32 = u32::MAX;

impl RegularFaces {
    /// Finds the regular faces of an all-quad topology.
    pub(super) fn new(topology: &Topology) -> Self {
        let regular: Vec<bool> = (0..topology.vertex_count())
            .map(|vertex| is_regular(topology, vertex))
            .collect();
        let (mut rows, mut controls) = (
            Vec::with_capacity(topology.face_count() as usize),
            Vec::new(),
        );
        for face in 0..topology.face_count() {
            if topology
                .face_vertices(face)
                .iter()
                .all(|&vertex| regular[vertex as usize])
            {
                rows.push(controls.len() as u32);
                controls.push(controls_of(topology, face));
            } else {
                rows.push(NO_ROW);
            }
        }
        Self { rows, controls }
    }

    /// The patch of a regular face.
    #[inline]
    pub(super) fn patch(&self, face: u32, positions: &[[f64; 3]]) -> Option<Patch> {
        let controls = self.controls.get(self.rows[face as usize] as usize)?;
        Some(Patch {
            controls: controls.map(|vertex| DVec3::from_array(positions[vertex as usize])),
        })
    }
}

/// True for a smooth vertex of valence 4 with smooth edges.
fn is_regular(topology: &Topology, vertex: u32) -> bool {
    topology.vertex_corners(vertex).len() == 4
        && topology.vertex_sharpness(vertex) == 0.0
        && topology
            .vertex_edges(vertex)
            .iter()
            .all(|&edge| topology.edge_sharpness(edge) == 0.0)
}

/// Controls in the order of [`Patch`]: the four corners, and what each corner sees behind it.
fn controls_of(topology: &Topology, face: u32) -> [u32; 16] {
    // From corner i: the corner, the end of the side behind it, the corner across behind it, and the end beside it.
    const PLACES: [[usize; 4]; 4] = [[5, 4, 0, 1], [6, 2, 3, 7], [10, 11, 15, 14], [9, 13, 12, 8]];
    let mut controls = [0; 16];
    for (corner, places) in topology.face_corners(face).zip(PLACES) {
        let corner = corner as u32;
        let ring = topology.vertex_corners(topology.corner_vertex(corner));
        let at = ring.iter().position(|&other| other == corner).unwrap_or(0);
        // The quad behind, across the vertex: its next corner is spoke at + 2, its previous one spoke at + 3.
        let behind = ring[(at + 2) & 3];
        let next = topology.next_corner(behind);
        let ends = [
            corner,
            next,
            topology.next_corner(next),
            topology.previous_corner(behind),
        ];
        for (place, end) in places.into_iter().zip(ends) {
            controls[place] = topology.corner_vertex(end);
        }
    }
    controls
}
