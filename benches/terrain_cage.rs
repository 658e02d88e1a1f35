//! A control cage of real ground, with an exact number of quads, about half of them irregular.
//!
//! The restricted quadtree (`quadtree`) is refined where the ground bends; its quads are moved apart a little, so that
//! none has a straight corner, and laid onto the heights. The number is that of the paper's terrain, 805,293 quads.
//!
//! Based on: Lin, Wang, Sun (2018), section 4, whose terrain is not published: this is one of its size and kind.

use anyhow::{Context as _, Result};
use drumlin_core::{
    cage::{Cage, Crease, Faces, NONE, Tags},
    fas::{FeatureKind, features},
};
use glam::DVec3;
use serde::Serialize;

use crate::{
    heights::Heights,
    quadtree::{Leaf, Quadtree},
};

/// Quads of the paper's terrain.
pub const PAPER_QUADS: u64 = 805_293;

/// Units a side are 2^11: 4 samples of an elevation model of 8192 a unit.
const UNIT_EXPONENT: u8 = 11;

/// A leaf's urgency is its error times its size to this power: the less, the more the sizes of neighbours differ. With
/// it half of the quads of the Moon's cage are irregular (0.44 of them at 0, 0.33 at 0.5).
const URGENCY_EXPONENT: f64 = -0.3;

/// Places along a leaf's side at which its error is looked for, at most.
const PROBES: u32 = 16;

/// What a cage holds, as experiments print it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CageCounts {
    /// Quads.
    pub faces: u32,
    /// Vertices.
    pub vertices: u32,
    /// Quads with an extraordinary vertex.
    pub irregular_faces: u32,
    /// Extraordinary vertices.
    pub features: u32,
    /// Sum of the features' valences.
    pub feature_valences: u64,
}

/// The cage of a square of ground with exactly so many quads, in metres: x east, y north, z up, origin in the middle.
///
/// # Errors
/// When the ground's quadtree cannot have that number of quads.
pub fn terrain_cage(heights: &Heights, quads: u64) -> Result<Cage> {
    terrain_cage_of(heights, quads, UNIT_EXPONENT)
}

/// Counts of a cage.
#[must_use]
pub fn cage_counts(cage: &Cage) -> CageCounts {
    let topology = cage.topology();
    let kinds = features(topology);
    let is_feature = |&vertex: &u32| kinds[vertex as usize] != FeatureKind::Regular;
    let irregular = (0..topology.face_count())
        .filter(|&face| topology.face_vertices(face).iter().any(is_feature));
    let found = || (0..topology.vertex_count()).filter(is_feature);
    CageCounts {
        faces: topology.face_count(),
        vertices: topology.vertex_count(),
        irregular_faces: irregular.count() as u32,
        features: found().count() as u32,
        feature_valences: found().map(|at| topology.valence(at) as u64).sum(),
    }
}

/// Semi-sharp creases where the cage bends most: on the twentieth of its inner edges between the most different normals.
#[must_use]
pub fn sharpest_edges(cage: &Cage) -> Vec<Crease> {
    let topology = cage.topology();
    let normal = |face: u32| {
        let corners = topology.face_vertices(face);
        let [a, b, c, d] =
            [0, 1, 2, 3].map(|at| DVec3::from(cage.positions()[corners[at] as usize]));
        (c - a).cross(d - b).normalize_or_zero()
    };
    let normals: Vec<_> = (0..topology.face_count()).map(normal).collect();
    let inner = (0..topology.edge_count()).filter(|&edge| !topology.is_boundary_edge(edge));
    let mut bends: Vec<_> = inner
        .map(|edge| {
            let [a, b] = topology.edge_faces(edge).map(|face| normals[face as usize]);
            (a.dot(b), edge)
        })
        .collect();
    bends.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let sharpest = bends
        .iter()
        .take(bends.len() / 20)
        .map(|&(_, edge)| Crease {
            vertices: topology.edge_vertices(edge),
            sharpness: 2.0,
        });
    sharpest.collect()
}

pub(crate) fn terrain_cage_of(heights: &Heights, quads: u64, unit_exponent: u8) -> Result<Cage> {
    let mut tree = Quadtree::new(unit_exponent);
    let units = f64::from(tree.side());
    tree.refine(quads, |leaf| {
        error(heights, leaf, units) * f64::from(leaf.size).powf(URGENCY_EXPONENT)
    })?;
    let mut mesh = Mesh::of(&tree);
    mesh.relax();
    let positions = mesh.laid_on(heights);
    Cage::new(positions, Faces::quads(&mesh.quads), &Tags::default())
        .context("linking the terrain cage")
}

/// The largest distance in height from the ground to the bilinear surface of a leaf's corners, metres.
fn error(heights: &Heights, leaf: Leaf, units: f64) -> f64 {
    let probes = (4 * leaf.size).min(PROBES);
    let at = |u: f64, v: f64| {
        let place = [(leaf.column, u), (leaf.row, v)]
            .map(|(first, along)| (f64::from(first) + f64::from(leaf.size) * along) / units);
        heights.at(place)
    };
    let corners = [[at(0.0, 0.0), at(1.0, 0.0)], [at(0.0, 1.0), at(1.0, 1.0)]];
    let mut most = 0.0_f64;
    for row in 0..=probes {
        let v = f64::from(row) / f64::from(probes);
        let [west, east] = [0, 1].map(|side| (1.0 - v) * corners[0][side] + v * corners[1][side]);
        for column in 0..=probes {
            let u = f64::from(column) / f64::from(probes);
            most = most.max((at(u, v) - (1.0 - u) * west - u * east).abs());
        }
    }
    most
}

