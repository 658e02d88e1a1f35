//! Builds a pyramid from a raster.

mod fit;
mod measure;
mod quantise;
mod sample;
mod samples;
mod scale;
#[cfg(test)]
pub(crate) mod testing;
mod voids;
