//! Subdivision of a regular lattice: uniform cubic B-spline knot insertion, (1, 6, 1) / 8 and (4, 4) / 8.
//!
//! From `n` controls in a row come `2 n - 3` children: an edge point between every two, a vertex point at every control
//! but the first and the last.

/// One row of controls, `2 n - 3` children: edge, vertex, edge, …, edge. Fewer than two controls have none.
#[must_use]
pub fn subdivide_line(controls: &[f64]) -> Vec<f64> {
    let mut children = Vec::with_capacity((2 * controls.len()).saturating_sub(3));
    for (i, pair) in controls.windows(2).enumerate() {
        if i > 0 {
            children.push((controls[i - 1] + 6.0 * controls[i] + controls[i + 1]) / 8.0);
        }
        children.push((pair[0] + pair[1]) / 2.0);
    }
    children
}

/// A lattice of `rows` × `columns` controls, row by row, subdivided both ways: `(2 rows - 3)` × `(2 columns - 3)`.
///
/// # Panics
/// When `controls` are not `rows · columns` many.
#[must_use]
pub fn subdivide_lattice(controls: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    assert_eq!(
        controls.len(),
        rows * columns,
        "a lattice of rows × columns controls"
    );
    let lines: Vec<Vec<f64>> = controls
        .chunks_exact(columns.max(1))
        .map(subdivide_line)
        .collect();
    let width = (2 * columns).saturating_sub(3);
    let height = (2 * rows).saturating_sub(3);
    let mut children = vec![0.0; width * height];
    for column in 0..width {
        let line: Vec<f64> = lines.iter().map(|line| line[column]).collect();
        for (row, child) in subdivide_line(&line).into_iter().enumerate() {
            children[row * width + column] = child;
        }
    }
    children
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_stays_a_ramp() {
        let children = subdivide_line(&[0.0, 1.0, 2.0, 3.0]);
        assert_eq!(children, [0.5, 1.0, 1.5, 2.0, 2.5]);
    }

    #[test]
    fn a_lattice_weighs_by_the_product_of_the_rows_masks() {
        let mut controls = vec![0.0; 25];
        controls[12] = 64.0;
        let children = subdivide_lattice(&controls, 5, 5);
        assert_eq!(children.len(), 49);
        assert_eq!(children[3 * 7 + 3], 36.0);
        assert_eq!(children[3 * 7 + 2], 24.0);
        assert_eq!(children[2 * 7 + 2], 16.0);
        assert_eq!(children[3 * 7 + 1], 6.0);
        assert_eq!(children[7 + 1], 1.0);
    }

    #[test]
    fn too_few_controls_have_no_children() {
        assert!(subdivide_line(&[1.0]).is_empty());
        assert!(subdivide_lattice(&[], 0, 0).is_empty());
    }
}
