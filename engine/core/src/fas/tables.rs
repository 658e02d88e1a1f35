//! Building the tables of a cage for given depths.

use super::{
    feature::{FeatureKind, SemiSharpLines, features},
    mesh::Mesh,
    patch::{Place, RenderTable, Source, add_patches, child_places},
    refine::{child_mesh, refine, refined_faces},
    rows::LevelRows,
};
use crate::cage::Topology;

/// Greatest depth of a feature.
pub const MAX_DEPTH: u8 = 10;

/// Subdivision and render table of a cage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tables {
    /// Points of the cage.
    pub cage_points: u32,
    /// Phantom points of level 0; its other rows are empty: its points are the cage's.
    pub base: LevelRows,
    /// Rows of levels 1, 2, ….
    pub levels: Vec<LevelRows>,
    /// The patches.
    pub render: RenderTable,
}

impl Tables {
    /// Tables with one depth for all features.
    ///
    /// # Errors
    /// Says so when a face is no quad: refine the cage once first.
    pub fn classic(topology: &Topology, depth: u8) -> Result<Self, &'static str> {
        Self::adaptive(topology, &vec![depth; topology.vertex_count() as usize])
    }

    /// Tables with a depth for every vertex that is a feature; other vertices' depths do not matter.
    ///
    /// # Errors
    /// Says so when a face is no quad, or the depths are not one a vertex, or one is above [`MAX_DEPTH`].
    pub fn adaptive(topology: &Topology, depths: &[u8]) -> Result<Self, &'static str> {
        if !topology.all_quads() {
            return Err("the cage has faces that are no quads: refine it once first");
        }
        if depths.len() != topology.vertex_count() as usize {
            return Err("there must be one depth a vertex");
        }
        if depths.iter().any(|&depth| depth > MAX_DEPTH) {
            return Err("a feature's depth is at most 10");
        }
        Ok(build(topology, depths))
    }

    /// Points of all levels, the cage's and phantoms included.
    #[must_use]
    pub fn point_count(&self) -> u32 {
        self.levels.last().unwrap_or(&self.base).end_point()
    }

    /// Points made by refinement: all but the cage's and phantoms.
    #[must_use]
    pub fn refined_point_count(&self) -> u32 {
        self.levels.iter().map(|level| level.counts().total()).sum()
    }

    /// Points that are numbered from the first made on, phantoms included.
    pub(super) fn made_point_count(&self) -> u32 {
        self.point_count() - self.base.first_point
    }

    /// Bytes of all tables.
    #[must_use]
    pub fn byte_count(&self) -> usize {
        let rings: usize = self
            .render
            .caps
            .iter()
            .flat_map(|cap| &cap.rings)
            .map(|ring| 4 * (ring.ends.len() + ring.diagonals.len()))
            .sum();
        self.base.byte_count()
            + self.levels.iter().map(LevelRows::byte_count).sum::<usize>()
            + size_of_val(self.render.patches.as_slice())
            + size_of_val(self.render.caps.as_slice())
            + rings
    }
}

fn build(topology: &Topology, depths: &[u8]) -> Tables {
    let lines = SemiSharpLines::of(topology);
    let mut levelled = depths.to_vec();
    for (vertex, depth) in lines.depths(depths) {
        levelled[vertex as usize] = depth;
    }
    let mut depths = levelled;
    let kinds = features(topology);
    for (depth, kind) in depths.iter_mut().zip(&kinds) {
        if *kind == FeatureKind::Regular {
            *depth = Mesh::REGULAR;
        }
    }
    let extraordinary = kinds
        .iter()
        .map(|kind| *kind == FeatureKind::Extraordinary)
        .collect();
    let mesh = Mesh::of_cage(topology, depths, extraordinary);
    grow(mesh, topology.vertex_count(), 0)
}

/// Tables of a whole cage with the depths its mesh names: points made are numbered from `first_point` on, patches of
/// levels before `first_level` are left out.
pub(super) fn grow(mut mesh: Mesh, first_point: u32, first_level: u8) -> Tables {
    let mut places: Vec<_> = (0..mesh.face_count() as u32)
        .map(|face| Place {
            face,
            ..Place::default()
        })
        .collect();
    let mut rows = LevelRows {
        first_point,
        vertex_offsets: vec![0],
        ..LevelRows::default()
    };
    let mut tables = Tables {
        cage_points: mesh.start.len() as u32,
        ..Tables::default()
    };
    let mut above = None;
    for level in 0.. {
        let refined = refined_faces(&mesh, level);
        let source = Source {
            mesh: &mesh,
            above: above.as_ref().map(|(mesh, children)| (mesh, children)),
            refined: refined.as_deref(),
            places: &places,
        };
        if level >= first_level {
            add_patches(&source, &mut rows, &mut tables.render);
        }
        let next = refined.map(|refined| refine(&mesh, refined, rows.end_point()));
        if level == 0 {
            tables.base = rows;
        } else {
            tables.levels.push(rows);
        }
        let Some((children, next_rows)) = next else {
            break;
        };
        rows = next_rows;
        let child = child_mesh(&mesh, &children, &rows);
        places = child_places(&child, &places);
        above = Some((std::mem::replace(&mut mesh, child), children));
    }
    tables
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::fas::testing::{cage, reference};

    /// One row of counts.csv from tables.
    fn counts(topology: &Topology, depth: u8) -> Vec<u32> {
        let tables = Tables::classic(topology, depth).expect("quads");
        let RenderTable { patches, caps } = &tables.render;
        let all: Vec<_> = patches
            .iter()
            .map(|patch| (patch.finer, patch.sharp))
            .chain(caps.iter().map(|cap| (cap.finer, cap.sharp)))
            .collect();
        let with = |sides: &[u8]| {
            all.iter()
                .filter(|(finer, _)| sides.contains(finer))
                .count() as u32
        };
        vec![
            tables.refined_point_count(),
            all.len() as u32,
            patches.len() as u32,
            caps.len() as u32,
            patches.iter().filter(|patch| patch.sharp != 0).count() as u32,
            with(&[1, 2, 4, 8]),
            with(&[3, 6, 12, 9]),
            with(&[5, 10]),
            with(&[7, 11, 13, 14]),
            with(&[15]),
        ]
    }

    #[test]
    fn every_cell_of_the_reference_counts_is_met() {
        let Some(path) = reference("counts.csv") else {
            return;
        };
        let text = fs::read_to_string(path).expect("a file");
        let mut wrong = Vec::new();
        for line in text.lines().skip(1) {
            let cells: Vec<_> = line.split(',').collect();
            let numbers: Vec<u32> = cells[1..]
                .iter()
                .map(|cell| cell.parse().expect("a number"))
                .collect();
            let depth = u8::try_from(numbers[0]).expect("a depth");
            let cage = cage(cells[0]).expect("it is there");
            let found = counts(cage.topology(), depth);
            if found != numbers[4..] {
                wrong.push(format!(
                    "{} {depth}: {found:?}, not {:?}",
                    cells[0],
                    &numbers[4..]
                ));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
