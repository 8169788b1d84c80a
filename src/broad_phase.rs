//! The interface of every algorithm.

use crate::{Aabb, Error, FramePlan, Pairs};

/// Finds all pairs of overlapping boxes.
///
/// Every implementation returns the same set of pairs for the same boxes: each overlapping pair once, the lower
/// position first, touching boxes included.
///
/// Implementations keep their buffers between calls, and allocate nothing after a frame as large and as dense. Two
/// exceptions: with several threads rayon allocates small jobs, and `pair-cache` takes some frames more, until its
/// margin has settled.
///
/// ```
/// use sapwise::{Aabb, BroadPhase, Error, Pairs};
///
/// /// Compares every box with every later one.
/// struct All;
///
/// impl BroadPhase for All {
///     fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
///         pairs.clear();
///         for (b, second) in (0..).zip(boxes) {
///             for (a, first) in (0..b).zip(boxes) {
///                 if first.overlaps(second) {
///                     pairs.push(a, b);
///                 }
///             }
///         }
///         pairs.finish()
///     }
/// }
/// let mut pairs = Pairs::new();
/// All.find_pairs(&[Aabb::cube([0.0; 3], 1.0); 2], &mut pairs)?;
/// assert_eq!(pairs.as_slice(), [(0, 1)]);
/// # Ok::<(), sapwise::Error>(())
/// ```
pub trait BroadPhase: Send + Sync {
    /// Replaces the content of `pairs` with the overlapping pairs of `boxes`.
    ///
    /// An implementation begins with [`Pairs::clear`], adds with [`Pairs::push`] and ends with [`Pairs::finish`].
    ///
    /// # Errors
    /// [`Error::InvalidBox`] names the first box with a NaN or inverted bound. [`Error::TooManyObjects`],
    /// [`Error::TooManyPairs`] and [`Error::OutOfMemory`] as they say. [`Error::Unavailable`] if a GPU is lost or the
    /// system refuses threads. After an error the next call starts afresh.
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error>;

    /// Does the same as [`find_pairs`](Self::find_pairs), and reuses what the caller knows about this frame.
    ///
    /// The plan may change the speed and the order of the pairs, never the set. The default ignores it.
    ///
    /// # Errors
    /// As [`find_pairs`](Self::find_pairs).
    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let _ = plan;
        self.find_pairs(boxes, pairs)
    }

    /// Gets ready for frames of up to `objects` boxes, so that the first of them costs no more than the next. The
    /// default does nothing.
    ///
    /// [`Adaptive`](crate::Adaptive) calls this between frames, before it switches to this algorithm. It calls an
    /// algorithm on a GPU on a thread of its own, because a driver may block, and runs others until the call returns.
    /// It calls any other algorithm on the thread of the frames: there it should only reserve memory.
    fn prepare(&mut self, objects: usize) {
        let _ = objects;
    }

    /// Returns whether a frame is cheaper after a similar one. To time such an algorithm, warm it up for some frames.
    /// The default is `false`.
    fn is_incremental(&self) -> bool {
        false
    }

    /// Returns how the last frame came about. [`Adaptive`](crate::Adaptive) asks incremental algorithms only, and
    /// compares the time of a frame with the time that its work lets expect. By default every frame counts alike.
    fn last_frame(&self) -> FrameWork {
        FrameWork::new(if self.is_incremental() { FrameKind::Updated } else { FrameKind::FromScratch }, 1.0)
    }

    /// Reports that other algorithms ran `frames` frames, at least one, since this one's last frame.
    /// [`Adaptive`](crate::Adaptive) calls this before the next frame of an incremental algorithm. Conclusions from
    /// earlier frames, such as that keeping work does not pay, may no longer hold.
    fn missed_frames(&mut self, frames: u64) {
        let _ = frames;
    }
}

/// How a frame of an incremental algorithm came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameKind {
    /// It updated the state that the previous frame left.
    Updated,
    /// It rebuilt its state for the frames that follow.
    Rebuilt,
    /// It found the pairs from scratch and keeps nothing.
    FromScratch,
}

/// The work of a frame of an incremental algorithm.
///
/// ```
/// use sapwise::algorithm::{FrameKind, FrameWork};
///
/// let rebuilt = FrameWork::new(FrameKind::Rebuilt, 3.0); // three times the usual work
/// assert_eq!(rebuilt.over_mean, 3.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FrameWork {
    /// How the frame came about.
    pub kind: FrameKind,
    /// Its work over the mean work of a frame of this scene, rebuilds included; 1 if unknown. Frames right after a
    /// rebuild are cheap, so a few of them say little about the mean.
    pub over_mean: f64,
}

impl FrameWork {
    /// Makes the work of a frame. `over_mean` counts as 1 unless it is a positive number.
    pub fn new(kind: FrameKind, over_mean: f64) -> Self {
        Self { kind, over_mean: if over_mean.is_finite() && over_mean > 0.0 { over_mean } else { 1.0 } }
    }
}

/// Returns an error if 32 bits can't number `objects` boxes.
pub fn check_count(objects: usize) -> Result<(), Error> {
    if u32::try_from(objects).is_err() { Err(Error::TooManyObjects { objects }) } else { Ok(()) }
}
