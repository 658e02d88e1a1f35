//! A part of a raster as a raster.

use super::{DemError, Raster, RasterHeader, Window};

/// A window of a raster, with a grid of its own.
pub struct Crop<'a> {
    whole: &'a dyn Raster,
    first: [u32; 2],
    header: RasterHeader,
}

impl<'a> Crop<'a> {
    /// The samples of a window.
    ///
    /// # Errors
    /// [`DemError::Window`] where the window is empty or leaves the raster.
    pub fn new(whole: &'a dyn Raster, window: Window) -> Result<Self, DemError> {
        let mut header = whole.header().clone();
        let grid = &mut header.grid;
        let inside = window.row_end() <= u64::from(grid.rows)
            && window.column_end() <= u64::from(grid.columns);
        if !inside || window.sample_count() == 0 {
            return Err(DemError::Window {
                file: header.source.name,
                window,
                what: format!("a raster of {} x {}", grid.rows, grid.columns),
            });
        }
        grid.origin = grid.position(f64::from(window.row), f64::from(window.column));
        grid.rows = window.rows;
        grid.columns = window.columns;
        Ok(Self {
            whole,
            first: [window.row, window.column],
            header,
        })
    }
}

impl Raster for Crop<'_> {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let window = Window {
            row: window.row + self.first[0],
            column: window.column + self.first[1],
            ..window
        };
        self.whole.read(window, out)
    }

    fn part_shape(&self) -> [u32; 2] {
        self.whole.part_shape()
    }

    fn memory_bytes(&self) -> u64 {
        self.whole.memory_bytes()
    }

    fn read_bytes(&self, samples: u64) -> u64 {
        self.whole.read_bytes(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::Synth;

    fn window([row, column, rows, columns]: [u32; 4]) -> Window {
        Window {
            row,
            column,
            rows,
            columns,
        }
    }

    #[test]
    fn a_part_has_the_heights_and_places_of_the_whole() {
        let whole = Synth::new(1, window([0, 0, 50, 60])).unwrap();
        let crop = Crop::new(&whole, window([10, 20, 30, 40])).unwrap();
        assert_eq!(crop.header().grid.origin, [200.0, -100.0]);
        let mut part = [0.0; 12];
        crop.read(window([27, 36, 3, 4]), &mut part).unwrap();
        let mut want = [0.0; 12];
        whole.read(window([37, 56, 3, 4]), &mut want).unwrap();
        assert_eq!(part, want);
        assert!(crop.read(window([28, 36, 3, 4]), &mut part).is_err());
    }

    #[test]
    fn windows_outside_are_errors() {
        let whole = Synth::new(1, window([0, 0, 50, 60])).unwrap();
        for bad in [
            [0, 0, 51, 1],
            [50, 0, 1, 1],
            [0, 0, 0, 1],
            [u32::MAX, 0, 2, 1],
        ] {
            assert!(Crop::new(&whole, window(bad)).is_err(), "{bad:?}");
        }
    }
}
