//! Patches become triangles: vertices by key, cells by template.
//!
//! A patch of level k is n × n cells, n = max(1, 2 >> k): a lattice quad's two samples a side at level 0. A side with
//! finer neighbours has a vertex in its middle then (from level 1 on; at level 0 it is there already), and its cell is a
//! fan about its centre:
//!
//! ```text
//!   3---2    3-m-2        corners counter-clockwise seen from outside, sides 0: 0–1, 1: 1–2, 2: 2–3, 3: 3–0
//!   | / |    |\|/|
//!   0---1    | c |        one finer side of four; others are whole
//!            |/ \|
//!            0---1
//! ```

use std::collections::HashMap;

use super::{FeatureShape, FeatureTable};
use crate::{
    fas::{PieceIndex, Place, Tables},
    reference::{refine::RefineSite, shared::NONE},
};

/// A face's side in the fixed steps that places are counted in: finer than any cell of the greatest depth.
const ONE: u32 = 1 << 12;

/// What a vertex is: what it lies on, where on it, and of which face where the surface is sharp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    on: On,
    face: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum On {
    Vertex(u32),
    /// An edge, steps from its first end.
    Edge(u32, u32),
    Face(u32, u32, u32),
}

struct Builder<'a> {
    shape: &'a FeatureShape,
    vertices: HashMap<Key, u32>,
    /// Vertices of sharp places by what they lie on: their positions are one.
    sharp: HashMap<On, u32>,
    sites: Vec<RefineSite>,
    samples: Vec<Option<[u32; 2]>>,
    indices: Vec<u32>,
}

/// Vertices and triangles of tables.
pub(super) fn table(shape: &FeatureShape, tables: Tables) -> FeatureTable {
    let mut builder = Builder {
        shape,
        vertices: HashMap::new(),
        sharp: HashMap::new(),
        sites: Vec::new(),
        samples: Vec::new(),
        indices: Vec::new(),
    };
    for (patch, at) in tables.render.patches.iter().zip(0..) {
        builder.piece(PieceIndex::Patch(at), patch.place, patch.finer);
    }
    for (cap, at) in tables.render.caps.iter().zip(0..) {
        builder.piece(PieceIndex::Cap(at), cap.place, cap.finer);
    }
    FeatureTable {
        sites: builder.sites,
        samples: builder.samples,
        indices: builder.indices,
        tables,
    }
}

impl Builder<'_> {
    fn piece(&mut self, piece: PieceIndex, place: Place, finer: u8) {
        let count = (2_u32 >> place.level).max(1);
        let side = ONE >> place.level;
        let step = side / count;
        let first = [u32::from(place.u) * side, u32::from(place.v) * side];
        let split = if place.level == 0 { 0 } else { finer };
        let mut vertex = |at: [u32; 2]| self.vertex(piece, place, at);
        let mut triangles = Vec::new();
        for (row, column) in (0..count).flat_map(|row| (0..count).map(move |column| (row, column)))
        {
            let low = [first[0] + column * step, first[1] + row * step];
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
                .map(|[u, v]| [low[0] + u * step, low[1] + v * step]);
            if split == 0 {
                let [a, b, c, d] = corners.map(&mut vertex);
                triangles.extend([a, b, c, a, c, d]);
                continue;
            }
            let centre = vertex(low.map(|at| at + step / 2));
            for at in 0..4 {
                let (from, to) = (corners[at], corners[(at + 1) % 4]);
                let (a, b) = (vertex(from), vertex(to));
                if split >> at & 1 == 0 {
                    triangles.extend([centre, a, b]);
                    continue;
                }
                let middle = vertex([0, 1].map(|axis| u32::midpoint(from[axis], to[axis])));
                triangles.extend([centre, a, middle, centre, middle, b]);
            }
        }
        self.indices.extend(triangles);
    }

    /// The vertex at steps (u, v) of a face, made when it is not there yet.
    fn vertex(&mut self, piece: PieceIndex, place: Place, at: [u32; 2]) -> u32 {
        let (on, is_sharp) = self.on(place.face, at);
        let face = if is_sharp { place.face } else { NONE };
        let key = Key { on, face };
        if let Some(&vertex) = self.vertices.get(&key) {
            return vertex;
        }
        let vertex = u32::try_from(self.sites.len()).unwrap_or(NONE);
        self.vertices.insert(key, vertex);
        // The same place on another face: its normal is that face's, its position the first's to the bit.
        let position_of = if is_sharp {
            *self.sharp.entry(on).or_insert(vertex)
        } else {
            vertex
        };
        let side = ONE >> place.level;
        let first = [place.u, place.v].map(|at| u32::from(at) * side);
        let share = |steps: u32, whole: u32| f64::from(steps) / f64::from(whole);
        self.sites.push(RefineSite {
            piece,
            uv: [0, 1].map(|axis| share(at[axis] - first[axis], side)),
            offset: self
                .shape
                .ring_offset(place, at.map(|steps| share(steps, ONE))),
            position_of,
        });
        self.samples.push(self.sample(on));
        vertex
    }

    /// What a place of a face lies on, and whether the surface is infinitely sharp there.
    fn on(&self, face: u32, [u, v]: [u32; 2]) -> (On, bool) {
        let topology = self.shape.cage.topology();
        let corners = topology.face_vertices(face);
        let corner = match [u, v] {
            [0, 0] => Some(0),
            [ONE, 0] => Some(1),
            [ONE, ONE] => Some(2),
            [0, ONE] => Some(3),
            _ => None,
        };
        let is_sharp = |edge: u32| topology.edge_sharpness(edge) == f64::INFINITY;
        if let Some(corner) = corner {
            let vertex: u32 = corners[corner];
            let mut edges = topology.vertex_edges(vertex).iter();
            return (On::Vertex(vertex), edges.any(|&edge| is_sharp(edge)));
        }
        let (side, along) = match [u, v] {
            [_, 0] => (0, u),
            [ONE, _] => (1, v),
            [_, ONE] => (2, ONE - u),
            [0, _] => (3, ONE - v),
            _ => return (On::Face(face, u, v), false),
        };
        let edge = topology.face_edges(face)[side];
        let is_forward = topology.edge_vertices(edge)[0] == corners[side];
        let along = if is_forward { along } else { ONE - along };
        (On::Edge(edge, along), is_sharp(edge))
    }

    /// The sample (column, row in the cut) that a place is, on the cut's border.
    fn sample(&self, on: On) -> Option<[u32; 2]> {
        match on {
            On::Vertex(vertex) => self.shape.samples[vertex as usize],
            On::Edge(edge, along) if 2 * along == ONE && self.shape.is_border_edge(edge) => {
                let ends = self.shape.cage.topology().edge_vertices(edge);
                let [a, b] = ends.map(|end| self.shape.samples[end as usize]);
                Some([0, 1].map(|axis| {
                    u32::midpoint(a.unwrap_or_default()[axis], b.unwrap_or_default()[axis])
                }))
            }
            _ => None,
        }
    }
}
