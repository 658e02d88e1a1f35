//! Linking: from a list of faces to a checked topology, in time linear in its corners.
//!
//! 1. every corner's half-edge goes into the bucket of its lower vertex, and finds its twin there;
//! 2. edges are numbered by their first half-edge;
//! 3. rings are walked from twin to twin.

#![expect(
    clippy::cast_possible_truncation,
    reason = "vertices and corners are checked to be fewer than 2^32 before they are numbered"
)]

use super::error::CageError;
use super::faces::{Faces, Tags};
use super::sharpness::{set_holes, set_sharpness};
use super::topology::{NONE, Topology};

/// Coordinates larger than this could overflow when a normal is formed.
const LARGEST_COORDINATE: f64 = 1e150;

/// Refuses coordinates that are not finite numbers.
pub(super) fn check_positions(positions: &[[f64; 3]]) -> Result<(), CageError> {
    if positions.len() >= NONE as usize {
        return Err(CageError::Budget {
            what: "vertices",
            limit: u64::from(NONE) - 1,
        });
    }
    let bad = |position: &[f64; 3]| {
        position
            .iter()
            .any(|x| !x.is_finite() || x.abs() > LARGEST_COORDINATE)
    };
    match positions.iter().position(bad) {
        Some(vertex) => Err(CageError::NotFinite {
            vertex: vertex as u32,
            position: positions[vertex],
        }),
        None => Ok(()),
    }
}

/// Links and checks a topology.
pub(super) fn link(vertex_count: u32, faces: Faces, tags: &Tags) -> Result<Topology, CageError> {
    check_faces(&faces, vertex_count)?;
    let quads = faces.iter().all(|face| face.len() == 4);
    let mut topology = Topology {
        vertex_count,
        faces,
        ..Topology::default()
    };
    if !quads {
        topology.corner_faces = corner_faces(&topology.faces);
    }
    let twins = find_twins(&topology)?;
    number_edges(&mut topology, &twins);
    walk_rings(&mut topology, &twins)?;
    set_sharpness(&mut topology, tags)?;
    set_holes(&mut topology, &tags.holes)?;
    Ok(topology)
}

fn check_faces(faces: &Faces, vertex_count: u32) -> Result<(), CageError> {
    if faces.count() == 0 {
        return Err(CageError::Empty);
    }
    if faces.list().len() >= NONE as usize {
        return Err(CageError::Budget {
            what: "face corners",
            limit: u64::from(NONE) - 1,
        });
    }
    let mut sorted = Vec::new();
    for (face, vertices) in (0..).zip(faces.iter()) {
        if vertices.len() < 3 {
            return Err(CageError::DegenerateFace {
                face,
                corners: vertices.len() as u32,
            });
        }
        if let Some(&vertex) = vertices.iter().find(|&&vertex| vertex >= vertex_count) {
            return Err(CageError::MissingVertex {
                face,
                vertex: u64::from(vertex),
                vertex_count,
            });
        }
        if let Some(vertex) = repeated(vertices, &mut sorted) {
            return Err(CageError::RepeatedCorner { face, vertex });
        }
    }
    Ok(())
}

/// A vertex that occurs twice. Quads are compared outright, larger faces sorted.
fn repeated(vertices: &[u32], sorted: &mut Vec<u32>) -> Option<u32> {
    if let &[a, b, c, d] = vertices {
        return if a == b || a == c || a == d {
            Some(a)
        } else if b == c || b == d {
            Some(b)
        } else {
            (c == d).then_some(c)
        };
    }
    sorted.clear();
    sorted.extend_from_slice(vertices);
    sorted.sort_unstable();
    sorted
        .windows(2)
        .find(|pair| pair[0] == pair[1])
        .map(|pair| pair[0])
}

fn corner_faces(faces: &Faces) -> Vec<u32> {
    let mut list = Vec::with_capacity(faces.list().len());
    for (face, vertices) in (0..).zip(faces.iter()) {
        list.extend(std::iter::repeat_n(face, vertices.len()));
    }
    list
}

impl Topology {
    /// The next corner of the same face.
    #[must_use]
    #[inline]
    pub fn next_corner(&self, corner: u32) -> u32 {
        if self.all_quads() {
            return (corner & !3) | ((corner + 1) & 3);
        }
        let range = self.face_corners(self.corner_face(corner));
        if corner as usize + 1 == range.end {
            range.start as u32
        } else {
            corner + 1
        }
    }

