//! A face and the rings of its corners, and their exact subdivision to a quarter of the face.
//!
//! What the limit surface over a quad depends on is its corners' rings; the rings of a quarter follow from those of
//! the whole. So any place of the surface is reached by splitting, without ever building a mesh.
//!
//! ```text
//!    3 ── m2 ── 2      quarter q has the corners q: vertex point of q
//!    │    │     │                                q + 1: edge point m(q)
//!   m3 ── f ─── m1                               q + 2: face point f
//!    │    │     │                                q + 3: edge point m(q - 1)
//!    0 ── m0 ── 1      (all modulo 4), so u and v keep their directions
//! ```

#![expect(
    clippy::cast_possible_truncation,
    reason = "a linked cage numbers everything in 32 bits"
)]

use glam::DVec3;

use super::super::topology::Cage;
use crate::subdiv::{child_sharpness, edge_mask, vertex_mask};

/// A vertex and the quads around it, counter-clockwise.
#[derive(Clone, Debug, Default)]
pub(super) struct Ring {
    /// The vertex.
    pub(super) center: DVec3,
    /// Its own sharpness.
    pub(super) sharpness: f64,
    /// Far ends of its edges and their sharpness; one more than quads where the vertex is on a boundary.
    pub(super) spokes: Vec<DVec3>,
    pub(super) spoke_sharpness: Vec<f64>,
    /// The corner across in each quad; quad `i` lies between spokes `i` and `i + 1`.
    pub(super) diagonals: Vec<DVec3>,
    /// The quad the patch is: its next corner is spoke `at`, its previous one spoke `at + 1`.
    pub(super) at: usize,
}

impl Ring {
    /// True when the quads go all the way round.
    pub(super) fn closed(&self) -> bool {
        self.spokes.len() == self.diagonals.len()
    }

    /// The spoke `steps` counter-clockwise from the patch's next corner. Past a boundary it wraps, which no caller that
    /// checked the boundary sees.
    pub(super) fn spoke(&self, steps: isize) -> usize {
        wrap(self.at, steps, self.spokes.len())
    }

    /// The quad `steps` counter-clockwise from the patch.
    pub(super) fn quad(&self, steps: isize) -> usize {
        wrap(self.at, steps, self.diagonals.len())
    }

    /// Sharp spokes, and how many of them for ever.
    pub(super) fn sharp_counts(&self) -> [usize; 2] {
        let count = |least: f64| {
            self.spoke_sharpness
                .iter()
                .filter(|&&s| s > 0.0 && s >= least)
                .count()
        };
        [count(0.0), count(f64::INFINITY)]
    }

    /// True when no sharpness will wear off any more.
    pub(super) fn settled(&self) -> bool {
        let for_ever = |s: f64| s == 0.0 || s == f64::INFINITY;
        for_ever(self.sharpness) && self.spoke_sharpness.iter().all(|&s| for_ever(s))
    }

    fn face_point(&self, quad: usize) -> DVec3 {
        let next = if quad + 1 == self.spokes.len() {
            0
        } else {
            quad + 1
        };
        0.25 * (self.center + self.spokes[quad] + self.diagonals[quad] + self.spokes[next])
    }

    fn edge_point(&self, spoke: usize) -> DVec3 {
        let mask = edge_mask(self.spoke_sharpness[spoke]);
        let point = mask.end * (self.center + self.spokes[spoke]);
        if mask.face == 0.0 {
            return point;
        }
        let before = if spoke == 0 {
            self.diagonals.len() - 1
        } else {
            spoke - 1
        };
        point + mask.face * (self.face_point(before) + self.face_point(spoke))
    }

    fn vertex_point(&self) -> DVec3 {
        let mask = vertex_mask(self.sharpness, self.spoke_sharpness.iter().copied());
        let mut point = mask.vertex * self.center;
        if mask.edge > 0.0 {
            point += mask.edge * self.spokes.iter().sum::<DVec3>();
            point += mask.face
                * (0..self.diagonals.len())
                    .map(|quad| self.face_point(quad))
                    .sum::<DVec3>();
        }
        if mask.crease > 0.0 {
            let [a, b] = mask.crease_edges;
            point += mask.crease * (self.spokes[a] + self.spokes[b]);
        }
        point
    }

    /// The child vertex's ring.
    fn vertex_child(&self, child: &mut Self) {
        child.center = self.vertex_point();
        child.sharpness = child_sharpness(self.sharpness);
        child.at = self.at;
        child.clear();
        child
            .spokes
            .extend((0..self.spokes.len()).map(|spoke| self.edge_point(spoke)));
        child
            .spoke_sharpness
            .extend(self.spoke_sharpness.iter().map(|&s| child_sharpness(s)));
        child
            .diagonals
            .extend((0..self.diagonals.len()).map(|quad| self.face_point(quad)));
    }

    fn clear(&mut self) {
        self.spokes.clear();
        self.spoke_sharpness.clear();
        self.diagonals.clear();
    }

