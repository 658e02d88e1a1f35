//! Plain numbers with a header beside them: ESRI `.flt` and `.bil` with `.hdr`, and ENVI's `.hdr`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::bytes::Bytes;
use super::memory::Parts;
use super::placement::Placement;
use super::plain::{Plain, Rows};
use super::samples::{SampleType, Scaling};
use super::{DemError, OpenOptions, Raster, wkt};
use crate::geo::{Crs, CrsKind};

/// Bytes a header may have.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// The header beside a file of plain numbers, if there is one.
pub(super) fn header_beside(path: &Path) -> Option<PathBuf> {
    let longer = path
        .extension()
        .map(|extension| format!("{}.hdr", extension.to_string_lossy()));
    let candidates = [Some("hdr".to_owned()), Some("HDR".to_owned()), longer];
    let mut candidates = candidates
        .iter()
        .flatten()
        .map(|ending| path.with_extension(ending));
    candidates.find(|candidate| candidate.is_file() && candidate != path)
}

/// Opens a raster by the header beside it.
pub(super) fn open(
    bytes: Bytes,
    header: &Path,
    options: &OpenOptions,
) -> Result<Box<dyn Raster>, DemError> {
    let file = File::open(header).map_err(|error| DemError::io(header, error))?;
    let mut text = Vec::new();
    file.take(MAX_HEADER_BYTES)
        .read_to_end(&mut text)
        .map_err(|error| DemError::io(header, error))?;
    let text = String::from_utf8_lossy(&text);
    let beside = wkt::beside(bytes.path())?;
    let described = if text.trim_start().starts_with("ENVI") {
        Fields::envi(&text).describe_envi(beside)
    } else {
        Fields::esri(&text).describe_esri(beside)
    };
    let (mut parts, rows) = described.map_err(|what| DemError::format(header, what))?;
    parts.scaling = Scaling::new(
        options.nodata.or(parts.scaling.nodata),
        options.scale.unwrap_or(1.0),
        0.0,
    );
    Plain::raster(bytes, options, parts, rows)
}

/// Keys (in lower case) and values of a header.
struct Fields(BTreeMap<String, String>);

impl Fields {
    /// Lines of `KEY value`.
    fn esri(text: &str) -> Self {
        let line = |line: &str| {
            let (key, value) = line.trim().split_once(|c: char| c.is_ascii_whitespace())?;
            Some((key.to_ascii_lowercase(), value.trim().to_ascii_lowercase()))
        };
        Self(text.lines().filter_map(line).collect())
    }

