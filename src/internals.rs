//! Items for the other crates of this repository. No promise is made about them.

pub use crate::adaptive::{Arrival, Background, Instances, Origin, SaveError, Setup, Start};
pub use crate::broad_phase::check_count;
pub use crate::cost::{Fallback, Helpers, MOST_UNIT_NS, Places, Residual, Work};
#[cfg(feature = "parallel")]
pub use crate::cpu::pinned_pool;
pub use crate::cpu::{Threads, Tree, Workers, triad};
pub use crate::gpu_identity::{GpuIdentity, GpuKind};
pub use crate::load::{SampledBoxes, SceneStats, StripGrid};
pub use crate::pairs::{FilterState, Pair};
pub use crate::ray::{Ray, RayDefect};
pub use crate::{splitmix, stats};
#[cfg(feature = "schema")]
pub use schemars;
#[cfg(feature = "serde")]
pub use serde;
