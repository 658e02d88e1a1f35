//! How far two lists of points are apart.

use std::fmt;

use serde::Serialize;

/// The median and the greatest of many distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Spread {
    median: f64,
    greatest: f64,
}

impl Spread {
    /// Of a list; zeros of an empty one.
    pub(crate) fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |index: usize| values.get(index).copied().unwrap_or(0.0);
        Self {
            median: at(values.len() / 2),
            greatest: at(values.len().saturating_sub(1)),
        }
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "median {:.1e}, greatest {:.1e}",
            self.median, self.greatest
        )
    }
}

/// Distances of points by twos, over an extent.
pub(crate) fn distances(a: &[[f32; 3]], b: &[[f32; 3]], extent: f64) -> Vec<f64> {
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
        let squares = (0..3).map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2));
        squares.sum::<f64>().sqrt() / extent
    };
    a.iter().zip(b).map(distance).collect()
}
