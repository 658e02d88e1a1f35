//! Planes of numbers on the disk, larger than memory: what one pass of a build leaves for the next.
//!
//! ```text
//! scratch/NAME/R.C     rows S R … and columns S C … of a plane of S × S files, row by row, little-endian
//! ```
//!
//! Any number of threads read and write rectangles; whoever writes a place is its only writer, and passes that read a
//! plane start when the one that wrote it is done. Files are opened for every access: passes touch each a few times,
//! and a plane may have more files than a process may open. Nothing is flushed: whoever goes on with what an earlier
//! process left asks whether it still [holds](Written). Knows numbers; knows no height.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::area::{Area, Blocks};
use crate::pyramid::PyramidError;
use crate::pyramid::files::{read_exact_at, write_all_at};

/// A plane of entries of `N` numbers each.
#[derive(Debug)]
pub(super) struct Plane<const N: usize> {
    folder: PathBuf,
    name: String,
    size: [usize; 2],
    /// Rows and columns of a file.
    side: usize,
    blocks: Blocks,
}

/// A rectangle as it was written to a plane.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Written {
    /// The plane's name.
    plane: String,
    /// First row, first column, row past the last, column past the last.
    area: [i64; 4],
    /// CRC32C of the bytes, in the order of the files.
    crc32c: u32,
    /// A later pass fills what is odd, the void samples: they are counted as 1.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) to_be_filled: bool,
}

/// What can say whether a rectangle is still as it was written.
pub(super) trait Check: Sync {
    /// True where it is.
    fn holds(&self, written: &Written) -> bool;
}

impl<const N: usize> Check for Plane<N> {
    fn holds(&self, written: &Written) -> bool {
        let [row, column, row_end, column_end] = written.area;
        let area = Area {
            rows: row..row_end,
            columns: column..column_end,
        };
        if written.plane != self.name || !Area::whole(self.size).contains(&area) {
            return false;
        }
        let (mut sum, mut numbers) = (0, Vec::<i32>::new());
        let read = self.parts(&area, |file, path, run| {
            numbers.resize(run.entries.len() * N, 0);
            read_exact_at(file, bytemuck::cast_slice_mut(&mut numbers), run.offset)
                .map_err(PyramidError::io("reading", path))?;
            if written.to_be_filled {
                for number in &mut numbers {
                    if i32::from_le(*number) & 1 == 1 {
                        *number = 1_i32.to_le();
                    }
                }
            }
            sum = crc32c::crc32c_append(sum, bytemuck::cast_slice(&numbers));
            Ok(())
        });
        read.is_ok() && sum == written.crc32c
    }
}

impl<const N: usize> Plane<N> {
    /// A plane of so many rows and columns, `side` of each a file, in a folder of its own, which may be there; its
    /// entries are to be written before they are read.
    pub(super) fn create(
        scratch: &Path,
        name: &str,
        size: [usize; 2],
        side: usize,
    ) -> Result<Self, PyramidError> {
        let folder = scratch.join(name);
        fs::create_dir_all(&folder).map_err(PyramidError::io("creating", &folder))?;
        Ok(Self {
            folder,
            name: name.to_owned(),
            size,
            side,
            blocks: Blocks::new(size, side),
        })
    }

    /// Rows and columns.
    pub(super) const fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The entries of an area of the plane, row by row.
    pub(super) fn read(&self, area: &Area) -> Result<Vec<[i32; N]>, PyramidError> {
        let mut entries = vec![[0; N]; area.count()];
        self.parts(area, |file, path, run| {
            let numbers = entries[run.entries].as_flattened_mut();
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(numbers);
            read_exact_at(file, bytes, run.offset).map_err(PyramidError::io("reading", path))
        })?;
        for number in entries.as_flattened_mut() {
            *number = i32::from_le(*number);
        }
        Ok(entries)
    }

    /// Writes the entries of an area of the plane: those of `within`, of which `area` is a part, row by row.
    pub(super) fn write(
        &self,
        area: &Area,
        within: &Area,
        entries: &[[i32; N]],
    ) -> Result<Written, PyramidError> {
        let [first_row, first_column] = within.offset_of(area);
        let [[_, width], [_, columns]] = [within.size(), area.size()];
        let mut line: Vec<[i32; N]> = Vec::new();
        let mut sum = 0;
        self.parts(area, |file, path, run| {
            line.clear();
            for start in run.entries.clone().step_by(columns.max(1)) {
                let end = run.entries.end.min((start / columns + 1) * columns);
                let from = (first_row + start / columns) * width + first_column + start % columns;
                line.extend_from_slice(&entries[from..from + end - start]);
            }
            for number in line.as_flattened_mut() {
                *number = number.to_le();
            }
            let bytes: &[u8] = bytemuck::cast_slice(line.as_flattened());
            sum = crc32c::crc32c_append(sum, bytes);
            write_all_at(file, bytes, run.offset).map_err(PyramidError::io("writing", path))
        })?;
        let Area { rows, columns } = area;
        Ok(Written {
            plane: self.name.clone(),
            area: [rows.start, columns.start, rows.end, columns.end],
            crc32c: sum,
            to_be_filled: false,
        })
    }

