//! The world: metres east, north and up from the middle of the data set.

use serde::{Deserialize, Serialize};

use super::{Crs, CrsKind, Grid};

/// The affine map from CRS coordinates to world metres: x east, y north, origin at the data set's centre.
///
/// A projected CRS is taken as it is, times its unit; a geographic one is laid on a plane, metres of longitude and
/// latitude at the centre's latitude on its ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldFrame {
    /// `x = a X + b Y + c` and `y = d X + e Y + f`, as `[[a, b, c], [d, e, f]]`.
    pub world_from_crs: [[f64; 3]; 2],
}

impl WorldFrame {
    /// The world of a data set.
    #[must_use]
    pub fn new(grid: &Grid, crs: &Crs) -> Self {
        let [x, y] = grid.extent().center();
        let [scale_x, scale_y] = match crs.kind {
            CrsKind::Geographic => crs.ellipsoid.metres_per_degree(y),
            CrsKind::Projected | CrsKind::Unknown => [crs.unit_metres; 2],
        };
        Self {
            world_from_crs: [[scale_x, 0.0, -scale_x * x], [0.0, scale_y, -scale_y * y]],
        }
    }

    /// World metres of CRS coordinates.
    #[must_use]
    pub fn to_world(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.world_from_crs.map(|[a, b, c]| a * x + b * y + c)
    }

    /// CRS coordinates of world metres.
    #[must_use]
    pub fn to_crs(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [[a, b, c], [d, e, f]] = self.world_from_crs;
        let (x, y, det) = (x - c, y - f, a * e - b * d);
        [(e * x - b * y) / det, (a * y - d * x) / det]
    }

    /// World metres of one CRS step: per column of a grid and per row (the second is negative: rows run south).
    #[must_use]
    pub fn step(&self, grid: &Grid) -> [f64; 2] {
        [
            self.world_from_crs[0][0] * grid.step[0],
            self.world_from_crs[1][1] * grid.step[1],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_is_the_origin_and_the_map_inverts() {
        let grid = Grid {
            columns: 1201,
            rows: 1201,
            origin: [-122.0, 47.0],
            step: [1.0 / 1200.0, -1.0 / 1200.0],
        };
        let frame = WorldFrame::new(&grid, &Crs::wgs84());
        let [x, y] = frame.to_world([-121.5, 46.5]);
        assert!(x.abs() < 1e-6 && y.abs() < 1e-6);
        let back = frame.to_crs(frame.to_world([-121.9, 46.1]));
        assert!((back[0] + 121.9).abs() < 1e-12 && (back[1] - 46.1).abs() < 1e-12);
    }
}
