//! Plain uniform refinement: every face splits, level by level. Slow, simple, and the oracle of all tables.
//!
//! Numbers of children follow from numbers of parents, so no map is kept:
//!
//! ```text
//!   vertex v → vertex v                edge e → vertex V + e                face f → vertex V + E + f
//!   corner c of face f → face c, its corners: the vertex point, the edge point of the side that leaves the
//!                                             corner, the face point, the edge point of the side that arrives
//! ```
//!
//! with V vertices and E edges of the parent.

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use super::error::CageError;
use super::faces::{Corner, Crease, Faces, Tags};
use super::obj::CageBudget;
use super::topology::{Cage, NONE, Topology};
use crate::subdiv::{child_sharpness, edge_mask, vertex_mask};

/// The cage one level finer: all quads, sharpness one less.
///
/// # Errors
/// [`CageError::Budget`] when the children are too many to be numbered in 32 bits.
pub fn refine(cage: &Cage) -> Result<Cage, CageError> {
    let topology = cage.topology();
    let vertex_count = u64::from(topology.vertex_count())
        + u64::from(topology.edge_count())
        + u64::from(topology.face_count());
    if 4 * u64::from(topology.corner_count()) >= u64::from(NONE) || vertex_count >= u64::from(NONE)
    {
        return Err(CageError::Budget {
            what: "face corners",
            limit: u64::from(NONE) - 1,
        });
    }
    Cage::new(
        child_positions(cage),
        child_faces(topology),
        &child_tags(topology),
    )
}

/// The cage so many levels finer, refused beforehand where it would have more face corners than the budget.
///
/// # Errors
/// [`CageError::Budget`].
pub fn refine_times(cage: &Cage, depth: u8, budget: CageBudget) -> Result<Cage, CageError> {
    // Every corner becomes a quad.
    let corners = u128::from(cage.topology().corner_count()) << (2 * u32::from(depth)).min(64);
    if corners > u128::from(budget.corners) {
        return Err(CageError::Budget {
            what: "face corners",
            limit: budget.corners,
        });
    }
    let mut fine = cage.clone();
    for _ in 0..depth {
        fine = refine(&fine)?;
    }
    Ok(fine)
}

/// Vertex points, edge points, face points.
fn child_positions(cage: &Cage) -> Vec<[f64; 3]> {
    let (topology, positions) = (cage.topology(), cage.positions());
    let face_points: Vec<_> = (0..topology.face_count())
        .map(|face| {
            mean(
                topology
                    .face_vertices(face)
                    .iter()
                    .map(|&v| positions[v as usize]),
            )
        })
        .collect();
    let mut children =
        Vec::with_capacity(positions.len() + topology.edge_vertices.len() + face_points.len());
    children.extend(
        (0..topology.vertex_count()).map(|vertex| vertex_point(cage, vertex, &face_points)),
    );
    children.extend((0..topology.edge_count()).map(|edge| edge_point(cage, edge, &face_points)));
    children.extend_from_slice(&face_points);
    children
}

fn mean(points: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let weight = 1.0 / points.len() as f64;
    let mut sum = [0.0; 3];
    points.for_each(|point| add(&mut sum, 1.0, point));
    sum.map(|x| weight * x)
}

fn add(sum: &mut [f64; 3], weight: f64, point: [f64; 3]) {
    for (sum, x) in sum.iter_mut().zip(point) {
        *sum += weight * x;
    }
}

fn edge_point(cage: &Cage, edge: u32, face_points: &[[f64; 3]]) -> [f64; 3] {
    let topology = cage.topology();
    let mask = edge_mask(topology.edge_sharpness(edge));
    let mut point = [0.0; 3];
    for vertex in topology.edge_vertices(edge) {
        add(&mut point, mask.end, cage.positions()[vertex as usize]);
    }
    if mask.face > 0.0 {
        for face in topology.edge_faces(edge) {
            add(&mut point, mask.face, face_points[face as usize]);
        }
    }
    point
}

fn vertex_point(cage: &Cage, vertex: u32, face_points: &[[f64; 3]]) -> [f64; 3] {
    let (topology, positions) = (cage.topology(), cage.positions());
    let edges = topology.vertex_edges(vertex);
    let position = positions[vertex as usize];
    if edges.is_empty() {
        return position;
    }
    let end = |edge: u32| positions[topology.edge_end(edge, vertex) as usize];
    let mask = vertex_mask(
        topology.vertex_sharpness(vertex),
        edges.iter().map(|&e| topology.edge_sharpness(e)),
    );
    let mut point = position.map(|x| mask.vertex * x);
    if mask.edge > 0.0 {
        edges
            .iter()
            .for_each(|&edge| add(&mut point, mask.edge, end(edge)));
        topology
            .vertex_faces(vertex)
            .for_each(|face| add(&mut point, mask.face, face_points[face as usize]));
    }
    if mask.crease > 0.0 {
        mask.crease_edges
            .iter()
            .for_each(|&place| add(&mut point, mask.crease, end(edges[place])));
    }
    point
}

fn child_faces(topology: &Topology) -> Faces {
    let (vertex_count, edge_count) = (topology.vertex_count(), topology.edge_count());
    let child = |corner: u32| {
        let side = |corner: u32| vertex_count + topology.corner_edges[corner as usize];
        let face_point = vertex_count + edge_count + topology.corner_face(corner);
        [
            topology.corner_vertex(corner),
            side(corner),
            face_point,
            side(topology.previous_corner(corner)),
        ]
    };
    (0..topology.corner_count()).map(child).collect()
}

