//! USGS DEM (`.dem`): profiles from south to north as Fortran text in records of 1,024 bytes.
//!
//! Based on: USGS, Standards for Digital Elevation Models, part 2 (1998).

use super::bytes::Bytes;
use super::memory::{Memory, Parts, check_size};
use super::placement::Placement;
use super::samples::{Samples, Scaling};
use super::units::FOOT;
use super::{DemError, OpenOptions, Raster};
use crate::geo::{Crs, CrsKind, Ellipsoid};

/// Bytes of a record; the last four stay empty.
const RECORD: usize = 1024;
/// Bytes of a profile before its heights.
const PROFILE_HEAD: usize = 144;
/// Bytes of a height.
const FIELD: usize = 6;
/// Void.
const VOIDS: [f64; 2] = [-32767.0, -32766.0];
/// The most bytes of a file.
const MAX_FILE_BYTES: u64 = 1 << 30;

/// True when the bytes are a header record.
pub(super) fn matches(head: &[u8]) -> bool {
    head.len() >= RECORD
        && head.is_ascii()
        && integer(head, 150).is_some_and(|pattern| pattern == 1)
        && integer(head, 540).is_some_and(|sides| sides == 4)
        && integer(head, 858).is_some_and(|profiles| profiles > 0)
}

/// A profile: where it begins and its heights in stored units.
struct Profile {
    start: [f64; 2],
    heights: Vec<f64>,
}

/// Reads a model.
pub(super) fn open(bytes: &Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let file = bytes.whole(MAX_FILE_BYTES)?;
    let path = bytes.path();
    let damaged = |what: String| DemError::format(path, format!("USGS DEM: {what}"));
    let crs = read_crs(&file).map_err(|what| DemError::unsupported(path, what))?;
    let resolution = [816, 828, 840].map(|at| real(&file, at, 12).filter(|value| *value > 0.0));
    let [Some(dx), Some(dy), Some(dz)] = resolution else {
        return Err(damaged("no resolution at byte 817".into()));
    };
    let profiles = read_profiles(&file, dz).map_err(damaged)?;
    let (north, rows) = north_and_rows(&profiles, dy).map_err(damaged)?;
    check_size(path, profiles.len() as u64, rows.into(), 8)?;
    let samples = spread(&profiles, north, dy, rows).map_err(damaged)?;

    let is_whole = |height: &f64| height.is_nan() || height.fract() == 0.0;
    let unit = if integer(&file, 534) == Some(1) {
        FOOT
    } else {
        1.0
    };
    let angle = if crs.kind == CrsKind::Geographic {
        1.0 / 3600.0
    } else {
        1.0
    };
    let origin = [profiles[0].start[0], north].map(|place| place * angle);
    let parts = Parts {
        columns: u32::try_from(profiles.len()).unwrap_or(u32::MAX),
        rows,
        placement: Some(Placement {
            origin,
            step: [dx * angle, -dy * angle],
        }),
        crs,
        whole: samples.iter().all(is_whole),
        scaling: Scaling::new(options.nodata, options.scale.unwrap_or(unit), 0.0),
    };
    Memory::raster(bytes, options, parts, Samples::F64(samples))
}

/// The northmost sample of all profiles, and the rows from there to the southmost.
fn north_and_rows(profiles: &[Profile], dy: f64) -> Result<(f64, u32), String> {
    let end = |profile: &Profile| profile.start[1] + dy * (profile.heights.len() as f64 - 1.0);
    let north = profiles.iter().map(end).fold(f64::MIN, f64::max);
    let south = profiles
        .iter()
        .map(|profile| profile.start[1])
        .fold(f64::MAX, f64::min);
    let rows = ((north - south) / dy).round() + 1.0;
    if !(1.0..=1e6).contains(&rows) {
        return Err(format!("profiles from {south} to {north} in steps of {dy}"));
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 1 to a million"
    )]
    Ok((north, rows as u32))
}

/// The heights of profiles on a grid, a profile a column; void where a profile does not reach.
fn spread(profiles: &[Profile], north: f64, dy: f64, rows: u32) -> Result<Vec<f64>, String> {
    let columns = profiles.len();
    let mut samples = vec![f64::NAN; columns * rows as usize];
    for (column, profile) in profiles.iter().enumerate() {
        let start = (north - profile.start[1]) / dy;
        if (start - start.round()).abs() > 0.01 || !(0.0..f64::from(rows) - 0.5).contains(&start) {
            return Err(format!("profile {} does not lie on the grid", column + 1));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "less than the rows"
        )]
        let start = start.round() as usize;
        for (up, &height) in profile.heights.iter().enumerate().take(start + 1) {
            samples[(start - up) * columns + column] = height;
        }
    }
    Ok(samples)
}

