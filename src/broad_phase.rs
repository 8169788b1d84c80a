//! What every algorithm promises.

use crate::{Aabb, Error, Pairs};

/// Finds all pairs of overlapping boxes.
///
/// Every implementation gives the same set of pairs for the same boxes: each overlapping pair once, the lower position
/// first, touching boxes included. Implementations keep their buffers between calls and allocate nothing once they have
/// seen a frame as large and as dense; but with more than one thread rayon allocates small jobs, and what `pair-cache` keeps follows
/// its margin, so that it settles over some frames more.
pub trait BroadPhase: Send {
    /// Replaces the content of `pairs` with the overlapping pairs of `boxes`.
    ///
    /// An implementation begins with [`Pairs::clear`], adds with [`Pairs::push`] and ends with [`Pairs::finish`].
    ///
    /// # Errors
    /// [`Error::InvalidBox`] names the first box with a NaN or inverted bound; [`Error::TooManyObjects`],
    /// [`Error::TooManyPairs`] and [`Error::OutOfMemory`] as they say. After an error the next call starts afresh.
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error>;

    /// Gets ready for frames of up to `objects` boxes, so that the first of them costs no more than the next.
    ///
    /// Called ahead of a switch to this algorithm. Cheap when there is nothing to do; doing nothing is allowed.
    fn prepare(&mut self, objects: usize) {
        let _ = objects;
    }

    /// Whether a frame is cheaper after one that was alike. Whoever times it has to run some frames first.
    fn is_incremental(&self) -> bool {
        false
    }

    /// Runs on so many threads from the next frame on, with all that it keeps. False where it can't, and then nothing changes.
    ///
    /// One instance for several numbers of threads is had from [`Registry::create_for`](crate::Registry::create_for).
    fn set_threads(&mut self, threads: u32) -> bool {
        let _ = threads;
        false
    }
}

/// `Ok` when 32-bit pair members can name `objects` boxes.
pub(crate) fn check_count(objects: usize) -> Result<(), Error> {
    if u32::try_from(objects).is_err() { Err(Error::TooManyObjects { objects }) } else { Ok(()) }
}