/// Quads on the plane: places as fractions of the sides, west to east and north to south.
struct Mesh {
    places: Vec<[f64; 2]>,
    quads: Vec<[u32; 4]>,
}

impl Mesh {
    fn of(tree: &Quadtree) -> Self {
        let width = 2 * tree.side() + 1;
        let mut numbers = vec![NONE; (width * width) as usize];
        let mut mesh = Self {
            places: Vec::new(),
            quads: Vec::new(),
        };
        for leaf in tree.leaves() {
            let polygon = tree.polygon(leaf);
            let count = polygon.len();
            let mut number = |[column, row]: [u32; 2]| {
                let number = &mut numbers[(row * width + column) as usize];
                if *number == NONE {
                    *number = mesh.places.len() as u32;
                    let place = [column, row].map(|at| f64::from(at) / f64::from(width - 1));
                    mesh.places.push(place);
                }
                *number
            };
            let centre = number([2 * leaf.column + leaf.size, 2 * leaf.row + leaf.size]);
            let corners: Vec<_> = polygon.iter().map(|&at| number(at)).collect();
            let middle = |i: usize| {
                let [a, b] = [polygon[i], polygon[(i + 1) % count]];
                [0, 1].map(|axis| (a[axis] + b[axis]) / 2)
            };
            let middles: Vec<_> = (0..count).map(|i| number(middle(i))).collect();
            let quads = (0..count).map(|i| {
                [
                    corners[i],
                    middles[i],
                    centre,
                    middles[(i + count - 1) % count],
                ]
            });
            mesh.quads.extend(quads);
        }
        mesh
    }

    /// Moves every inner vertex to the mean of its neighbours, once: straight corners open.
    fn relax(&mut self) {
        let mut sums = vec![([0.0; 2], 0_u32); self.places.len()];
        // Of the two faces at an inner edge one walks it from each of its ends.
        for quad in &self.quads {
            for side in 0..4 {
                let [from, to] = [quad[side], quad[(side + 1) % 4]].map(|at| at as usize);
                let (sum, count) = &mut sums[from];
                *sum = [0, 1].map(|axis| sum[axis] + self.places[to][axis]);
                *count += 1;
            }
        }
        for (place, (sum, count)) in self.places.iter_mut().zip(sums) {
            if place.iter().all(|at| (f64::EPSILON..1.0).contains(at)) {
                *place = sum.map(|sum| sum / f64::from(count));
            }
        }
    }

    fn laid_on(&self, heights: &Heights) -> Vec<[f64; 3]> {
        let [width, height] = heights.size();
        let laid = |&[x, y]: &[f64; 2]| [(x - 0.5) * width, (0.5 - y) * height, heights.at([x, y])];
        self.places.iter().map(laid).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Ground with a ridge and pits, 257 samples a side.
    pub(crate) fn ground() -> Heights {
        let samples = (0..257 * 257).map(|at| {
            let [x, y] = [at % 257, at / 257].map(|at| at as f32 / 256.0);
            let pit = -200.0 * (-60.0 * ((x - 0.7).powi(2) + (y - 0.3).powi(2))).exp();
            pit + 150.0 * (9.0 * x + 3.0 * (7.0 * y).sin()).sin().abs()
        });
        Heights::new(257, samples.collect(), [5000.0, 5000.0]).expect("samples")
    }

    #[test]
    fn a_cage_has_exactly_the_quads_asked_for_and_one_boundary() {
        for quads in [2001, 6000] {
            // Linking refuses what is not manifold, or turned two ways.
            let cage = terrain_cage_of(&ground(), quads, 7).expect("units enough");
            let topology = cage.topology();
            assert_eq!(u64::from(topology.face_count()), quads);
            assert!(topology.all_quads());
            // A disc: no T-junction makes a hole in it.
            let euler = i64::from(topology.vertex_count()) - i64::from(topology.edge_count())
                + i64::from(topology.face_count());
            assert_eq!(euler, 1);
            let border = |&edge: &u32| topology.is_boundary_edge(edge);
            for edge in (0..topology.edge_count()).filter(border) {
                let ends = topology
                    .edge_vertices(edge)
                    .map(|at| cage.positions()[at as usize]);
                let on_side = |axis: usize| ends.iter().all(|end| end[axis].abs() == 2500.0);
                assert!(on_side(0) || on_side(1), "{ends:?}");
            }
        }
    }

    #[test]
    fn quads_are_convex_seen_from_above_and_have_no_straight_corner() {
        let cage = terrain_cage_of(&ground(), 6000, 7).expect("units enough");
        let topology = cage.topology();
        for face in 0..topology.face_count() {
            let corners = topology.face_vertices(face);
            for corner in 0..4 {
                let [a, b, c] =
                    [0, 1, 2].map(|step| cage.positions()[corners[(corner + step) % 4] as usize]);
                let [p, q] = [[b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]];
                let sine = (p[0] * q[1] - p[1] * q[0]) / (p[0].hypot(p[1]) * q[0].hypot(q[1]));
                assert!(sine > 0.05, "face {face}: {sine}");
            }
        }
    }

    #[test]
    fn features_are_the_corners_of_finer_leaves_and_the_centres_beside_them() {
        let cage = terrain_cage_of(&ground(), 6000, 7).expect("units enough");
        let counts = cage_counts(&cage);
        let share = f64::from(counts.irregular_faces) / f64::from(counts.faces);
        assert!((0.2..0.8).contains(&share), "{counts:?}");
        let topology = cage.topology();
        let most = (0..topology.vertex_count())
            .map(|at| topology.valence(at))
            .max();
        assert!(most <= Some(8));
    }
}
