//! The finest level as stored, answering for single controls and samples: what features are laid into.

use std::num::NonZero;
use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;

use super::area::{Area, Blocks};
use super::planes::{ControlPlane, SamplePlane};
use crate::pyramid::PyramidError;
use crate::pyramid::feature::Ground;

/// Numbers a side of what is read at once.
const SIDE: usize = 128;
/// So many blocks are kept: 4 MiB.
const BLOCKS: NonZero<usize> = NonZero::new(64).unwrap();

/// Controls and samples of the finest level.
pub(super) struct StoredGround<'a> {
    samples: &'a SamplePlane,
    cage: &'a ControlPlane,
    kept: Mutex<LruCache<Key, Arc<Vec<i32>>>>,
    /// The first error: who lays features cannot be told at once.
    failed: Mutex<Option<PyramidError>>,
}

/// Which plane, and which block of it.
type Key = (bool, usize);

impl<'a> StoredGround<'a> {
    pub(super) fn new(samples: &'a SamplePlane, cage: &'a ControlPlane) -> Self {
        Self {
            samples,
            cage,
            kept: Mutex::new(LruCache::new(BLOCKS)),
            failed: Mutex::new(None),
        }
    }

    /// The error of any read so far, after which answers were 0.
    pub(super) fn check(&self) -> Result<(), PyramidError> {
        let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
        failed.take().map_or(Ok(()), Err)
    }

    fn number(&self, is_sample: bool, row: usize, column: usize) -> i32 {
        let size = if is_sample {
            self.samples.size()
        } else {
            self.cage.size()
        };
        let blocks = Blocks::new(size, SIDE);
        let [rows, columns] = blocks.shape();
        let index = (row / SIDE).min(rows - 1) * columns + (column / SIDE).min(columns - 1);
        let area = blocks.area(index);
        let place = Area::new(row..row + 1, column..column + 1);
        let [down, across] = area.offset_of(&place);
        match self.block((is_sample, index), &area) {
            Ok(block) => block[down * area.size()[1] + across],
            Err(error) => {
                let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
                failed.get_or_insert(error);
                0
            }
        }
    }

    fn block(&self, key: Key, area: &Area) -> Result<Arc<Vec<i32>>, PyramidError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(block) = kept.get(&key) {
            return Ok(block.clone());
        }
        let block = Arc::new(if key.0 {
            self.samples.read(area)?.values
        } else {
            self.cage.read(area)?
        });
        kept.put(key, block.clone());
        Ok(block)
    }
}

impl Ground for StoredGround<'_> {
    fn control(&self, row: i64, column: i64) -> i32 {
        let [row, column] = [row, column].map(|at| usize::try_from(at + 1).unwrap_or(0));
        self.number(false, row, column)
    }

    fn sample(&self, row: u32, column: u32) -> i32 {
        self.number(true, row as usize, column as usize)
    }
}
