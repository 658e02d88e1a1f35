//! The shape of a quad's neighbourhood: what its limit surface depends on besides positions.
//!
//! Faces of one shape share their limit stencils: the surface is the same sum of their controls. Controls are the four
//! corners, then for each corner, counter-clockwise, what only its ring has:
//!
//! ```text
//!        d ── s ── ·          corner i below left of its patch F, valence 4:
//!        │    │    │          spokes s besides the patch's two sides,
//!        s ── i ── i+1        diagonals d of quads that share no side with F;
//!        │    │ F             the other diagonals are spokes of the corners i + 1 and i - 1
//! ```
//!
//! A corner of valence n has n - 2 spokes and n - 3 diagonals of its own: 16 controls for a regular face, 2 N + 8 for
//! one with one extraordinary vertex.

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use glam::DVec3;

use super::super::topology::Topology;
use super::ring::Neighbourhood;

/// Shape of the ring at one corner: places in the list of controls.
#[derive(Clone, Debug, PartialEq)]
struct RingShape {
    sharpness: f64,
    spokes: Vec<u32>,
    spoke_sharpness: Vec<f64>,
    diagonals: Vec<u32>,
    at: usize,
}

/// Shape of a neighbourhood.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    rings: [RingShape; 4],
    pub(super) control_count: usize,
}

/// The part of a shape that tells it from others, as numbers: for each corner its counts, place and sharpnesses.
pub(super) fn key(topology: &Topology, face: u32, key: &mut Vec<u64>) {
    key.clear();
    for corner in topology.face_corners(face) {
        let vertex = topology.corner_vertex(corner as u32);
        let (edges, corners) = (
            topology.vertex_edges(vertex),
            topology.vertex_corners(vertex),
        );
        let at = place_of(corners, corner as u32);
        // All the way round, the patch may count as the first quad.
        let (first, open) = if edges.len() == corners.len() {
            (at, 0)
        } else {
            (0, 1 + at as u64)
        };
        key.push((edges.len() as u64) << 32 | open);
        key.push(topology.vertex_sharpness(vertex).to_bits());
        let sharp = |i: usize| topology.edge_sharpness(edges[(first + i) % edges.len()]);
        for (i, sharpness) in (0..edges.len()).map(sharp).enumerate() {
            if sharpness > 0.0 {
                key.extend([i as u64, sharpness.to_bits()]);
            }
        }
    }
}

fn place_of(corners: &[u32], corner: u32) -> usize {
    corners
        .iter()
        .position(|&other| other == corner)
        .unwrap_or(0)
}

/// Vertices of a face's controls, in the order of its shape. `false` where a corner has fewer than three edges without
/// being on a boundary: its quads meet twice, and the list is not made for that.
pub(super) fn controls(topology: &Topology, face: u32, list: &mut Vec<u32>) -> bool {
    list.extend_from_slice(topology.face_vertices(face));
    for corner in topology.face_corners(face) {
        let vertex = topology.corner_vertex(corner as u32);
        let (edges, corners) = (
            topology.vertex_edges(vertex),
            topology.vertex_corners(vertex),
        );
        if edges.len() < 3 && edges.len() == corners.len() {
            return false;
        }
        let at = place_of(corners, corner as u32);
        for spoke in own_spokes(at, edges.len()) {
            list.push(topology.edge_end(edges[spoke], vertex));
        }
        for quad in own_quads(at, edges.len(), corners.len()) {
            let across = topology.next_corner(topology.next_corner(corners[quad]));
            list.push(topology.corner_vertex(across));
        }
    }
    true
}

/// Spokes besides the patch's own two.
fn own_spokes(at: usize, spokes: usize) -> impl Iterator<Item = usize> {
    (2..spokes).map(move |i| (at + i) % spokes)
}

/// Quads that share no side with the patch.
fn own_quads(at: usize, spokes: usize, quads: usize) -> impl Iterator<Item = usize> {
    let closed = spokes == quads;
    let beside = move |quad: usize| {
        let steps = (quad + quads - at) % quads;
        let (next, previous) = (steps == 1, steps + 1 == quads);
        if closed {
            next || previous
        } else {
            quad == at + 1 || quad + 1 == at
        }
    };
    (1..quads)
        .map(move |i| (at + i) % quads)
        .filter(move |&quad| !beside(quad))
}

impl Shape {
    /// The shape of a face for which [`controls`] makes a list.
    pub(super) fn new(topology: &Topology, face: u32) -> Self {
        let mut next = 4;
        let corners: Vec<u32> = topology
            .face_corners(face)
            .map(|corner| corner as u32)
            .collect();
        let mut rings: [RingShape; 4] =
            std::array::from_fn(|i| own_ring(topology, i as u32, corners[i], &mut next));
        for i in 0..4 {
            let (before, after) = (&rings[(i + 3) & 3], &rings[(i + 1) & 3]);
            let (shared_before, shared_after) = (spoke(before, -1), spoke(after, 2));
            let ring = &mut rings[i];
            let (quads, closed) = (
                ring.diagonals.len(),
                ring.spokes.len() == ring.diagonals.len(),
            );
            if closed || ring.at + 1 < quads {
                ring.diagonals[(ring.at + 1) % quads] = shared_before;
            }
            if closed || ring.at > 0 {
                ring.diagonals[(ring.at + quads - 1) % quads] = shared_after;
            }
        }
        Self {
            rings,
            control_count: next as usize,
        }
    }

    /// The neighbourhood with these controls.
    pub(super) fn fill(&self, control: impl Fn(usize) -> DVec3, hood: &mut Neighbourhood) {
        hood.origin = DVec3::ZERO;
        for (i, (shape, ring)) in self.rings.iter().zip(&mut hood.rings).enumerate() {
            let at = |&place: &u32| control(place as usize);
            (ring.center, ring.sharpness, ring.at) = (control(i), shape.sharpness, shape.at);
            ring.spoke_sharpness.clone_from(&shape.spoke_sharpness);
            ring.spokes.clear();
            ring.spokes.extend(shape.spokes.iter().map(at));
            ring.diagonals.clear();
            ring.diagonals.extend(shape.diagonals.iter().map(at));
        }
    }
}

fn spoke(ring: &RingShape, steps: isize) -> u32 {
    ring.spokes[(ring.at as isize + steps).rem_euclid(ring.spokes.len() as isize) as usize]
}

/// A ring but for the diagonals that are its neighbours' spokes.
fn own_ring(topology: &Topology, i: u32, corner: u32, next: &mut u32) -> RingShape {
    let vertex = topology.corner_vertex(corner);
    let (edges, corners) = (
        topology.vertex_edges(vertex),
        topology.vertex_corners(vertex),
    );
    let at = place_of(corners, corner);
    let mut take = || std::mem::replace(next, *next + 1);
    let mut spokes = vec![0; edges.len()];
    spokes[at] = (i + 1) & 3;
    spokes[(at + 1) % edges.len()] = (i + 3) & 3;
    own_spokes(at, edges.len()).for_each(|spoke| spokes[spoke] = take());
    let mut diagonals = vec![0; corners.len()];
    diagonals[at] = (i + 2) & 3;
    own_quads(at, edges.len(), corners.len()).for_each(|quad| diagonals[quad] = take());
    let spoke_sharpness = edges
        .iter()
        .map(|&edge| topology.edge_sharpness(edge))
        .collect();
    RingShape {
        sharpness: topology.vertex_sharpness(vertex),
        spokes,
        spoke_sharpness,
        diagonals,
        at,
    }
}
