//! What one level around a feature is made of: its rows, its patches and its caps, in the numbers of [`Lattice`].
//!
//! All features of one shape share one template, and so do all their levels. Places are counted in patches from the
//! feature along its sector's axes; [`Turn`](super::turn::Turn) brings them to the axes of the cage's face.
//!
//! ```text
//!   3 ---- 3 ---- 3 ---- 3      P   patches of the level, three a sector
//!   |      |      |      |      C   refined further; a cap at the last level
//!   2 -P-- 2 -P-- 2      3      the outer cells only lend their points
//!   |      |      |      |
//!   1 -C-- 1 -P-- 2      3
//!   |      |      |      |
//!   v ---- 1 ---- 2 ---- 3
//! ```

use super::super::{
    Cap, CapRing, Patch, Place,
    execute::{Real, crease_point, mean, smooth_point},
};
use super::lattice::Lattice;
use crate::{
    cage::NONE,
    subdiv::{VertexRule, vertex_rule},
};

/// What an edge at a feature is, at level 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Spoke {
    /// Smooth, or less than 1 sharp.
    Smooth,
    /// Semi-sharp by 1 or more: a cap takes it as sharp, no patch ends there.
    SemiSharp,
    /// A boundary or infinitely sharp.
    Sharp,
}

/// What of a feature's surroundings decides its template.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Shape {
    /// False on a boundary.
    pub(super) is_closed: bool,
    /// True when the vertex itself is sharp.
    pub(super) is_sharp: bool,
    /// Its edges.
    pub(super) spokes: Vec<Spoke>,
}

/// A face point: its corners in the level above.
struct FaceRow {
    point: u32,
    corners: [u32; 4],
}

/// An edge point: its ends in the level above; its face points in its own where it is not sharp.
struct EdgeRow {
    point: u32,
    ends: [u32; 2],
    faces: Option<[u32; 2]>,
}

/// The point of a regular vertex of the level above, of ends there and face points in its own level.
struct VertexRow {
    point: u32,
    vertex: u32,
    ends: [u32; 4],
    faces: [u32; 4],
}

/// A vertex point along a crease, all of the level above.
struct CreaseRow {
    point: u32,
    vertex: u32,
    ends: [u32; 2],
}

/// One level around features of one shape.
pub(super) struct Template {
    pub(super) lattice: Lattice,
    faces: Vec<FaceRow>,
    edges: Vec<EdgeRow>,
    vertices: Vec<VertexRow>,
    creases: Vec<CreaseRow>,
    feature: VertexRule,
    /// Three a sector; [`NONE`] beyond sharp spokes. Finer sides are those of levels that are not the last.
    pub(super) patches: Vec<[Patch; 3]>,
    /// One a sector.
    pub(super) caps: Vec<Cap>,
}

/// Cells of a sector's three patches.
const CELLS: [[u16; 2]; 3] = [[1, 0], [1, 1], [0, 1]];

impl Template {
    pub(super) fn new(shape: &Shape) -> Self {
        let lattice = Lattice {
            spokes: shape.spokes.len() as u32,
            is_closed: shape.is_closed,
        };
        let sharp_count = shape.sharp_spokes().count();
        let sharpness = if shape.is_sharp { f64::INFINITY } else { 0.0 };
        let mut template = Self {
            lattice,
            faces: Vec::new(),
            edges: Vec::new(),
            vertices: Vec::new(),
            creases: Vec::new(),
            feature: vertex_rule(sharpness, sharp_count),
            patches: Vec::new(),
            caps: Vec::new(),
        };
        template.add_feature_row(shape);
        for spoke in 0..lattice.spokes {
            if shape.ends_sector(spoke) {
                template.add_sharp_spoke(spoke);
            } else {
                template.add_spoke(spoke);
            }
        }
        for sector in 0..lattice.sectors() {
            template.add_sector(sector);
            let patches = CELLS.map(|cell| patch(lattice, shape, sector, cell));
            template.patches.push(patches);
            template.caps.push(cap(lattice, shape, sector));
        }
        template
    }

