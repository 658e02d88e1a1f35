//! What of a feature's mesh does not depend on the view: its cage, refined once, in metres; which of its faces lie in
//! ring 1; which of its vertices are samples of the ground.

use super::{FeatureMesh, FeatureTable, border::Border};
use crate::{
    cage::{Cage, NONE, Topology, refine},
    fas::{DepthRule, Features, Place, Tables},
    pyramid::PyramidError,
    reference::{
        refine::RefineGround,
        shared::border::{QUAD_SAMPLES, TILE_CELLS},
    },
    stream::Bounds,
};

/// Where a cut lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPlace {
    /// First row, first column, row past the last, column past the last, in patches of the finest level.
    pub cut: [u32; 4],
    /// World x and y of the cut's north-west lattice point.
    pub corner: [f64; 2],
    /// Metres a column (east) and a row (north, negative) of finest samples.
    pub step: [f64; 2],
    /// Metres a height unit.
    pub unit: f64,
}

impl CutPlace {
    /// The cut of a data set whose first finest sample is at a world x and y, `corner`.
    pub(in crate::terrain) fn new(
        cut: [u32; 4],
        corner: [f64; 2],
        step: [f64; 2],
        unit: f64,
    ) -> Self {
        let first = [cut[1], cut[0]].map(|patch| f64::from(patch * QUAD_SAMPLES));
        Self {
            cut,
            corner: [0, 1].map(|axis| corner[axis] + first[axis] * step[axis]),
            step,
            unit,
        }
    }

    /// Samples from west to east and from north to south.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [[1, 3], [0, 2]].map(|[from, to]| (self.cut[to] - self.cut[from]) * QUAD_SAMPLES)
    }

    /// The finest sample (row, column) of the cut's north-west corner.
    #[must_use]
    pub fn first_sample(&self) -> [u32; 2] {
        [self.cut[0], self.cut[1]].map(|patch| patch * QUAD_SAMPLES)
    }

    /// Rows and columns of the first and the last tile that the cut lies in.
    fn tiles(&self) -> [[u32; 2]; 2] {
        let last = [0, 1].map(|axis| (self.cut[axis + 2] * QUAD_SAMPLES - 1) / TILE_CELLS);
        [self.first_sample().map(|sample| sample / TILE_CELLS), last]
    }

    /// The same as the stage `refine` knows it.
    pub(super) fn ground(&self) -> RefineGround {
        let [first, last] = self.tiles();
        let sample = self.first_sample();
        RefineGround {
            step: self.step,
            size: self.size(),
            first: [1, 0].map(|axis| sample[axis] % TILE_CELLS),
            tiles: [1, 0].map(|axis: usize| last[axis] - first[axis] + 1),
        }
    }

    /// The place in the group's list of the tile at a finest sample (row, column), and the sample's row and column there.
    pub(super) fn tile_at(&self, sample: [u32; 2]) -> (u32, [u32; 2]) {
        let [first, last] = self.tiles();
        let tile = [0, 1].map(|axis| (sample[axis] / TILE_CELLS).clamp(first[axis], last[axis]));
        let inside = [0, 1].map(|axis| sample[axis] - tile[axis] * TILE_CELLS);
        let place = (tile[0] - first[0]) * (last[1] - first[1] + 1) + tile[1] - first[1];
        (place, inside)
    }
}

/// A feature, ready to be meshed for any view.
#[derive(Clone, Debug)]
pub struct FeatureShape {
    pub(super) place: CutPlace,
    /// Quads; metres east, north and up of the origin.
    pub(super) cage: Cage,
    pub(super) features: Features,
    /// For every face in ring 1: its corners' columns and rows on the lattice.
    pub(super) ring: Vec<Option<[[f64; 2]; 4]>>,
    /// For every vertex: column and row in the cut of the sample it is, on the cut's border.
    pub(super) samples: Vec<Option<[u32; 2]>>,
    pub(super) border: Border,
    /// Heights of the border's samples, by the place they are asked for, in units.
    pub(super) heights: Vec<i32>,
    pub(super) origin: [f64; 3],
    /// Of its cage, in world metres.
    bounds: Bounds,
}