fn read_profiles(file: &[u8], dz: f64) -> Result<Vec<Profile>, String> {
    let count = integer(file, 858)
        .and_then(|count| usize::try_from(count).ok())
        .unwrap_or(0);
    let mut profiles = Vec::new();
    let mut at = RECORD;
    for index in 1..=count {
        let truncated =
            || format!("truncated: profile {index} of {count} is missing or incomplete");
        let head = file
            .get(at..)
            .filter(|rest| rest.len() > PROFILE_HEAD)
            .ok_or_else(truncated)?;
        let rows = integer(head, 12)
            .and_then(|rows| usize::try_from(rows).ok())
            .ok_or_else(truncated)?;
        let numbers = [24, 48, 72].map(|at| real(head, at, 24));
        let [Some(x), Some(y), Some(datum)] = numbers else {
            return Err(format!("profile {index} does not say where it starts"));
        };
        // No more heights than the file has room for.
        if rows == 0 || rows > head.len() / FIELD {
            return Err(truncated());
        }
        let mut heights = Vec::with_capacity(rows);
        let mut field = PROFILE_HEAD;
        for _ in 0..rows {
            if field % RECORD + FIELD > RECORD - 4 {
                field = field.next_multiple_of(RECORD);
            }
            let stored = integer(head, field).ok_or_else(truncated)? as f64;
            heights.push(if VOIDS.contains(&stored) {
                f64::NAN
            } else {
                stored * dz + datum
            });
            field += FIELD;
        }
        profiles.push(Profile {
            start: [x, y],
            heights,
        });
        at += field.next_multiple_of(RECORD);
    }
    if profiles.is_empty() {
        Err("no profiles".into())
    } else {
        Ok(profiles)
    }
}

fn read_crs(file: &[u8]) -> Result<Crs, String> {
    let datum = file
        .get(890..892)
        .and_then(|field| str::from_utf8(field).ok())
        .and_then(|text| text.trim().parse().ok());
    let nad27 = Ellipsoid {
        semi_major: 6_378_206.4,
        inverse_flattening: 294.978_698_213_898,
    };
    let zone = integer(file, 162).unwrap_or(0);
    match (integer(file, 156), integer(file, 528)) {
        (Some(0), Some(3)) => {
            let code = match datum {
                Some(3) => Some("EPSG:4326"),
                Some(4) => Some("EPSG:4269"),
                None | Some(1) => Some("EPSG:4267"),
                _ => None,
            };
            let ellipsoid = if matches!(datum, None | Some(1)) {
                nad27
            } else {
                Ellipsoid::WGS84
            };
            Ok(Crs {
                kind: CrsKind::Geographic,
                code: code.map(Into::into),
                ellipsoid,
                ..Crs::unknown()
            })
        }
        (Some(1), Some(2)) => {
            let code = match datum {
                Some(3) if (1..=60).contains(&zone) => Some(format!("EPSG:{}", 32_600 + zone)),
                Some(4) if (1..=23).contains(&zone) => Some(format!("EPSG:{}", 26_900 + zone)),
                None | Some(1) if (1..=22).contains(&zone) => {
                    Some(format!("EPSG:{}", 26_700 + zone))
                }
                _ => None,
            };
            let name = Some(format!("UTM zone {zone}"));
            Ok(Crs {
                kind: CrsKind::Projected,
                code,
                name,
                ellipsoid: nad27,
                ..Crs::unknown()
            })
        }
        (system, unit) => Err(format!(
            "USGS DEM: reference system {system:?} in units {unit:?} (bytes 157, 529)"
        )),
    }
}

/// A whole number of six characters.
fn integer(record: &[u8], at: usize) -> Option<i64> {
    str::from_utf8(record.get(at..at + FIELD)?)
        .ok()?
        .trim()
        .parse()
        .ok()
}

/// A Fortran number, as `0.30D+02`.
fn real(record: &[u8], at: usize, len: usize) -> Option<f64> {
    let text = str::from_utf8(record.get(at..at + len)?)
        .ok()?
        .trim()
        .replace(['D', 'd'], "E");
    text.parse().ok().filter(|value: &f64| value.is_finite())
}
