//! How a pass goes over its blocks: on all threads of the pool, begun in order.
//!
//! Blocks in order are neighbours, so what one has read from the disk the next finds in the system's cache. A block is
//! one thread's work from its first byte to its last: as many are in memory as there are threads.

use rayon::prelude::*;

use crate::pyramid::PyramidError;

/// Does the work of every index and joins the results, in whatever order they come; stops at the first error.
pub(super) fn in_order<R: Default + Send>(
    count: usize,
    work: impl Fn(usize) -> Result<R, PyramidError> + Sync + Send,
    join: impl Fn(R, R) -> R + Sync + Send,
) -> Result<R, PyramidError> {
    (0..count)
        .par_bridge()
        .map(work)
        .try_reduce(R::default, |a, b| Ok(join(a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_work_is_done_or_the_error_told() {
        assert_eq!(in_order(1000, Ok, |a, b| a + b).unwrap(), 499_500);
        let work = |index| {
            if index == 77 {
                Err(PyramidError::Interrupted)
            } else {
                Ok(())
            }
        };
        assert!(in_order(1000, work, |(), ()| ()).is_err());
    }
}
