//! Several rasters as one.

use super::{DemError, Raster, RasterHeader, SourceInfo, Window, header::MAX_SIDE};
use crate::geo::Grid;

/// How far samples may lie from the common lattice, in steps: rounding in files' text, not another grid.
const LATTICE_TOLERANCE: f64 = 0.01;

/// Several rasters of one CRS and step as one: the later given wins where it is not void; gaps are void.
pub struct Mosaic {
    header: RasterHeader,
    parts: Vec<Part>,
}

struct Part {
    raster: Box<dyn Raster>,
    /// Row and column of its north-west sample in the mosaic.
    row: u32,
    column: u32,
}

impl Mosaic {
    /// Joins rasters whose samples lie on a common lattice. The grid starts at the first raster's lattice.
    ///
    /// # Errors
    /// [`DemError::Mismatch`] naming two files that differ in CRS, step or lattice, or lie too far apart;
    /// [`DemError::Format`] when none are given, or one of several says nothing of where it lies.
    pub fn new(rasters: Vec<Box<dyn Raster>>) -> Result<Self, DemError> {
        let Some(first) = rasters.first().map(|raster| raster.header().clone()) else {
            return Err(DemError::Format {
                file: "mosaic".into(),
                what: "no rasters given".into(),
            });
        };
        let mut places = Vec::new();
        for raster in &rasters {
            check_fits(&first, raster.header(), rasters.len())?;
            places.push(lattice_place(&first, raster.header())?);
        }
        let (start, grid) = union(&first, &rasters, &places)?;
        let headers = || rasters.iter().map(|raster| raster.header());
        let header = RasterHeader {
            grid,
            crs: first.crs.clone(),
            integer: headers().all(|header| header.integer),
            georeferenced: first.georeferenced,
            reading: headers()
                .map(|header| header.reading.as_str())
                .collect::<Vec<_>>()
                .join(", "),
            source: SourceInfo {
                name: name(&rasters),
                bytes: headers().map(|header| header.source.bytes).sum(),
            },
        };
        // Each lies within the grid just made, so the offsets fit.
        let offset = |place: i64, start: i64| u32::try_from(place - start).unwrap_or(0);
        let parts = rasters
            .into_iter()
            .zip(places)
            .map(|(raster, [row, column])| Part {
                raster,
                row: offset(row, start[0]),
                column: offset(column, start[1]),
            });
        Ok(Self {
            header,
            parts: parts.collect(),
        })
    }
}

impl Raster for Mosaic {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        out.fill(f64::NAN);
        let mut heights = Vec::new();
        // The last given first: what it leaves void, the others may fill.
        for part in self.parts.iter().rev() {
            let Some(shared) = part.shared(window) else {
                continue;
            };
            let places = || (0..shared.rows).map(|row| place(shared, window, row));
            if !places().any(|place| out[place].iter().any(|height| height.is_nan())) {
                continue;
            }
            heights.resize(shared.rows as usize * shared.columns as usize, 0.0);
            let own = Window {
                row: shared.row - part.row,
                column: shared.column - part.column,
                ..shared
            };
            part.raster.read(own, &mut heights)?;
            for (place, heights) in places().zip(heights.chunks_exact(shared.columns as usize)) {
                for (out, &height) in out[place].iter_mut().zip(heights) {
                    *out = if out.is_nan() { height } else { *out };
                }
            }
        }
        Ok(())
    }

    fn part_shape(&self) -> [u32; 2] {
        self.parts
            .first()
            .map_or([1, self.header.grid.columns], |part| {
                part.raster.part_shape()
            })
    }

    fn memory_bytes(&self) -> u64 {
        self.parts
            .iter()
            .map(|part| part.raster.memory_bytes())
            .sum()
    }

    fn read_bytes(&self, samples: u64) -> u64 {
        let parts = self.parts.iter();
        let most = parts.map(|part| part.raster.read_bytes(samples)).max();
        // Beside it, the heights of one of the rasters.
        samples * size_of::<f64>() as u64 + most.unwrap_or(0)
    }
}

