//! What a cage holds, counted.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::topology::{Cage, Topology};

/// Counts of a cage, for people and for machines.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CageInfo {
    /// Vertices.
    pub vertices: u32,
    /// Vertices of no face.
    pub loose_vertices: u32,
    /// Edges.
    pub edges: u32,
    /// Faces.
    pub faces: u32,
    /// Faces by number of corners.
    pub faces_by_size: BTreeMap<usize, u32>,
    /// Faces that are no part of the surface.
    pub holes: u32,
    /// Vertices inside the surface by valence.
    pub inner_valences: BTreeMap<usize, u32>,
    /// Vertices on its boundary by number of faces.
    pub boundary_faces: BTreeMap<usize, u32>,
    /// Edges of one face.
    pub boundary_edges: u32,
    /// Inner edges of finite sharpness.
    pub semi_sharp_edges: u32,
    /// Inner edges of infinite sharpness.
    pub infinite_edges: u32,
    /// Sharp vertices, those that are so for being a boundary's only left out.
    pub corners: u32,
    /// Vertices that are extraordinary by topology alone: an inner valence other than 4, more than two boundary faces.
    pub extraordinary_vertices: u32,
    /// Faces with an extraordinary vertex, or of a size other than 4.
    pub irregular_faces: u32,
    /// Least and greatest coordinates.
    pub bounds: [[f64; 3]; 2],
}

impl CageInfo {
    /// Counts a cage.
    #[must_use]
    pub fn of(cage: &Cage) -> Self {
        let topology = cage.topology();
        let mut info = Self {
            vertices: topology.vertex_count(),
            edges: topology.edge_count(),
            faces: topology.face_count(),
            bounds: cage.bounds(),
            ..Self::default()
        };
        (0..info.vertices).for_each(|vertex| info.add_vertex(topology, vertex));
        (0..info.edges).for_each(|edge| info.add_edge(topology, edge));
        (0..info.faces).for_each(|face| info.add_face(topology, face));
        info
    }

    fn add_vertex(&mut self, topology: &Topology, vertex: u32) {
        let faces = topology.vertex_corners(vertex).len();
        if faces == 0 {
            self.loose_vertices += 1;
            return;
        }
        let boundary = topology.is_boundary_vertex(vertex);
        let histogram = if boundary {
            &mut self.boundary_faces
        } else {
            &mut self.inner_valences
        };
        *histogram.entry(faces).or_default() += 1;
        self.extraordinary_vertices += u32::from(topology.is_extraordinary(vertex));
        self.corners +=
            u32::from(topology.vertex_sharpness(vertex) > 0.0 && !(boundary && faces == 1));
    }

    fn add_edge(&mut self, topology: &Topology, edge: u32) {
        let sharpness = topology.edge_sharpness(edge);
        if topology.is_boundary_edge(edge) {
            self.boundary_edges += 1;
        } else if sharpness == f64::INFINITY {
            self.infinite_edges += 1;
        } else if sharpness > 0.0 {
            self.semi_sharp_edges += 1;
        }
    }

    fn add_face(&mut self, topology: &Topology, face: u32) {
        let vertices = topology.face_vertices(face);
        *self.faces_by_size.entry(vertices.len()).or_default() += 1;
        self.holes += u32::from(topology.is_hole(face));
        let irregular = vertices.len() != 4
            || vertices
                .iter()
                .any(|&vertex| topology.is_extraordinary(vertex));
        self.irregular_faces += u32::from(irregular);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CageBudget, read_obj};
    use super::*;
    use std::path::Path;

    fn info(path: &Path) -> CageInfo {
        CageInfo::of(&read_obj(&std::fs::read(path).unwrap(), CageBudget::default()).unwrap())
    }

    #[test]
    fn a_creased_box_is_counted_as_it_is_built() {
        let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let info = info(&repository.join("tests/vectors/catmull-clark/box_creases.obj"));
        assert_eq!(
            (
                info.faces,
                info.irregular_faces,
                info.extraordinary_vertices
            ),
            (32, 24, 8)
        );
        assert_eq!(
            (info.infinite_edges, info.semi_sharp_edges, info.corners),
            (3, 12, 2)
        );
        assert_eq!(
            (info.boundary_edges, info.holes, info.loose_vertices),
            (0, 0, 0)
        );
        assert_eq!(
            i64::from(info.vertices) - i64::from(info.edges) + i64::from(info.faces),
            2
        );
    }

    #[test]
    fn irregular_faces_are_those_of_the_reference_counts() {
        let folder =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/catmull-clark");
        if !folder.is_dir() {
            assert_ne!(
                std::env::var("CI").as_deref(),
                Ok("true"),
                "no ../shared/reference/catmull-clark in CI"
            );
            println!("skipped: no ../shared/reference/catmull-clark");
            return;
        }
        for line in std::fs::read_to_string(folder.join("counts.csv"))
            .unwrap()
            .lines()
            .skip(1)
        {
            let words: Vec<&str> = line.split(',').collect();
            let [name, depth, counts @ ..] = &words[..5] else {
                panic!("five words")
            };
            let path = [folder.clone(), folder.join("table1")]
                .map(|folder| folder.join(format!("{name}.obj")));
            let Some(path) = path.iter().find(|path| *depth == "1" && path.is_file()) else {
                continue;
            };
            let info = info(path);
            let ours = [
                info.faces,
                info.irregular_faces,
                info.extraordinary_vertices,
            ]
            .map(|count| count.to_string());
            assert_eq!(ours.as_slice(), counts, "{name}");
        }
    }
}
