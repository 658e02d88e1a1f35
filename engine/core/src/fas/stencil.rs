//! Pieces of the render table as sums of points: what a device needs of a cap, and what is exact at a cap's corners.
//!
//! A patch is sixteen controls and two parameters, small enough as it is. A cap's rings have any number of points, so its
//! places become *stencils*: points, each with its weights in the position and in both derivatives. At a corner those are
//! the limit masks themselves, tangents too; elsewhere the weights are what the surface gives for points of one and zero.

use std::f64::consts::PI;

use super::{
    Cap, CapRing, RenderTable, Sample,
    execute::{Real, add, scale},
};
use crate::subdiv::{CREASE_LIMIT, crease_tangent, smooth_limit, smooth_tangent};

/// A patch or a cap, by its place in the render table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PieceIndex {
    /// Of [`RenderTable::patches`].
    Patch(u32),
    /// Of [`RenderTable::caps`].
    Cap(u32),
}

/// A point, and its weights in the position, in the derivative by u and in the one by v.
pub type StencilTerm = (u32, [f64; 3]);

impl RenderTable {
    /// The surface at (u, v) of a piece.
    ///
    /// # Panics
    /// When the table has no such piece, or is of other points.
    #[must_use]
    pub fn evaluate<T: Real>(
        &self,
        piece: PieceIndex,
        points: &[[T; 3]],
        uv: [f64; 2],
    ) -> Sample<T> {
        match piece {
            PieceIndex::Patch(patch) => self.patches[patch as usize].evaluate(points, uv),
            PieceIndex::Cap(cap) => self.caps[cap as usize].evaluate(points, uv),
        }
    }
}

impl Cap {
    /// The cap's surface at (u, v) as a sum of points; a point may be named more than once.
    #[must_use]
    pub fn stencil(&self, uv: [f64; 2]) -> Vec<StencilTerm> {
        match corner_at(uv) {
            Some(corner) => self.corner_stencil(corner),
            None => self.inner_stencil(uv),
        }
    }

    /// At a corner: its limit, and the limit tangents turned into derivatives by u and v.
    ///
    /// ```text
    ///   3 ─◀─ 2    tangents run from a corner to the next (a) and to the previous one (b):
    ///   ▼     ▲    corner 0: u = a, v = b     corner 1: u = -b, v = a
    ///   0 ─▶─ 1    corner 2: u = -a, v = -b   corner 3: u = b, v = -a
    /// ```
    pub(super) fn corner_stencil(&self, corner: usize) -> Vec<StencilTerm> {
        let mut terms = self.rings[corner].limit_terms();
        for (_, [_, du, dv]) in &mut terms {
            let (a, b) = (*du, *dv);
            [*du, *dv] = [[a, b], [-b, a], [-a, -b], [b, -a]][corner];
        }
        terms
    }

    /// Off the corners: the surface is linear in its points, so a point's weights are its values where the point is one
    /// and all others are zero; three points a time, one an axis.
    fn inner_stencil(&self, uv: [f64; 2]) -> Vec<StencilTerm> {
        let mut points: Vec<u32> = self.rings.iter().flat_map(CapRing::points).collect();
        points.sort_unstable();
        points.dedup();
        let local = self.renumbered(|point| points.binary_search(&point).unwrap_or(0) as u32);
        let mut terms = Vec::with_capacity(points.len());
        for (chunk, first) in points.chunks(3).zip((0..).step_by(3)) {
            let mut unit = vec![[0.0; 3]; points.len()];
            for axis in 0..chunk.len() {
                unit[first + axis][axis] = 1.0;
            }
            let found = local.evaluate(&unit, uv);
            terms.extend(chunk.iter().enumerate().map(|(axis, &point)| {
                let weights = [found.position[axis], found.du[axis], found.dv[axis]];
                (point, weights)
            }));
        }
        terms
    }

    fn renumbered(&self, number: impl Fn(u32) -> u32) -> Self {
        let mut cap = self.clone();
        for ring in &mut cap.rings {
            ring.vertex = number(ring.vertex);
            for point in ring.ends.iter_mut().chain(&mut ring.diagonals) {
                *point = number(*point);
            }
        }
        cap
    }
}

impl CapRing {
    fn points(&self) -> impl Iterator<Item = u32> {
        let around = self.ends.iter().chain(&self.diagonals).copied();
        std::iter::once(self.vertex).chain(around)
    }

    /// Weights in the limit of the vertex and in its tangents along ends `own` and `own + 1`.
    ///
    /// Where those two lie on one line (valence 2, one face beside a crease) the second one is another direction of the
    /// tangent plane, on the face's side.
    fn limit_terms(&self) -> Vec<StencilTerm> {
        if self.corner {
            return vec![
                (self.vertex, [1.0, -1.0, -1.0]),
                (self.end(self.own), [0.0, 1.0, 0.0]),
                (self.end(self.own + 1), [0.0, 0.0, 1.0]),
            ];
        }
        if self.closed {
            self.smooth_terms()
        } else {
            self.crease_terms()
        }
    }