    /// The corner before it in the same face.
    #[must_use]
    #[inline]
    pub fn previous_corner(&self, corner: u32) -> u32 {
        if self.all_quads() {
            return (corner & !3) | ((corner + 3) & 3);
        }
        let range = self.face_corners(self.corner_face(corner));
        if corner as usize == range.start {
            range.end as u32 - 1
        } else {
            corner - 1
        }
    }

    fn half_edge(&self, corner: u32) -> [u32; 2] {
        [
            self.corner_vertex(corner),
            self.corner_vertex(self.next_corner(corner)),
        ]
    }
}

/// Sums of counts: where each bucket starts, and at the end where the last one ends.
fn offsets_of(counts: impl Iterator<Item = u32>, length: usize) -> Vec<u32> {
    let mut offsets = Vec::with_capacity(length + 1);
    let mut sum = 0;
    for count in counts {
        offsets.push(sum);
        sum += count;
    }
    offsets.push(sum);
    offsets
}

/// A half-edge in its bucket: the higher vertex, and its corner with the direction in the lowest bit.
#[derive(Clone, Copy, Default)]
struct HalfEdge {
    high: u32,
    corner: u32,
}

/// Each corner's half-edge's twin, the same edge walked the other way, or [`NONE`].
fn find_twins(topology: &Topology) -> Result<Vec<u32>, CageError> {
    let corner_count = topology.faces.list().len() as u32;
    let mut counts = vec![0_u32; topology.vertex_count as usize];
    for corner in 0..corner_count {
        let [a, b] = topology.half_edge(corner);
        counts[a.min(b) as usize] += 1;
    }
    let offsets = offsets_of(counts.iter().copied(), counts.len());
    drop(counts);
    let mut slots = offsets.clone();
    let mut buckets = vec![HalfEdge::default(); corner_count as usize];
    for corner in 0..corner_count {
        let [a, b] = topology.half_edge(corner);
        let slot = &mut slots[a.min(b) as usize];
        buckets[*slot as usize] = HalfEdge {
            high: a.max(b),
            corner,
        };
        *slot += 1;
    }
    drop(slots);
    let mut twins = vec![NONE; corner_count as usize];
    for ends in offsets.windows(2) {
        match_bucket(
            topology,
            &mut buckets[ends[0] as usize..ends[1] as usize],
            &mut twins,
        )?;
    }
    Ok(twins)
}

/// Pairs the half-edges of one bucket; they share the lower vertex.
fn match_bucket(
    topology: &Topology,
    bucket: &mut [HalfEdge],
    twins: &mut [u32],
) -> Result<(), CageError> {
    // Most buckets hold four to eight, where insertion sort is as fast as any search.
    bucket.sort_unstable_by_key(|half| (half.high, half.corner));
    for same in bucket.chunk_by(|a, b| a.high == b.high) {
        match *same {
            [_] => {}
            [a, b] if topology.corner_vertex(a.corner) != topology.corner_vertex(b.corner) => {
                twins[a.corner as usize] = b.corner;
                twins[b.corner as usize] = a.corner;
            }
            _ => return Err(bad_edge(topology, same)),
        }
    }
    Ok(())
}

/// What is wrong with half-edges that do not pair.
fn bad_edge(topology: &Topology, halves: &[HalfEdge]) -> CageError {
    let face = |half: &HalfEdge| topology.corner_face(half.corner);
    for (i, later) in halves.iter().enumerate() {
        for first in halves[..i].iter().take(64) {
            if same_cycle(topology, first.corner, later.corner) {
                return CageError::RepeatedFace {
                    face: face(later),
                    first: face(first),
                };
            }
        }
    }
    let vertices = topology.half_edge(halves[0].corner);
    if let [a, b] = halves {
        return CageError::Orientation {
            faces: [face(a), face(b)],
            vertices,
        };
    }
    CageError::NonManifoldEdge {
        vertices,
        face_count: halves.len() as u32,
        face: face(&halves[2]),
    }
}

