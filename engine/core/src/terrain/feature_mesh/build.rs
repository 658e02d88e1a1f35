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

use super::{FeatureMesh, FeatureShape};
use crate::{
    fas::{Cap, Patch, Place, Sample, Tables},
    reference::shared::{NONE, SAMPLE_BITS, border::TILE_SAMPLES},
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

enum Piece<'a> {
    Patch(&'a Patch),
    Cap(&'a Cap),
}

impl Piece<'_> {
    fn evaluate(&self, points: &[[f64; 3]], uv: [f64; 2]) -> Sample<f64> {
        match self {
            Self::Patch(patch) => patch.evaluate(points, uv),
            Self::Cap(cap) => cap.evaluate(points, uv),
        }
    }
}

struct Builder<'a> {
    shape: &'a FeatureShape,
    points: Vec<[f64; 3]>,
    vertices: HashMap<Key, u32>,
    /// Vertices of sharp places by what they lie on: their positions are one.
    sharp: HashMap<On, u32>,
    mesh: FeatureMesh,
}

/// The mesh of tables.
pub(super) fn mesh(shape: &FeatureShape, tables: &Tables) -> FeatureMesh {
    let mut builder = Builder {
        shape,
        points: tables.execute(shape.cage.positions()),
        vertices: HashMap::new(),
        sharp: HashMap::new(),
        mesh: FeatureMesh {
            origin: shape.origin,
            ..FeatureMesh::default()
        },
    };
    for patch in &tables.render.patches {
        builder.piece(&Piece::Patch(patch), patch.place, patch.finer);
    }
    for cap in &tables.render.caps {
        builder.piece(&Piece::Cap(cap), cap.place, cap.finer);
    }
    mend_normals(&mut builder.mesh);
    builder.mesh
}

impl Builder<'_> {
    fn piece(&mut self, piece: &Piece<'_>, place: Place, finer: u8) {
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
        self.mesh.indices.extend(triangles);
    }

    /// The vertex at steps (u, v) of a face, made when it is not there yet.
    fn vertex(&mut self, piece: &Piece<'_>, place: Place, at: [u32; 2]) -> u32 {
        let (on, is_sharp) = self.on(place.face, at);
        let face = if is_sharp { place.face } else { NONE };
        let key = Key { on, face };
        if let Some(&vertex) = self.vertices.get(&key) {
            return vertex;
        }
        let vertex = self.make(piece, place, at, on);
        self.vertices.insert(key, vertex);
        if is_sharp {
            // The same place on another face: its normal is that face's, its position the first's to the bit.
            let first = *self.sharp.entry(on).or_insert(vertex);
            self.mesh.positions[vertex as usize] = self.mesh.positions[first as usize];
        }
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

    fn make(&mut self, piece: &Piece<'_>, place: Place, at: [u32; 2], on: On) -> u32 {
        let shape = self.shape;
        let side = ONE >> place.level;
        let first = [place.u, place.v].map(|at| u32::from(at) * side);
        let local = [0, 1].map(|axis| f64::from(at[axis] - first[axis]) / f64::from(side));
        let mut sample = piece.evaluate(&self.points, local);
        if shape.in_ring[place.face as usize] {
            self.add_offset(&mut sample);
        }
        let cut = shape.place;
        let start = cut.first_sample();
        let (tile, border) = if let Some([x, y]) = self.sample(on) {
            let rise = f64::from(shape.height([x, y])) * cut.unit - shape.origin[2];
            sample.position = [f64::from(x) * cut.step[0], f64::from(y) * cut.step[1], rise];
            let (tile, [row, column]) = cut.tile_at([start[0] + y, start[1] + x]);
            (tile, tile << SAMPLE_BITS | (row * TILE_SAMPLES + column))
        } else {
            (self.tile_under(sample.position), NONE)
        };
        let mesh = &mut self.mesh;
        let vertex = u32::try_from(mesh.positions.len()).unwrap_or(NONE);
        mesh.positions.push(narrow(sample.position));
        mesh.normals.push(narrow(
            unit(cross(sample.du, sample.dv)).unwrap_or_default(),
        ));
        mesh.border.push(border);
        mesh.tiles.push(tile);
        vertex
    }

    /// Ring 1: the border's offset on top, with its slope.
    fn add_offset(&self, sample: &mut Sample<f64>) {
        let cut = &self.shape.place;
        let at = [0, 1].map(|axis| sample.position[axis] / cut.step[axis]);
        let slope = self.shape.border.slope(at);
        for tangent in [&mut sample.du, &mut sample.dv] {
            tangent[2] += cut.unit
                * (0..2)
                    .map(|axis| slope[axis] * tangent[axis] / cut.step[axis])
                    .sum::<f64>();
        }
        sample.position[2] += cut.unit * self.shape.border.offset(at);
    }

    /// The group's tile under a position; the nearest of them where an overhang reaches past the cut.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the cut, whose samples fit 32 bits"
    )]
    fn tile_under(&self, position: [f64; 3]) -> u32 {
        let cut = &self.shape.place;
        let (size, first) = (cut.size(), cut.first_sample());
        let inside = |axis: usize| {
            (position[axis] / cut.step[axis]).clamp(0.0, f64::from(size[axis])) as u32
        };
        cut.tile_at([first[0] + inside(1), first[1] + inside(0)]).0
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "metres from the cut's corner are f32"
)]
fn narrow(a: [f64; 3]) -> [f32; 3] {
    a.map(|part| part as f32)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = a.iter().map(|part| part * part).sum::<f64>().sqrt();
    (length > 1e-12).then(|| a.map(|part| part / length))
}

/// Where the surface has no tangent plane of its own, the triangles around decide.
fn mend_normals(mesh: &mut FeatureMesh) {
    let broken = |normal: &[f32; 3]| *normal == [0.0; 3];
    if !mesh.normals.iter().any(broken) {
        return;
    }
    let mut sums = vec![[0.0_f64; 3]; mesh.normals.len()];
    for triangle in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[triangle[i] as usize].map(f64::from));
        let edge = |to: [f64; 3]| [0, 1, 2].map(|axis| to[axis] - a[axis]);
        let area = cross(edge(b), edge(c));
        for &vertex in triangle {
            (0..3).for_each(|axis| sums[vertex as usize][axis] += area[axis]);
        }
    }
    for (normal, sum) in mesh.normals.iter_mut().zip(sums) {
        if broken(normal) {
            *normal = narrow(unit(sum).unwrap_or([0.0, 0.0, 1.0]));
        }
    }
}
