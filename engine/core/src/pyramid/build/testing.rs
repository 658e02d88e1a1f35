//! Rasters in memory, for tests.

use std::path::PathBuf;

use crate::dem::{DemError, Raster, RasterHeader, SourceInfo, Window};
use crate::geo::{Crs, Grid};

/// A raster in memory.
pub(crate) struct Field {
    header: RasterHeader,
    heights: Vec<f64>,
}

impl Field {
    /// A raster of a function of row and column, in plane metres.
    pub(crate) fn new(rows: u32, columns: u32, height: impl Fn(u32, u32) -> f64) -> Self {
        let heights: Vec<f64> = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .map(|(r, c)| height(r, c))
            .collect();
        let header = RasterHeader {
            grid: Grid {
                columns,
                rows,
                origin: [0.0, 0.0],
                step: [10.0, -10.0],
            },
            crs: Crs::unknown(),
            integer: heights
                .iter()
                .all(|height| !height.is_finite() || height.fract() == 0.0),
            georeferenced: true,
            reading: String::new(),
            source: SourceInfo {
                name: "field".into(),
                bytes: 0,
            },
        };
        Self { header, heights }
    }

    /// The height at a row and column.
    pub(crate) fn at(&self, row: usize, column: usize) -> f64 {
        self.heights[row * self.header.grid.columns as usize + column]
    }
}

impl Raster for Field {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        for (line, out) in out.chunks_exact_mut(window.columns as usize).enumerate() {
            let start = (window.row as usize + line) * self.header.grid.columns as usize
                + window.column as usize;
            out.copy_from_slice(&self.heights[start..start + out.len()]);
        }
        Ok(())
    }

    fn memory_bytes(&self) -> u64 {
        8 * self.heights.len() as u64
    }
}

/// Rough hills: whole metres.
pub(crate) fn hills(row: u32, column: u32) -> f64 {
    let (y, x) = (f64::from(row), f64::from(column));
    let noise =
        f64::from((row.wrapping_mul(2_654_435_761) ^ column.wrapping_mul(40_503)) >> 7 & 15);
    (300.0 * (x / 61.0).sin() * (y / 47.0).cos() + 60.0 * (x / 9.0 + y / 13.0).sin() + noise)
        .round()
}

/// A file of the shared data; none, with a message, where it is missing and CI does not ask for it.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared")
        .join(path);
    if file.exists() {
        return Some(file);
    }
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{} is missing",
        file.display()
    );
    println!("skipped: {} is missing", file.display());
    None
}