fn child_tags(topology: &Topology) -> Tags {
    let mut tags = Tags::default();
    for edge in (0..topology.edge_count()).filter(|&edge| !topology.is_boundary_edge(edge)) {
        let sharpness = child_sharpness(topology.edge_sharpness(edge));
        if sharpness > 0.0 {
            let point = topology.vertex_count() + edge;
            let halves = topology.edge_vertices(edge).map(|end| Crease {
                vertices: [end, point],
                sharpness,
            });
            tags.creases.extend(halves);
        }
    }
    for vertex in 0..topology.vertex_count() {
        let sharpness = child_sharpness(topology.vertex_sharpness(vertex));
        if sharpness > 0.0 {
            tags.corners.push(Corner { vertex, sharpness });
        }
    }
    let holes = (0..topology.face_count()).filter(|&face| topology.is_hole(face));
    tags.holes = holes
        .flat_map(|face| topology.face_corners(face))
        .map(|corner| corner as u32)
        .collect();
    tags
}

#[cfg(test)]
mod tests {
    use super::super::{CageBudget, read_obj};
    use super::*;

    fn read(text: &str) -> Cage {
        read_obj(text.as_bytes(), CageBudget::default()).unwrap()
    }

    const PYRAMID: &str = "v 0 0 1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n\
        f 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\nf 5 4 3 2\nt crease 2/1/0 1 2 2.5\nt corner 1/1/0 0 10\nt hole 1/0/0 4\n";

    #[test]
    fn counts_follow_the_formulas_and_tags_wear_off() {
        let cage = read(PYRAMID);
        let fine = refine(&cage).unwrap();
        let topology = fine.topology();
        assert_eq!(topology.vertex_count(), 5 + 8 + 5);
        assert_eq!(topology.face_count(), 16);
        assert_eq!(topology.edge_count(), 2 * 8 + 16);
        assert!(topology.all_quads());
        let sharp: Vec<f64> = (0..32)
            .map(|edge| topology.edge_sharpness(edge))
            .filter(|&s| s > 0.0)
            .collect();
        assert_eq!(sharp, [1.5, 1.5]);
        assert_eq!(topology.vertex_sharpness(0), f64::INFINITY);
        assert_eq!((0..16).filter(|&face| topology.is_hole(face)).count(), 4);
        assert_eq!(fine.positions()[0], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn refining_keeps_to_a_budget_beforehand() {
        let cage = read(PYRAMID);
        let budget = CageBudget {
            vertices: 1000,
            corners: 16 * 16,
        };
        let fine = refine_times(&cage, 2, budget).unwrap();
        assert_eq!(u64::from(fine.topology().corner_count()), budget.corners);
        let twice = refine(&refine(&cage).unwrap()).unwrap();
        assert_eq!(fine.positions(), twice.positions());
        for depth in [3, 255] {
            assert_eq!(
                refine_times(&cage, depth, budget).unwrap_err(),
                CageError::Budget {
                    what: "face corners",
                    limit: 256
                }
            );
        }
    }

    #[test]
    fn an_affine_map_may_come_before_or_after() {
        let map = |[x, y, z]: [f64; 3]| [2.0 * x - y + 3.0, 0.5 * z - 1.0, x + y + 7.0 * z];
        let cage = read(PYRAMID);
        let topology = cage.topology().clone();
        let moved = Cage::new(
            cage.positions().iter().copied().map(map).collect(),
            topology.faces().clone(),
            &Tags {
                creases: vec![Crease {
                    vertices: [1, 2],
                    sharpness: 2.5,
                }],
                corners: vec![Corner {
                    vertex: 0,
                    sharpness: 10.0,
                }],
                holes: vec![4],
            },
        );
        let after = refine(&moved.unwrap()).unwrap();
        for (a, b) in after
            .positions()
            .iter()
            .zip(refine(&cage).unwrap().positions())
        {
            assert!((0..3).all(|axis| (a[axis] - map(*b)[axis]).abs() < 1e-14));
        }
    }

    #[test]
    fn points_are_those_of_the_published_baselines() {
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
        let load = |name: String| {
            read_obj(
                &std::fs::read(folder.join(name)).unwrap(),
                CageBudget::default(),
            )
            .unwrap()
        };
        for name in [
            "catmark_cube",
            "catmark_cube_corner2",
            "catmark_cube_creases1",
            "catmark_edgecorner",
            "catmark_pyramid",
            "catmark_pyramid_creases0",
            "catmark_tent_creases0",
        ] {
            let mut cage = load(format!("{name}.obj"));
            for level in 0..3 {
                cage = refine(&cage).unwrap();
                let baseline = load(format!("baseline/{name}_level{level}.obj"));
                let (ours, theirs) = (cage.positions(), baseline.positions());
                assert_eq!(ours.len(), theirs.len(), "{name} level {level}");
                // Baselines are printed in single precision, in an order of their own.
                let far = theirs.iter().filter(|t| {
                    !ours
                        .iter()
                        .any(|o| (0..3).all(|i| (o[i] - t[i]).abs() < 2e-6))
                });
                assert_eq!(far.count(), 0, "{name} level {level}");
            }
        }
    }
}
