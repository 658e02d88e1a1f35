//! The render table: bicubic patches with their sixteen controls, [caps](Cap) around features that end, and which of
//! their sides face finer patches.
//!
//! ```text
//!   row 3   12 13 14 15      controls 5, 6, 10, 9 are the face's corners 0, 1, 2, 3;
//!   row 2    8  9 10 11      beyond a boundary or an infinitely sharp side lie phantoms,
//!   row 1    4  5  6  7      twice the point on the side less the one within
//!   row 0    0  1  2  3
//! ```

use super::{
    cap::{Cap, child_rings, own_rings},
    mesh::{ABSENT, Mesh, next, previous},
    refine::Children,
    rows::LevelRows,
};
use crate::cage::NONE;

/// Which part of which face of the cage a patch is: the square of side 2^-level at (u, v) · 2^-level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Place {
    /// Face of the cage.
    pub face: u32,
    /// Column of the square.
    pub u: u16,
    /// Row of the square.
    pub v: u16,
    /// How often the face was halved.
    pub level: u8,
}

impl Place {
    /// The quarter at a corner of the patch.
    pub(super) fn child(self, corner: u8) -> Self {
        let [du, dv] = [[0, 0], [1, 0], [1, 1], [0, 1]][corner as usize];
        Self {
            face: self.face,
            u: 2 * self.u + du,
            v: 2 * self.v + dv,
            level: self.level + 1,
        }
    }
}

/// A bicubic B-spline patch. At the last level also faces at what is semi-sharp: there it stands for the surface once
/// the rest of the sharpness is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its place on the cage.
    pub place: Place,
    /// Sixteen points, row by row; NONE nowhere.
    pub controls: [u32; 16],
    /// Sides that face finer patches, bit `s` for side `s`: a transition patch when not zero.
    pub finer: u8,
    /// Sides on a boundary or an infinitely sharp edge.
    pub sharp: u8,
}

/// All patches of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderTable {
    /// Regular and transition patches, level by level.
    pub patches: Vec<Patch>,
    /// Irregular patches.
    pub caps: Vec<Cap>,
}

/// What a level's patches are gathered from.
pub(super) struct Source<'a> {
    /// The level.
    pub(super) mesh: &'a Mesh,
    /// The level above and the points it gave; none for level 0.
    pub(super) above: Option<(&'a Mesh, &'a Children)>,
    /// Which faces are refined further.
    pub(super) refined: Option<&'a [bool]>,
    /// Place of each face.
    pub(super) places: &'a [Place],
}

/// Adds the patches of one level: its faces that are not refined. Phantoms are added to the level's rows.
pub(super) fn add_patches(source: &Source<'_>, rows: &mut LevelRows, table: &mut RenderTable) {
    let mesh = source.mesh;
    for face in 0..mesh.face_count() {
        if source.refined.is_some_and(|refined| refined[face]) || mesh.is_hole(face) {
            continue;
        }
        let place = source.places[face];
        let (finer, sharp) = (finer_sides(source, face), sharp_sides(mesh, face));
        if mesh.is_extraordinary(face) {
            let rings = match source.above {
                None => own_rings(mesh, face),
                Some((above, children)) => child_rings(above, children, mesh.parents[face]),
            };
            table.caps.push(Cap {
                place,
                finer,
                sharp,
                rings,
            });
        } else {
            let mut grid = match source.above {
                None => own_grid(mesh, face, sharp),
                Some((above, children)) => {
                    let (parent, corner) = mesh.parents[face];
                    let own = [0, 1, 2, 3].map(|corner| mesh.point(face, corner));
                    child_grid(
                        above,
                        children,
                        (parent as usize, corner as usize),
                        own,
                        sharp,
                    )
                }
            };
            fill_phantoms(&mut grid, sharp, rows);
            table.patches.push(Patch {
                place,
                controls: grid,
                finer,
                sharp,
            });
        }
    }
}

/// Places of a mesh's children.
pub(super) fn child_places(child: &Mesh, places: &[Place]) -> Vec<Place> {
    child
        .parents
        .iter()
        .map(|&(face, corner)| places[face as usize].child(corner))
        .collect()
}

fn finer_sides(source: &Source<'_>, face: usize) -> u8 {
    let Some(refined) = source.refined else {
        return 0;
    };
    let finer = |side: usize| {
        let across = source.mesh.across[face][side];
        across < ABSENT && refined[across as usize / 4]
    };
    (0..4).map(|side| u8::from(finer(side)) << side).sum()
}

pub(super) fn sharp_sides(mesh: &Mesh, face: usize) -> u8 {
    (0..4)
        .map(|side| u8::from(mesh.sharpness(face, side) == f32::INFINITY) << side)
        .sum()
}

/// Places of a face's corners in the grid of sixteen, and the steps towards the next and the previous corner.
const CORNERS: [(usize, isize, isize); 4] = [(5, 1, 4), (6, 4, -1), (10, -1, -4), (9, -4, 1)];