impl Part {
    /// The samples it shares with a window, in the mosaic's rows and columns.
    fn shared(&self, window: Window) -> Option<Window> {
        let grid = &self.raster.header().grid;
        let row = self.row.max(window.row);
        let column = self.column.max(window.column);
        let row_end = (self.row + grid.rows).min(window.row + window.rows);
        let column_end = (self.column + grid.columns).min(window.column + window.columns);
        (row < row_end && column < column_end).then(|| Window {
            row,
            column,
            rows: row_end - row,
            columns: column_end - column,
        })
    }
}

/// The least row and column of the rasters in the first one's lattice, and the grid around all.
fn union(
    first: &RasterHeader,
    rasters: &[Box<dyn Raster>],
    places: &[[i64; 2]],
) -> Result<([i64; 2], Grid), DemError> {
    let (mut start, mut end) = ([i64::MAX; 2], [i64::MIN; 2]);
    for (raster, place) in rasters.iter().zip(places) {
        let grid = &raster.header().grid;
        for (axis, count) in [grid.rows, grid.columns].into_iter().enumerate() {
            start[axis] = start[axis].min(place[axis]);
            end[axis] = end[axis].max(place[axis] + i64::from(count));
        }
        if [0, 1]
            .iter()
            .any(|&axis| end[axis] - start[axis] > i64::from(MAX_SIDE))
        {
            let what = "they lie too far apart for one grid";
            return Err(mismatch(
                &first.source.name,
                &raster.header().source.name,
                what,
            ));
        }
    }
    let count = |axis: usize| u32::try_from(end[axis] - start[axis]).unwrap_or(MAX_SIDE);
    let grid = Grid {
        rows: count(0),
        columns: count(1),
        origin: first.grid.position(start[0] as f64, start[1] as f64),
        step: first.grid.step,
    };
    Ok((start, grid))
}

/// Where in a window's buffer a row of a smaller window lies.
fn place(shared: Window, window: Window, row: u32) -> std::ops::Range<usize> {
    let first = (shared.row - window.row + row) as usize * window.columns as usize;
    let first = first + (shared.column - window.column) as usize;
    first..first + shared.columns as usize
}

fn name(rasters: &[Box<dyn Raster>]) -> String {
    let first = &rasters[0].header().source.name;
    if rasters.len() == 1 {
        first.clone()
    } else {
        format!("{first} and {} more", rasters.len() - 1)
    }
}

fn mismatch(first: &str, second: &str, what: impl Into<String>) -> DemError {
    DemError::Mismatch {
        first: first.into(),
        second: second.into(),
        what: what.into(),
    }
}

fn check_fits(first: &RasterHeader, other: &RasterHeader, count: usize) -> Result<(), DemError> {
    if count > 1 && !other.georeferenced {
        let what = "it does not say where it lies, so it cannot be put beside others".into();
        return Err(DemError::Format {
            file: other.source.name.clone(),
            what,
        });
    }
    if !first.crs.same_as(&other.crs) {
        let what = format!(
            "their coordinate systems are {} and {}",
            first.crs.label(),
            other.crs.label()
        );
        return Err(mismatch(&first.source.name, &other.source.name, what));
    }
    for axis in [0, 1] {
        let (a, b) = (first.grid.step[axis], other.grid.step[axis]);
        let samples =
            [&first.grid, &other.grid].map(|grid| if axis == 0 { grid.columns } else { grid.rows });
        let drift = (a - b).abs() / a.abs() * f64::from(samples[0].max(samples[1]));
        if drift > LATTICE_TOLERANCE {
            let what = format!("their samples are {} and {} apart", a.abs(), b.abs());
            return Err(mismatch(&first.source.name, &other.source.name, what));
        }
    }
    Ok(())
}

/// Row and column of a raster's north-west sample in the first one's lattice.
fn lattice_place(first: &RasterHeader, other: &RasterHeader) -> Result<[i64; 2], DemError> {
    let place = first.grid.row_column(other.grid.origin);
    for value in place {
        if value.abs() > f64::from(u32::MAX) {
            return Err(mismatch(
                &first.source.name,
                &other.source.name,
                "they lie too far apart for one grid",
            ));
        }
        if (value - value.round()).abs() > LATTICE_TOLERANCE {
            let off = (value - value.round()).abs();
            let what = format!(
                "their samples do not lie on one lattice (off by {off:.3} of a step); resample one"
            );
            return Err(mismatch(&first.source.name, &other.source.name, what));
        }
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "within 32 bits, as was just checked"
    )]
    Ok(place.map(|value| value.round() as i64))
}
