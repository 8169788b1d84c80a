//! The thread pools of a registry.

#[cfg(feature = "parallel")]
use crate::cpu::helpers::Helpers;
use crate::{Unavailable, clock};
#[cfg(feature = "parallel")]
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// One rayon pool for each number of helpers, shared by all algorithms and by the clones of this; or the program's own
/// pool for all.
#[derive(Debug, Default, Clone)]
pub struct Threads {
    /// Whether the threads of pools made from now on are pinned; see
    /// [`Registry::pin_threads`](crate::Registry::pin_threads).
    pub pinned: bool,
    /// Whether algorithms made from now on decide by counted work, and not by the clock: then they do the same work in
    /// every run.
    pub untimed: bool,
    #[cfg(feature = "parallel")]
    pools: Arc<Mutex<BTreeMap<Kind, Arc<Helpers>>>>,
    /// The program's pool; see [`Registry::use_pool`](crate::Registry::use_pool).
    #[cfg(feature = "parallel")]
    given: Option<Arc<Helpers>>,
}

/// The number of helpers of a pool, and whether they are pinned.
#[cfg(feature = "parallel")]
type Kind = (u32, bool);

impl Threads {
    /// Makes pools whose threads are pinned.
    pub fn pinned() -> Self {
        Self { pinned: true, ..Self::default() }
    }

    /// Takes a program's pool. Its threads run where the program has them.
    #[cfg(feature = "parallel")]
    pub fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        Self { given: Some(Arc::new(Helpers::of(pool))), ..Self::default() }
    }

    /// Returns what these threads are: `pinned`, `free`, or `given` by the program.
    #[cfg(feature = "parallel")]
    pub fn kind(&self) -> &'static str {
        match (&self.given, self.pinned && crate::cpu::placement::may_pin()) {
            (Some(_), _) => "given",
            (None, true) => "pinned",
            (None, false) => "free",
        }
    }

    /// Returns whether algorithms decide by measured times.
    pub(crate) fn timed(&self) -> bool {
        clock::is_fine() && !self.untimed
    }

    /// Returns the most threads of an algorithm, its caller among them, if the program's pool bounds them.
    pub fn most(&self) -> Option<u32> {
        #[cfg(feature = "parallel")]
        return self.given.as_ref().map(|given| given.count.saturating_add(1));
        #[cfg(not(feature = "parallel"))]
        None
    }

    /// Returns why an algorithm can't have `threads` threads if it may have as many as `cores`, or `None` if it can.
    pub(crate) fn unavailable(&self, threads: u32, cores: u32) -> Option<Unavailable> {
        if threads > 1 && !cfg!(feature = "parallel") {
            return Some(Unavailable::NotParallel);
        }
        let too_small =
            self.most().filter(|&most| threads > most).map(|most| Unavailable::PoolTooSmall { pool: most - 1 });
        too_small.or_else(|| (threads > cores).then_some(Unavailable::TooFewCores { threads, most: cores }))
    }

    /// Returns a pool of `count` helpers, which may not have started; the program's own pool may have more.
    #[cfg(feature = "parallel")]
    pub(crate) fn helpers(&self, count: u32) -> Arc<Helpers> {
        if let Some(given) = &self.given {
            return Arc::clone(given);
        }
        let make = || Arc::new(Helpers::new(count, self.pinned));
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(pools.entry((count, self.pinned)).or_insert_with(make))
    }
}
