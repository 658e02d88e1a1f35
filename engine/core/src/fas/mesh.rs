//! One level of quads, with what is next to what: the whole cage at level 0, refined faces' children below.
//!
//! A side of a face has the number `face · 4 + side`; side `s` runs from corner `s` to the next. The side across is kept
//! for each, so that a vertex's ring is walked by arithmetic alone:
//!
//! ```text
//!      corner 3 ---- side 2 ---- corner 2
//!         |                         |          child c of a face keeps the parent's axes:
//!       side 3        face        side 1       its corner c is the parent's vertex point c,
//!         |                         |          its corner c + 2 the face point
//!      corner 0 ---- side 0 ---- corner 1
//! ```

use crate::{
    cage::{NONE, Topology},
    subdiv::child_sharpness,
};

/// There is a face across, but its parent was not refined and this level does not have it.
pub(super) const ABSENT: u32 = NONE - 1;

/// The next corner or side of a quad.
pub(super) const fn next(side: usize) -> usize {
    (side + 1) % 4
}

/// The previous corner or side of a quad.
pub(super) const fn previous(side: usize) -> usize {
    (side + 3) % 4
}

/// Quads of one level. Vertices are numbered from 0 within the level; `first_point` makes them points of the table.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    /// The level's first point in the table.
    pub(super) first_point: u32,
    /// Vertices of each face.
    pub(super) corners: Vec<[u32; 4]>,
    /// The side across each side; [`NONE`] on boundaries, [`ABSENT`] where the level ends.
    pub(super) across: Vec<[u32; 4]>,
    /// Sharpness of each side; empty where nothing but boundaries is sharp.
    pub(super) sharpness: Vec<[f32; 4]>,
    /// Own sharpness of each vertex; empty where no vertex has one.
    pub(super) vertex_sharpness: Vec<f32>,
    /// Depth each vertex asks for as a feature; [`Mesh::REGULAR`] for vertices that are none.
    pub(super) feature: Vec<u8>,
    /// True for features that stay features however often they are refined: those of no semi-sharp thing alone.
    pub(super) extraordinary: Vec<bool>,
    /// One corner of each vertex, `face · 4 + corner`: the first counter-clockwise for boundary vertices.
    pub(super) start: Vec<u32>,
    /// Faces that are no part of the surface; empty where there are none.
    pub(super) holes: Vec<bool>,
    /// For children: the parent's face, and which child.
    pub(super) parents: Vec<(u32, u8)>,
}

impl Mesh {
    /// The depth of a vertex that is no feature.
    pub(super) const REGULAR: u8 = u8::MAX;

    /// The whole of a cage of quads; `feature` holds the depth of every feature, `extraordinary` which of them stay.
    pub(super) fn of_cage(topology: &Topology, feature: Vec<u8>, extraordinary: Vec<bool>) -> Self {
        let faces = topology.face_count() as usize;
        let mut mesh = Self {
            feature,
            extraordinary,
            corners: Vec::with_capacity(faces),
            across: vec![[NONE; 4]; faces],
            start: vec![NONE; topology.vertex_count() as usize],
            ..Self::default()
        };
        // The first side met of every edge waits for the second.
        let mut waiting = vec![NONE; topology.edge_count() as usize];
        for face in 0..topology.face_count() {
            let corners = topology.face_vertices(face);
            mesh.corners
                .push([corners[0], corners[1], corners[2], corners[3]]);
            for (side, &edge) in topology.face_edges(face).iter().enumerate() {
                let this = face * 4 + side as u32;
                let other = std::mem::replace(&mut waiting[edge as usize], this);
                if other != NONE {
                    mesh.across[face as usize][side] = other;
                    mesh.across[other as usize / 4][other as usize % 4] = this;
                }
            }
        }
        for vertex in 0..topology.vertex_count() {
            if let Some(&corner) = topology.vertex_corners(vertex).first() {
                mesh.start[vertex as usize] = corner;
            }
        }
        mesh.take_tags(topology);
        mesh
    }

