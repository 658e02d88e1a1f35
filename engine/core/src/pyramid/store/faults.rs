//! A store that misbehaves on purpose: every store's twin in tests.
//!
//! The same seed gives the same faults, read by read, where one thread reads.

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::Duration,
};

use serde::{Deserialize, Serialize};

use super::{Store, StoreError};

/// How a store misbehaves. Rates are shares of reads, 0 to 1; the default is to behave.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Faults {
    /// Decides which reads are hit.
    pub seed: u64,
    /// Only keys that start with this are hit.
    pub prefix: String,
    /// Every read waits this long.
    pub delay_millis: u64,
    /// So many reads fail at first.
    pub error_count: u64,
    /// Share of reads that fail.
    pub error_rate: f64,
    /// Share of reads that return fewer bytes than asked for and do not say so.
    pub truncate_rate: f64,
    /// Share of reads with one bit flipped.
    pub flip_rate: f64,
    /// Share of reads that return the bytes of the read before: swapped or stale.
    pub stale_rate: f64,
}

/// A store with faults.
#[derive(Debug)]
pub struct FaultStore<S> {
    inner: S,
    faults: Faults,
    reads: AtomicU64,
    hits: AtomicU64,
    last: Mutex<Option<Vec<u8>>>,
}

impl<S: Store> FaultStore<S> {
    /// Puts faults before a store.
    #[must_use]
    pub const fn new(inner: S, faults: Faults) -> Self {
        Self {
            inner,
            faults,
            reads: AtomicU64::new(0),
            hits: AtomicU64::new(0),
            last: Mutex::new(None),
        }
    }

    /// Reads that were hit so far, delays aside.
    #[must_use]
    pub fn hit_count(&self) -> u64 {
        self.hits.load(Ordering::Relaxed)
    }

    fn hit(&self) {
        self.hits.fetch_add(1, Ordering::Relaxed);
    }

    /// Spoils bytes that were read well.
    fn spoil(&self, mut bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let before = last.replace(bytes.clone());
        if dice.hit(self.faults.stale_rate)
            && let Some(before) = before
        {
            self.hit();
            bytes = before;
        }
        if dice.hit(self.faults.truncate_rate) && !bytes.is_empty() {
            self.hit();
            bytes.truncate(dice.below(bytes.len()));
        }
        if dice.hit(self.faults.flip_rate) && !bytes.is_empty() {
            self.hit();
            let at = dice.below(bytes.len());
            bytes[at] ^= 1 << dice.below(8);
        }
        bytes
    }
}

impl<S: Store> Store for FaultStore<S> {
    fn read(&self, key: &str, range: Range<u64>) -> Result<Vec<u8>, StoreError> {
        if !key.starts_with(&self.faults.prefix) {
            return self.inner.read(key, range);
        }
        if self.faults.delay_millis > 0 {
            thread::sleep(Duration::from_millis(self.faults.delay_millis));
        }
        let count = self.reads.fetch_add(1, Ordering::Relaxed);
        let mut dice = Dice(self.faults.seed ^ count.wrapping_mul(0xD134_2543_DE82_EF95));
        if count < self.faults.error_count || dice.hit(self.faults.error_rate) {
            self.hit();
            let source = std::io::Error::other("a fault was asked for");
            return Err(StoreError::Io {
                name: self.name(key),
                source,
            });
        }
        Ok(self.spoil(self.inner.read(key, range)?, &mut dice))
    }

    fn size(&self, key: &str) -> Result<u64, StoreError> {
        self.inner.size(key)
    }

    fn bytes_under(&self, folder: &str) -> Result<u64, StoreError> {
        self.inner.bytes_under(folder)
    }

    fn name(&self, key: &str) -> String {
        self.inner.name(key)
    }
}

/// The splitmix64 generator.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn hit(&mut self, rate: f64) -> bool {
        ((self.next() >> 11) as f64) < rate * (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, reason = "under `count`")]
        let number = (self.next() % count as u64) as usize;
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::FileStore;

    fn replies(faults: &Faults) -> (Vec<Option<Vec<u8>>>, u64) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a"), (0..=255).collect::<Vec<u8>>()).unwrap();
        let store = FaultStore::new(FileStore::new(folder.path()), faults.clone());
        let replies = (0..100)
            .map(|at| store.read("a", at..at + 50).ok())
            .collect();
        (replies, store.hit_count())
    }

    #[test]
    fn a_store_without_faults_behaves() {
        let (replies, hits) = replies(&Faults::default());
        assert_eq!(hits, 0);
        for (at, reply) in (0..).zip(replies) {
            assert_eq!(reply, Some((at..at + 50).collect()));
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_faults_and_another_seed_others() {
        let rates = Faults {
            error_rate: 0.1,
            truncate_rate: 0.1,
            flip_rate: 0.1,
            stale_rate: 0.1,
            ..Faults::default()
        };
        let [one, again, other] = [1, 1, 2].map(|seed| {
            replies(&Faults {
                seed,
                ..rates.clone()
            })
        });
        assert!(one == again && one.0 != other.0);
        assert!((20..60).contains(&one.1), "{} hits of about 39", one.1);
    }

    #[test]
    fn only_keys_with_the_prefix_are_hit() {
        let faults = Faults {
            error_rate: 1.0,
            prefix: "tile/".into(),
            ..Faults::default()
        };
        assert!(replies(&faults).0.iter().all(Option::is_some));
    }
}
