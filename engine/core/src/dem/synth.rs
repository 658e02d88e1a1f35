//! Endless terrain that is computed: mountains with ridges, gullies and rubble, in place of a file.
//!
//! A height is a function of seed, row and column alone, so any window of any size is read in constant memory, and of
//! sums, products and square roots alone, so it has the same bits on every machine. Three layers, coarse to fine:
//!
//! 1. mountains: octaves of noise that count less where the octaves before them are steep, which leaves ridges sharp
//!    and valley floors smooth;
//! 2. gullies: waves that run down the slope of what is there so far, each octave down the slope of the one before, so
//!    that they branch;
//! 3. rubble: octaves of plain noise, more of it on steeper ground.
//!
//! Amplitudes halve from octave to octave, which gives a spectrum like that of real mountains.
//!
//! Based on: I. Quilez, "Value noise derivatives", 2008 (octaves damped by slope); C. John, "Eroded terrain noise",
//! 2018 (gullies as waves down the slope).

mod noise;

use self::noise::{gradient_noise, hash, wave_noise};
use super::{DemError, Raster, RasterHeader, SourceInfo, Window};
use crate::geo::{Crs, Grid};

/// Metres from sample to sample.
pub const SPACING: f64 = 10.0;

/// Samples across the largest mountains.
const MOUNTAIN: f64 = 4096.0;
/// Metres that one unit of the sum stands for, and of its middle.
const RELIEF: f64 = 5500.0;
const MIDDLE: f64 = 2000.0;
const MOUNTAIN_OCTAVES: u32 = 5;
/// How much steep ground damps the octaves after it.
const DAMPING: f64 = 0.9;
/// Cells across the largest gullies, as a share of a mountain, and their height.
const GULLY: f64 = MOUNTAIN / 14.0;
const GULLY_HEIGHT: f64 = 0.0135;
const GULLY_OCTAVES: u32 = 4;
/// The slope from which on gullies are at their deepest; peaks, ridges and valley floors have none.
const GULLY_SLOPE: f64 = 1.0;
/// How much of a gully's own slope turns the next ones: all of it would make them meander.
const GULLY_TURN: f64 = 0.65;
/// Samples across the coarsest rubble, and its height.
const RUBBLE: f64 = MOUNTAIN / 128.0;
const RUBBLE_HEIGHT: f64 = 0.7 / 128.0;
const RUBBLE_OCTAVES: u32 = 5;
const RUBBLE_GAIN: f64 = 0.5;

/// A window of the endless terrain of a seed: a raster like any other.
#[derive(Debug)]
pub struct Synth {
    header: RasterHeader,
    seed: u32,
    first: [u32; 2],
}

impl Synth {
    /// The samples of a window; windows of one seed agree where they overlap, and lie side by side on the map.
    ///
    /// # Errors
    /// [`DemError::Limit`] where the window is empty or reaches past 2²⁶ rows or columns.
    pub fn new(seed: u64, window: Window) -> Result<Self, DemError> {
        let name = format!("synth of seed {seed}");
        let limit = u64::from(super::header::MAX_SIDE);
        if window.sample_count() == 0 || window.row_end().max(window.column_end()) > limit {
            return Err(DemError::Limit {
                file: name,
                what: format!(
                    "a window of {} x {} samples at row {}, column {}",
                    window.rows, window.columns, window.row, window.column
                ),
                limit: format!("1 to {limit} rows and columns"),
            });
        }
        let grid = Grid {
            columns: window.columns,
            rows: window.rows,
            origin: [
                f64::from(window.column) * SPACING,
                f64::from(window.row) * -SPACING,
            ],
            step: [SPACING, -SPACING],
        };
        #[expect(clippy::cast_possible_truncation, reason = "both halves are mixed")]
        let seed = hash(seed as u32, (seed >> 32) as u32, 0);
        Ok(Self {
            header: RasterHeader {
                grid,
                crs: Crs::unknown(),
                integer: false,
                georeferenced: true,
                reading: name.clone(),
                source: SourceInfo { name, bytes: 0 },
            },
            seed,
            first: [window.row, window.column],
        })
    }
}

impl Raster for Synth {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        let [row, column] = [self.first[0] + window.row, self.first[1] + window.column];
        for (row, out) in (row..).zip(out.chunks_exact_mut(window.columns.max(1) as usize)) {
            for (column, height) in (column..).zip(out) {
                *height = self::height(self.seed, row, column);
            }
        }
        Ok(())
    }

    fn part_shape(&self) -> [u32; 2] {
        [1, 1]
    }

    fn memory_bytes(&self) -> u64 {
        0
    }
}

