//! What a pyramid says of itself: the attributes of its root `zarr.json`.

use serde::{Deserialize, Serialize};

use super::feature::FeatureMetadata;
use crate::geo::{Crs, Grid, WorldFrame};

/// Heights' zero: never guessed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VerticalReference {
    /// Above the ellipsoid.
    Ellipsoidal,
    /// Above a geoid.
    Orthometric,
    /// The sources do not say.
    #[default]
    Unknown,
}

/// A file the pyramid was built from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceMetadata {
    /// File name, without folders.
    pub name: String,
    /// Size of the file.
    pub bytes: u64,
    /// BLAKE3 of the file, in hexadecimal.
    pub blake3: String,
}

/// One level of the pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Rows and columns of tiles.
    pub tiles: [u32; 2],
    /// Height units a code step: q.
    pub step: i32,
    /// True when the cage is stored whole, so that no parent is needed, and not as codes against the subdivided parent.
    pub key: bool,
    /// Bytes a cage number: 1, 2 or 4.
    pub cage_bytes: u8,
    /// Bytes a residual code: 1, 2 or 4.
    pub detail_bytes: u8,
    /// True when records carry void bits.
    pub voids: bool,
}

/// How colour tiles are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColorCodec {
    /// As they are, RGBA compressed by zstd.
    #[default]
    Zstd,
    /// RGB as JPEG, and alpha compressed by zstd.
    Jpeg {
        /// 1 to 100.
        quality: u8,
    },
}

impl ColorCodec {
    /// JPEG's quality where none is given.
    pub const QUALITY: u8 = 85;

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde calls")]
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl std::fmt::Display for ColorCodec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Zstd => f.write_str("lossless, zstd"),
            Self::Jpeg { quality } => write!(f, "JPEG of quality {quality}"),
        }
    }
}

/// The imagery of a pyramid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorMetadata {
    /// Number of colour levels, 0 the coarsest; colour tile `l/r/c` covers the same ground as height tile `l/r/c`.
    pub levels: u8,
    /// Texels a side of a colour tile; the border texels lie on the tile's border and are shared with neighbours.
    pub texels: u32,
    /// How tiles are stored.
    #[serde(default, skip_serializing_if = "ColorCodec::is_default")]
    pub codec: ColorCodec,
    /// The imagery's file names.
    pub sources: Vec<SourceMetadata>,
}

/// What a build of named sources made, so that the same build again has nothing to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BuildMetadata {
    /// BLAKE3 of all that decides the bytes (inputs, options, builder), in hexadecimal.
    pub key: String,
    /// Finest samples that are void.
    pub void_samples: u64,
    /// The root tile's true error in metres.
    pub root_error: f64,
}

/// What a pyramid says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Version of the profile; [`Metadata::VERSION`].
    pub version: u32,
    /// The finest level's sample points.
    pub grid: Grid,
    /// Coordinates of the grid.
    pub crs: Crs,
    /// Zero of the heights.
    pub vertical: VerticalReference,
    /// The height unit u is 2^this metres.
    pub unit_exponent: i32,
    /// Greatest distance of a stored finest sample from its source, metres.
    pub eps: f64,
    /// Least and greatest height of finest samples that are not void, in units.
    pub height_range: [i32; 2],
    /// The levels, coarsest first.
    pub levels: Vec<Level>,
    /// Imagery, where there is any.
    pub color: Option<ColorMetadata>,
    /// Authored features laid into the finest level, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<FeatureMetadata>,
    /// What it was built from, in the order given.
    pub sources: Vec<SourceMetadata>,
    /// Its build, where it was built of named sources.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub build: Option<BuildMetadata>,
}

impl Metadata {
    /// The version of the profile this crate reads and writes.
    pub const VERSION: u32 = 1;

    /// One height unit in metres.
    #[must_use]
    pub fn unit(&self) -> f64 {
        f64::from(self.unit_exponent).exp2()
    }

    /// The world of the data set.
    #[must_use]
    pub fn frame(&self) -> WorldFrame {
        WorldFrame::new(&self.grid, &self.crs)
    }

    /// The finest level.
    #[must_use]
    pub fn finest(&self) -> u8 {
        self.grid.level_count() - 1
    }
}
