//! The planes of a level on the disk: samples with their void marks, and controls.

use std::path::Path;

use super::area::Area;
use super::border::mirrored;
use super::samples::Samples;
use super::scratch::Plane;
use crate::pyramid::PyramidError;

/// Samples, each one number: the height in units, doubled, plus one where it is void.
///
/// Heights are under 2²⁶ units, so nothing is lost.
#[derive(Debug)]
pub(super) struct SamplePlane(Plane<1>);

impl SamplePlane {
    /// A plane of so many rows and columns.
    pub(super) fn create(
        scratch: &Path,
        name: &str,
        size: [usize; 2],
    ) -> Result<Self, PyramidError> {
        Plane::create(scratch, name, size).map(Self)
    }

    /// Rows and columns.
    pub(super) const fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    /// The samples of an area of the plane.
    pub(super) fn read(&self, area: &Area) -> Result<Samples, PyramidError> {
        let packed = self.0.read(area)?;
        let any_void = packed.iter().any(|[number]| number & 1 == 1);
        let values = packed.iter().map(|[number]| number >> 1).collect();
        let mut samples = Samples::new(area.clone(), values);
        if any_void {
            let columns = samples.columns;
            for at in (0..packed.len()).filter(|at| packed[*at][0] & 1 == 1) {
                samples.set_void(at / columns, at % columns);
            }
        }
        Ok(samples)
    }

    /// The samples of an area that may reach past the plane's ends.
    pub(super) fn read_mirrored(&self, area: &Area) -> Result<Samples, PyramidError> {
        mirrored(area, self.size(), |area| self.read(area))
    }

    /// Writes the part of some samples that lies in an area.
    pub(super) fn write(&self, area: &Area, samples: &Samples) -> Result<(), PyramidError> {
        let mut packed: Vec<[i32; 1]> = samples.values.iter().map(|height| [height << 1]).collect();
        if samples.voids.is_some() {
            for (at, number) in packed.iter_mut().enumerate() {
                number[0] |= i32::from(samples.is_void(at / samples.columns, at % samples.columns));
            }
        }
        self.0.write(area, &samples.area, &packed)
    }

    /// Removes the plane from the disk.
    pub(super) fn remove(self) -> Result<(), PyramidError> {
        self.0.remove()
    }
}

/// The controls of a level: row and column 0 are lattice points −1.
#[derive(Debug)]
pub(super) struct ControlPlane(Plane<1>);

impl ControlPlane {
    /// A plane of so many rows and columns.
    pub(super) fn create(
        scratch: &Path,
        name: &str,
        size: [usize; 2],
    ) -> Result<Self, PyramidError> {
        Plane::create(scratch, name, size).map(Self)
    }

    /// Rows and columns.
    pub(super) const fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    /// The controls of an area of the plane, row by row.
    pub(super) fn read(&self, area: &Area) -> Result<Vec<i32>, PyramidError> {
        Ok(self.0.read(area)?.into_flattened())
    }

    /// Writes the part of some controls, those of `within`, that lies in an area.
    pub(super) fn write(
        &self,
        area: &Area,
        within: &Area,
        controls: &[i32],
    ) -> Result<(), PyramidError> {
        let (entries, _) = controls.as_chunks::<1>();
        self.0.write(area, within, entries)
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
}
