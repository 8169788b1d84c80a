//! The name of a body.

use std::fmt;
use std::num::NonZeroU64;

/// Names a body of a [`Space`](crate::Space), until it is removed. No other body gets the same handle before its slot
/// has had four billion bodies, unless the space goes back to an earlier state by `clone_from`. Handles of two spaces
/// may be equal: don't mix them.
///
/// 64 bits: slot, then generation. Handles sort by slot. 0 is no handle, so `Option<Handle>` has 64 bits too. With the
/// feature `serde`, a handle is this number. In memory it is a [`NonZeroU64`].
///
/// ```
/// use sapwise::{Aabb, Body, Handle, Space};
///
/// let mut space = Space::new();
/// let ball = space.insert(Aabb::cube([0.0; 3], 1.0), Body::default())?;
/// let bits = ball.to_bits(); // for an engine that keeps integers
/// assert_eq!(Handle::from_bits(bits), Some(ball));
/// space.remove(ball)?;
/// assert!(!space.contains(ball));
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(transparent)]
pub struct Handle(NonZeroU64);

impl Handle {
    /// Makes a handle. `generation` must not be 0.
    pub(super) fn new(slot: u32, generation: u32) -> Self {
        Self(NonZeroU64::MIN.saturating_add((u64::from(slot) << 32 | u64::from(generation)) - 1))
    }

    /// Returns the 64 bits of the handle.
    pub fn to_bits(self) -> u64 {
        self.0.get()
    }

    /// Returns the handle with these bits, `None` for 0.
    pub fn from_bits(bits: u64) -> Option<Self> {
        NonZeroU64::new(bits).map(Self)
    }

    pub(super) fn slot(self) -> u32 {
        (self.0.get() >> 32) as u32
    }

    pub(super) fn generation(self) -> u32 {
        self.0.get() as u32
    }
}

impl fmt::Debug for Handle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Handle({}v{})", self.slot(), self.generation())
    }
}

impl fmt::Display for Handle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}v{}", self.slot(), self.generation())
    }
}
