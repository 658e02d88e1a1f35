//! A camera path: keys with a time, a place and a place looked at, and a smooth way between them.
//!
//! Files are JSON: `{"keys": [{"t": s, "position": [x, y, z], "look_at": [x, y, z], "fov_y": degrees}]}`, x and y in
//! CRS coordinates, z in metres of height.
//!
//! Between keys every coordinate follows a cubic with one tangent a key (Catmull-Rom, with the keys' own times), so that
//! places and velocities are continuous.

use std::path::Path as FilePath;

use anyhow::{Context, Result, bail, ensure};
use drumlin_core::geo::WorldFrame;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;

/// Degrees, where a key says nothing.
pub(crate) const DEFAULT_FOV_Y_DEGREES: f64 = 50.0;

/// One key of a path file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Key {
    /// Seconds.
    pub(crate) t: f64,
    /// CRS x, CRS y, metres of height.
    pub(crate) position: [f64; 3],
    /// Likewise.
    pub(crate) look_at: [f64; 3],
    /// Vertical field of view in degrees.
    #[serde(default = "default_fov_y")]
    pub(crate) fov_y: f64,
}

/// A path in the world of a data set.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    times: Vec<f64>,
    /// Eye, target and field of view a key.
    values: Vec<[f64; 7]>,
}

#[derive(Serialize, Deserialize)]
struct PathFile {
    keys: Vec<Key>,
}

impl Path {
    /// Checks keys and lays them out in the world.
    pub(crate) fn new(keys: &[Key], frame: &WorldFrame) -> Result<Self> {
        check_all(keys)?;
        let place = |[x, y, z]: [f64; 3]| {
            let [x, y] = frame.to_world([x, y]);
            [x, y, z]
        };
        let values = keys.iter().map(|key| {
            let ([a, b, c], [d, e, f]) = (place(key.position), place(key.look_at));
            [a, b, c, d, e, f, key.fov_y]
        });
        Ok(Self {
            times: keys.iter().map(|key| key.t).collect(),
            values: values.collect(),
        })
    }

    /// Seconds from the first key to the last.
    pub(crate) fn seconds(&self) -> f64 {
        self.times[self.times.len() - 1] - self.times[0]
    }

    /// The camera some seconds after the first key; the ends hold.
    pub(crate) fn camera(&self, seconds: f64) -> Camera {
        let [a, b, c, d, e, f, fov_y] = self.value(self.times[0] + seconds);
        Camera::look_at(
            DVec3::new(a, b, c),
            DVec3::new(d, e, f),
            fov_y.clamp(1.0, 170.0),
        )
    }

    fn value(&self, t: f64) -> [f64; 7] {
        let last = self.times.len() - 1;
        let after = self.times.partition_point(|&time| time <= t);
        if after == 0 || after > last {
            return self.values[after.min(last)];
        }
        let before = after - 1;
        let span = self.times[after] - self.times[before];
        let u = (t - self.times[before]) / span;
        let (p, q) = (self.values[before], self.values[after]);
        let (v, w) = (self.tangent(before), self.tangent(after));
        // The cubic Hermite basis.
        let [h00, h10] = [
            (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u),
            u * (1.0 - u) * (1.0 - u),
        ];
        let [h01, h11] = [u * u * (3.0 - 2.0 * u), u * u * (u - 1.0)];
        std::array::from_fn(|i| h00 * p[i] + h10 * span * v[i] + h01 * q[i] + h11 * span * w[i])
    }

    /// Velocity at a key: of the parabola through it and its neighbours; at rest at both ends.
    fn tangent(&self, key: usize) -> [f64; 7] {
        if key == 0 || key + 1 == self.times.len() {
            return [0.0; 7];
        }
        let [before, here, after] = [key - 1, key, key + 1];
        let (s, t) = (
            self.times[here] - self.times[before],
            self.times[after] - self.times[here],
        );
        let (p, q, r) = (self.values[before], self.values[here], self.values[after]);
        std::array::from_fn(|i| (t * (q[i] - p[i]) / s + s * (r[i] - q[i]) / t) / (s + t))
    }
}

/// Reads the keys of a path file.
pub(crate) fn read(file: &FilePath) -> Result<Vec<Key>> {
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("{}: reading failed", file.display()))?;
    parse(&text).with_context(|| format!("{}: not a path", file.display()))
}

fn parse(text: &str) -> Result<Vec<Key>> {
    let file: PathFile = serde_json::from_str(text)?;
    check_all(&file.keys)?;
    Ok(file.keys)
}

