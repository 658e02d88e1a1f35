//! Times of the frame loop, by two clocks that answer two questions.
//!
//! * **Wall**: how long it took. On a busy machine that counts the turns of other threads and programs; a software
//!   driver is such a thread.
//! * **CPU**: how long the calling thread itself was at work, in the program or in the kernel for it.
//!
//! A wait shows in the first and not in the second, so neither stands alone.

use std::{
    iter::Sum,
    time::{Duration, Instant},
};

use cpu_time::ThreadTime;

/// What something took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    /// By the wall clock.
    pub(crate) wall: Duration,
    /// By the calling thread's own work, as finely as the system counts it.
    pub(crate) cpu: Duration,
}

/// Measures one section after the other, all on the thread it was started on.
pub(crate) struct Stopwatch {
    wall: Instant,
    cpu: ThreadTime,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: ThreadTime::now(),
        }
    }

    /// What the section since the start or the last lap took; the next one begins.
    pub(crate) fn lap(&mut self) -> Span {
        let before = std::mem::replace(self, Self::start());
        Span {
            wall: self.wall.duration_since(before.wall),
            cpu: self.cpu.duration_since(before.cpu),
        }
    }
}

impl Sum for Span {
    fn sum<I: Iterator<Item = Self>>(spans: I) -> Self {
        spans.fold(Self::default(), |sum, span| Self {
            wall: sum.wall + span.wall,
            cpu: sum.cpu + span.cpu,
        })
    }
}

/// A time as reports give it.
pub(crate) fn millis(time: Duration) -> f64 {
    1000.0 * time.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_is_wall_time_and_no_work() {
        let mut watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(200));
        let span = watch.lap();
        // Falling asleep and waking up are work of microseconds; a tenth of the wait leaves room for a slow machine
        // and for systems that count work in steps of 16 milliseconds.
        assert!(span.wall >= Duration::from_millis(200));
        assert!(span.cpu < Duration::from_millis(20));
    }
}
