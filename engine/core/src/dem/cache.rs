//! Decoded strips and tiles that are likely to be asked for again, within a budget of bytes.

use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;

use super::{DemError, samples::Samples};

/// Places to wait while another thread decodes the same part.
const DOORS: usize = 16;

/// The last used parts of a file, at most so many bytes of them: none where one part is more.
pub(super) struct Cache {
    kept: Mutex<Kept>,
    doors: [Mutex<()>; DOORS],
    budget_bytes: usize,
}

struct Kept {
    parts: LruCache<usize, Arc<Samples>>,
    bytes: usize,
}

impl Cache {
    pub(super) fn new(budget_bytes: usize) -> Self {
        let kept = Kept {
            parts: LruCache::unbounded(),
            bytes: 0,
        };
        Self {
            kept: Mutex::new(kept),
            doors: Default::default(),
            budget_bytes,
        }
    }

    /// Bytes of the parts that are kept at most.
    pub(super) const fn budget_bytes(&self) -> usize {
        self.budget_bytes
    }

    /// A part, decoded by `decode` unless it is there; two threads never decode the same part at once.
    pub(super) fn get(
        &self,
        index: usize,
        decode: impl FnOnce() -> Result<Samples, DemError>,
    ) -> Result<Arc<Samples>, DemError> {
        if let Some(part) = self.find(index) {
            return Ok(part);
        }
        // A panic elsewhere leaves nothing half-done behind these locks.
        let _door = self.doors[index % DOORS]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(part) = self.find(index) {
            return Ok(part);
        }
        let part = Arc::new(decode()?);
        self.keep(index, &part);
        Ok(part)
    }

    fn find(&self, index: usize) -> Option<Arc<Samples>> {
        self.kept
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .parts
            .get(&index)
            .cloned()
    }

    fn keep(&self, index: usize, part: &Arc<Samples>) {
        if part.byte_len() > self.budget_bytes {
            return;
        }
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.bytes += part.byte_len();
        if let Some(old) = kept.parts.put(index, Arc::clone(part)) {
            kept.bytes -= old.byte_len();
        }
        while kept.bytes > self.budget_bytes {
            let Some((_, oldest)) = kept.parts.pop_lru() else {
                break;
            };
            kept.bytes -= oldest.byte_len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_holds_and_the_last_used_stay() {
        let cache = Cache::new(10);
        let part = |value: u8| Ok(Samples::U8(vec![value; 4]));
        for index in [0, 1, 0, 2] {
            cache.get(index, || part(0)).expect("decodes");
        }
        let again = |index| {
            cache
                .get(index, || part(9))
                .map(|part| *part == Samples::U8(vec![9; 4]))
        };
        assert!(!again(0).expect("kept") && !again(2).expect("kept"));
        assert!(again(1).expect("decoded again"));
    }

    #[test]
    fn a_part_over_the_budget_is_not_kept_and_drives_out_none() {
        let cache = Cache::new(10);
        let part = |len: usize| Ok(Samples::U8(vec![0; len]));
        cache.get(0, || part(10)).expect("decodes");
        assert_eq!(cache.get(1, || part(11)).expect("decodes").byte_len(), 11);
        assert!(cache.find(0).is_some() && cache.find(1).is_none());
    }
}