/// The height of a sample in metres, as a 32-bit number holds it.
fn height(seed: u32, row: u32, column: u32) -> f64 {
    let place = [f64::from(column), f64::from(row)];
    let mut ground = mountains(seed, place);
    add_gullies(&mut ground, seed, place);
    add_rubble(&mut ground, seed, place);
    #[expect(clippy::cast_possible_truncation, reason = "rounded on purpose")]
    let height = (MIDDLE + RELIEF * ground.height) as f32;
    f64::from(height)
}

/// Ground as it is so far; slopes are in heights a mountain's width, along x and y.
struct Ground {
    height: f64,
    slope: [f64; 2],
}

impl Ground {
    fn steepness(&self) -> f64 {
        let [x, y] = self.slope;
        // Not quite 0 on flat ground, whose direction is nobody's.
        (x * x + y * y + 1e-4).sqrt()
    }
}

/// One octave of noise after the other, each at half the size, turned by an angle whose cosine is 4/5, so that their
/// lattices never lie upon each other.
struct Octaves {
    place: [f64; 2],
    turn: [f64; 2],
}

impl Octaves {
    fn new(place: [f64; 2], size: f64) -> Self {
        Self {
            place: place.map(|at| at / size),
            turn: [1.0, 0.0],
        }
    }

    /// The next octave's value, and its slopes along x and y in its own cells.
    fn next(&mut self, seed: u32) -> (f64, [f64; 2]) {
        let (value, [a, b]) = gradient_noise(seed, self.place);
        let [cos, sin] = self.turn;
        let slope = [cos * a + sin * b, cos * b - sin * a];
        let [x, y] = self.place;
        self.place = [1.6 * x - 1.2 * y + 17.3, 1.2 * x + 1.6 * y - 9.1];
        self.turn = [0.8 * cos - 0.6 * sin, 0.8 * sin + 0.6 * cos];
        (value, slope)
    }
}

fn mountains(seed: u32, place: [f64; 2]) -> Ground {
    let mut octaves = Octaves::new(place, MOUNTAIN);
    let mut undamped = [0.0; 2];
    let mut ground = Ground {
        height: 0.0,
        slope: [0.0; 2],
    };
    let mut amplitude = 1.0;
    for octave in 0..MOUNTAIN_OCTAVES {
        let (value, slope) = octaves.next(seed.wrapping_add(octave));
        for (sum, slope) in undamped.iter_mut().zip(slope) {
            *sum += slope;
        }
        let [x, y] = undamped;
        let damping = 1.0 / (1.0 + DAMPING * (x * x + y * y));
        ground.height += amplitude * damping * value;
        for (sum, slope) in ground.slope.iter_mut().zip(slope) {
            *sum += damping * slope;
        }
        amplitude *= 0.5;
    }
    ground
}

fn add_gullies(ground: &mut Ground, seed: u32, place: [f64; 2]) {
    let (mut size, mut amplitude) = (GULLY, GULLY_HEIGHT);
    for octave in 0..GULLY_OCTAVES {
        let steepness = ground.steepness();
        let across = [-ground.slope[1] / steepness, ground.slope[0] / steepness];
        let seed = seed.wrapping_add(100 + octave);
        let (value, slope) = wave_noise(seed, place.map(|at| at / size), across);
        let depth = amplitude * smooth_step(steepness / GULLY_SLOPE);
        // Gullies cut in more than their ridges rise.
        ground.height += depth * (value - 0.3);
        let turn = GULLY_TURN * depth * slope * (MOUNTAIN / size);
        for (sum, across) in ground.slope.iter_mut().zip(across) {
            *sum += turn * across;
        }
        size *= 0.5;
        amplitude *= 0.5;
    }
}

fn add_rubble(ground: &mut Ground, seed: u32, place: [f64; 2]) {
    let mut octaves = Octaves::new(place, RUBBLE);
    let mut amplitude = RUBBLE_HEIGHT * (0.2 + 0.8 * ground.steepness().min(1.0));
    for octave in 0..RUBBLE_OCTAVES {
        let (value, _) = octaves.next(seed.wrapping_add(200 + octave));
        ground.height += amplitude * value;
        amplitude *= RUBBLE_GAIN;
    }
}

/// From 0 at 0 to 1 at 1, level at both ends.
fn smooth_step(t: f64) -> f64 {
    let t = t.min(1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests;