/// Puts the three controls beyond a corner: opposite the next corner, opposite the previous one, and diagonally.
fn put(grid: &mut [u32; 16], corner: usize, beyond: [u32; 3]) {
    let (at, to_next, to_previous) = CORNERS[corner];
    let steps = [-to_next, -to_previous, -to_next - to_previous];
    for (step, point) in steps.into_iter().zip(beyond) {
        grid[at.wrapping_add_signed(step)] = point;
    }
}

/// Controls from a level's own faces; [`NONE`] beyond sharp sides.
pub(super) fn own_grid(mesh: &Mesh, face: usize, sharp: u8) -> [u32; 16] {
    let mut grid = [NONE; 16];
    for corner in 0..4 {
        grid[CORNERS[corner].0] = mesh.point(face, corner);
        let before = neighbour(mesh, face, previous(corner), sharp);
        let after = neighbour(mesh, face, corner, sharp);
        let diagonal = before
            .zip(after)
            .map(|((g, s), _)| split(mesh.across[g][previous(s)]));
        put(
            &mut grid,
            corner,
            [
                before.map_or(NONE, |(g, s)| mesh.point(g, previous(s))),
                after.map_or(NONE, |(g, t)| mesh.point(g, (t + 2) % 4)),
                diagonal.map_or(NONE, |(g, s)| mesh.point(g, (s + 2) % 4)),
            ],
        );
    }
    grid
}

/// Controls of child `c` of face `f` from the points its parent's neighbourhood gave, its own corners `own`; [`NONE`]
/// beyond sharp sides.
pub(super) fn child_grid(
    above: &Mesh,
    children: &Children,
    (f, c): (usize, usize),
    own: [u32; 4],
    sharp: u8,
) -> [u32; 16] {
    let mut grid = [NONE; 16];
    for corner in 0..4 {
        grid[CORNERS[corner].0] = own[corner];
    }
    let vertex = |corner: usize| children.vertex[above.corners[f][corner] as usize];
    let before = neighbour(
        above,
        f,
        previous(c),
        if sharp >> previous(c) & 1 == 1 { 15 } else { 0 },
    );
    let after = neighbour(above, f, c, if sharp >> c & 1 == 1 { 15 } else { 0 });
    let diagonal = before
        .zip(after)
        .map(|((g, s), _)| split(above.across[g][previous(s)]).0);
    put(
        &mut grid,
        c,
        [
            before.map_or(NONE, |(g, s)| children.side[g][previous(s)]),
            after.map_or(NONE, |(g, t)| children.side[g][next(t)]),
            diagonal.map_or(NONE, |g| children.face[g]),
        ],
    );
    put(
        &mut grid,
        next(c),
        [
            after.map_or(NONE, |(g, _)| children.face[g]),
            vertex(next(c)),
            after.map_or(NONE, |(g, t)| children.side[g][previous(t)]),
        ],
    );
    put(
        &mut grid,
        (c + 2) % 4,
        [
            children.side[f][next(c)],
            children.side[f][(c + 2) % 4],
            vertex((c + 2) % 4),
        ],
    );
    put(
        &mut grid,
        previous(c),
        [
            vertex(previous(c)),
            before.map_or(NONE, |(g, _)| children.face[g]),
            before.map_or(NONE, |(g, s)| children.side[g][next(s)]),
        ],
    );
    grid
}

/// Face and side across a side that is not sharp.
fn neighbour(mesh: &Mesh, face: usize, side: usize, sharp: u8) -> Option<(usize, usize)> {
    let across = mesh.across[face][side];
    (sharp >> side & 1 == 0 && across < ABSENT).then(|| split(across))
}

pub(super) const fn split(side: u32) -> (usize, usize) {
    (side as usize / 4, side as usize % 4)
}

/// Fills what lies beyond sharp sides with twice the point on the side less the one within: columns beyond the left and
/// right sides whole, then rows.
fn fill_phantoms(grid: &mut [u32; 16], sharp: u8, rows: &mut LevelRows) {
    let mut fill = |beyond: usize, border: usize, within: usize| {
        if grid[beyond] == NONE && grid[border] != NONE {
            let wanted = [grid[border], grid[within]];
            grid[beyond] = rows.end_point();
            rows.phantoms.push(wanted);
        }
    };
    let is_sharp = |side: usize| sharp >> side & 1 == 1;
    for (_, column, inward) in [(3, 0, 1), (1, 3, -1)]
        .into_iter()
        .filter(|(side, ..)| is_sharp(*side))
    {
        for row in 0..4_usize {
            let at = 4 * row + column;
            fill(
                at,
                at.wrapping_add_signed(inward),
                at.wrapping_add_signed(2 * inward),
            );
        }
    }
    for (_, row, inward) in [(0, 0, 4), (2, 12, -4)]
        .into_iter()
        .filter(|(side, ..)| is_sharp(*side))
    {
        for column in 0..4_usize {
            let at = row + column;
            fill(
                at,
                at.wrapping_add_signed(inward),
                at.wrapping_add_signed(2 * inward),
            );
        }
    }
}