impl FeatureShape {
    /// Prepares a laid cage. `sample` answers for the stored height, in units, of a finest sample (row, column) on the
    /// cut's border.
    ///
    /// # Errors
    ///
    /// When the cage cannot be refined, or is none that was laid into this cut.
    pub fn new(
        laid: &Cage,
        place: CutPlace,
        sample: impl Fn([u32; 2]) -> i32,
    ) -> Result<Self, PyramidError> {
        let fine = refine(laid).map_err(refused)?;
        let samples = border_samples(&fine, place.size());
        let heights = border_heights(&place, sample);
        let found = samples.iter().flatten().count() * 2;
        if found != heights.len() {
            return Err(PyramidError::Refused(format!(
                "a feature's cage has {found} samples on the border of its cut, which has {}",
                heights.len()
            )));
        }
        let base = heights.iter().copied().min().unwrap_or(0);
        let metres = |[x, y, z]: [f64; 3]| {
            let rise = (z - f64::from(base)) * place.unit;
            [x * place.step[0], y * place.step[1], rise]
        };
        let cage = fine.moved(metres).map_err(refused)?;
        let mut shape = Self {
            features: Features::of(&cage),
            ring: ring_faces(laid, place.size()),
            samples,
            border: Border::new(place.size()),
            heights,
            origin: [
                place.corner[0],
                place.corner[1],
                f64::from(base) * place.unit,
            ],
            bounds: Bounds::default(),
            cage,
            place,
        };
        shape.bounds = shape.find_bounds();
        shape.find_offsets().map_err(refused)?;
        Ok(shape)
    }

    /// World metres that meshes are relative to.
    #[must_use]
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Its box in world metres: that of its cage, whose hull holds the surface.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn find_bounds(&self) -> Bounds {
        let [min, max] = self.cage.bounds();
        let world = |corner: [f64; 3]| [0, 1, 2].map(|axis| corner[axis] + self.origin[axis]);
        Bounds {
            min: world(min),
            max: world(max),
        }
    }

