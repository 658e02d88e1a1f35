//! DTED levels 0 to 2 (`.dt0`, `.dt1`, `.dt2`): columns from the west, each from the south, in signed magnitude.
//!
//! Based on: MIL-PRF-89020B.

use super::bytes::Bytes;
use super::memory::{Memory, Parts, check_size};
use super::placement::Placement;
use super::samples::{Samples, Scaling};
use super::{DemError, OpenOptions, Raster};
use crate::geo::Crs;

/// Void.
const VOID: f64 = -32767.0;
/// Bytes of the three headers together.
const HEADER_BYTES: usize = 80 + 648 + 2700;
/// Bytes of a column before and after its heights.
const COLUMN_HEAD: usize = 8;
const COLUMN_TAIL: usize = 4;

/// True when the bytes begin like a DTED file.
pub(super) fn matches(head: &[u8]) -> bool {
    head.starts_with(b"UHL1")
}

/// Reads a cell.
pub(super) fn open(bytes: &Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let damaged = |what: &str| DemError::format(bytes.path(), format!("DTED: {what}"));
    let head = bytes.head(80)?;
    let number = |first: usize, count: usize| -> Result<u32, DemError> {
        let text = head
            .get(first..first + count)
            .and_then(|field| str::from_utf8(field).ok());
        let number = text.and_then(|text| text.trim().parse().ok());
        number.ok_or_else(|| damaged(&format!("no number at byte {first} of the header")))
    };
    let angle = |first: usize| angle(head.get(first..first + 8)?);
    let (Some(west), Some(south)) = (angle(4), angle(12)) else {
        return Err(damaged("no origin in the header"));
    };
    // Tenths of seconds.
    let step = [number(20, 4)?, number(24, 4)?].map(|tenths| f64::from(tenths) / 36_000.0);
    let (columns, rows) = (number(47, 4)?, number(51, 4)?);
    check_size(bytes.path(), columns.into(), rows.into(), 2)?;
    let column_bytes = COLUMN_HEAD + rows as usize * 2 + COLUMN_TAIL;
    let needed = HEADER_BYTES + columns as usize * column_bytes;
    if (needed as u64) > bytes.len() {
        return Err(damaged(&format!(
            "truncated: {columns} x {rows} heights need {needed} bytes"
        )));
    }
    let file = bytes.head(needed as u64)?;
    let (width, height) = (columns as usize, rows as usize);
    let mut heights = vec![0; width * height];
    for (column, data) in file[HEADER_BYTES..].chunks_exact(column_bytes).enumerate() {
        let (stored, _) = data[COLUMN_HEAD..column_bytes - COLUMN_TAIL].as_chunks();
        for (row, &value) in stored.iter().enumerate() {
            heights[(height - 1 - row) * width + column] =
                signed_magnitude(u16::from_be_bytes(value));
        }
    }
    let north = south + step[1] * f64::from(rows.saturating_sub(1));
    let parts = Parts {
        columns,
        rows,
        placement: Some(Placement {
            origin: [west, north],
            step: [step[0], -step[1]],
        }),
        crs: Crs::wgs84(),
        whole: true,
        scaling: Scaling::new(
            options.nodata.or(Some(VOID)),
            options.scale.unwrap_or(1.0),
            0.0,
        ),
    };
    Memory::raster(bytes, options, parts, Samples::I16(heights))
}

/// A height whose first bit is its sign; some writers use two's complement, told by depths no sea has.
fn signed_magnitude(stored: u16) -> i16 {
    let magnitude = i32::from(stored & 0x7fff);
    let value = match (stored >> 15, magnitude) {
        (0, _) => magnitude,
        (_, 0x7fff) => -32767,
        (_, 12_001..) => i32::from(stored) - 0x1_0000,
        _ => -magnitude,
    };
    i16::try_from(value).unwrap_or(-32767)
}

/// Degrees of `DDDMMSSH`.
fn angle(field: &[u8]) -> Option<f64> {
    let text = str::from_utf8(field).ok()?;
    let number =
        |first: usize, count: usize| text.get(first..first + count)?.trim().parse::<u16>().ok();
    let degrees = f64::from(number(0, 3)?)
        + f64::from(number(3, 2)?) / 60.0
        + f64::from(number(5, 2)?) / 3600.0;
    match field.get(7)? {
        b'N' | b'E' => Some(degrees),
        b'S' | b'W' => Some(-degrees),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_below_the_sea_are_read_in_both_ways() {
        assert_eq!(signed_magnitude(0x8005), -5);
        assert_eq!(signed_magnitude(0xfffb), -5);
        assert_eq!(signed_magnitude(0xffff), -32767);
        assert_eq!(signed_magnitude(0x1000), 4096);
    }

    #[test]
    fn angles_are_degrees_minutes_seconds() {
        assert_eq!(angle(b"0793000W"), Some(-79.5));
        assert_eq!(angle(b"0430000N"), Some(43.0));
        assert_eq!(angle(b"04x0000N"), None);
    }
}