    /// Lines of `key = value`, where a value in braces may go over several lines.
    fn envi(text: &str) -> Self {
        let mut fields = BTreeMap::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('=') {
            let key = before
                .lines()
                .last()
                .unwrap_or("")
                .trim()
                .to_ascii_lowercase();
            let after = after.trim_start_matches([' ', '\t']);
            let (value, next) = match after.strip_prefix('{') {
                Some(inner) => inner.split_once('}').unwrap_or((inner, "")),
                None => after.split_once('\n').unwrap_or((after, "")),
            };
            fields.insert(key, value.trim().to_owned());
            rest = next;
        }
        Self(fields)
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, String> {
        let parse = |text: &str| {
            text.parse()
                .map_err(|_| format!("{key} is {text:?}, not a number"))
        };
        self.text(key).map(parse).transpose()
    }

    fn count(&self, key: &str) -> Result<Option<u32>, String> {
        let parse = |text: &str| {
            text.parse()
                .map_err(|_| format!("{key} is {text:?}, not a count"))
        };
        self.text(key).map(parse).transpose()
    }

    fn require(&self, key: &str) -> Result<u32, String> {
        self.count(key)?.ok_or_else(|| format!("{key} is missing"))
    }

    fn one_band(&self, key: &str) -> Result<(), String> {
        match self.count(key)?.unwrap_or(1) {
            1 => Ok(()),
            bands => Err(format!("{bands} bands; an elevation model has one")),
        }
    }

    fn describe_esri(&self, crs: Crs) -> Result<(Parts, Rows), String> {
        self.one_band("nbands")?;
        let (columns, rows) = (self.require("ncols")?, self.require("nrows")?);
        // A float grid's header says nothing of bits.
        let is_float_grid = self.text("nbits").is_none() && self.text("cellsize").is_some();
        let bits = self
            .count("nbits")?
            .unwrap_or(if is_float_grid { 32 } else { 16 });
        let is_float = is_float_grid || self.text("pixeltype") == Some("float");
        let is_unsigned = self.text("pixeltype") == Some("unsignedint");
        let kind = match (bits, is_float, is_unsigned) {
            (8, false, _) => SampleType::U8,
            (16, false, true) => SampleType::U16,
            (16, false, false) => SampleType::I16,
            (32, false, true) => SampleType::U32,
            (32, false, false) => SampleType::I32,
            (32, true, _) => SampleType::F32,
            (64, true, _) => SampleType::F64,
            _ => return Err(format!("nbits {bits} of such numbers is not supported")),
        };
        let order = self.text("byteorder").unwrap_or("i");
        let big_endian = order.starts_with('m');
        let row_bytes = u64::from(columns) * u64::from(kind.bytes());
        let stride = self
            .count("totalrowbytes")?
            .map_or(row_bytes, u64::from)
            .max(row_bytes);
        let offset = self.count("skipbytes")?.unwrap_or(0).into();
        let nodata = self.number("nodata")?.or(self.number("nodata_value")?);
        let placement = self.esri_placement(rows)?;
        Ok(describe(
            columns,
            rows,
            placement,
            crs,
            kind,
            nodata,
            [offset, stride],
            big_endian,
        ))
    }

    fn esri_placement(&self, rows: u32) -> Result<Option<Placement>, String> {
        let step = [self.number("xdim")?, self.number("ydim")?];
        let upper_left = [self.number("ulxmap")?, self.number("ulymap")?];
        if let ([Some(x), Some(y)], [Some(dx), Some(dy)]) = (upper_left, step) {
            return Ok(Some(Placement {
                origin: [x, y],
                step: [dx, -dy],
            }));
        }
        let Some(cell) = self.number("cellsize")? else {
            return Ok(None);
        };
        let edge = |corner: &str, center: &str| -> Result<Option<f64>, String> {
            Ok(self
                .number(center)?
                .or(self.number(corner)?.map(|edge| edge + 0.5 * cell)))
        };
        let west = edge("xllcorner", "xllcenter")?;
        let south = edge("yllcorner", "yllcenter")?;
        let north = |south: f64| south + cell * f64::from(rows.saturating_sub(1));
        Ok(west.zip(south).map(|(west, south)| Placement {
            origin: [west, north(south)],
            step: [cell, -cell],
        }))
    }

    fn describe_envi(&self, beside: Crs) -> Result<(Parts, Rows), String> {
        self.one_band("bands")?;
        let (columns, rows) = (self.require("samples")?, self.require("lines")?);
        let kind = match self.require("data type")? {
            1 => SampleType::U8,
            2 => SampleType::I16,
            3 => SampleType::I32,
            4 => SampleType::F32,
            5 => SampleType::F64,
            12 => SampleType::U16,
            13 => SampleType::U32,
            other => return Err(format!("data type {other} is not supported")),
        };
        let stride = u64::from(columns) * u64::from(kind.bytes());
        let offset = self.count("header offset")?.unwrap_or(0).into();
        let big_endian = self.count("byte order")? == Some(1);
        let nodata = self.number("data ignore value")?;
        let (placement, crs) = match self.text("map info") {
            Some(info) => map_info(info)?,
            None => (None, Crs::unknown()),
        };
        let crs = if beside == Crs::unknown() {
            crs
        } else {
            beside
        };
        Ok(describe(
            columns,
            rows,
            placement,
            crs,
            kind,
            nodata,
            [offset, stride],
            big_endian,
        ))
    }
}

#[expect(
    clippy::too_many_arguments,
    reason = "two headers say the same eight things in their own words"
)]
fn describe(
    columns: u32,
    rows: u32,
    placement: Option<Placement>,
    crs: Crs,
    kind: SampleType,
    nodata: Option<f64>,
    [offset, stride]: [u64; 2],
    big_endian: bool,
) -> (Parts, Rows) {
    let scaling = Scaling::new(nodata, 1.0, 0.0);
    let parts = Parts {
        columns,
        rows,
        placement,
        crs,
        whole: kind.is_whole(),
        scaling,
    };
    (
        parts,
        Rows {
            offset,
            stride,
            kind,
            big_endian,
        },
    )
}

