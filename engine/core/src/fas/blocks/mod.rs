//! Feature-adaptive tables that follow their depths: level 1 is numbered once, every deeper level of a feature is one
//! block of points laid by a closed form, and a depth that changes moves that feature's blocks alone.
//!
//! ```text
//! points   | cage | level 1: face, edge, vertex points | blocks of features, levels 2 to d_v | …
//! ```
//!
//! Beside [`Tables`](super::Tables), which knows no closed form, keeps every row, and is made anew for new depths; both
//! give the same patches. The differences:
//!
//! * Rows below level 1 are not kept: a feature of N faces makes 12 N + 1 points a level by the rows of its
//!   [`Template`], which all features of its shape share. Two features a face apart each have their own copy of the
//!   level-2 points between them; copies are equal to the bit.
//! * Nothing is kept for points beyond sharp sides: they are made when a patch's controls are gathered.
//! * Around what is semi-sharp there is no closed form while it is sharp: patches below level 1 there are those of
//!   general tables, made anew when a depth on such a line changes.
//!
//! For whoever moves depths often and evaluates on the CPU: benches, and applications. The terrain meshes its features with
//! `Tables`, whose rows the stage `refine` executes. Knows topology and depths; knows no view and no device.
//!
//! Based on: Lin, Wang, Sun, *Improved feature-adaptive subdivision for Catmull-Clark surface model* (2018), section 2;
//! H. Schäfer, J. Raab, B. Keinert, M. Meyer, M. Stamminger, M. Nießner, *Dynamic feature-adaptive subdivision* (2015).

mod build;
mod entry;
mod first_level;
mod lattice;
mod positions;
mod runs;
mod template;
#[cfg(test)]
mod tests;
mod turn;
mod visit;

use self::{first_level::FirstLevel, runs::Runs, template::Template};
use super::{
    MAX_DEPTH,
    feature::SemiSharpLines,
    mesh::Mesh,
    tables::{Tables, grow},
};
use crate::cage::NONE;

pub use self::{
    entry::{CapEntry, Entry, Piece},
    positions::Positions,
};

/// A feature with patches of its own around it.
#[derive(Clone, Copy, Debug)]
struct Block {
    vertex: u32,
    template: u32,
    /// Its corners, then the level-1 points within 2 of it, in `Blocks::rings`.
    ring: u32,
    /// Its first point of level 2; meaningless for depths below 2.
    first_point: u32,
}

/// What depends on semi-sharp lines.
#[derive(Default)]
struct SemiSharp {
    lines: SemiSharpLines,
    /// Vertices on lines; empty where there are no lines.
    on_line: Vec<bool>,
    /// Vertices on lines that are regular from level 1 on.
    worn: Vec<bool>,
    /// Patches below level 1 around lines, with points of their own.
    tables: Option<Tables>,
}

/// Tables of a cage for depths that change.
///
/// ```
/// use drumlin_core::{cage::{Cage, Faces, Tags}, fas::{Blocks, Positions}};
///
/// let corners = [0, 1].map(|z| [[0.0, 0.0, z as f64], [1.0, 0.0, z as f64], [1.0, 1.0, z as f64], [0.0, 1.0, z as f64]]);
/// let sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// let faces = Faces::quads(&sides);
/// let cube = Cage::new(corners.concat(), faces, &Tags::default())?;
///
/// let mut blocks = Blocks::new(cube.topology())?;
/// blocks.set_depths(&[3; 8])?;
/// let mut points = Positions::new(&blocks, cube.positions());
/// assert_eq!(blocks.patch_count(), 8 * 3 * (3 * 2 + 1));
///
/// let changes = blocks.set_depths(&[3, 3, 3, 3, 1, 1, 1, 1])?;
/// points.update(&blocks, &changes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Blocks {
    /// The cage, with the depth of every feature.
    mesh: Mesh,
    first: FirstLevel,
    templates: Vec<Template>,
    /// By vertex.
    blocks: Vec<Block>,
    rings: Vec<u32>,
    runs: Runs,
    semi_sharp: SemiSharp,
}