    /// A ring of few points around an unsharp vertex.
    fn set(
        &mut self,
        center: DVec3,
        at: usize,
        spokes: &[DVec3],
        sharpness: &[f64],
        diagonals: &[DVec3],
    ) {
        self.clear();
        (self.center, self.sharpness, self.at) = (center, 0.0, at);
        self.spokes.extend_from_slice(spokes);
        self.spoke_sharpness.extend_from_slice(sharpness);
        self.diagonals.extend_from_slice(diagonals);
    }

    fn shift(&mut self, by: DVec3) {
        self.center -= by;
        self.spokes
            .iter_mut()
            .chain(&mut self.diagonals)
            .for_each(|point| *point -= by);
    }
}

fn wrap(at: usize, steps: isize, count: usize) -> usize {
    (at as isize + steps).rem_euclid(count as isize) as usize
}

/// A quad and the rings of its corners, in coordinates from an origin of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbourhood {
    /// Rings of the corners at (0, 0), (1, 0), (1, 1), (0, 1).
    pub(super) rings: [Ring; 4],
    /// Where all points are counted from: near the place sought, so that small differences keep their digits.
    pub(super) origin: DVec3,
}

impl Neighbourhood {
    /// Takes a quad out of a cage whose faces around it are all quads.
    pub(super) fn load(&mut self, cage: &Cage, face: u32) {
        let topology = cage.topology();
        let position = |vertex: u32| DVec3::from_array(cage.positions()[vertex as usize]);
        self.origin = position(topology.face_vertices(face)[0]);
        for (ring, corner) in self.rings.iter_mut().zip(topology.face_corners(face)) {
            let vertex = topology.corner_vertex(corner as u32);
            ring.clear();
            ring.center = position(vertex);
            ring.sharpness = topology.vertex_sharpness(vertex);
            for &edge in topology.vertex_edges(vertex) {
                ring.spokes.push(position(topology.edge_end(edge, vertex)));
                ring.spoke_sharpness.push(topology.edge_sharpness(edge));
            }
            for (place, &other) in topology.vertex_corners(vertex).iter().enumerate() {
                let across = topology.next_corner(topology.next_corner(other));
                ring.diagonals
                    .push(position(topology.corner_vertex(across)));
                if other as usize == corner {
                    ring.at = place;
                }
            }
            ring.shift(self.origin);
        }
    }

    /// The quarter at corner `q`.
    pub(super) fn split(&self, q: usize, quarter: &mut Self) {
        let rings = &self.rings;
        let at = |i: usize| &rings[i & 3];
        let edge_points: [DVec3; 4] = std::array::from_fn(|i| at(i).edge_point(at(i).at));
        let vertex_points: [DVec3; 4] = std::array::from_fn(|i| at(i).vertex_point());
        let face_point = at(q).face_point(at(q).at);

        rings[q].vertex_child(&mut quarter.rings[q]);
        self.split_side(
            q,
            1,
            face_point,
            &edge_points,
            &vertex_points,
            &mut quarter.rings[(q + 1) & 3],
        );
        let diagonals = [1, 2, 3, 0].map(|i| vertex_points[i]);
        quarter.rings[(q + 2) & 3].set(
            face_point,
            (q + 3) & 3,
            &edge_points,
            &[0.0; 4],
            &diagonals,
        );
        self.split_side(
            (q + 3) & 3,
            0,
            face_point,
            &edge_points,
            &vertex_points,
            &mut quarter.rings[(q + 3) & 3],
        );

        let shift = quarter.rings[q].center;
        quarter.origin = self.origin + shift;
        quarter.rings.iter_mut().for_each(|ring| ring.shift(shift));
    }

    /// The ring of the edge point of side `i`:
    ///
    /// ```text
    ///      f
    ///   1  │  0       spokes v(i+1), f, v(i), g; quads 0 to 3 from v(i+1) on;
    ///  vi ─ m ─ vi+1  without a face g below, the ring is open
    ///   2  │  3
    ///      g
    /// ```
    fn split_side(
        &self,
        i: usize,
        at: usize,
        f: DVec3,
        edges: &[DVec3; 4],
        vertices: &[DVec3; 4],
        child: &mut Ring,
    ) {
        let (here, there) = (&self.rings[i], &self.rings[(i + 1) & 3]);
        let sharp = child_sharpness(here.spoke_sharpness[here.at]);
        let ends = [vertices[(i + 1) & 3], f, vertices[i]];
        let inner = [edges[(i + 1) & 3], edges[(i + 3) & 3]];
        if !here.closed() && here.at == 0 {
            return child.set(edges[i], at, &ends, &[sharp, 0.0, sharp], &inner);
        }
        let g = here.face_point(here.quad(-1));
        let outer = [
            here.edge_point(here.spoke(-1)),
            there.edge_point(there.spoke(2)),
        ];
        let spokes = [ends[0], ends[1], ends[2], g];
        let diagonals = [inner[0], inner[1], outer[0], outer[1]];
        child.set(edges[i], at, &spokes, &[sharp, 0.0, sharp, 0.0], &diagonals);
    }
}