/// ENVI's `map info`: projection, reference column and row from 1, their coordinates, steps, zone, hemisphere, datum.
fn map_info(info: &str) -> Result<(Option<Placement>, Crs), String> {
    let words: Vec<&str> = info.split(',').map(str::trim).collect();
    let number = |index: usize| words.get(index).and_then(|word| word.parse::<f64>().ok());
    let [column, row, x, y, dx, dy] = [1, 2, 3, 4, 5, 6].map(number);
    let (Some(column), Some(row), Some(x), Some(y), Some(dx), Some(dy)) =
        (column, row, x, y, dx, dy)
    else {
        return Err(format!("map info {info:?} lacks numbers"));
    };
    // Column 1 is the west edge of the first sample's area, 1.5 its middle.
    let placement = Placement {
        origin: [x + (1.5 - column) * dx, y - (1.5 - row) * dy],
        step: [dx, -dy],
    };
    let wgs84 = words.iter().any(|word| word.eq_ignore_ascii_case("WGS-84"));
    let zone = number(7).filter(|zone| (1.0..=60.0).contains(zone));
    let crs = match (words[0], zone) {
        ("UTM", Some(zone)) => {
            let south = words
                .get(8)
                .is_some_and(|word| word.eq_ignore_ascii_case("south"));
            let code = wgs84.then(|| format!("EPSG:32{}{zone:02}", if south { 7 } else { 6 }));
            Crs {
                kind: CrsKind::Projected,
                code,
                name: Some(format!("UTM zone {zone}")),
                ..Crs::unknown()
            }
        }
        (name, _) if name.starts_with("Geographic") => Crs {
            kind: CrsKind::Geographic,
            code: wgs84.then(|| "EPSG:4326".into()),
            ..Crs::unknown()
        },
        _ => Crs::unknown(),
    };
    Ok((Some(placement), crs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envi_header_says_where_and_what() {
        let text = "ENVI\ndescription = {\na = b}\nsamples = 3\nlines   = 2\nbands = 1\ndata type = 4\nbyte order = 1\n\
            map info = {UTM, 1, 1, 500, 900, 10, 10, 11, North,WGS-84}\ndata ignore value = -9999";
        let (parts, rows) = Fields::envi(text)
            .describe_envi(Crs::unknown())
            .expect("a header");
        assert_eq!(
            (parts.columns, parts.rows, parts.scaling.nodata),
            (3, 2, Some(-9999.0))
        );
        assert_eq!(
            (rows.kind, rows.big_endian, rows.stride),
            (SampleType::F32, true, 12)
        );
        assert_eq!(
            parts.placement,
            Some(Placement {
                origin: [505.0, 895.0],
                step: [10.0, -10.0]
            })
        );
        assert_eq!(parts.crs.code.as_deref(), Some("EPSG:32611"));
    }

    #[test]
    fn a_float_grid_says_nothing_of_bits() {
        let text = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -9999\nbyteorder LSBFIRST\n";
        let (parts, rows) = Fields::esri(text)
            .describe_esri(Crs::unknown())
            .expect("a header");
        assert_eq!((rows.kind, rows.big_endian), (SampleType::F32, false));
        assert_eq!(
            parts.placement,
            Some(Placement {
                origin: [1.0, 3.0],
                step: [2.0, -2.0]
            })
        );
    }
}