    /// Removes the plane from the disk.
    pub(super) fn remove(self) -> Result<(), PyramidError> {
        fs::remove_dir_all(&self.folder).map_err(PyramidError::io("removing", self.folder))
    }

    /// Visits the runs of an area that lie in a row in a file.
    fn parts(
        &self,
        area: &Area,
        mut visit: impl FnMut(&File, &Path, Run) -> Result<(), PyramidError>,
    ) -> Result<(), PyramidError> {
        debug_assert!(Area::whole(self.size).contains(area), "{area:?}");
        let [_, file_columns] = self.blocks.shape();
        for index in self.files_of(area) {
            let all = self.blocks.area(index);
            let part = all.and(area);
            let [rows, columns] = part.size();
            let name = format!("{}.{}", index / file_columns, index % file_columns);
            let path = self.folder.join(name);
            let file = open(&path)?;
            let [row, column] = all.offset_of(&part);
            let [out_row, out_column] = area.offset_of(&part);
            let [[_, file_width], [_, width]] = [all.size(), area.size()];
            // Rows as wide as the file and the area follow each other in both.
            let (lines, length) = if columns == file_width && columns == width {
                (1, rows * columns)
            } else {
                (rows, columns)
            };
            for line in 0..lines {
                let first = (out_row + line) * width + out_column;
                let offset = ((row + line) * file_width + column) * N * size_of::<i32>();
                let run = Run {
                    entries: first..first + length,
                    offset: offset as u64,
                };
                visit(&file, &path, run)?;
            }
        }
        Ok(())
    }

    /// The files an area touches.
    fn files_of(&self, area: &Area) -> impl Iterator<Item = usize> + use<N> {
        let [rows, columns] = self.blocks.shape();
        let files = |range: &std::ops::Range<i64>, count: usize| {
            let file =
                |place: i64| (usize::try_from(place).unwrap_or(0) / self.side).min(count - 1);
            if range.is_empty() {
                0..0
            } else {
                file(range.start)..file(range.end - 1) + 1
            }
        };
        let across = files(&area.columns, columns);
        files(&area.rows, rows)
            .flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }
}

/// Entries of an area that lie in a row in a file.
struct Run {
    entries: std::ops::Range<usize>,
    /// Where in the file, in bytes.
    offset: u64,
}

fn open(path: &Path) -> Result<File, PyramidError> {
    File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .map_err(PyramidError::io("opening", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_come_back_across_files() {
        let folder = tempfile::tempdir().unwrap();
        let size = [4100, 8300];
        let plane = Plane::<2>::create(folder.path(), "a", size, 4096).unwrap();
        let entry = |row: i64, column: i64| {
            [
                i32::try_from(row * 10_000 + column).unwrap(),
                i32::try_from(row).unwrap(),
            ]
        };
        let entries = |area: &Area| -> Vec<[i32; 2]> {
            let columns = area.columns.clone();
            area.rows
                .clone()
                .flat_map(|row| columns.clone().map(move |column| entry(row, column)))
                .collect()
        };
        let all = Area::new(4090..4100, 0..8300);
        for part in [
            Area::new(4090..4097, 0..8300),
            Area::new(4097..4100, 0..8300),
        ] {
            plane.write(&part, &all, &entries(&all)).unwrap();
        }
        for area in [
            Area::new(4091..4099, 4000..8200),
            Area::new(4095..4096, 8191..8300),
            all.clone(),
            Area::new(4095..4095, 3..3),
        ] {
            assert_eq!(plane.read(&area).unwrap(), entries(&area));
        }
    }

    #[test]
    fn what_was_written_holds_until_it_is_changed() {
        let folder = tempfile::tempdir().unwrap();
        let plane = Plane::<1>::create(folder.path(), "a", [10, 10], 4).unwrap();
        let area = Area::new(2..9, 3..10);
        let put = |numbers: &[[i32; 1]]| plane.write(&area, &area, numbers).unwrap();
        let mut written = put(&[[1]; 49]);
        let other = Plane::<1>::create(folder.path(), "b", [10, 10], 4).unwrap();
        assert!(plane.holds(&written) && !other.holds(&written));
        // Void samples, all of which are filled later.
        put(&[[77]; 49]);
        assert!(!plane.holds(&written));
        written.to_be_filled = true;
        assert!(plane.holds(&written));
        put(&[[78]; 49]);
        assert!(!plane.holds(&written));
        written.area[3] = 11;
        assert!(!plane.holds(&written));
    }

    #[test]
    fn a_file_that_was_not_written_is_an_error_and_a_removed_plane_leaves_none() {
        let folder = tempfile::tempdir().unwrap();
        let plane = Plane::<1>::create(folder.path(), "a", [10, 10], 4).unwrap();
        assert!(plane.read(&Area::new(3..4, 0..10)).is_err());
        plane.remove().unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
