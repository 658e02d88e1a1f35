//! Tags laid onto a linked topology.

use super::error::CageError;
use super::faces::{Corner, Crease, Tags};
use super::topology::{NONE, Topology};
use crate::subdiv::stored_sharpness;

/// Sharpness of all edges and vertices: tags, then boundaries.
pub(super) fn set_sharpness(topology: &mut Topology, tags: &Tags) -> Result<(), CageError> {
    topology.edge_sharpness = vec![0.0; topology.edge_vertices.len()];
    topology.vertex_sharpness = vec![0.0; topology.vertex_count as usize];
    for crease in &tags.creases {
        let edge = tagged_edge(topology, crease)?;
        topology.edge_sharpness[edge as usize] = stored_sharpness(crease.sharpness);
    }
    for corner in &tags.corners {
        check_sharpness(corner.sharpness, || {
            format!("the corner at vertex {}", corner.vertex)
        })?;
        let count = topology.vertex_count;
        let slot = topology.vertex_sharpness.get_mut(corner.vertex as usize);
        let missing = CageError::MissingTagged {
            what: "vertex",
            index: u64::from(corner.vertex),
            count,
        };
        *slot.ok_or(missing)? = stored_sharpness(corner.sharpness);
    }
    sharpen_boundaries(topology);
    Ok(())
}

impl Topology {
    /// The tags that are not there for a boundary's sake: those of inner edges, of vertices of more than one face, and
    /// holes. A cage made part of a larger one is given these.
    #[must_use]
    pub fn tags(&self) -> Tags {
        let written = |sharpness: f64| sharpness.min(crate::subdiv::INFINITE_SHARPNESS);
        let creases = (0..self.edge_count())
            .filter(|&edge| self.edge_sharpness(edge) > 0.0 && !self.is_boundary_edge(edge))
            .map(|edge| Crease {
                vertices: self.edge_vertices(edge),
                sharpness: written(self.edge_sharpness(edge)),
            });
        let corners = (0..self.vertex_count())
            .filter(|&vertex| {
                self.vertex_sharpness(vertex) > 0.0 && self.vertex_corners(vertex).len() != 1
            })
            .map(|vertex| Corner {
                vertex,
                sharpness: written(self.vertex_sharpness(vertex)),
            });
        Tags {
            creases: creases.collect(),
            corners: corners.collect(),
            holes: (0..self.face_count())
                .filter(|&face| self.is_hole(face))
                .collect(),
        }
    }
}

fn tagged_edge(topology: &Topology, crease: &Crease) -> Result<u32, CageError> {
    let [a, b] = crease.vertices;
    check_sharpness(crease.sharpness, || {
        format!("the crease from vertex {a} to vertex {b}")
    })?;
    let count = topology.vertex_count;
    if let Some(&vertex) = crease.vertices.iter().find(|&&vertex| vertex >= count) {
        return Err(CageError::MissingTagged {
            what: "vertex",
            index: u64::from(vertex),
            count,
        });
    }
    topology.edge_between(a, b).ok_or(CageError::MissingEdge {
        vertices: [a, b].map(u64::from),
    })
}

fn check_sharpness(sharpness: f64, what: impl FnOnce() -> String) -> Result<(), CageError> {
    // A NaN is not at least 0 either.
    if sharpness >= 0.0 {
        Ok(())
    } else {
        Err(CageError::Sharpness {
            what: what(),
            sharpness,
        })
    }
}

/// Edge and corner: boundary edges are infinitely sharp, boundary vertices of one face are corners.
fn sharpen_boundaries(topology: &mut Topology) {
    for (sharpness, faces) in topology.edge_sharpness.iter_mut().zip(&topology.edge_faces) {
        if faces[1] == NONE {
            *sharpness = f64::INFINITY;
        }
    }
    for vertex in 0..topology.vertex_count {
        if topology.vertex_corners(vertex).len() == 1 {
            topology.vertex_sharpness[vertex as usize] = f64::INFINITY;
        }
    }
}

/// Flags of faces that are no part of the surface.
pub(super) fn set_holes(topology: &mut Topology, holes: &[u32]) -> Result<(), CageError> {
    let count = topology.face_count();
    for &face in holes {
        topology.holes.resize(count as usize, false);
        let missing = CageError::MissingTagged {
            what: "face",
            index: u64::from(face),
            count,
        };
        *topology.holes.get_mut(face as usize).ok_or(missing)? = true;
    }
    Ok(())
}