    fn smooth_terms(&self) -> Vec<StencilTerm> {
        let n = self.diagonals.len();
        let limit = smooth_limit(n);
        let tangents = |i: usize| {
            let along = smooth_tangent(n, (i + n - self.own) % n);
            let mut beside = smooth_tangent(n, (i + 2 * n - self.own - 1) % n);
            if n == 2 {
                beside = [0.0, if i == self.own { 1.0 } else { -1.0 }];
            }
            [along, beside]
        };
        let mut terms = vec![(self.vertex, [limit.vertex, 0.0, 0.0])];
        for i in 0..n {
            let [along, beside] = tangents(i);
            terms.push((self.ends[i], [limit.edge, along[0], beside[0]]));
            terms.push((self.diagonals[i], [limit.diagonal, along[1], beside[1]]));
        }
        terms
    }

    fn crease_terms(&self) -> Vec<StencilTerm> {
        let faces = self.diagonals.len();
        let mask = crease_tangent(faces);
        // Both tangents are sums of the one along the crease and the one across.
        let turn = |k: usize| (PI * k as f64 / faces as f64).sin_cos();
        let (first, mut second) = (turn(self.own), turn(self.own + 1));
        if faces == 1 {
            second = (1.0, 0.0);
        }
        let weights = |limit: f64, along: f64, across: f64| {
            let tangent = |(sin, cos): (f64, f64)| cos * along + sin * across;
            [limit, tangent(first), tangent(second)]
        };
        let mut terms = vec![(self.vertex, weights(CREASE_LIMIT[0], 0.0, mask.vertex))];
        for (k, &end) in self.ends.iter().enumerate() {
            terms.push(match k {
                0 => (end, weights(CREASE_LIMIT[1], 0.5, mask.crease)),
                k if k == faces => (end, weights(CREASE_LIMIT[1], -0.5, mask.crease)),
                k => (end, weights(0.0, 0.0, mask.edge(k))),
            });
        }
        let diagonals = self.diagonals.iter().enumerate();
        terms.extend(diagonals.map(|(k, &at)| (at, weights(0.0, 0.0, mask.diagonal(k)))));
        terms
    }
}

/// The sum of a stencil's points.
pub(super) fn gather<T: Real>(terms: &[StencilTerm], points: &[[T; 3]]) -> Sample<T> {
    let zero = [T::default(); 3];
    let mut sums = [zero; 3];
    for (point, weights) in terms {
        for (sum, weight) in sums.iter_mut().zip(weights) {
            *sum = add(*sum, scale(T::of(*weight), points[*point as usize]));
        }
    }
    let [position, du, dv] = sums;
    Sample { position, du, dv }
}

/// The corner that (u, v) is, if it is one.
pub(super) fn corner_at(uv: [f64; 2]) -> Option<usize> {
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        .iter()
        .position(|corner| *corner == uv)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        cage::LimitSurface,
        fas::{Tables, testing::cage},
    };

    const CAGES: [&str; 3] = ["discs_3_5_7_10", "box_creases", "sheet_boundary"];

    fn normal(sample: &Sample<f64>) -> glam::DVec3 {
        glam::DVec3::from(sample.du)
            .cross(sample.dv.into())
            .normalize_or_zero()
    }

    /// Sums of a few dozen products in another order: 1e-12 of the cage.
    #[test]
    fn stencils_are_the_surface() {
        for name in CAGES {
            let Some(cage) = cage(name) else { return };
            let tables = Tables::classic(cage.topology(), 2).unwrap();
            let points = tables.execute(cage.positions());
            for cap in &tables.render.caps {
                for uv in [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0], [0.25, 0.75], [1.0, 1.0]] {
                    let (found, wanted) =
                        (gather(&cap.stencil(uv), &points), cap.evaluate(&points, uv));
                    for axis in 0..3 {
                        let close = |a: [f64; 3], b: [f64; 3]| {
                            (a[axis] - b[axis]).abs() <= 1e-12 * cage.extent()
                        };
                        assert!(close(found.position, wanted.position), "{name} {uv:?}");
                        assert!(close(found.du, wanted.du) && close(found.dv, wanted.dv));
                    }
                }
            }
        }
    }

    /// The limit surface splits the cage around the corner on its own way; both are exact.
    #[test]
    fn caps_have_the_limits_normals_at_their_corners_at_any_depth() {
        for name in CAGES {
            let Some(cage) = cage(name) else { return };
            let limit = LimitSurface::new(&cage).unwrap();
            let mut checked = 0;
            for depth in 0..3 {
                let tables = Tables::classic(cage.topology(), depth).unwrap();
                let points = tables.execute(cage.positions());
                for cap in &tables.render.caps {
                    let side = f64::from(cap.place.level).exp2();
                    for (corner, ring) in cap.rings.iter().enumerate() {
                        // Semi-sharp things that have not worn off are drawn as if they were smooth.
                        let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][corner];
                        let at = [
                            (f64::from(cap.place.u) + uv[0]) / side,
                            (f64::from(cap.place.v) + uv[1]) / side,
                        ];
                        let wanted = limit.evaluate(cap.place.face, at[0], at[1]).unwrap();
                        let found = cap.evaluate(&points, uv);
                        let is_exact = (0..3).all(|axis| {
                            (found.position[axis] - wanted.position[axis]).abs()
                                < 1e-12 * cage.extent()
                        });
                        if !is_exact || ring.corner {
                            continue;
                        }
                        let angle = normal(&found).angle_between(wanted.normal.into());
                        assert!(
                            angle < 1e-6,
                            "{name} depth {depth} face {} {at:?}: {angle}",
                            cap.place.face
                        );
                        checked += 1;
                    }
                }
            }
            assert!(checked > 20, "{name}: {checked}");
        }
    }
}
