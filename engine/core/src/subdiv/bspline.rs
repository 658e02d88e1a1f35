//! The uniform cubic B-spline's four basis functions on one span.

/// Weights of the four controls at `t` in 0..=1.
#[must_use]
#[inline]
pub fn basis(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    let (t2, s2) = (t * t, s * s);
    let (t3, s3) = (t2 * t, s2 * s);
    [
        s3 / 6.0,
        (4.0 - 6.0 * t2 + 3.0 * t3) / 6.0,
        (4.0 - 6.0 * s2 + 3.0 * s3) / 6.0,
        t3 / 6.0,
    ]
}

/// Derivatives of the four weights by `t`.
#[must_use]
#[inline]
pub fn basis_derivative(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    let (t2, s2) = (t * t, s * s);
    [-0.5 * s2, 1.5 * t2 - 2.0 * t, 2.0 * s - 1.5 * s2, 0.5 * t2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_derivatives_to_zero() {
        for t in [0.0, 0.1, 0.5, 0.77, 1.0] {
            assert!((basis(t).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(basis_derivative(t).iter().sum::<f64>().abs() < 1e-15);
        }
    }

    #[test]
    fn a_straight_row_of_controls_gives_its_own_parameter() {
        for t in [0.0, 0.25, 0.6, 1.0] {
            let value: f64 = basis(t)
                .iter()
                .zip([-1.0, 0.0, 1.0, 2.0])
                .map(|(w, c)| w * c)
                .sum();
            let slope: f64 = basis_derivative(t)
                .iter()
                .zip([-1.0, 0.0, 1.0, 2.0])
                .map(|(w, c)| w * c)
                .sum();
            assert!((value - t).abs() < 1e-15 && (slope - 1.0).abs() < 1e-15);
        }
    }
}