    fn take_tags(&mut self, topology: &Topology) {
        let inner_sharp = (0..topology.edge_count())
            .any(|edge| !topology.is_boundary_edge(edge) && topology.edge_sharpness(edge) > 0.0);
        if inner_sharp {
            self.sharpness = (0..topology.face_count())
                .map(|face| {
                    let edges = topology.face_edges(face);
                    [0, 1, 2, 3].map(|side| narrow(topology.edge_sharpness(edges[side])))
                })
                .collect();
        }
        if (0..topology.vertex_count()).any(|vertex| topology.vertex_sharpness(vertex) > 0.0) {
            self.vertex_sharpness = (0..topology.vertex_count())
                .map(|vertex| narrow(topology.vertex_sharpness(vertex)))
                .collect();
        }
        if (0..topology.face_count()).any(|face| topology.is_hole(face)) {
            self.holes = (0..topology.face_count())
                .map(|face| topology.is_hole(face))
                .collect();
        }
    }

    /// Faces.
    pub(super) fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// The point of a face's corner.
    pub(super) fn point(&self, face: usize, corner: usize) -> u32 {
        self.first_point + self.corners[face][corner]
    }

    /// The side across a side.
    pub(super) fn across(&self, side: u32) -> u32 {
        self.across[side as usize / 4][side as usize % 4]
    }

    /// Sharpness of a side; boundaries are infinite.
    pub(super) fn sharpness(&self, face: usize, side: usize) -> f32 {
        if self.across[face][side] == NONE {
            f32::INFINITY
        } else {
            self.sharpness.get(face).map_or(0.0, |sides| sides[side])
        }
    }

    /// Own sharpness of a vertex.
    pub(super) fn vertex_sharpness(&self, vertex: u32) -> f32 {
        self.vertex_sharpness
            .get(vertex as usize)
            .copied()
            .unwrap_or(0.0)
    }

    /// True for a face that is no part of the surface.
    pub(super) fn is_hole(&self, face: usize) -> bool {
        self.holes.get(face).copied().unwrap_or(false)
    }

    /// True when a face has a feature among its corners whose depth is more than a level.
    pub(super) fn is_refined(&self, face: usize, level: u8) -> bool {
        self.corners[face].iter().any(|&corner| {
            let depth = self.feature[corner as usize];
            depth != Self::REGULAR && depth > level
        })
    }

    /// True when a face has an extraordinary feature among its corners: it is no bicubic patch at any depth.
    pub(super) fn is_extraordinary(&self, face: usize) -> bool {
        self.corners[face]
            .iter()
            .any(|&corner| self.extraordinary[corner as usize])
    }

    /// A vertex's corners, `face · 4 + corner`, counter-clockwise, into a list; true when the ring closes.
    ///
    /// Rings of vertices of refined faces, and all of level 0, are complete.
    pub(super) fn ring(&self, vertex: u32, ring: &mut Vec<u32>) -> bool {
        ring.clear();
        let start = self.start[vertex as usize];
        if start == NONE {
            return false;
        }
        let mut corner = start;
        loop {
            ring.push(corner);
            let arriving = corner / 4 * 4 + previous(corner as usize % 4) as u32;
            corner = self.across(arriving);
            if corner == start {
                return true;
            }
            if corner >= ABSENT {
                return false;
            }
        }
    }

    /// Sharpness of the children of a side.
    pub(super) fn child_side_sharpness(&self, face: usize, side: usize) -> f32 {
        narrow(child_sharpness(f64::from(self.sharpness(face, side))))
    }
}

/// Sharpness fits f32: it is a small number or infinite.
#[expect(
    clippy::cast_possible_truncation,
    reason = "sharpness needs no more digits"
)]
pub(super) fn narrow(sharpness: f64) -> f32 {
    sharpness as f32
}
