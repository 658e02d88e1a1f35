//! Ranges of points: taken, given back, and taken again by what needs just as many.

use std::collections::BTreeMap;

/// Where points of features lie: one range a feature.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs {
    end: u32,
    free: BTreeMap<u32, Vec<u32>>,
    free_points: u32,
}

impl Runs {
    /// None taken, the first point numbered `first`.
    pub(super) fn new(first: u32) -> Self {
        Self {
            end: first,
            ..Self::default()
        }
    }

    /// A range of so many points: a free one of just this length, or a new one.
    pub(super) fn take(&mut self, length: u32) -> u32 {
        if let Some(first) = self.free.get_mut(&length).and_then(Vec::pop) {
            self.free_points -= length;
            return first;
        }
        self.take_last(length)
    }

    /// A new range after all others.
    pub(super) fn take_last(&mut self, length: u32) -> u32 {
        let first = self.end;
        self.end += length;
        first
    }

    /// Gives a range back.
    pub(super) fn give(&mut self, first: u32, length: u32) {
        if length > 0 {
            self.free.entry(length).or_default().push(first);
            self.free_points += length;
        }
    }

    /// The point after all ranges.
    pub(super) fn end(&self) -> u32 {
        self.end
    }

    /// Points of ranges given back.
    pub(super) fn free_points(&self) -> u32 {
        self.free_points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_given_back_is_taken_again_by_what_fits_it() {
        let mut runs = Runs::new(10);
        let [a, b] = [runs.take(5), runs.take(7)];
        assert_eq!((a, b, runs.end()), (10, 15, 22));
        runs.give(a, 5);
        assert_eq!(runs.free_points(), 5);
        assert_eq!((runs.take(4), runs.take(5)), (22, 10));
        assert_eq!((runs.end(), runs.free_points()), (26, 0));
    }
}
