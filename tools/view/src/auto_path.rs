//! A flight made from the terrain, for data sets that come without a path: once around, looking at the highest ground,
//! and never through a hill.

use std::f64::consts::TAU;

use anyhow::Result;
use drumlin_core::geo::{Extent, WorldFrame};

use crate::path::{DEFAULT_FOV_Y_DEGREES, Key, Path};

const KEY_COUNT: u32 = 13;
const SECONDS: f64 = 18.0;
/// Cameras looked at along a path when it is checked against the ground.
const CHECKED: u32 = 600;
const LIFTS: u32 = 40;
/// Samples a side of the coarse look at the ground.
const LOOKS: u32 = 48;

/// Heights by CRS coordinates; none where void or outside.
pub(crate) type Ground<'a> = &'a dyn Fn([f64; 2]) -> Option<f64>;

/// The keys of a flight over an extent of CRS coordinates.
pub(crate) fn auto_path(
    extent: &Extent,
    frame: &WorldFrame,
    ground: Ground<'_>,
) -> Result<Vec<Key>> {
    let [low, high] = [frame.to_world(extent.min), frame.to_world(extent.max)];
    let half = [
        0.5 * (high[0] - low[0]).abs(),
        0.5 * (high[1] - low[1]).abs(),
    ];
    let size = half[0].max(half[1]).max(1e-3);
    let survey = Survey::new(extent, ground);
    // Narrow strips still get a round flight: past their sides, at the height of the ground inside.
    let reach = half.map(|half| half.max(0.3 * size));
    let clearance = 0.1 * size + 0.3 * (survey.highest - survey.lowest);
    let middle = frame.to_world(extent.center());
    let summit = frame.to_world(survey.summit);
    let focus = [0, 1].map(|i| 0.5 * (middle[i] + summit[i]));
    let mut keys: Vec<Key> = (0..KEY_COUNT)
        .map(|index| {
            let part = f64::from(index) / f64::from(KEY_COUNT - 1);
            let (sin, cos) = (TAU * (0.9 * part + 0.5)).sin_cos();
            let radius = 0.9 - 0.35 * (TAU * 0.5 * part).sin();
            let eye = frame.to_crs([
                middle[0] + radius * reach[0] * sin,
                middle[1] + radius * reach[1] * cos,
            ]);
            let target = frame.to_crs(focus);
            let low = ground(eye).unwrap_or(survey.lowest);
            let aim = ground(target).unwrap_or(0.5 * (survey.lowest + survey.highest));
            Key {
                t: SECONDS * part,
                position: [eye[0], eye[1], low + clearance],
                look_at: [target[0], target[1], aim],
                fov_y: DEFAULT_FOV_Y_DEGREES,
            }
        })
        .collect();
    lift(&mut keys, frame, ground, 0.5 * clearance)?;
    Ok(keys)
}

/// Raises keys until the path keeps its distance from the ground everywhere.
fn lift(keys: &mut [Key], frame: &WorldFrame, ground: Ground<'_>, clearance: f64) -> Result<()> {
    for _ in 0..LIFTS {
        let lacks = lacking(
            &Path::new(keys, frame)?,
            keys.len(),
            frame,
            ground,
            clearance,
        );
        if lacks.iter().all(|&lack| lack == 0.0) {
            break;
        }
        for (key, lack) in keys.iter_mut().zip(lacks) {
            key.position[2] += 1.25 * lack;
        }
    }
    Ok(())
}

/// How many metres the path is too low around each of its keys.
fn lacking(
    path: &Path,
    keys: usize,
    frame: &WorldFrame,
    ground: Ground<'_>,
    clearance: f64,
) -> Vec<f64> {
    let mut lacks = vec![0.0_f64; keys];
    for index in 0..=CHECKED {
        let part = f64::from(index) / f64::from(CHECKED);
        let eye = path.camera(part * path.seconds()).eye;
        let Some(height) = ground(frame.to_crs([eye.x, eye.y])) else {
            continue;
        };
        let lack = (height + clearance - eye.z).max(0.0);
        let place = index as usize * (keys - 1);
        for key in [place / CHECKED as usize, place.div_ceil(CHECKED as usize)] {
            lacks[key] = lacks[key].max(lack);
        }
    }
    lacks
}

/// What a coarse look at the ground finds.
struct Survey {
    lowest: f64,
    highest: f64,
    /// CRS coordinates of the highest place.
    summit: [f64; 2],
}

impl Survey {
    fn new(extent: &Extent, ground: Ground<'_>) -> Self {
        let mut survey = Self {
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            summit: extent.center(),
        };
        for index in 0..LOOKS * LOOKS {
            let part = |i: u32| (f64::from(i) + 0.5) / f64::from(LOOKS);
            let at = [
                extent.min[0] + part(index % LOOKS) * (extent.max[0] - extent.min[0]),
                extent.min[1] + part(index / LOOKS) * (extent.max[1] - extent.min[1]),
            ];
            let Some(height) = ground(at) else { continue };
            survey.lowest = survey.lowest.min(height);
            if height > survey.highest {
                (survey.highest, survey.summit) = (height, at);
            }
        }
        if survey.lowest > survey.highest {
            (survey.lowest, survey.highest) = (0.0, 0.0);
        }
        survey
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent {
        min: [0.0, 0.0],
        max: [1000.0, 600.0],
    };
    const FRAME: WorldFrame = WorldFrame {
        world_from_crs: [[1.0, 0.0, -500.0], [0.0, 1.0, -300.0]],
    };

    #[test]
    fn the_flight_never_meets_the_ground() {
        let hills = |[x, y]: [f64; 2]| {
            EXTENT
                .contains([x, y])
                .then(|| 200.0 * (x / 40.0).sin() * (y / 55.0).cos() + 0.3 * x)
        };
        let keys = auto_path(&EXTENT, &FRAME, &hills).unwrap();
        let path = Path::new(&keys, &FRAME).unwrap();
        for step in 0..2000 {
            let eye = path.camera(path.seconds() * f64::from(step) / 2000.0).eye;
            let ground = hills(FRAME.to_crs([eye.x, eye.y])).unwrap_or(f64::NEG_INFINITY);
            assert!(eye.z > ground, "{step}: {eye} under {ground}");
        }
    }

    #[test]
    fn a_data_set_of_voids_and_one_of_one_sample_still_fly() {
        let point = Extent {
            min: [3.0, 4.0],
            max: [3.0, 4.0],
        };
        for extent in [EXTENT, point] {
            let keys = auto_path(&extent, &FRAME, &|_| None).unwrap();
            assert!(Path::new(&keys, &FRAME).is_ok());
        }
    }
}
