//! Limit masks: where a vertex ends up, and the tangents there.
//!
//! For vertices among quads only: E are the far ends of the vertex's edges in rotation order and D the corners of its
//! faces across from it, D_i between E_i and E_(i + 1). Tangents are scaled to be the derivatives of the bicubic
//! B-spline patch at valence 4.
//!
//! Based on: M. Halstead, M. Kass, T. DeRose, *Efficient, fair interpolation using Catmull-Clark surfaces* (1993);
//! H. Biermann, A. Levin, D. Zorin, *Piecewise smooth subdivision surfaces with normal control* (2000).

use std::f64::consts::PI;

/// Limit of a crease vertex: the vertex, and each of its crease's two neighbours.
pub const CREASE_LIMIT: [f64; 2] = [2.0 / 3.0, 1.0 / 6.0];

/// Limit position of a smooth vertex: `vertex · V + edge · ΣE + diagonal · ΣD`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothLimit {
    /// Weight of the vertex.
    pub vertex: f64,
    /// Weight of each E.
    pub edge: f64,
    /// Weight of each D.
    pub diagonal: f64,
}

/// The limit position's mask of a smooth vertex.
#[must_use]
pub fn smooth_limit(valence: usize) -> SmoothLimit {
    let n = valence as f64;
    let diagonal = 1.0 / (n * (n + 5.0));
    SmoothLimit {
        vertex: n / (n + 5.0),
        edge: 4.0 * diagonal,
        diagonal,
    }
}

/// Second largest eigenvalue of a smooth vertex's subdivision: rings shrink by it from level to level.
#[must_use]
pub fn subdominant_eigenvalue(valence: usize) -> f64 {
    eigenvalue((2.0 * PI / valence as f64).cos())
}

/// Weights of E_i and D_i in the limit tangent of a smooth vertex along its edge 0.
///
/// The tangent along edge `k` has the weights of `i - k`. At valence 2 edge and face directions share their eigenvalue
/// and the tangent along an edge is that of its two ends.
#[must_use]
pub fn smooth_tangent(valence: usize, i: usize) -> [f64; 2] {
    let n = valence as f64;
    let angle = |i: usize| (2.0 * PI * i as f64 / n).cos();
    let c = angle(1);
    let edge = if valence == 2 {
        4.0
    } else {
        16.0 * eigenvalue(c) - 4.0
    };
    let scale = 2.0 / (n * (edge + 2.0));
    [scale * edge * angle(i), scale * (angle(i) + angle(i + 1))]
}

/// Weights of the limit tangent across a crease, pointing into the faces on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CreaseTangent {
    /// Weight of the vertex.
    pub vertex: f64,
    /// Weight of each of the crease's two neighbours.
    pub crease: f64,
    inner: f64,
    diagonal: f64,
    angle: f64,
}

impl CreaseTangent {
    /// Weight of the `i`-th E inside the side, `1 <= i < faces`, counted from the crease's first edge as 0.
    #[must_use]
    pub fn edge(&self, i: usize) -> f64 {
        self.inner * (self.angle * i as f64).sin()
    }

    /// Weight of the `i`-th D of the side.
    #[must_use]
    pub fn diagonal(&self, i: usize) -> f64 {
        self.diagonal * ((self.angle * i as f64).sin() + (self.angle * (i + 1) as f64).sin())
    }
}

