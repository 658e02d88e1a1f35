//! A road cut: a level bed between creased edges, and banks up or down to the ground.
//!
//! ```text
//!  rim                           rim       a section, right to left
//!   ╲                            ╱
//!    ╲ bank                     ╱
//!     ▔▔▔▔▔▔▔▔▔▔bed▔▔▔▔▔▔▔▔▔▔▔▔▔           ▔ creased
//! ```

use super::super::error::CageError;
use super::super::faces::{Crease, Faces, Tags};
use super::super::topology::Cage;
use super::{GroundHeight, Path, check_lengths, ease, strip};

/// Lengths of a road cut, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Road {
    /// From edge to edge of the bed.
    pub width: f64,
    /// How deep the bed lies under the ground's mean along the road.
    pub depth: f64,
    /// Width of each bank in plan.
    pub bank: f64,
}

/// How sharp the edges of the bed are: they stay edges close up, and are round when touched.
const EDGE_SHARPNESS: f64 = 4.0;
/// Vertices across.
const ACROSS: u32 = 5;

/// A road along a path.
///
/// # Errors
/// [`CageError::Shape`] for lengths that are not greater than 0 and paths with too many steps.
pub fn road(path: &Path, lengths: &Road, ground: GroundHeight<'_>) -> Result<Cage, CageError> {
    let Road { width, depth, bank } = *lengths;
    check_lengths(&[("width", width), ("depth", depth), ("bank", bank)])?;
    let stations = path.stations(0.5 * (width + bank), 6)?;
    let profile = profile(path, &stations, ground);
    let taper = (0.25 * path.length()).min(4.0 * (width + bank));
    let mut positions = Vec::with_capacity(stations.len() * ACROSS as usize);
    for (&way, level) in stations.iter().zip(profile) {
        let cut = ease(way.min(path.length() - way) / taper);
        let bed = level - depth * cut;
        let half = 0.5 * width;
        for left in [-half - bank, -half, 0.0, half, half + bank] {
            let [x, y] = path.place(way, left);
            let z = if left.abs() > half {
                ground([x, y])
            } else {
                ground([x, y]) * (1.0 - cut) + bed * cut
            };
            positions.push([x, y, z]);
        }
    }
    let rows = stations.len() as u32;
    let edge = |column: u32| {
        (1..rows - 2).map(move |row| Crease {
            vertices: [row * ACROSS + column, (row + 1) * ACROSS + column],
            sharpness: EDGE_SHARPNESS,
        })
    };
    let tags = Tags {
        creases: edge(1).chain(edge(3)).collect(),
        ..Tags::default()
    };
    Cage::new(positions, Faces::quads(&strip(rows, ACROSS)), &tags)
}

/// The ground along the road, smoothed: the mean of a station and two on each side.
fn profile(path: &Path, stations: &[f64], ground: GroundHeight<'_>) -> Vec<f64> {
    let heights: Vec<f64> = stations
        .iter()
        .map(|&way| ground(path.place(way, 0.0)))
        .collect();
    let last = heights.len() - 1;
    let mean = |at: usize| {
        let near = &heights[at.saturating_sub(2)..=(at + 2).min(last)];
        near.iter().sum::<f64>() / near.len() as f64
    };
    (0..=last).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::boundary_loops;
    use super::super::flat;
    use super::*;

    #[test]
    fn a_road_lies_under_the_ground_between_its_banks_and_has_one_rim_on_it() {
        let path = Path::new(vec![[0.0, 0.0], [300.0, 0.0], [500.0, 150.0]]).unwrap();
        let lengths = Road {
            width: 12.0,
            depth: 6.0,
            bank: 10.0,
        };
        let cage = road(&path, &lengths, &flat).unwrap();
        let [low, high] = cage.bounds();
        assert_eq!((low[2], high[2]), (-6.0, 0.0));
        let loops = boundary_loops(cage.topology());
        assert_eq!(loops.len(), 1);
        assert!(
            loops[0]
                .iter()
                .all(|&v| cage.positions()[v as usize][2] == 0.0)
        );
        assert!(!cage.topology().tags().creases.is_empty());
    }
}
