//! Where a TIFF's samples lie: the transform, the GeoKeys, and a world file where there are none.
//!
//! Based on: OGC GeoTIFF 1.1 (19-008r4).

use super::super::{DemError, bytes::Bytes, placement::Placement, world_file};
use super::geokeys::GeoKeys;
use super::ifd::{Ifd, tag};
use crate::geo::Crs;

/// All that is known of where the samples lie.
#[derive(Clone, Debug)]
pub(in super::super) struct Georef {
    /// None where nothing says it.
    pub(in super::super) placement: Option<Placement>,
    pub(in super::super) crs: Crs,
    /// Metres a unit of height, where the keys say so.
    pub(in super::super) vertical_unit: Option<f64>,
}

impl Georef {
    /// Reads it from the tags of a directory.
    pub(in super::super) fn read(bytes: &Bytes, ifd: &Ifd) -> Result<Self, DemError> {
        let keys = GeoKeys::read(bytes, ifd)?;
        let crs = keys
            .crs()
            .map_err(|what| DemError::unsupported(bytes.path(), what))?;
        let placement = match corner_transform(bytes, ifd)? {
            // Coordinates of a place are those of a sample's corner in an area, of its centre for points.
            Some([origin, step]) => Some(Placement {
                origin: if keys.pixel_is_point() {
                    origin
                } else {
                    [0, 1].map(|i| origin[i] + 0.5 * step[i])
                },
                step,
            }),
            None => world_file::find(bytes.path())?,
        };
        Ok(Self {
            placement,
            crs,
            vertical_unit: keys.vertical_unit(),
        })
    }
}

/// Origin and step of the raster space's (0, 0), from the tags.
fn corner_transform(bytes: &Bytes, ifd: &Ifd) -> Result<Option<[[f64; 2]; 2]>, DemError> {
    if let Some(matrix) = ifd.doubles(bytes, tag::TRANSFORMATION)? {
        return from_matrix(bytes, &matrix).map(Some);
    }
    let ties = ifd.doubles(bytes, tag::TIE_POINTS)?;
    let scale = ifd.doubles(bytes, tag::PIXEL_SCALE)?;
    match (scale.as_deref(), ties.as_deref()) {
        (Some([x, y, ..]), Some([column, row, _, tie_x, tie_y, ..])) => {
            // The scale counts rows downward.
            let step = [*x, -*y];
            Ok(Some([
                [tie_x - column * step[0], tie_y - row * step[1]],
                step,
            ]))
        }
        (Some(_), _) => Err(DemError::format(
            bytes.path(),
            "tag 33550 (pixel scale) without a tie point in tag 33922",
        )),
        (None, Some(ties)) if ties.len() > 6 => {
            let count = ties.len() / 6;
            let what = format!(
                "{count} ground control points (tag 33922) in place of a transform; warp it first"
            );
            Err(DemError::unsupported(bytes.path(), what))
        }
        _ => Ok(None),
    }
}

fn from_matrix(bytes: &Bytes, matrix: &[f64]) -> Result<[[f64; 2]; 2], DemError> {
    let [a, b, _, x, c, d, _, y, ..] = matrix else {
        let what = format!(
            "tag 34264 (transformation) has {} numbers, not 16",
            matrix.len()
        );
        return Err(DemError::format(bytes.path(), what));
    };
    // A ten thousandth of a step over 100,000 samples: noise of arithmetic, no rotation.
    if b.abs() > 1e-9 * a.abs() || c.abs() > 1e-9 * d.abs() {
        let what = "a rotated or sheared grid (tag 34264); warp it to north up first";
        return Err(DemError::unsupported(bytes.path(), what));
    }
    Ok([[*x, *y], [*a, *d]])
}