    /// Bytes in memory, about, for budgets.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        let topology = self.cage.topology();
        u64::from(topology.vertex_count()) * 64
            + u64::from(topology.corner_count()) * 24
            + self.features.list.len() as u64 * 80
    }

    /// Depths of the features for an eye in world metres; see [`Features::depths`].
    #[must_use]
    pub fn depths(&self, eye: [f64; 3], pixels_per_radian: f64, previous: &[u8]) -> Vec<u8> {
        let eye = [0, 1, 2].map(|axis| eye[axis] - self.origin[axis]);
        self.features
            .depths(eye, pixels_per_radian, DepthRule::DEFAULT, previous)
    }

    /// Depths so that what remains everywhere is at most `tolerance` metres.
    #[must_use]
    pub fn equal_error_depths(&self, tolerance: f64) -> Vec<u8> {
        self.features.equal_error_depths(tolerance)
    }

    /// The mesh at depths, one a vertex of the refined cage.
    ///
    /// # Errors
    ///
    /// When there are not as many depths as vertices.
    pub fn mesh(&self, depths: &[u8]) -> Result<FeatureMesh, PyramidError> {
        Ok(self.table(depths)?.execute(self))
    }

    /// The mesh at depths before it has positions, for a device.
    ///
    /// # Errors
    ///
    /// When there are not as many depths as vertices.
    pub fn table(&self, depths: &[u8]) -> Result<FeatureTable, PyramidError> {
        let tables = Tables::adaptive(self.cage.topology(), depths).map_err(refused)?;
        Ok(FeatureTable::new(self, tables))
    }

    /// Ring 1: metres of the border's offset at (u, v) of a place's face, and how it slopes along u and v of the place.
    ///
    /// Faces of ring 1 are the lattice's, so the offset is one of parameters alone and needs no point of the surface.
    pub(super) fn ring_offset(&self, place: Place, [u, v]: [f64; 2]) -> Option<[f64; 3]> {
        let [a, b, _, d] = self.ring[place.face as usize]?;
        let along = |end: [f64; 2]| [0, 1].map(|axis| end[axis] - a[axis]);
        let (by_u, by_v) = (along(b), along(d));
        let at = [0, 1].map(|axis| a[axis] + u * by_u[axis] + v * by_v[axis]);
        let slope = self.border.slope(at);
        let side = f64::from(place.level).exp2().recip();
        let tilt = |by: [f64; 2]| side * (slope[0] * by[0] + slope[1] * by[1]);
        let units = [self.border.offset(at), tilt(by_u), tilt(by_v)];
        Some(units.map(|units| units * self.place.unit))
    }

    /// The group's tile under a position; the nearest of them where an overhang reaches past the cut.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the cut, whose samples fit 32 bits"
    )]
    pub(super) fn tile_under(&self, position: [f64; 3]) -> u32 {
        let (cut, size) = (&self.place, self.place.size());
        let first = cut.first_sample();
        let inside = |axis: usize| {
            (position[axis] / cut.step[axis]).clamp(0.0, f64::from(size[axis])) as u32
        };
        cut.tile_at([first[0] + inside(1), first[1] + inside(0)]).0
    }

    /// Vertices of the refined cage: as many depths make a mesh.
    #[must_use]
    pub fn vertex_count(&self) -> u32 {
        self.cage.topology().vertex_count()
    }

    /// The height in units of a sample on the border (column, row).
    pub(super) fn height(&self, [x, y]: [u32; 2]) -> i32 {
        self.heights[self.border.place([x, y])]
    }

    /// True for an edge on the border of the cut.
    pub(super) fn is_border_edge(&self, edge: u32) -> bool {
        is_outline(self.cage.topology(), edge)
            && self
                .cage
                .topology()
                .edge_vertices(edge)
                .iter()
                .all(|&end| self.samples[end as usize].is_some())
    }

    /// How far border samples are off the limit surface there.
    fn find_offsets(&mut self) -> Result<(), &'static str> {
        let depths = vec![0; self.cage.topology().vertex_count() as usize];
        let tables = Tables::adaptive(self.cage.topology(), &depths)?;
        let points = tables.execute(self.cage.positions());
        for patch in &tables.render.patches {
            let face = patch.place.face;
            if self.ring[face as usize].is_none() {
                continue;
            }
            for side in 0..4 {
                let corners = self.cage.topology().face_vertices(face);
                let ends = [corners[side], corners[(side + 1) % 4]];
                let edge = self.cage.topology().face_edges(face)[side];
                let [Some(a), Some(b)] = ends.map(|end| self.samples[end as usize]) else {
                    continue;
                };
                if !self.is_border_edge(edge) {
                    continue;
                }
                let middle = [0, 1].map(|axis| u32::midpoint(a[axis], b[axis]));
                for (sample, along) in [(a, 0.0), (middle, 0.5)] {
                    let uv = [
                        [along, 0.0],
                        [1.0, along],
                        [1.0 - along, 1.0],
                        [0.0, 1.0 - along],
                    ][side];
                    let limit = patch.evaluate(&points, uv).position[2] + self.origin[2];
                    let offset = f64::from(self.height(sample)) - limit / self.place.unit;
                    self.border.set(sample, offset);
                }
            }
        }
        Ok(())
    }
}

fn refused(error: impl std::fmt::Display) -> PyramidError {
    PyramidError::Refused(format!("meshing a feature: {error}"))
}

/// True for an edge between what is drawn and a hole.
fn is_outline(topology: &Topology, edge: u32) -> bool {
    let [a, b] = topology.edge_faces(edge);
    b != NONE && topology.is_hole(a) != topology.is_hole(b)
}

