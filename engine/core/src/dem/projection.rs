//! The usual projections by their own parameters, as GeoKeys and WKT give them, written out as PROJ strings.
//!
//! Based on: OGC GeoTIFF 1.1 (19-008r4), annex C; PROJ's pages of the projections.

/// A way of projecting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    TransverseMercator,
    Mercator,
    LambertConic1,
    LambertConic2,
    LambertAzimuthal,
    Albers,
    PolarStereographic,
    Equirectangular,
    Sinusoidal,
}

/// A projection's parameters, as far as a file gives them: degrees, and the system's unit of length.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Projection {
    pub(super) method: Method,
    pub(super) latitude: Option<f64>,
    pub(super) longitude: Option<f64>,
    pub(super) parallels: [Option<f64>; 2],
    pub(super) scale: Option<f64>,
    pub(super) false_origin: [Option<f64>; 2],
}

impl Projection {
    /// The PROJ string over a datum's parameters; none where a parameter is missing that has no usual value.
    pub(super) fn definition(&self, base: &str, unit_metres: f64) -> Option<String> {
        let latitude = self.latitude.unwrap_or(0.0);
        let longitude = self.longitude.unwrap_or(0.0);
        let scale = self.scale.unwrap_or(1.0);
        let [first, second] = self.parallels;
        let own = match self.method {
            Method::TransverseMercator => {
                format!("+proj=tmerc +lat_0={latitude} +lon_0={longitude} +k={scale}")
            }
            Method::Mercator => match first {
                Some(parallel) => format!("+proj=merc +lat_ts={parallel} +lon_0={longitude}"),
                None => format!("+proj=merc +lon_0={longitude} +k={scale}"),
            },
            Method::LambertConic1 => {
                let parallel = first.unwrap_or(latitude);
                format!(
                    "+proj=lcc +lat_1={parallel} +lat_0={latitude} +lon_0={longitude} +k_0={scale}"
                )
            }
            Method::LambertConic2 => format!(
                "+proj=lcc +lat_1={} +lat_2={} +lat_0={latitude} +lon_0={longitude}",
                first?, second?
            ),
            Method::LambertAzimuthal => {
                format!("+proj=laea +lat_0={latitude} +lon_0={longitude}")
            }
            Method::Albers => format!(
                "+proj=aea +lat_1={} +lat_2={} +lat_0={latitude} +lon_0={longitude}",
                first?, second?
            ),
            Method::PolarStereographic => {
                // One latitude is given, of the pole with a scale there or of the parallel of true scale.
                let parallel = first.or(self.latitude)?;
                let pole = 90_f64.copysign(parallel);
                if parallel == pole {
                    format!("+proj=stere +lat_0={pole} +lon_0={longitude} +k={scale}")
                } else {
                    format!("+proj=stere +lat_0={pole} +lat_ts={parallel} +lon_0={longitude}")
                }
            }
            Method::Equirectangular => {
                let parallel = first.unwrap_or(0.0);
                format!("+proj=eqc +lat_ts={parallel} +lat_0={latitude} +lon_0={longitude}")
            }
            Method::Sinusoidal => format!("+proj=sinu +lon_0={longitude}"),
        };
        let [x, y] = self
            .false_origin
            .map(|value| value.unwrap_or(0.0) * unit_metres);
        Some(format!(
            "{own} +x_0={x} +y_0={y} {base} +to_meter={unit_metres} +no_defs"
        ))
    }
}
