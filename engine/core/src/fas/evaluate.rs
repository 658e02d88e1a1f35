//! Points of patches and caps: position and first derivatives.
//!
//! Regular and transition patches are bicubic B-splines and exact. A cap is a bicubic Bézier patch whose corners are
//! exact limit points; its border curves depend only on what both faces of a border share, so caps meet without gaps.
//!
//! Based on: C. Loop, S. Schaefer, *Approximating Catmull-Clark subdivision surfaces with bicubic patches* (2008),
//! section 3.

use super::{
    Cap, CapRing, Patch, Place,
    execute::{add, scale},
    stencil::{corner_at, gather},
};
use crate::subdiv::{Real, basis, basis_derivative};

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Position.
    pub position: [T; 3],
    /// Derivative by u over the patch.
    pub du: [T; 3],
    /// Derivative by v over the patch.
    pub dv: [T; 3],
}

impl Place {
    /// The patch's own parameters of a place on its face, where the patch holds it.
    #[must_use]
    pub fn local(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let side = f64::from(self.level).exp2();
        let local = [u * side - f64::from(self.u), v * side - f64::from(self.v)];
        local
            .iter()
            .all(|part| (0.0..=1.0).contains(part))
            .then_some(local)
    }
}

impl Patch {
    /// The surface at (u, v) of the patch.
    #[must_use]
    pub fn evaluate<T: Real>(&self, points: &[[T; 3]], uv: [f64; 2]) -> Sample<T> {
        let controls = self.controls.map(|point| points[point as usize]);
        tensor(&controls, uv.map(basis), uv.map(basis_derivative))
    }
}

impl Cap {
    /// The sixteen Bézier controls, rows of v.
    #[must_use]
    pub fn controls<T: Real>(&self, points: &[[T; 3]]) -> [[T; 3]; 16] {
        self.controls_of(&|point| points[point as usize])
    }

    /// The same of points that are looked up.
    pub(super) fn controls_of<T: Real>(&self, points: &impl Fn(u32) -> [T; 3]) -> [[T; 3]; 16] {
        let mut controls = [[T::default(); 3]; 16];
        // Corner, towards the next corner, towards the previous one, inside.
        const PLACES: [[usize; 4]; 4] =
            [[0, 1, 4, 5], [3, 7, 2, 6], [15, 14, 11, 10], [12, 8, 13, 9]];
        for (ring, places) in self.rings.iter().zip(PLACES) {
            let [along_next, along_previous] =
                [ring.own, ring.own + 1].map(|end| ring.edge_control(points, end));
            let found = [
                ring.limit(points),
                along_next,
                along_previous,
                ring.inner_control(points, ring.own),
            ];
            for (place, control) in places.into_iter().zip(found) {
                controls[place] = control;
            }
        }
        controls
    }

    /// The cap's surface at (u, v); at its corners the limit with its tangents.
    #[must_use]
    pub fn evaluate<T: Real>(&self, points: &[[T; 3]], uv: [f64; 2]) -> Sample<T> {
        if let Some(corner) = corner_at(uv) {
            return gather(&self.corner_stencil(corner), points);
        }
        tensor(
            &self.controls(points),
            uv.map(bernstein),
            uv.map(bernstein_derivative),
        )
    }
}

impl CapRing {
    pub(super) fn end(&self, index: usize) -> u32 {
        self.ends[index % self.ends.len()]
    }

    /// Faces of a whole ring that would hold as many in this sector: twice a boundary's.
    fn valence(&self) -> f64 {
        let faces = self.diagonals.len() as f64;
        if self.closed { faces } else { 2.0 * faces }
    }

    /// The exact limit of the vertex: smooth, along the sharp edges that end the sector, or in place.
    fn limit<T: Real>(&self, points: &impl Fn(u32) -> [T; 3]) -> [T; 3] {
        let vertex = points(self.vertex);
        if self.corner {
            return vertex;
        }
        if !self.closed {
            let ends = [self.ends[0], self.ends[self.ends.len() - 1]];
            return weighted(
                points,
                &[
                    (self.vertex, 4.0 / 6.0),
                    (ends[0], 1.0 / 6.0),
                    (ends[1], 1.0 / 6.0),
                ],
            );
        }
        let n = self.valence();
        let unit = 1.0 / (n * (n + 5.0));
        let ring = self
            .ends
            .iter()
            .map(|&end| (end, 4.0 * unit))
            .chain(self.diagonals.iter().map(|&at| (at, unit)));
        ring.fold(
            scale(T::of(n * n * unit), vertex),
            |sum, (point, weight)| add(sum, scale(T::of(weight), points(point))),
        )
    }

    /// The Bézier control inside face `face` of the sector.
    fn inner_control<T: Real>(&self, points: &impl Fn(u32) -> [T; 3], face: usize) -> [T; 3] {
        let n = if self.corner { 4.0 } else { self.valence() };
        let unit = 1.0 / (n + 5.0);
        weighted(
            points,
            &[
                (self.vertex, n * unit),
                (self.end(face), 2.0 * unit),
                (self.end(face + 1), 2.0 * unit),
                (self.diagonals[face % self.diagonals.len()], unit),
            ],
        )
    }