/// The tangent across a crease with `faces` faces on that side.
///
/// It is the left eigenvector of subdivision there with sin(π i / faces) on the i-th E. Biermann et al. 2000 give one
/// of the same form for rules they change to have eigenvalue 1/2; ours is for Catmull-Clark's own rules, and the same
/// at two faces. With one face the surface has a cusp across: the tangent is then the mean of the two edges. With more
/// than three faces the surface has no tangent plane at the vertex (a second wave shrinks no faster than the crease);
/// this tangent and the crease's own are then the sensible plane.
#[must_use]
pub fn crease_tangent(faces: usize) -> CreaseTangent {
    let angle = PI / faces.max(1) as f64;
    if faces < 2 {
        return CreaseTangent {
            vertex: -1.0,
            crease: 0.5,
            inner: 0.0,
            diagonal: 0.0,
            angle,
        };
    }
    let (sin, cos) = angle.sin_cos();
    let eigenvalue = eigenvalue(cos);
    // Two faces give the bicubic patch's own derivative.
    let scale = 1.0 / (faces as f64 * (3.0 + cos));
    // E columns: inner (3 + cos) / 8 + diagonal (1 + cos) / 2 = eigenvalue · inner; D columns: inner / 16 + diagonal / 4
    // = eigenvalue · diagonal. The V column and the sum of all weights, which is zero, leave these two:
    let inner = 16.0 * eigenvalue - 4.0;
    let sines = (1.0 + cos) / sin;
    let crease = -sines * (32.0 * eigenvalue * eigenvalue - 16.0 * eigenvalue + 1.0)
        / (4.0 * eigenvalue - 1.0);
    let vertex = -2.0 * crease - sines * (inner + 2.0);
    CreaseTangent {
        vertex: scale * vertex,
        crease: scale * crease,
        inner: scale * inner,
        diagonal: scale,
        angle,
    }
}

/// The larger eigenvalue of a ring's wave whose neighbours differ by an angle of this cosine.
fn eigenvalue(cos: f64) -> f64 {
    (5.0 + cos + ((9.0 + cos) * (1.0 + cos)).sqrt()) / 16.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_masks_sum_to_one() {
        for valence in 2..400 {
            let mask = smooth_limit(valence);
            let sum = mask.vertex + valence as f64 * (mask.edge + mask.diagonal);
            assert!((sum - 1.0).abs() < 1e-14);
        }
        assert!((CREASE_LIMIT[0] + 2.0 * CREASE_LIMIT[1] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn tangent_masks_sum_to_zero() {
        for valence in 2..50 {
            let sum: f64 = (0..valence).flat_map(|i| smooth_tangent(valence, i)).sum();
            assert!(sum.abs() < 1e-14);
        }
        for faces in 1..50 {
            let mask = crease_tangent(faces);
            let sum = mask.vertex + 2.0 * mask.crease;
            let inner: f64 = (1..faces).map(|i| mask.edge(i)).sum();
            let diagonals: f64 = (0..faces).map(|i| mask.diagonal(i)).sum();
            assert!((sum + inner + diagonals).abs() < 1e-13, "{faces} faces");
        }
    }

    #[test]
    fn regular_masks_are_those_of_the_bspline_patch() {
        assert!((subdominant_eigenvalue(4) - 0.5).abs() < 1e-15);
        let mask = smooth_limit(4);
        for (weight, of_36) in [(mask.vertex, 16.0), (mask.edge, 4.0), (mask.diagonal, 1.0)] {
            assert!((weight - of_36 / 36.0).abs() < 1e-15);
        }
        for (i, [edge, diagonal]) in [[4.0, 1.0], [0.0, -1.0], [-4.0, -1.0], [0.0, 1.0]]
            .into_iter()
            .enumerate()
        {
            let [e, d] = smooth_tangent(4, i);
            assert!((12.0 * e - edge).abs() < 1e-14 && (12.0 * d - diagonal).abs() < 1e-14);
        }
        let across = crease_tangent(2);
        for (weight, of_6) in [
            (across.vertex, -4.0),
            (across.crease, -1.0),
            (across.edge(1), 4.0),
        ] {
            assert!((6.0 * weight - of_6).abs() < 1e-14);
        }
        assert!((6.0 * across.diagonal(0) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn rings_shrink_by_the_published_eigenvalues() {
        for (valence, value) in [(3, 0.410), (5, 0.550), (6, 0.580), (8, 0.611)] {
            assert!((subdominant_eigenvalue(valence) - value).abs() < 5e-4);
        }
    }
}