    /// Makes a level from the one above, of which the points within 2 of the feature are read.
    pub(super) fn execute<T: Real>(&self, above: &[[T; 3]], level: &mut [[T; 3]]) {
        let up = |point: u32| above[point as usize];
        for row in &self.faces {
            level[row.point as usize] = mean(row.corners.map(up));
        }
        for row in &self.edges {
            let [a, b] = row.ends.map(up);
            let [f, g] = row
                .faces
                .map_or([a, b], |faces| faces.map(|face| level[face as usize]));
            level[row.point as usize] = mean([a, f, b, g]);
        }
        for row in &self.vertices {
            let end = |index: usize| up(row.ends[index]);
            let face = |index: usize| level[row.faces[index] as usize];
            level[row.point as usize] = smooth_point(up(row.vertex), 4, end, face);
        }
        for row in &self.creases {
            level[row.point as usize] = crease_point(up(row.vertex), row.ends.map(up));
        }
        match self.feature {
            VertexRule::Corner => level[0] = up(0),
            // Among the crease rows.
            VertexRule::Crease => {}
            VertexRule::Smooth => {
                let end = |spoke: usize| up(self.lattice.spoke(spoke as u32, 1));
                let face = |sector: usize| level[self.lattice.at(sector as u32, 1, 1) as usize];
                level[0] = smooth_point(up(0), self.lattice.spokes as usize, end, face);
            }
        }
    }

    fn add_feature_row(&mut self, shape: &Shape) {
        let mut sharp = shape.sharp_spokes();
        if let (VertexRule::Crease, Some(a), Some(b)) = (self.feature, sharp.next(), sharp.next()) {
            self.creases.push(CreaseRow {
                point: 0,
                vertex: 0,
                ends: [a, b].map(|spoke| self.lattice.spoke(spoke, 1)),
            });
        }
    }

    fn add_sharp_spoke(&mut self, spoke: u32) {
        let at = |distance: u32| self.lattice.spoke(spoke, distance);
        self.edges.extend([0, 1].map(|end| EdgeRow {
            point: at(2 * end + 1),
            ends: [at(end), at(end + 1)],
            faces: None,
        }));
        self.creases.push(CreaseRow {
            point: at(2),
            vertex: at(1),
            ends: [at(0), at(2)],
        });
    }

    /// A smooth spoke has sectors on both sides.
    fn add_spoke(&mut self, sector: u32) {
        for x in [1, 3] {
            self.add_edge(sector, [x, 0]);
        }
        self.add_vertex(sector, [2, 0]);
    }

    fn add_sector(&mut self, sector: u32) {
        for [x, y] in [[1, 1], [3, 1], [1, 3], [3, 3]] {
            let corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
                .map(|[dx, dy]| self.lattice.at(sector, (x + dx) / 2, (y + dy) / 2));
            let point = self.lattice.at(sector, x, y);
            self.faces.push(FaceRow { point, corners });
        }
        for place in [[1, 2], [3, 2], [2, 1], [2, 3]] {
            self.add_edge(sector, place);
        }
        self.add_vertex(sector, [2, 2]);
    }

    /// The edge point at (x, y), one of them odd: the edge lies along that axis, its faces beside it.
    fn add_edge(&mut self, sector: u32, [x, y]: [i32; 2]) {
        let [along, beside] = if x % 2 == 1 {
            [[1, 0], [0, 1]]
        } else {
            [[0, 1], [1, 0]]
        };
        let at = |[dx, dy]: [i32; 2], sign: i32| [x + sign * dx, y + sign * dy];
        let point = |[x, y]: [i32; 2]| self.lattice.at(sector, x, y);
        let row = EdgeRow {
            point: point([x, y]),
            ends: [-1, 1].map(|sign| point(at(along, sign).map(|at| at / 2))),
            faces: Some([-1, 1].map(|sign| point(at(beside, sign)))),
        };
        self.edges.push(row);
    }

    /// The vertex point at (x, y), both even, of a regular vertex.
    fn add_vertex(&mut self, sector: u32, [x, y]: [i32; 2]) {
        let point = |x: i32, y: i32| self.lattice.at(sector, x, y);
        let row = VertexRow {
            point: point(x, y),
            vertex: point(x / 2, y / 2),
            ends: [[1, 0], [0, 1], [-1, 0], [0, -1]].map(|[dx, dy]| point(x / 2 + dx, y / 2 + dy)),
            faces: [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(|[dx, dy]| point(x + dx, y + dy)),
        };
        self.vertices.push(row);
    }
}

impl Shape {
    /// Spokes that end the sectors of caps.
    fn sharp_spokes(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.spokes.len() as u32).filter(|&spoke| self.ends_sector(spoke))
    }

