//! Caps: faces around a feature that is not refined further, and what lies around their corners.

use super::{
    mesh::{ABSENT, Mesh, next, previous},
    patch::{Place, split},
    refine::Children,
};

/// A face at an extraordinary feature that is not refined further: drawn by a bicubic Bézier patch through exact limit corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Cap {
    /// Its place on the cage.
    pub place: Place,
    /// Sides that face finer patches.
    pub finer: u8,
    /// Sides on a boundary or an infinitely sharp edge.
    pub sharp: u8,
    /// What lies around each corner.
    pub rings: [CapRing; 4],
}

/// A cap's corner: its vertex and the sector of faces it lies in, between sharp edges where there are any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CapRing {
    /// The vertex.
    pub vertex: u32,
    /// Far ends of the sector's edges, counter-clockwise; as many as faces when it closes, one more otherwise.
    pub ends: Vec<u32>,
    /// Across corners of the sector's faces; face `i` lies between ends `i` and `i + 1`.
    pub diagonals: Vec<u32>,
    /// Which of the faces is the cap itself.
    pub own: usize,
    /// True when the sector is the whole ring.
    pub closed: bool,
    /// True when the vertex stays in place under subdivision.
    pub corner: bool,
}

/// Rings of the corners of a face of a level whose rings are complete.
pub(super) fn own_rings(mesh: &Mesh, face: usize) -> [CapRing; 4] {
    let around = Around {
        end: |(face, side): (usize, usize)| mesh.point(face, next(side)),
        last_end: |(face, side): (usize, usize)| mesh.point(face, side),
        diagonal: |(face, corner): (usize, usize)| mesh.point(face, (corner + 2) % 4),
        sharpness: |(face, side): (usize, usize)| mesh.sharpness(face, side),
    };
    [0, 1, 2, 3].map(|corner| {
        let vertex = mesh.corners[face][corner];
        let is_sharp = mesh.vertex_sharpness(vertex) >= 1.0;
        let point = mesh.first_point + vertex;
        vertex_ring(mesh, (face, corner), (point, is_sharp), &around)
    })
}

/// Rings of the corners of child `c` of face `f`. The faces around the child need not all be there: its points are, and
/// what lies around them is known from the level above.
pub(super) fn child_rings(above: &Mesh, children: &Children, (f, c): (u32, u8)) -> [CapRing; 4] {
    let (f, c) = (f as usize, usize::from(c));
    let around = Around {
        end: |(face, side): (usize, usize)| children.side[face][side],
        last_end: |(face, side): (usize, usize)| children.side[face][side],
        diagonal: |(face, _): (usize, usize)| children.face[face],
        sharpness: |(face, side): (usize, usize)| above.child_side_sharpness(face, side),
    };
    let vertex = above.corners[f][c];
    let is_sharp = above.vertex_sharpness(vertex) >= 2.0;
    let point = children.vertex[vertex as usize];
    let mut rings = [0; 4].map(|_| CapRing::default());
    rings[c] = vertex_ring(above, (f, c), (point, is_sharp), &around);
    rings[next(c)] = side_ring(above, children, (f, c), 1);
    rings[(c + 2) % 4] = face_ring(above, children, f, c);
    rings[previous(c)] = side_ring(above, children, (f, previous(c)), 0);
    rings
}

/// Points and sharpness around a vertex, by face and side or corner.
struct Around<End, Last, Diagonal, Sharpness> {
    /// Far end of the side that leaves the vertex.
    end: End,
    /// Far end of the side that arrives at it.
    last_end: Last,
    diagonal: Diagonal,
    sharpness: Sharpness,
}

/// The ring of a corner that is a vertex, or a vertex point, of `mesh`: the sector of faces it lies in.
fn vertex_ring(
    mesh: &Mesh,
    (face, corner): (usize, usize),
    (point, is_sharp): (u32, bool),
    around: &Around<
        impl Fn((usize, usize)) -> u32,
        impl Fn((usize, usize)) -> u32,
        impl Fn((usize, usize)) -> u32,
        impl Fn((usize, usize)) -> f32,
    >,
) -> CapRing {
    let mut corners = Vec::new();
    let closed = mesh.ring(mesh.corners[face][corner], &mut corners);
    let own = corners
        .iter()
        .position(|&found| found as usize == face * 4 + corner)
        .unwrap_or(0);
    let side_sharp = |corner: u32| (around.sharpness)(split(corner)) >= 1.0;
    let sharp_count =
        corners.iter().filter(|&&corner| side_sharp(corner)).count() + usize::from(!closed);
    let whole = closed && sharp_count < 2;
    let (first, count) = sector(&corners, own, whole, closed, &side_sharp);
    let sector: Vec<_> = (0..count)
        .map(|i| split(corners[(first + i) % corners.len()]))
        .collect();
    let mut ends: Vec<_> = sector.iter().map(|&at| (around.end)(at)).collect();
    if let (false, Some(&(face, corner))) = (whole, sector.last()) {
        ends.push((around.last_end)((face, previous(corner))));
    }
    CapRing {
        vertex: point,
        ends,
        diagonals: sector.iter().map(|&at| (around.diagonal)(at)).collect(),
        own: (own + corners.len() - first) % corners.len(),
        closed: whole,
        corner: is_sharp || sharp_count > 2,
    }
}

/// The ring of the edge point of a side, on the side's left first; `own` is 0 for the child at the side's end, 1 for the
/// one at its start.
fn side_ring(above: &Mesh, children: &Children, (f, side): (usize, usize), own: usize) -> CapRing {
    let vertex = |corner: usize| children.vertex[above.corners[f][corner] as usize];
    let mut ring = CapRing {
        vertex: children.side[f][side],
        ends: vec![vertex(next(side)), children.face[f], vertex(side)],
        diagonals: vec![
            children.side[f][next(side)],
            children.side[f][previous(side)],
        ],
        own,
        closed: false,
        corner: false,
    };
    let across = above.across[f][side];
    if across < ABSENT && above.child_side_sharpness(f, side) < 1.0 {
        let (g, there) = split(across);
        ring.ends.push(children.face[g]);
        ring.diagonals.extend([
            children.side[g][next(there)],
            children.side[g][previous(there)],
        ]);
        ring.closed = true;
    }
    ring
}

/// The ring of a face point; child `c` is the cap.
fn face_ring(above: &Mesh, children: &Children, f: usize, c: usize) -> CapRing {
    let vertex = |corner: usize| children.vertex[above.corners[f][corner] as usize];
    CapRing {
        vertex: children.face[f],
        ends: children.side[f].to_vec(),
        diagonals: [0, 1, 2, 3].map(|side| vertex(next(side))).to_vec(),
        own: previous(c),
        closed: true,
        corner: false,
    }
}

/// First face and number of faces of the sector that holds face `own`: sharp sides end it.
fn sector(
    corners: &[u32],
    own: usize,
    whole: bool,
    closed: bool,
    side_sharp: &impl Fn(u32) -> bool,
) -> (usize, usize) {
    let n = corners.len();
    if whole {
        return (0, n);
    }
    let mut first = own;
    while !side_sharp(corners[first]) && (closed || first > 0) {
        first = (first + n - 1) % n;
    }
    let mut count = 1;
    while count < n {
        let following = (first + count) % n;
        if side_sharp(corners[following]) || (!closed && following == 0) {
            break;
        }
        count += 1;
    }
    (first, count)
}
