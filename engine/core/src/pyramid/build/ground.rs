//! The finest level as stored, answering for single controls and samples: what features are laid into.

use std::num::NonZero;
use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;

use super::area::{Area, Blocks};
use super::planes::{ControlPlane, SamplePlane};
use super::samples::Samples;
use crate::pyramid::PyramidError;
use crate::pyramid::feature::Ground;

/// Numbers a side of what is read at once.
const SIDE: usize = 128;
/// So many blocks of each plane are kept: 2 MiB.
const BLOCKS: NonZero<usize> = NonZero::new(32).unwrap();

/// Controls and samples of the finest level.
pub(super) struct StoredGround<'a> {
    samples: &'a SamplePlane,
    cage: &'a ControlPlane,
    kept_samples: Kept<Samples>,
    kept_controls: Kept<Vec<i32>>,
    /// The first error: who lays features cannot be told at once.
    failed: Mutex<Option<PyramidError>>,
}

impl<'a> StoredGround<'a> {
    pub(super) fn new(samples: &'a SamplePlane, cage: &'a ControlPlane) -> Self {
        Self {
            samples,
            cage,
            kept_samples: Kept::new(samples.size()),
            kept_controls: Kept::new(cage.size()),
            failed: Mutex::new(None),
        }
    }

    /// The error of any read so far, after which answers were 0.
    pub(super) fn check(&self) -> Result<(), PyramidError> {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        failed.take().map_or(Ok(()), Err)
    }

    fn at_sample<T: Default>(
        &self,
        [row, column]: [u32; 2],
        of: impl Fn(&Samples, usize) -> T,
    ) -> T {
        let place = [row as usize, column as usize];
        let found = self.kept_samples.at(place, |area| self.samples.read(area));
        self.answer(found, of)
    }

    /// What a block says of one of its places; nothing where it could not be read.
    fn answer<B, T: Default>(
        &self,
        found: Result<(Arc<B>, usize), PyramidError>,
        of: impl Fn(&B, usize) -> T,
    ) -> T {
        match found {
            Ok((block, index)) => of(&block, index),
            Err(error) => {
                let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
                failed.get_or_insert(error);
                T::default()
            }
        }
    }
}

impl Ground for StoredGround<'_> {
    fn control(&self, row: i64, column: i64) -> i32 {
        let place = [row, column].map(|at| usize::try_from(at + 1).unwrap_or(0));
        let found = self
            .kept_controls
            .at(place, |area| self.cage.controls(area));
        self.answer(found, |block, index| block[index])
    }

    fn sample(&self, row: u32, column: u32) -> i32 {
        self.at_sample([row, column], |block, index| block.values[index])
    }

    fn is_void(&self, row: u32, column: u32) -> bool {
        self.at_sample([row, column], |block, index| {
            block.is_void(index / block.columns, index % block.columns)
        })
    }
}

/// Blocks of a plane that were read last.
struct Kept<B> {
    blocks: Blocks,
    read: Mutex<LruCache<usize, Arc<B>>>,
}

impl<B> Kept<B> {
    fn new(size: [usize; 2]) -> Self {
        Self {
            blocks: Blocks::new(size, SIDE),
            read: Mutex::new(LruCache::new(BLOCKS)),
        }
    }

    /// The block that holds a place, and the place's index in it.
    fn at(
        &self,
        [row, column]: [usize; 2],
        read: impl FnOnce(&Area) -> Result<B, PyramidError>,
    ) -> Result<(Arc<B>, usize), PyramidError> {
        let [rows, columns] = self.blocks.shape();
        let index = (row / SIDE).min(rows - 1) * columns + (column / SIDE).min(columns - 1);
        let area = self.blocks.area(index);
        let [down, across] = area.offset_of(&Area::new(row..row + 1, column..column + 1));
        let place = down * area.size()[1] + across;
        let mut kept = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(block) = kept.get(&index) {
            return Ok((block.clone(), place));
        }
        let block = Arc::new(read(&area)?);
        kept.put(index, block.clone());
        Ok((block, place))
    }
}