    fn ends_sector(&self, spoke: u32) -> bool {
        self.spokes[spoke as usize] != Spoke::Smooth
    }

    fn is_border(&self, spoke: u32) -> bool {
        self.spokes[spoke as usize] == Spoke::Sharp
    }
}

fn patch(lattice: Lattice, shape: &Shape, sector: u32, cell: [u16; 2]) -> Patch {
    let (x_border, y_border) = (
        shape.is_border(sector),
        shape.is_border(lattice.after(sector)),
    );
    let [low_x, low_y] = cell.map(|low| i32::from(low) - 1);
    let (below, left) = (x_border && cell[1] == 0, y_border && cell[0] == 0);
    let controls = std::array::from_fn(|index| {
        let (column, row) = (index as i32 % 4, index as i32 / 4);
        if (below && row == 0) || (left && column == 0) {
            return NONE;
        }
        lattice.at(sector, low_x + column, low_y + row)
    });
    Patch {
        place: Place {
            u: cell[0],
            v: cell[1],
            ..Place::default()
        },
        controls,
        finer: match cell {
            [1, 0] => 0b1000,
            [0, 1] => 0b0001,
            _ => 0,
        },
        sharp: u8::from(below) | u8::from(left) << 3,
    }
}

fn cap(lattice: Lattice, shape: &Shape, sector: u32) -> Cap {
    let after = lattice.after(sector);
    Cap {
        place: Place::default(),
        finer: 0,
        sharp: u8::from(shape.is_border(sector)) | u8::from(shape.is_border(after)) << 3,
        rings: [
            feature_ring(lattice, shape, sector),
            regular_ring(lattice, sector, [1, 0], shape.ends_sector(sector)),
            regular_ring(lattice, sector, [1, 1], false),
            regular_ring(lattice, sector, [0, 1], shape.ends_sector(after)),
        ],
    }
}

/// The ring of a cap's regular corner; only this side of it where a sharp spoke runs through it.
fn regular_ring(lattice: Lattice, sector: u32, [x, y]: [i32; 2], is_sharp: bool) -> CapRing {
    // Counter-clockwise, ends and diagonals in turn. One that lies on a spoke begins along it, on this side.
    let around = [
        [1, 0],
        [1, 1],
        [0, 1],
        [-1, 1],
        [-1, 0],
        [-1, -1],
        [0, -1],
        [1, -1],
    ];
    let first = if y == 0 { 0 } else { 6 };
    let point = |index: usize| {
        let [dx, dy] = around[(first + index) % 8];
        lattice.at(sector, x + dx, y + dy)
    };
    let (ends, faces) = if is_sharp { (3, 2) } else { (4, 4) };
    // The cap itself lies towards the feature: the face whose diagonal is the corner across it.
    let across = lattice.at(sector, 1 - x, 1 - y);
    let diagonals: Vec<_> = (0..faces).map(|face| point(2 * face + 1)).collect();
    CapRing {
        vertex: lattice.at(sector, x, y),
        ends: (0..ends).map(|end| point(2 * end)).collect(),
        own: diagonals.iter().position(|&at| at == across).unwrap_or(0),
        diagonals,
        closed: !is_sharp,
        corner: false,
    }
}

/// The ring of the feature itself: the faces between the sharp spokes beside a sector, all when there are fewer than
/// two.
fn feature_ring(lattice: Lattice, shape: &Shape, sector: u32) -> CapRing {
    let sharp_count = shape.sharp_spokes().count();
    let is_whole = shape.is_closed && sharp_count < 2;
    let mut first = if is_whole { 0 } else { sector };
    while !is_whole && !shape.ends_sector(first) {
        first = lattice.before(first);
    }
    let mut spokes = vec![first];
    let mut spoke = lattice.after(first);
    while if is_whole {
        spoke != first
    } else {
        !shape.ends_sector(spoke)
    } {
        spokes.push(spoke);
        spoke = lattice.after(spoke);
    }
    let faces = spokes.clone();
    if !is_whole {
        spokes.push(spoke);
    }
    CapRing {
        vertex: 0,
        ends: spokes
            .iter()
            .map(|&spoke| lattice.spoke(spoke, 1))
            .collect(),
        own: faces.iter().position(|&face| face == sector).unwrap_or(0),
        diagonals: faces.iter().map(|&face| lattice.at(face, 1, 1)).collect(),
        closed: is_whole,
        corner: shape.is_sharp || sharp_count > 2,
    }
}
