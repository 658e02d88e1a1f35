//! A bicubic patch as a polynomial in u and v, for many places on one patch.
//!
//! Turning a patch into powers costs about as much as two evaluations; after that a position is 15 multiply-adds an
//! axis. Vectors have four lanes, the last unused, so that compilers keep them in two or one registers.

use glam::DVec3;

use super::patch::{Jet, Patch};

type Lanes = [f64; 4];

/// Coefficients: `rows[j][i]` belongs to `v^j u^i`.
#[derive(Clone, Debug)]
pub(super) struct PowerPatch {
    rows: [[Lanes; 4]; 4],
}

impl From<&Patch> for PowerPatch {
    fn from(patch: &Patch) -> Self {
        let point = |row: usize, column: usize| {
            let DVec3 { x, y, z } = patch.controls[4 * row + column];
            [x, y, z, 0.0]
        };
        let along: [[Lanes; 4]; 4] =
            std::array::from_fn(|row| powers(std::array::from_fn(|i| point(row, i))));
        let mut rows = [[[0.0; 4]; 4]; 4];
        for i in 0..4 {
            let column = powers(std::array::from_fn(|row| along[row][i]));
            for (row, value) in rows.iter_mut().zip(column) {
                row[i] = value;
            }
        }
        Self { rows }
    }
}

/// Coefficients of `1, t, t², t³` of a cubic B-spline span.
#[inline(always)]
fn powers([a, b, c, d]: [Lanes; 4]) -> [Lanes; 4] {
    const SIXTH: f64 = 1.0 / 6.0;
    const TWO_THIRDS: f64 = 2.0 / 3.0;
    let each = |f: &dyn Fn(usize) -> f64| -> Lanes { [f(0), f(1), f(2), f(3)] };
    [
        each(&|i| SIXTH * (a[i] + c[i]) + TWO_THIRDS * b[i]),
        each(&|i| 0.5 * (c[i] - a[i])),
        each(&|i| 0.5 * (a[i] + c[i]) - b[i]),
        each(&|i| SIXTH * (d[i] - a[i]) + 0.5 * (b[i] - c[i])),
    ]
}

#[inline(always)]
fn step(sum: Lanes, t: f64, next: Lanes) -> Lanes {
    [
        sum[0] * t + next[0],
        sum[1] * t + next[1],
        sum[2] * t + next[2],
        sum[3] * t + next[3],
    ]
}

#[inline(always)]
fn horner(c: &[Lanes; 4], t: f64) -> Lanes {
    step(step(step(c[3], t, c[2]), t, c[1]), t, c[0])
}

/// Value and derivative.
#[inline(always)]
fn horner_both(c: &[Lanes; 4], t: f64) -> [Lanes; 2] {
    let value = step(c[3], t, c[2]);
    let slope = step(c[3], t, value);
    let value = step(value, t, c[1]);
    let slope = step(slope, t, value);
    [step(value, t, c[0]), slope]
}

impl PowerPatch {
    #[inline]
    pub(super) fn position(&self, u: f64, v: f64) -> [f64; 3] {
        let rows = &self.rows;
        let column = [
            horner(&rows[0], u),
            horner(&rows[1], u),
            horner(&rows[2], u),
            horner(&rows[3], u),
        ];
        let [x, y, z, _] = horner(&column, v);
        [x, y, z]
    }

    #[inline]
    pub(super) fn jet(&self, u: f64, v: f64) -> Jet {
        let rows = &self.rows;
        let [a, b, c, d] = [
            horner_both(&rows[0], u),
            horner_both(&rows[1], u),
            horner_both(&rows[2], u),
            horner_both(&rows[3], u),
        ];
        let [position, dv] = horner_both(&[a[0], b[0], c[0], d[0]], v);
        let du = horner(&[a[1], b[1], c[1], d[1]], v);
        let vector = |[x, y, z, _]: Lanes| DVec3::new(x, y, z);
        Jet {
            position: vector(position),
            du: vector(du),
            dv: vector(dv),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_basis_functions_are_one_patch() {
        let controls = std::array::from_fn(|i| {
            let t = i as f64;
            DVec3::new((1.3 * t).sin(), (0.7 * t * t).cos(), t % 3.0)
        });
        let patch = Patch { controls };
        let power = PowerPatch::from(&patch);
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.8), (1.0, 1.0), (0.5, 0.01)] {
            let (a, b) = (patch.evaluate(u, v), power.jet(u, v));
            assert!(a.position.distance(b.position) < 4e-15 && a.du.distance(b.du) < 1e-14);
            assert!(a.dv.distance(b.dv) < 1e-14);
            assert_eq!(power.position(u, v), b.position.to_array());
        }
    }
}
