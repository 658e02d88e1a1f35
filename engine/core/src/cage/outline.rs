//! The outline of a cage: the loops of edges that have one face. In a linked topology a vertex has none or two of them.

use super::topology::Topology;

/// The boundary loops of a topology, each as its vertices in order, the surface on the left: a sheet that faces up has
/// its outer loop counter-clockwise seen from above. Loops are in the order of their lowest corner.
#[must_use]
pub fn boundary_loops(topology: &Topology) -> Vec<Vec<u32>> {
    let mut next = vec![None; topology.vertex_count() as usize];
    for edge in (0..topology.edge_count()).filter(|&edge| topology.is_boundary_edge(edge)) {
        let [from, to] = topology.edge_vertices(edge);
        next[from as usize] = Some(to);
    }
    let mut loops = Vec::new();
    for start in 0..topology.vertex_count() {
        let mut around = Vec::new();
        let mut vertex = start;
        while let Some(to) = next[vertex as usize].take() {
            around.push(vertex);
            vertex = to;
        }
        if !around.is_empty() {
            loops.push(around);
        }
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::super::{Cage, Faces, Tags};
    use super::*;

    fn loops(vertex_count: usize, faces: &[&[u32]]) -> Vec<Vec<u32>> {
        let faces: Faces = faces.iter().collect();
        let cage = Cage::new(vec![[0.0; 3]; vertex_count], faces, &Tags::default()).unwrap();
        boundary_loops(cage.topology())
    }

    #[test]
    fn a_sheet_has_one_loop_with_the_surface_on_its_left() {
        assert_eq!(
            loops(6, &[&[0, 1, 4, 3], &[1, 2, 5, 4]]),
            [[0, 1, 2, 5, 4, 3]]
        );
    }

    #[test]
    fn a_closed_cage_has_none_and_a_ring_two() {
        assert!(loops(3, &[&[0, 1, 2], &[0, 2, 1]]).is_empty());
        let ring: [&[u32]; 3] = [&[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
        assert_eq!(loops(6, &ring), [[0, 1, 2], [3, 5, 4]]);
    }
}
