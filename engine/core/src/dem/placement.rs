//! From the order in which a file stores samples to rows from the north and columns from the west.

use std::path::Path;

use super::{DemError, OpenOptions, Window, header::MAX_SIDE};
use crate::geo::Grid;

/// An axis-parallel map from stored columns and rows to CRS coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// CRS coordinates of the first stored sample's point.
    pub(super) origin: [f64; 2],
    /// CRS units a stored column and a stored row, of either sign.
    pub(super) step: [f64; 2],
}

/// Which axes a file stores the other way round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Flip {
    rows: bool,
    columns: bool,
}

impl Placement {
    /// For files that say nothing: from (0, 0), by the caller's spacing.
    pub(super) fn unknown(options: &OpenOptions) -> Self {
        let spacing = options.spacing.unwrap_or(1.0);
        Self {
            origin: [0.0; 2],
            step: [spacing, -spacing],
        }
    }

    /// A placement whose numbers make sense, or what does not.
    pub(super) fn check(self) -> Result<Self, String> {
        let [x, y] = self.step;
        if self.origin.iter().chain(&self.step).all(|v| v.is_finite()) && x != 0.0 && y != 0.0 {
            Ok(self)
        } else {
            Err(format!(
                "a grid from {:?} by steps of {:?} has no places",
                self.origin, self.step
            ))
        }
    }

    /// The grid of so many stored columns and rows, and how to turn stored windows into its own.
    pub(super) fn grid(
        self,
        path: &Path,
        columns: u32,
        rows: u32,
    ) -> Result<(Grid, Flip), DemError> {
        let placement = self.check().map_err(|what| DemError::format(path, what))?;
        if columns == 0 || rows == 0 {
            return Err(DemError::format(
                path,
                format!("{columns} x {rows} samples are none"),
            ));
        }
        if columns > MAX_SIDE || rows > MAX_SIDE {
            let what = format!("a raster of {columns} x {rows} samples");
            return Err(DemError::limit(
                path,
                what,
                format!("{MAX_SIDE} samples a side"),
            ));
        }
        let flip = Flip {
            rows: placement.step[1] > 0.0,
            columns: placement.step[0] < 0.0,
        };
        let last = [columns, rows].map(|count| f64::from(count - 1));
        let flipped = [flip.columns, flip.rows];
        let origin = [0, 1].map(|axis| {
            let shift = if flipped[axis] {
                last[axis] * placement.step[axis]
            } else {
                0.0
            };
            placement.origin[axis] + shift
        });
        let step = [placement.step[0].abs(), -placement.step[1].abs()];
        Ok((
            Grid {
                columns,
                rows,
                origin,
                step,
            },
            flip,
        ))
    }
}

impl Flip {
    /// Where a window of so many rows and columns lies in the file.
    pub(super) fn stored(self, window: Window, [rows, columns]: [u32; 2]) -> Window {
        let mut stored = window;
        if self.rows {
            stored.row = rows - window.row - window.rows;
        }
        if self.columns {
            stored.column = columns - window.column - window.columns;
        }
        stored
    }

    /// Turns the samples of a stored window, in place.
    pub(super) fn turn<T>(self, window: Window, samples: &mut [T]) {
        let columns = window.columns as usize;
        if self.columns {
            samples
                .chunks_exact_mut(columns.max(1))
                .for_each(<[T]>::reverse);
        }
        if self.rows && columns > 0 {
            let mut rest = samples;
            // The northmost and southmost row left change places.
            while rest.len() >= 2 * columns {
                let (north, after) = rest.split_at_mut(columns);
                let (middle, south) = after.split_at_mut(after.len() - columns);
                north.swap_with_slice(south);
                rest = middle;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stored 3 × 2 raster 0, 1 / 2, 3 / 4, 5 read through a flip.
    fn read(step: [f64; 2], window: Window) -> (Grid, Vec<f64>) {
        let placement = Placement {
            origin: [10.0, 20.0],
            step,
        };
        let (grid, flip) = placement.grid(Path::new("x"), 2, 3).expect("a fine grid");
        let stored = flip.stored(window, [grid.rows, grid.columns]);
        let mut out = Vec::new();
        for row in stored.row..stored.row + stored.rows {
            out.extend(
                (0..stored.columns).map(|column| f64::from(row * 2 + stored.column + column)),
            );
        }
        flip.turn(window, &mut out);
        (grid, out)
    }

    #[test]
    fn rows_from_the_south_and_columns_from_the_east_are_turned() {
        let whole = Window {
            row: 0,
            column: 0,
            rows: 3,
            columns: 2,
        };
        let (grid, heights) = read([1.0, 1.0], whole);
        assert_eq!((grid.origin, grid.step), ([10.0, 22.0], [1.0, -1.0]));
        assert_eq!(heights, [4.0, 5.0, 2.0, 3.0, 0.0, 1.0]);
        let (grid, heights) = read([-1.0, -1.0], whole);
        assert_eq!(grid.origin, [9.0, 20.0]);
        assert_eq!(heights, [1.0, 0.0, 3.0, 2.0, 5.0, 4.0]);
        assert_eq!(read([-1.0, 1.0], whole).1, [5.0, 4.0, 3.0, 2.0, 1.0, 0.0]);
    }

    #[test]
    fn windows_are_turned_too() {
        let south = Window {
            row: 1,
            column: 1,
            rows: 2,
            columns: 1,
        };
        assert_eq!(read([1.0, 1.0], south).1, [3.0, 1.0]);
        assert_eq!(read([1.0, -1.0], south).1, [3.0, 5.0]);
    }
}
