//! All patches of the tables, in parts that may be visited in any order, on any thread.
//!
//! First those of levels 0 and 1, face by face of the cage; then those around features, feature by feature; then those
//! around semi-sharp lines.

use std::ops::Range;

use super::super::{
    Cap, Patch, Place,
    cap::own_rings,
    execute::Real,
    mesh::{ABSENT, Mesh, next, previous},
    patch::{own_grid, sharp_sides},
};
use super::{Block, Blocks, CapEntry, Entry, Piece, Positions, entry::Numbers, turn::Turn};
use crate::cage::NONE;

/// Faces, features or patches a part: large enough to be worth a task, small enough to share.
const IN_A_PART: usize = 1024;

/// What is told of every patch.
type Visit<'a> = &'a mut dyn FnMut(&Entry<'_>);

impl Blocks {
    /// Parts of all patches.
    #[must_use]
    pub fn part_count(&self) -> usize {
        self.section_parts().iter().sum()
    }

    /// Tells of every patch of one part.
    ///
    /// # Panics
    /// When there is no such part.
    pub fn visit_part(&self, part: usize, visit: Visit<'_>) {
        let [faces, blocks, lines] = self.section_parts();
        assert!(part < faces + blocks + lines, "there is no part {part}");
        if part < faces {
            range(part, self.mesh.face_count()).for_each(|face| self.visit_face(face, visit));
        } else if part < faces + blocks {
            let blocks = &self.blocks[range(part - faces, self.blocks.len())];
            blocks
                .iter()
                .for_each(|block| self.visit_block(block, visit));
        } else {
            self.visit_lines(visit);
        }
    }

    /// Tells of every patch, in order.
    pub fn visit(&self, mut visit: impl FnMut(&Entry<'_>)) {
        (0..self.part_count()).for_each(|part| self.visit_part(part, &mut visit));
    }

    /// Patches, caps among them.
    #[must_use]
    pub fn patch_count(&self) -> u32 {
        let mut count = 0;
        self.visit(|_| count += 1);
        count
    }

    fn section_parts(&self) -> [usize; 3] {
        [
            self.mesh.face_count().div_ceil(IN_A_PART),
            self.blocks.len().div_ceil(IN_A_PART),
            usize::from(self.semi_sharp.tables.is_some()),
        ]
    }

    /// Patches of a face of the cage but those at its features.
    fn visit_face(&self, face: usize, visit: Visit<'_>) {
        if self.mesh.is_hole(face) {
            return;
        }
        if !self.mesh.is_refined(face, 0) {
            return self.visit_whole_face(face, visit);
        }
        for corner in 0..4 {
            let vertex = self.mesh.corners[face][corner];
            if self.mesh.extraordinary[vertex as usize] || self.is_child_refined(vertex) {
                continue;
            }
            let (controls, sharp) = self.first.patch(&self.mesh, face, corner);
            visit(&Entry::Patch(Patch {
                place: child_place(face, corner),
                controls,
                finer: self.finer_children(face, corner),
                sharp,
            }));
        }
    }

    fn visit_whole_face(&self, face: usize, visit: Visit<'_>) {
        let mesh = &self.mesh;
        let sharp = sharp_sides(mesh, face);
        let is_finer = |side: usize| {
            let across = mesh.across[face][side];
            across < ABSENT && mesh.is_refined(across as usize / 4, 0)
        };
        let finer = (0..4).map(|side| u8::from(is_finer(side)) << side).sum();
        let place = Place {
            face: face as u32,
            ..Place::default()
        };
        if !mesh.is_extraordinary(face) {
            let controls = own_grid(mesh, face, sharp);
            return visit(&Entry::Patch(Patch {
                place,
                controls,
                finer,
                sharp,
            }));
        }
        let cap = Cap {
            place,
            finer,
            sharp,
            rings: own_rings(mesh, face),
        };
        visit(&Entry::Cap(CapEntry {
            place,
            finer,
            cap: &cap,
            turn: Turn(0),
            points: Numbers::From(0),
        }));
    }

    /// Patches at a feature.
    fn visit_block(&self, block: &Block, visit: Visit<'_>) {
        let depth = self.depth(block.vertex);
        let (corners, inner) = self.ring(block);
        for (sector, &at) in corners.iter().enumerate() {
            let (face, corner) = (at as usize / 4, at as usize % 4);
            if self.mesh.is_hole(face) || !self.mesh.is_refined(face, 0) {
                continue;
            }
            if !self.is_child_refined(block.vertex) {
                visit(&Entry::Cap(CapEntry {
                    place: child_place(face, corner),
                    finer: self.finer_children(face, corner),
                    cap: &self.template(block).caps[sector],
                    turn: Turn(corner as u8),
                    points: Numbers::Listed(inner),
                }));
            } else if !self.is_on_line(block.vertex) {
                self.visit_sector(block, (sector, face, Turn(corner as u8)), depth, visit);
            }
        }
    }

    /// A sector's patches from level 2 on, and its cap.
    fn visit_sector(
        &self,
        block: &Block,
        (sector, face, turn): (usize, usize, Turn),
        depth: u8,
        visit: Visit<'_>,
    ) {
        let template = self.template(block);
        let mut first = block.first_point;
        let place = |level: u8, cell: [u16; 2]| {
            let [u, v] = turn.cell(cell, 1 << level);
            Place {
                face: face as u32,
                u,
                v,
                level,
            }
        };
        for level in 2..=depth {
            for patch in &template.patches[sector] {
                let controls = patch
                    .controls
                    .map(|point| if point == NONE { NONE } else { first + point });
                visit(&Entry::Patch(Patch {
                    place: place(level, [patch.place.u, patch.place.v]),
                    controls: turn.grid(controls),
                    finer: if level < depth {
                        turn.sides(patch.finer)
                    } else {
                        0
                    },
                    sharp: turn.sides(patch.sharp),
                }));
            }
            first += template.lattice.points();
        }
        visit(&Entry::Cap(CapEntry {
            place: place(depth, [0, 0]),
            finer: 0,
            cap: &template.caps[sector],
            turn,
            points: Numbers::From(first - template.lattice.points()),
        }));
    }

    fn visit_lines(&self, visit: Visit<'_>) {
        let Some(tables) = &self.semi_sharp.tables else {
            return;
        };
        for patch in &tables.render.patches {
            visit(&Entry::Patch(*patch));
        }
        for cap in &tables.render.caps {
            visit(&Entry::Cap(CapEntry {
                place: cap.place,
                finer: cap.finer,
                cap,
                turn: Turn(0),
                points: Numbers::From(0),
            }));
        }
    }

    /// True when the level-1 faces at a vertex are refined.
    fn is_child_refined(&self, vertex: u32) -> bool {
        let depth = self.depth(vertex);
        let is_feature = depth != Mesh::REGULAR;
        is_feature
            && depth > 1
            && !(self.is_on_line(vertex) && self.semi_sharp.worn[vertex as usize])
    }

    /// Finer sides of a child that is not refined itself: only children of the same face can be beyond them, as those of
    /// other faces beside it share its vertex of the cage.
    fn finer_children(&self, face: usize, corner: usize) -> u8 {
        let is_finer = |at: usize| self.is_child_refined(self.mesh.corners[face][at]);
        u8::from(is_finer(next(corner))) << next(corner)
            | u8::from(is_finer(previous(corner))) << ((corner + 2) % 4)
    }
}

impl<T: Real> Positions<T> {
    /// Tells of every patch of one part with its controls.
    ///
    /// # Panics
    /// When there is no such part, or the positions are not those of `blocks`.
    pub fn visit_part(&self, blocks: &Blocks, part: usize, visit: &mut dyn FnMut(&Piece<T>)) {
        blocks.visit_part(part, &mut |entry| visit(&entry.piece(self.points())));
    }
}

fn range(part: usize, count: usize) -> Range<usize> {
    part * IN_A_PART..((part + 1) * IN_A_PART).min(count)
}

fn child_place(face: usize, corner: usize) -> Place {
    let place = Place {
        face: face as u32,
        ..Place::default()
    };
    place.child(corner as u8)
}
