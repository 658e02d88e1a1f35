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

const TOO_DEEP: &str = "a feature's depth is at most 10";

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
        self.check(depths)?;
        if depths.iter().any(|&depth| depth > MAX_DEPTH) {
            return Err(TOO_DEEP);
        }
        let differs = |&index: &u32| {
            let vertex = self.blocks[index as usize].vertex;
            self.depth(vertex) != depths[vertex as usize]
        };
        let moved = (0..self.blocks.len() as u32).filter(differs).collect();
        self.change(depths, moved, !self.semi_sharp.lines.is_empty())
    }

    /// [`Blocks::set_depths`] where no depth but those of `vertices` differs from the last ones.
    ///
    /// Costs what has changed, however large the cage; a depth on a semi-sharp line costs a look at all lines.
    ///
    /// # Errors
    /// As [`Blocks::set_depths`], and for a vertex that is not there. Nothing changes then.
    pub fn change_depths(
        &mut self,
        depths: &[u8],
        vertices: &[u32],
    ) -> Result<Changes, &'static str> {
        self.check(depths)?;
        let mut moved = Vec::with_capacity(vertices.len());
        let mut is_line_touched = false;
        for &vertex in vertices {
            match depths.get(vertex as usize) {
                None => return Err("a vertex is not of the cage"),
                Some(&depth) if depth > MAX_DEPTH => return Err(TOO_DEEP),
                Some(_) => {}
            }
            is_line_touched |= self.is_on_line(vertex);
            let found = self
                .blocks
                .binary_search_by_key(&vertex, |block| block.vertex);
            moved.extend(found.ok().map(|index| index as u32));
        }
        moved.sort_unstable();
        moved.dedup();
        self.change(depths, moved, is_line_touched)
    }

    fn check(&self, depths: &[u8]) -> Result<(), &'static str> {
        if depths.len() == self.mesh.start.len() {
            Ok(())
        } else {
            Err("there must be one depth a vertex")
        }
    }

    /// Moves these blocks, by index and each once, and with `lines` those of semi-sharp lines.
    fn change(
        &mut self,
        depths: &[u8],
        mut moved: Vec<u32>,
        lines: bool,
    ) -> Result<Changes, &'static str> {
        moved.retain(|&index| !self.is_on_line(self.blocks[index as usize].vertex));
        // Free ranges are never more than those in use, see `compact`.
        if 2 * self.points_after(depths, &moved) + u64::from(self.first.rows.end_point())
            >= u64::from(NONE)
        {
            return Err("the depths make more points than can be numbered");
        }
        let mut changes = Changes::default();
        let mut crossed = Vec::new();
        for index in moved {
            let vertex = self.blocks[index as usize].vertex;
            let (old, new) = (self.depth(vertex), depths[vertex as usize]);
            if old == new {
                continue;
            }
            self.mesh.feature[vertex as usize] = new;
            if (old == 0) != (new == 0) {
                crossed.push(vertex);
            }
            self.move_block(index as usize, old, new);
            if new > 1 {
                changes.blocks.push(index);
            }
        }
        if lines {
            self.set_line_depths(depths, &mut crossed, &mut changes);
        }
        self.want(&crossed, &mut changes);
        if self.runs.free_points() > self.points_in_use() {
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

    /// Points below level 1.
    fn points_in_use(&self) -> u32 {
        self.runs.end() - self.first.rows.end_point() - self.runs.free_points()
    }

    /// Points below level 1 once some blocks have other depths, those around semi-sharp lines as they are.
    fn points_after(&self, depths: &[u8], moved: &[u32]) -> u64 {
        let mut points = u64::from(self.points_in_use());
        for &index in moved {
            let block = &self.blocks[index as usize];
            let new = depths[block.vertex as usize];
            points += u64::from(self.run_length(block, new));
            points -= u64::from(self.run_length(block, self.depth(block.vertex)));
        }
        points
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