/// What new depths changed: points to be made again by [`Positions::update`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// Blocks with other points than before.
    blocks: Vec<u32>,
    /// Vertices of the cage around which level-1 points came into use; none where `all` is.
    vertices: Vec<u32>,
    /// True when too much changed to be listed.
    all: bool,
    semi_sharp: bool,
}

impl Changes {
    /// True when nothing changed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl Blocks {
    /// Gives every feature its depth: one depth a vertex, of which only those of features matter.
    ///
    /// Costs what has changed, and a look at every feature.
    ///
    /// # Errors
    /// Says so when the depths are not one a vertex, or one is above [`MAX_DEPTH`], or the points would be too many to
    /// be numbered. Nothing changes then.
    pub fn set_depths(&mut self, depths: &[u8]) -> Result<Changes, &'static str> {
        if depths.len() != self.mesh.start.len() {
            return Err("there must be one depth a vertex");
        }
        if depths.iter().any(|&depth| depth > MAX_DEPTH) {
            return Err("a feature's depth is at most 10");
        }
        // Free ranges are never more than those in use, see `compact`.
        if 2 * self.points_at(depths) + u64::from(self.first.rows.end_point()) >= u64::from(NONE) {
            return Err("the depths make more points than can be numbered");
        }
        let mut changes = Changes::default();
        let mut crossed = Vec::new();
        for index in 0..self.blocks.len() {
            let block = self.blocks[index];
            let (old, new) = (self.depth(block.vertex), depths[block.vertex as usize]);
            if old == new || self.is_on_line(block.vertex) {
                continue;
            }
            self.mesh.feature[block.vertex as usize] = new;
            if (old == 0) != (new == 0) {
                crossed.push(block.vertex);
            }
            self.move_block(index, old, new);
            if new > 1 {
                changes.blocks.push(index as u32);
            }
        }
        self.set_line_depths(depths, &mut crossed, &mut changes);
        self.want(&crossed, &mut changes);
        if self.runs.free_points()
            > self.runs.end() - self.first.rows.end_point() - self.runs.free_points()
        {
            self.compact(&mut changes);
        }
        Ok(changes)
    }

    /// The depth of a feature; of no meaning for other vertices.
    #[must_use]
    pub fn depth(&self, vertex: u32) -> u8 {
        self.mesh.feature[vertex as usize]
    }

    /// Vertices that are features, in order; those that are semi-sharp alone are not among them.
    pub fn features(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.blocks.iter().map(|block| block.vertex)
    }

    /// One more than the greatest number of a point: numbers of points that are not in use among them.
    #[must_use]
    pub fn point_count(&self) -> u32 {
        self.runs.end()
    }

    /// Points that refinement makes.
    #[must_use]
    pub fn refined_point_count(&self) -> u32 {
        let below: u32 = self
            .laid()
            .map(|block| self.run_length(block, self.depth(block.vertex)))
            .sum();
        let lines = self
            .semi_sharp
            .tables
            .as_ref()
            .map_or(0, Tables::refined_point_count);
        self.first.used_count() + below + lines
    }

    /// Bytes of all tables; positions are not among them.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        let mesh = &self.mesh;
        size_of_val(mesh.corners.as_slice())
            + size_of_val(mesh.across.as_slice())
            + size_of_val(mesh.sharpness.as_slice())
            + size_of_val(mesh.vertex_sharpness.as_slice())
            + size_of_val(mesh.start.as_slice())
            + mesh.feature.len()
            + mesh.extraordinary.len()
            + mesh.holes.len()
            + self.first.byte_count()
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.rings.as_slice())
            + self.semi_sharp.on_line.len()
            + self.semi_sharp.worn.len()
            + self
                .semi_sharp
                .tables
                .as_ref()
                .map_or(0, Tables::byte_count)
    }

    /// Points of blocks at other depths, those around semi-sharp lines as they are.
    fn points_at(&self, depths: &[u8]) -> u64 {
        let lines = self
            .semi_sharp
            .tables
            .as_ref()
            .map_or(0, Tables::made_point_count);
        let blocks = self.laid().map(|block| {
            let depth = depths[block.vertex as usize];
            u64::from(depth.saturating_sub(1)) * u64::from(self.template(block).lattice.points())
        });
        blocks.sum::<u64>() + u64::from(lines)
    }

    /// Blocks whose levels from 2 on are laid by the closed form.
    fn laid(&self) -> impl Iterator<Item = &Block> {
        self.blocks
            .iter()
            .filter(|block| !self.is_on_line(block.vertex))
    }

    /// Points of a block's levels from 2 on.
    fn run_length(&self, block: &Block, depth: u8) -> u32 {
        u32::from(depth.saturating_sub(1)) * self.template(block).lattice.points()
    }

    fn move_block(&mut self, index: usize, old: u8, new: u8) {
        let block = self.blocks[index];
        self.runs
            .give(block.first_point, self.run_length(&block, old));
        self.blocks[index].first_point = self.runs.take(self.run_length(&block, new));
    }

    fn set_line_depths(&mut self, depths: &[u8], crossed: &mut Vec<u32>, changes: &mut Changes) {
        let lines = std::mem::take(&mut self.semi_sharp.lines);
        for (vertex, new) in lines.depths(depths) {
            let old = std::mem::replace(&mut self.mesh.feature[vertex as usize], new);
            changes.semi_sharp |= old != new;
            if (old == 0) != (new == 0) {
                crossed.push(vertex);
            }
        }
        self.semi_sharp.lines = lines;
        if changes.semi_sharp {
            self.lay_lines();
        }
    }

    /// Makes the tables around semi-sharp lines: as if nothing else was a feature.
    fn lay_lines(&mut self) {
        if let Some(old) = self.semi_sharp.tables.take() {
            self.runs.give(old.base.first_point, old.made_point_count());
        }
        let mut mesh = self.mesh.clone();
        for (feature, on_line) in mesh.feature.iter_mut().zip(&self.semi_sharp.on_line) {
            if !on_line {
                *feature = Mesh::REGULAR;
            }
        }
        let tables = grow(mesh, self.runs.end(), 2);
        if tables.levels.len() > 1 {
            self.runs.take_last(tables.made_point_count());
            self.semi_sharp.tables = Some(tables);
        }
    }

    /// Finds what of level 1 is in use, after the depths of some vertices left 0 or became it.
    fn want(&mut self, crossed: &[u32], changes: &mut Changes) {
        // Looking at a vertex's surroundings costs about as much as looking at as many faces.
        const FACES_AROUND: usize = 16;
        if crossed.len() * FACES_AROUND < self.mesh.face_count() {
            changes.vertices = self.first.want_around(&self.mesh, crossed);
        } else if !crossed.is_empty() {
            self.first.want_all(&self.mesh);
            changes.all = true;
        }
    }

    /// Lays all blocks anew without free ranges between them.
    fn compact(&mut self, changes: &mut Changes) {
        self.runs = Runs::new(self.first.rows.end_point());
        for index in 0..self.blocks.len() {
            let block = self.blocks[index];
            if !self.is_on_line(block.vertex) {
                let length = self.run_length(&block, self.depth(block.vertex));
                self.blocks[index].first_point = self.runs.take(length);
            }
        }
        if self.semi_sharp.tables.take().is_some() {
            self.lay_lines();
        }
        changes.all = true;
    }

    fn template(&self, block: &Block) -> &Template {
        &self.templates[block.template as usize]
    }

    fn is_on_line(&self, vertex: u32) -> bool {
        !self.semi_sharp.lines.is_empty() && self.semi_sharp.on_line[vertex as usize]
    }

    /// A block's corners, and the level-1 points within 2 of it.
    fn ring(&self, block: &Block) -> (&[u32], &[u32]) {
        let lattice = self.template(block).lattice;
        let ring = &self.rings[block.ring as usize..];
        let (corners, rest) = ring.split_at(lattice.sectors() as usize);
        (corners, &rest[..lattice.inner_points() as usize])
    }
}
