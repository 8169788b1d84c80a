//! What every algorithm promises, and what those do that build on the frame before.

use crate::aabb::Aabb;
use crate::error::Error;
use crate::load::FramePlan;
use crate::pairs::Pairs;

/// Finds all pairs of overlapping boxes.
///
/// Every implementation returns the same set of pairs for the same boxes: each overlapping pair once, the lower position
/// first, touching boxes included. Implementations keep their buffers between calls and allocate nothing once they have
/// seen a frame as large and as dense; but with more than one thread rayon allocates small jobs, and what `pair-cache` keeps follows
/// its margin, so that it settles over some frames more.
pub trait BroadPhase: Send + Sync {
    /// Replaces the content of `pairs` with the overlapping pairs of `boxes`.
    ///
    /// An implementation begins with [`Pairs::clear`], adds with [`Pairs::push`] and ends with [`Pairs::finish`].
    ///
    /// # Errors
    /// [`Error::InvalidBox`] names the first box with a NaN or inverted bound; [`Error::TooManyObjects`],
    /// [`Error::TooManyPairs`] and [`Error::OutOfMemory`] as they say. After an error the next call starts afresh.
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error>;

    /// As [`find_pairs`](Self::find_pairs), with what is known of this frame already, so that it need not be worked out twice.
    ///
    /// The plan may change how fast the pairs are found and in which order, never which. An algorithm that has no use for it leaves
    /// this as it is.
    ///
    /// # Errors
    /// As [`find_pairs`](Self::find_pairs).
    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let _ = plan;
        self.find_pairs(boxes, pairs)
    }

    /// Gets ready for frames of up to `objects` boxes, so that the first of them costs no more than the next.
    ///
    /// Called ahead of a switch to this algorithm. Cheap when there is nothing to do; doing nothing is allowed. [`Adaptive`](crate::Adaptive)
    /// calls it between frames: of an algorithm on a GPU, whose driver may keep it waiting, on a thread of its own, and chooses others until it
    /// returns; of any other on the thread of the frames, where it is to reserve memory at most.
    fn prepare(&mut self, objects: usize) {
        let _ = objects;
    }

    /// This algorithm as one that builds on the frame before, if it is one: `Some(self)`.
    fn as_incremental(&mut self) -> Option<&mut dyn Incremental> {
        None
    }
}

/// How a frame of an incremental algorithm came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameKind {
    /// It built on what the frame before had left.
    Updated,
    /// It made again what it keeps, for the frames that follow.
    Rebuilt,
    /// It found the pairs from scratch, and keeps nothing.
    FromScratch,
}

/// The work of a frame of an incremental algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FrameWork {
    /// How the frame came about.
    pub kind: FrameKind,
    /// Its work over that of the mean frame of the present scene, those included in which all is made again; 1 where nobody knows. Frames right after
    /// one of these are cheap, so that a few of them tell little of the mean.
    pub over_mean: f64,
}

impl FrameWork {
    /// Of a frame of this kind and so many times the work of the mean frame; what is no positive number counts as 1.
    #[must_use]
    pub fn new(kind: FrameKind, over_mean: f64) -> Self {
        Self { kind, over_mean: if over_mean.is_finite() && over_mean > 0.0 { over_mean } else { 1.0 } }
    }
}

/// An algorithm whose frame is cheaper after one that was alike. Time it after some frames, not on the first.
pub trait Incremental: BroadPhase {
    /// How the last frame came about. [`Adaptive`](crate::Adaptive) compares what a frame took with what its work lets expect; of an algorithm that
    /// does not tell, every frame counts alike.
    fn last_frame(&self) -> FrameWork {
        FrameWork::new(FrameKind::Updated, 1.0)
    }

    /// Other algorithms ran so many frames, one at least, since this one's last frame: [`Adaptive`](crate::Adaptive) calls this before its next one. What was concluded
    /// from earlier frames, such as that keeping work does not pay, may hold no longer.
    fn missed_frames(&mut self, frames: u64) {
        let _ = frames;
    }

    /// Runs on this many threads from the next frame on, with all that it keeps. `false` where it can't, and then nothing changes.
    ///
    /// One instance for several numbers of threads comes from [`Registry::create_family`](crate::Registry::create_family).
    fn set_threads(&mut self, threads: u32) -> bool {
        let _ = threads;
        false
    }
}

impl dyn BroadPhase {
    /// Whether a frame is cheaper after one that was alike.
    pub fn is_incremental(&mut self) -> bool {
        self.as_incremental().is_some()
    }
}

/// `Ok` when 32-bit pair members can name `objects` boxes.
pub(crate) fn check_count(objects: usize) -> Result<(), Error> {
    if u32::try_from(objects).is_err() { Err(Error::TooManyObjects { objects }) } else { Ok(()) }
}
