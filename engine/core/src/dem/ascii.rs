//! ESRI ASCII grids (`.asc`): a few lines of header, then heights as text, north row first.

use std::path::Path;
use std::str::SplitAsciiWhitespace;

use super::bytes::Bytes;
use super::memory::{Memory, Parts, check_size};
use super::placement::Placement;
use super::samples::{Samples, Scaling};
use super::{DemError, OpenOptions, Raster, wkt};

/// The most bytes of a file.
const MAX_FILE_BYTES: u64 = 1 << 31;
/// Void where the header does not say.
const DEFAULT_VOID: f64 = -9999.0;

/// True when the bytes begin like the header of a grid.
pub(super) fn matches(head: &[u8]) -> bool {
    let text: Vec<u8> = head
        .trim_ascii_start()
        .iter()
        .take(5)
        .map(u8::to_ascii_lowercase)
        .collect();
    text == b"ncols" || text == b"nrows"
}

/// The lines of a header.
#[derive(Debug, Default)]
struct Header {
    columns: Option<u32>,
    rows: Option<u32>,
    /// West and south, and whether they are those of the corner's sample and not of the corner.
    west: Option<(f64, bool)>,
    south: Option<(f64, bool)>,
    step: [Option<f64>; 2],
    nodata: Option<f64>,
}

/// Reads a grid.
pub(super) fn open(bytes: &Bytes, options: &OpenOptions) -> Result<Box<dyn Raster>, DemError> {
    let file = bytes.whole(MAX_FILE_BYTES)?;
    let text = str::from_utf8(&file).map_err(|error| {
        DemError::format(
            bytes.path(),
            format!("byte {} is not text", error.valid_up_to()),
        )
    })?;
    let path = bytes.path();
    let (header, words) = Header::read(text).map_err(|what| DemError::format(path, what))?;
    let missing = |what: &str| DemError::format(path, format!("the header has no {what}"));
    let columns = header.columns.ok_or_else(|| missing("ncols"))?;
    let rows = header.rows.ok_or_else(|| missing("nrows"))?;
    check_size(path, columns.into(), rows.into(), 8)?;
    let count = u64::from(columns) * u64::from(rows);
    // A digit and a space each: so no memory is taken for heights that cannot be there.
    if count > file.len() as u64 / 2 + 1 {
        let what = format!(
            "{} bytes cannot hold {columns} x {rows} heights",
            file.len()
        );
        return Err(DemError::format(path, what));
    }
    let heights = read_heights(path, words, count)?;
    let placement = header
        .placement(rows)
        .map_err(|what| DemError::format(path, what))?;
    let nodata = options.nodata.or(header.nodata).unwrap_or(DEFAULT_VOID);
    let scaling = Scaling::new(Some(nodata), options.scale.unwrap_or(1.0), 0.0);
    let whole = heights
        .iter()
        .all(|height| height.fract() == 0.0 || scaling.height(*height).is_nan());
    let parts = Parts {
        columns,
        rows,
        placement: Some(placement),
        crs: wkt::beside(path)?,
        whole,
        scaling,
    };
    Memory::raster(bytes, options, parts, Samples::F64(heights))
}

fn read_heights(
    path: &Path,
    words: SplitAsciiWhitespace<'_>,
    count: u64,
) -> Result<Vec<f64>, DemError> {
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let mut heights = Vec::with_capacity(count);
    for word in words.take(count) {
        let height = word.parse().map_err(|_| {
            let word: String = word.chars().take(20).collect();
            DemError::format(
                path,
                format!("height {} is {word:?}, not a number", heights.len() + 1),
            )
        })?;
        heights.push(height);
    }
    if heights.len() < count {
        let what = format!("truncated: {} heights of {count}", heights.len());
        return Err(DemError::format(path, what));
    }
    Ok(heights)
}

impl Header {
    /// The header, and the words after it.
    fn read(text: &str) -> Result<(Self, SplitAsciiWhitespace<'_>), String> {
        let mut header = Self::default();
        let mut words = text.split_ascii_whitespace();
        loop {
            let rest = words.clone();
            let Some(key) = words.next() else {
                return Ok((header, rest));
            };
            if !key.starts_with(|first: char| first.is_ascii_alphabetic())
                || key.eq_ignore_ascii_case("nan")
            {
                return Ok((header, rest));
            }
            let value = words.next().unwrap_or("");
            let number = value.parse::<f64>().ok();
            let number =
                number.ok_or_else(|| format!("header line {key} says {value:?}, not a number"))?;
            let count = || {
                value
                    .parse::<u32>()
                    .map_err(|_| format!("header line {key} says {value:?}"))
            };
            match key.to_ascii_lowercase().as_str() {
                "ncols" => header.columns = Some(count()?),
                "nrows" => header.rows = Some(count()?),
                "xllcorner" => header.west = Some((number, false)),
                "xllcenter" => header.west = Some((number, true)),
                "yllcorner" => header.south = Some((number, false)),
                "yllcenter" => header.south = Some((number, true)),
                "cellsize" => header.step = [Some(number); 2],
                "dx" => header.step[0] = Some(number),
                "dy" => header.step[1] = Some(number),
                "nodata_value" | "nodata" => header.nodata = Some(number),
                _ => return Err(format!("header line {key:?} is not known")),
            }
        }
    }

    fn placement(&self, rows: u32) -> Result<Placement, String> {
        let [Some(x), Some(y)] = self.step else {
            return Err("the header has no cellsize".into());
        };
        let (Some(west), Some(south)) = (self.west, self.south) else {
            return Err("the header has no xllcorner and yllcorner".into());
        };
        let sample = |(edge, is_sample): (f64, bool), step: f64| {
            if is_sample { edge } else { edge + 0.5 * step }
        };
        let north = sample(south, y) + y * f64::from(rows.saturating_sub(1));
        Ok(Placement {
            origin: [sample(west, x), north],
            step: [x, -y],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_centres_are_told_apart() {
        for (kind, west) in [("corner", 5.0), ("center", 0.0)] {
            let text =
                format!("NCOLS 2\nnrows 3\nxll{kind} 0\nyll{kind} 100\ncellsize 10\n1 2 3 4 5 6");
            let (header, words) = Header::read(&text).expect("a header");
            let placement = header.placement(3).expect("placed");
            assert_eq!(
                placement,
                Placement {
                    origin: [west, 120.0 + west],
                    step: [10.0, -10.0]
                }
            );
            assert_eq!(words.count(), 6);
        }
    }

    #[test]
    fn a_header_that_says_nonsense_is_refused() {
        for text in ["ncols x", "ncols", "ncols -3", "colour red 1"] {
            assert!(Header::read(text).is_err(), "{text}");
        }
    }
}
