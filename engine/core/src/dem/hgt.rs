//! SRTM tiles (`.hgt`): a square degree of big-endian 16-bit metres, its place in its name.

use super::bytes::Bytes;
use super::error::file_name;
use super::memory::Parts;
use super::placement::Placement;
use super::plain::{Plain, Rows};
use super::samples::{SampleType, Scaling};
use super::{DemError, OpenOptions, Raster};
use crate::geo::Crs;

/// SRTM's mark for void.
const VOID: f64 = -32768.0;

/// Columns and rows of the tiles there are: 1″, 3″, 30″, and 1″ with columns 2″ apart near the poles.
const SIZES: [(u32, u32); 4] = [(3601, 3601), (1201, 1201), (121, 121), (1801, 3601)];

/// Opens a tile.
pub(super) fn open(bytes: Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let size =
        |&(columns, rows): &(u32, u32)| u64::from(columns) * u64::from(rows) * 2 == bytes.len();
    let Some(&(columns, rows)) = SIZES.iter().find(|pair| size(pair)) else {
        let what = format!(
            "{} bytes are no SRTM tile of 3601, 1201 or 121 samples a side",
            bytes.len()
        );
        return Err(DemError::format(bytes.path(), what));
    };
    let Some([south, west]) = place(&file_name(bytes.path())) else {
        let what = "an SRTM tile's place is in its name, as in N46W122.hgt; this name has none";
        return Err(DemError::format(bytes.path(), what));
    };
    let step = [columns, rows].map(|count| 1.0 / f64::from(count - 1));
    let placement = Placement {
        origin: [west, south + 1.0],
        step: [step[0], -step[1]],
    };
    let parts = Parts {
        columns,
        rows,
        placement: Some(placement),
        crs: Crs::wgs84(),
        whole: true,
        scaling: Scaling::new(
            options.nodata.or(Some(VOID)),
            options.scale.unwrap_or(1.0),
            0.0,
        ),
    };
    let rows = Rows {
        offset: 0,
        stride: u64::from(columns) * 2,
        kind: SampleType::I16,
        big_endian: true,
    };
    Plain::raster(bytes, options, parts, rows)
}

/// Latitude and longitude of the south-west corner, from a name as `N46W122.hgt` or `s05e010.SRTMGL1.hgt`.
fn place(name: &str) -> Option<[f64; 2]> {
    let name = name.to_ascii_uppercase();
    let latitude: u8 = name.get(1..3)?.parse().ok()?;
    let longitude: u8 = name.get(4..7)?.parse().ok()?;
    let sign = |at: usize, plus: u8, minus: u8| match *name.as_bytes().get(at)? {
        letter if letter == plus => Some(1.0),
        letter if letter == minus => Some(-1.0),
        _ => None,
    };
    let place = [
        sign(0, b'N', b'S')? * f64::from(latitude),
        sign(3, b'E', b'W')? * f64::from(longitude),
    ];
    (latitude <= 90 && longitude <= 180).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_s_place_is_in_its_name() {
        assert_eq!(place("N46W122.hgt"), Some([46.0, -122.0]));
        assert_eq!(place("s05e010.SRTMGL1.hgt"), Some([-5.0, 10.0]));
        for name in [
            "rainier.hgt",
            "N4",
            "X46W122.hgt",
            "N99W122.hgt",
            "ÄN46W122",
        ] {
            assert_eq!(place(name), None, "{name}");
        }
    }
}