/// True when two faces, walked from these corners, meet the same vertices.
fn same_cycle(topology: &Topology, mut a: u32, mut b: u32) -> bool {
    let size = |corner| topology.face_corners(topology.corner_face(corner)).len();
    if size(a) != size(b) {
        return false;
    }
    for _ in 0..size(a) {
        if topology.corner_vertex(a) != topology.corner_vertex(b) {
            return false;
        }
        (a, b) = (topology.next_corner(a), topology.next_corner(b));
    }
    true
}

fn number_edges(topology: &mut Topology, twins: &[u32]) {
    let corner_count = twins.len() as u32;
    let mut corner_edges = vec![NONE; twins.len()];
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    vertices.reserve(twins.len() / 2 + 1);
    faces.reserve(twins.len() / 2 + 1);
    for corner in 0..corner_count {
        let twin = twins[corner as usize];
        if twin < corner {
            corner_edges[corner as usize] = corner_edges[twin as usize];
            continue;
        }
        corner_edges[corner as usize] = vertices.len() as u32;
        vertices.push(topology.half_edge(corner));
        let second = if twin == NONE {
            NONE
        } else {
            topology.corner_face(twin)
        };
        faces.push([topology.corner_face(corner), second]);
    }
    topology.corner_edges = corner_edges;
    topology.edge_vertices = vertices;
    topology.edge_faces = faces;
}

/// Fills the rings of all vertices.
fn walk_rings(topology: &mut Topology, twins: &[u32]) -> Result<(), CageError> {
    let starts = ring_starts(topology, twins);
    topology.ring_corner_offsets =
        offsets_of(starts.iter().map(|start| start.corner_count), starts.len());
    let edges = starts
        .iter()
        .map(|start| start.corner_count + u32::from(start.boundary));
    topology.ring_edge_offsets = offsets_of(edges, starts.len());
    let mut ring_corners = Vec::with_capacity(twins.len());
    let mut ring_edges = Vec::with_capacity(twins.len() + starts.len() / 8);
    for (vertex, start) in (0..).zip(&starts) {
        let mut corner = start.corner;
        for _ in 0..start.corner_count {
            ring_corners.push(corner);
            ring_edges.push(topology.corner_edges[corner as usize]);
            let arriving = topology.previous_corner(corner);
            corner = twins[arriving as usize];
            if corner == NONE {
                ring_edges.push(topology.corner_edges[arriving as usize]);
                break;
            }
            if corner == start.corner {
                break;
            }
        }
        if ring_corners.len() != topology.ring_corner_offsets[vertex as usize + 1] as usize
            || (start.corner_count > 0 && start.boundary != (corner == NONE))
        {
            return Err(CageError::NonManifoldVertex {
                vertex,
                face: second_fan(topology, vertex, &ring_corners),
            });
        }
    }
    topology.ring_corners = ring_corners;
    topology.ring_edges = ring_edges;
    Ok(())
}

/// Where a vertex's ring starts, and how many faces it should have.
#[derive(Clone, Copy)]
struct RingStart {
    corner: u32,
    corner_count: u32,
    boundary: bool,
}

fn ring_starts(topology: &Topology, twins: &[u32]) -> Vec<RingStart> {
    let none = RingStart {
        corner: NONE,
        corner_count: 0,
        boundary: false,
    };
    let mut starts = vec![none; topology.vertex_count as usize];
    for (corner, &vertex) in (0..).zip(topology.faces.list()) {
        let start = &mut starts[vertex as usize];
        let leaves_boundary = twins[corner as usize] == NONE;
        if start.corner_count == 0 || (leaves_boundary && !start.boundary) {
            start.corner = corner;
        }
        start.boundary |= leaves_boundary;
        start.corner_count += 1;
    }
    starts
}

/// A face at the vertex that the walk from its start did not meet.
fn second_fan(topology: &Topology, vertex: u32, ring_corners: &[u32]) -> u32 {
    let first = topology.ring_corner_offsets[vertex as usize] as usize;
    let met = &ring_corners[first.min(ring_corners.len())..];
    let corners = (0..)
        .zip(topology.faces.list())
        .filter(|&(_, &other)| other == vertex);
    let missed = corners
        .map(|(corner, _)| corner)
        .find(|corner| !met.contains(corner));
    topology.corner_face(missed.unwrap_or(met[0]))
}