/// The samples that vertices of the refined cage are, on the border of a cut.
fn border_samples(fine: &Cage, size: [u32; 2]) -> Vec<Option<[u32; 2]>> {
    let topology = fine.topology();
    let mut samples = vec![None; topology.vertex_count() as usize];
    for edge in (0..topology.edge_count()).filter(|&edge| is_outline(topology, edge)) {
        for end in topology.edge_vertices(edge) {
            let [x, y, _] = fine.positions()[end as usize];
            samples[end as usize] = sample_on_border([x, y], size);
        }
    }
    samples
}

fn sample_on_border(at: [f64; 2], size: [u32; 2]) -> Option<[u32; 2]> {
    let whole = at.map(f64::round);
    let end = size.map(f64::from);
    let is_sample = (0..2).all(|axis| {
        (at[axis] - whole[axis]).abs() < 1e-6 && (0.0..=end[axis]).contains(&whole[axis])
    });
    let on_border = (0..2).any(|axis| whole[axis] == 0.0 || whole[axis] == end[axis]);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 0..=size just before"
    )]
    (is_sample && on_border).then(|| whole.map(|at| at as u32))
}

/// For every face of the refined cage whose parent is a lattice quad at the border of the cut: its corners on the lattice.
fn ring_faces(laid: &Cage, size: [u32; 2]) -> Vec<Option<[[f64; 2]; 4]>> {
    let topology = laid.topology();
    let quads = (0..topology.face_count()).flat_map(|face| {
        let quad = lattice_corners(laid, face).filter(|quad| touches_border(quad, size));
        let middle =
            |a: [f64; 2], b: [f64; 2]| [0, 1].map(|axis: usize| f64::midpoint(a[axis], b[axis]));
        // A corner's child runs from it to its side's middle, the centre, and the middle of the side before it.
        (0..topology.face_corners(face).len()).map(move |corner| {
            let quad = quad?;
            let [own, next, across, previous] = [0, 1, 2, 3].map(|i| quad[(corner + i) % 4]);
            let sides = [middle(own, next), middle(own, previous)];
            Some([own, sides[0], middle(own, across), sides[1]])
        })
    });
    quads.collect()
}

/// Columns and rows of a face's corners where it is a quad of the lattice.
fn lattice_corners(laid: &Cage, face: u32) -> Option<[[f64; 2]; 4]> {
    let topology = laid.topology();
    let corners: [u32; 4] = topology.face_vertices(face).try_into().ok()?;
    let quad = corners.map(|corner| {
        let [x, y, _] = laid.positions()[corner as usize];
        [x, y]
    });
    let spans = [0, 1].map(|axis| span(&quad, axis));
    let side = f64::from(QUAD_SAMPLES);
    let is_lattice = spans
        .iter()
        .all(|[low, high]| high - low == side && low % side == 0.0);
    (is_lattice && !topology.is_hole(face)).then_some(quad)
}

fn touches_border(quad: &[[f64; 2]; 4], size: [u32; 2]) -> bool {
    (0..2).any(|axis| {
        let [low, high] = span(quad, axis);
        low == 0.0 || high == f64::from(size[axis])
    })
}

fn span(quad: &[[f64; 2]; 4], axis: usize) -> [f64; 2] {
    quad.iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
            [low.min(at[axis]), high.max(at[axis])]
        })
}

/// Heights of the border's samples, clockwise from the north-west corner.
fn border_heights(place: &CutPlace, sample: impl Fn([u32; 2]) -> i32) -> Vec<i32> {
    let [width, height] = place.size();
    let [row, column] = place.first_sample();
    let around = (0..width)
        .map(|x| [x, 0])
        .chain((0..height).map(|y| [width, y]))
        .chain((0..width).map(|x| [width - x, height]))
        .chain((0..height).map(|y| [0, height - y]));
    around.map(|[x, y]| sample([row + y, column + x])).collect()
}