    /// The Bézier control on edge `end` of the sector: the mean of the inner ones beside it, or a third along a sharp
    /// edge.
    fn edge_control<T: Real>(&self, points: &impl Fn(u32) -> [T; 3], end: usize) -> [T; 3] {
        let faces = self.diagonals.len();
        let sharp = !self.closed && (end == 0 || end == faces);
        if sharp || self.corner {
            return weighted(
                points,
                &[(self.vertex, 2.0 / 3.0), (self.end(end), 1.0 / 3.0)],
            );
        }
        let [before, after] = [end + faces - 1, end].map(|face| self.inner_control(points, face));
        scale(T::of(0.5), add(before, after))
    }
}

fn weighted<T: Real>(points: &impl Fn(u32) -> [T; 3], weights: &[(u32, f64)]) -> [T; 3] {
    weights
        .iter()
        .fold([T::default(); 3], |sum, &(point, weight)| {
            add(sum, scale(T::of(weight), points(point)))
        })
}

pub(super) fn tensor<T: Real>(
    controls: &[[T; 3]; 16],
    basis: [[f64; 4]; 2],
    slope: [[f64; 4]; 2],
) -> Sample<T> {
    let mut sample = Sample {
        position: [T::default(); 3],
        du: [T::default(); 3],
        dv: [T::default(); 3],
    };
    for (index, &control) in controls.iter().enumerate() {
        let (column, row) = (index % 4, index / 4);
        let weigh = |u: f64, v: f64| scale(T::of(u * v), control);
        sample.position = add(sample.position, weigh(basis[0][column], basis[1][row]));
        sample.du = add(sample.du, weigh(slope[0][column], basis[1][row]));
        sample.dv = add(sample.dv, weigh(basis[0][column], slope[1][row]));
    }
    sample
}

pub(super) fn bernstein(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

pub(super) fn bernstein_derivative(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [
        -3.0 * s * s,
        3.0 * s * s - 6.0 * s * t,
        6.0 * s * t - 3.0 * t * t,
        3.0 * t * t,
    ]
}

#[cfg(test)]
mod tests {
    use super::super::{
        Tables,
        testing::{CAGES, cage},
    };

    /// Face, (u, v), kind, level and position of a reference sample.
    type Row = (u32, [f64; 2], String, i32, [f64; 3]);

    fn samples(name: &str) -> Vec<Row> {
        let path =
            super::super::testing::reference(&format!("{name}.csv")).expect("the caller looked");
        let text = std::fs::read_to_string(path).expect("a file");
        let rows = text.lines().skip(1).map(|line| {
            let cells: Vec<_> = line.split(',').collect();
            let number = |cell: usize| cells[cell].parse::<f64>().expect("a number");
            let face = cells[1].parse().expect("a face");
            let level = cells[5].parse().expect("a level");
            (
                face,
                [number(2), number(3)],
                cells[4].to_owned(),
                level,
                [number(6), number(7), number(8)],
            )
        });
        rows.collect()
    }

    #[test]
    fn isolated_patches_are_exact_and_caps_end_in_the_limit() {
        for name in CAGES {
            let Some(cage) = cage(name) else { return };
            let depth = 5;
            let tables = Tables::classic(cage.topology(), depth).expect("quads");
            let points = tables.execute(cage.positions());
            let (mut exact, mut vertices) = (0.0_f64, 0.0_f64);
            for (face, uv, kind, level, position) in samples(name) {
                let patch = tables.render.patches.iter().find_map(|patch| {
                    let local = (patch.place.face == face)
                        .then(|| patch.place.local(uv))
                        .flatten()?;
                    Some(patch.evaluate(&points, local))
                });
                let found = patch.or_else(|| {
                    tables.render.caps.iter().find_map(|cap| {
                        let local = (cap.place.face == face)
                            .then(|| cap.place.local(uv))
                            .flatten()?;
                        Some(cap.evaluate(&points, local))
                    })
                });
                let found = found.expect("patches and caps cover every face").position;
                let distance = (0..3)
                    .map(|axis| (found[axis] - position[axis]).abs())
                    .fold(0.0, f64::max);
                if kind == "vertex" {
                    vertices = vertices.max(distance);
                } else if (0..=i32::from(depth)).contains(&level) {
                    exact = exact.max(distance);
                }
            }
            assert!(
                exact <= 1e-12 * cage.extent(),
                "{name}: {exact} of {}",
                cage.extent()
            );
            // What is still semi-sharp at the last level is drawn as if it were smooth.
            let topology = cage.topology();
            let worn_off = (0..topology.edge_count())
                .map(|edge| topology.edge_sharpness(edge))
                .chain((0..topology.vertex_count()).map(|vertex| topology.vertex_sharpness(vertex)))
                .all(|sharpness| sharpness <= f64::from(depth) || sharpness.is_infinite());
            assert!(
                !worn_off || vertices <= 1e-12 * cage.extent(),
                "{name}, vertices: {vertices}"
            );
        }
    }

    #[test]
    fn single_precision_stays_within_a_millionth_of_the_extent() {
        let Some(cage) = cage("terrain_a") else {
            return;
        };
        let tables = Tables::classic(cage.topology(), 4).expect("quads");
        let exact = tables.execute(cage.positions());
        let narrow: Vec<_> = cage
            .positions()
            .iter()
            .map(|point| point.map(|part| part as f32))
            .collect();
        let found = tables.execute(&narrow);
        let scale = cage
            .bounds()
            .iter()
            .flatten()
            .fold(0.0_f64, |most, part| most.max(part.abs()));
        for (exact, found) in exact.iter().zip(found) {
            for axis in 0..3 {
                assert!((exact[axis] - f64::from(found[axis])).abs() <= 1e-6 * scale);
            }
        }
    }
}