/// The text of a path file.
pub(crate) fn to_json(keys: &[Key]) -> Result<String> {
    Ok(serde_json::to_string_pretty(&PathFile {
        keys: keys.to_vec(),
    })?)
}

fn check_all(keys: &[Key]) -> Result<()> {
    ensure!(!keys.is_empty(), "it has no keys; at least one is needed");
    for (index, key) in keys.iter().enumerate() {
        check(key).with_context(|| format!("key {index}"))?;
    }
    if let Some(index) = keys.windows(2).position(|pair| pair[1].t <= pair[0].t) {
        let (before, after) = (keys[index].t, keys[index + 1].t);
        bail!(
            "key {}: its t = {after} does not come after t = {before} of the key before",
            index + 1
        );
    }
    Ok(())
}

fn check(key: &Key) -> Result<()> {
    let numbers = [&[key.t, key.fov_y], &key.position[..], &key.look_at[..]].concat();
    ensure!(
        numbers.iter().all(|number| number.is_finite()),
        "a number is not finite"
    );
    ensure!(
        key.position != key.look_at,
        "position and look_at are the same place"
    );
    ensure!(
        (1.0..=170.0).contains(&key.fov_y),
        "fov_y is {}, not from 1 to 170 degrees",
        key.fov_y
    );
    Ok(())
}

const fn default_fov_y() -> f64 {
    DEFAULT_FOV_Y_DEGREES
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: WorldFrame = WorldFrame {
        world_from_crs: [[2.0, 0.0, -10.0], [0.0, 3.0, 1.0]],
    };

    fn key(t: f64, x: f64) -> Key {
        Key {
            t,
            position: [x, 0.0, 5.0],
            look_at: [x, 10.0, 0.0],
            fov_y: 40.0,
        }
    }

    #[test]
    fn keys_are_met_in_world_metres() {
        let path = Path::new(&[key(1.0, 5.0), key(2.0, 7.0), key(5.0, 4.0)], &FRAME).unwrap();
        assert_eq!(path.seconds(), 4.0);
        assert_eq!(path.camera(0.0).eye, DVec3::new(0.0, 1.0, 5.0));
        assert_eq!(path.camera(1.0).eye, DVec3::new(4.0, 1.0, 5.0));
        assert_eq!(path.camera(99.0).eye, DVec3::new(-2.0, 1.0, 5.0));
    }

    #[test]
    fn velocity_is_continuous_at_keys() {
        let path = Path::new(
            &[key(0.0, 0.0), key(1.0, 7.0), key(3.0, 4.0), key(3.5, 9.0)],
            &FRAME,
        )
        .unwrap();
        for t in [1.0, 3.0] {
            let h = 1e-6;
            let speed = |a: f64, b: f64| (path.camera(b).eye - path.camera(a).eye) / (b - a);
            assert!((speed(t - h, t) - speed(t, t + h)).length() < 1e-3);
        }
    }

    #[test]
    fn one_key_stands_still() {
        let path = Path::new(&[key(3.0, 1.0)], &FRAME).unwrap();
        assert_eq!(path.seconds(), 0.0);
        assert_eq!(path.camera(0.0), path.camera(8.0));
    }

    #[test]
    fn bad_paths_are_one_clear_error() {
        let text = |text: &str| format!("{:#}", parse(text).unwrap_err());
        assert!(text("{\"keys\": []}").contains("no keys"));
        assert!(text("{}").contains("keys"));
        assert!(text("keys").contains("line 1"));
        let bad = |keys: &[Key]| format!("{:#}", Path::new(keys, &FRAME).unwrap_err());
        assert!(bad(&[key(1.0, 0.0), key(1.0, 1.0)]).contains("key 1"));
        assert!(bad(&[key(f64::NAN, 0.0)]).contains("finite"));
        assert!(
            bad(&[Key {
                look_at: [0.0, 0.0, 5.0],
                ..key(0.0, 0.0)
            }])
            .contains("same place")
        );
        assert!(
            bad(&[Key {
                fov_y: 0.0,
                ..key(0.0, 0.0)
            }])
            .contains("fov_y")
        );
    }

    #[test]
    fn a_written_path_reads_back() {
        let keys = [key(0.0, 0.25), key(1.0, 1.0 / 3.0)];
        let file: PathFile = serde_json::from_str(&to_json(&keys).unwrap()).unwrap();
        assert_eq!(file.keys, keys);
    }
}
