//! The planes of a level on the disk: samples with their void marks, and controls.

use std::path::Path;

use super::area::Area;
use super::border::mirrored;
use super::samples::Samples;
use super::scratch::{Check, Plane, Written};
use crate::geo::{QUAD_SAMPLES, TILE_QUADS};
use crate::pyramid::PyramidError;

/// Heights are under this many units, so that doubled and marked they are a number. Those that are read are under 2²⁵;
/// fitted and continued ones may overshoot that, and are refused here.
const HEIGHT_LIMIT: i32 = 1 << 30;

/// Rows and columns of a file of samples: as many as a task makes, which is so the only one to write it.
pub(super) const TASK_SIDE: usize = 4096;
/// Samples of a task.
pub(super) const TASK_SAMPLES: u64 = (TASK_SIDE * TASK_SIDE) as u64;

/// Samples, each one number: the height in units, doubled, plus one where it is void.
#[derive(Debug)]
pub(super) struct SamplePlane(Plane<1>);

impl SamplePlane {
    /// A plane of so many rows and columns.
    pub(super) fn create(
        scratch: &Path,
        name: &str,
        size: [usize; 2],
    ) -> Result<Self, PyramidError> {
        Plane::create(scratch, name, size, TASK_SIDE).map(Self)
    }

    /// Rows and columns.
    pub(super) const fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    /// The samples of an area of the plane.
    pub(super) fn read(&self, area: &Area) -> Result<Samples, PyramidError> {
        let numbers = self.0.read(area)?.into_flattened();
        let mut samples = Samples::new(area.clone(), numbers);
        let columns = samples.columns;
        for at in 0..samples.values.len() {
            if samples.values[at] & 1 == 1 {
                samples.set_void(at / columns, at % columns);
            }
            samples.values[at] >>= 1;
        }
        Ok(samples)
    }

    /// The samples of an area that may reach past the plane's ends.
    pub(super) fn read_mirrored(&self, area: &Area) -> Result<Samples, PyramidError> {
        mirrored(area, self.size(), |area| self.read(area))
    }

    /// Writes the part of some samples that lies in an area.
    ///
    /// # Errors
    /// [`PyramidError::Unfit`] for a height too large to be marked; what the disk says.
    pub(super) fn write(&self, area: &Area, samples: &Samples) -> Result<Written, PyramidError> {
        let packed = samples.values.iter().map(|height| pack(*height));
        let mut packed = packed.collect::<Result<Vec<[i32; 1]>, _>>()?;
        if samples.voids.is_some() {
            for (at, number) in packed.iter_mut().enumerate() {
                number[0] |= i32::from(samples.is_void(at / samples.columns, at % samples.columns));
            }
        }
        self.0.write(area, &samples.area, &packed)
    }

    /// As [`Self::write`], of samples whose void ones are 0 and will be filled.
    pub(super) fn write_unfilled(&self, samples: &Samples) -> Result<Written, PyramidError> {
        let mut written = self.write(&samples.area, samples)?;
        written.to_be_filled = samples.voids.is_some();
        Ok(written)
    }

    /// Removes the plane from the disk.
    pub(super) fn remove(self) -> Result<(), PyramidError> {
        self.0.remove()
    }
}

impl Check for SamplePlane {
    fn holds(&self, written: &Written) -> bool {
        self.0.holds(written)
    }
}

fn pack(height: i32) -> Result<[i32; 1], PyramidError> {
    if height.unsigned_abs() < HEIGHT_LIMIT.unsigned_abs() {
        return Ok([height << 1]);
    }
    Err(PyramidError::Unfit(format!(
        "a fitted height of {height} units is over the limit of 2^30; a greater error bound or unit allows it"
    )))
}

/// The controls of a level: row and column 0 are lattice points −1.
pub(super) type ControlPlane = Plane<1>;

impl ControlPlane {
    /// A plane of the controls of so many rows and columns of tiles.
    pub(super) fn of_tiles(
        scratch: &Path,
        name: &str,
        tiles: [u32; 2],
    ) -> Result<Self, PyramidError> {
        let size = tiles.map(|count| count as usize * TILE_QUADS + 3);
        Self::create(scratch, name, size, TASK_SIDE / QUAD_SAMPLES)
    }

    /// The controls of an area of the plane, row by row.
    pub(super) fn controls(&self, area: &Area) -> Result<Vec<i32>, PyramidError> {
        Ok(self.read(area)?.into_flattened())
    }

    /// Writes the part of some controls, those of `within`, that lies in an area.
    pub(super) fn put_controls(
        &self,
        area: &Area,
        within: &Area,
        controls: &[i32],
    ) -> Result<Written, PyramidError> {
        let (entries, _) = controls.as_chunks::<1>();
        self.write(area, within, entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_of_either_sign_and_voids_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let plane = SamplePlane::create(folder.path(), "a", [4, 5]).unwrap();
        let heights = (0..20).map(|at| (at - 10) * 6_000_000 / 2).collect();
        let mut samples = Samples::new(Area::whole([4, 5]), heights);
        samples.set_void(2, 3);
        plane.write(&Area::whole([4, 5]), &samples).unwrap();
        assert_eq!(plane.read(&Area::whole([4, 5])).unwrap(), samples);
        let beyond = plane.read_mirrored(&Area::new(0..6, 2..5)).unwrap();
        assert_eq!(
            beyond.values[5 * 3],
            2 * samples.values[17] - samples.values[7]
        );
        assert!(beyond.is_void(4, 1));
    }

    #[test]
    fn a_height_too_large_to_be_marked_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let plane = SamplePlane::create(folder.path(), "a", [1, 1]).unwrap();
        let all = Area::whole([1, 1]);
        let write = |height| plane.write(&all, &Samples::new(all.clone(), vec![height]));
        for height in [HEIGHT_LIMIT - 1, 1 - HEIGHT_LIMIT] {
            write(height).unwrap();
            assert_eq!(plane.read(&all).unwrap().values, [height]);
        }
        for height in [HEIGHT_LIMIT, i32::MIN] {
            assert!(matches!(write(height), Err(PyramidError::Unfit(_))));
        }
    }
}
