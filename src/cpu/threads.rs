//! Thread pools, shared by all algorithms of the same width, or the one pool of the program's.

#[cfg(feature = "parallel")]
use crate::cpu::helpers::Helpers;
use crate::error::Unavailable;
#[cfg(feature = "parallel")]
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// One rayon pool for each number of helpers that was asked for, made on first use; or the program's own pool for all.
#[derive(Debug, Default)]
pub(crate) struct Threads {
    /// Whether pools made from now on are pinned; see [`Registry::pin_threads`](crate::Registry::pin_threads).
    pub(crate) pinned: bool,
    #[cfg(feature = "parallel")]
    pools: Mutex<BTreeMap<u32, Arc<Helpers>>>,
    /// The program's pool, with the number of its threads; see [`Registry::use_pool`](crate::Registry::use_pool).
    #[cfg(feature = "parallel")]
    given: Option<(u32, Arc<Helpers>)>,
}

impl Threads {
    /// Pools that are pinned.
    #[cfg(feature = "measure")]
    pub(crate) fn pinned() -> Self {
        Self { pinned: true, ..Self::default() }
    }

    /// The threads of a program's pool. They stay where the program has them.
    #[cfg(feature = "parallel")]
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        let threads = u32::try_from(pool.current_num_threads()).unwrap_or(u32::MAX);
        Self { given: Some((threads, Arc::new(Helpers::of(pool)))), ..Self::default() }
    }

    /// Which threads these are: `pinned`, `free`, or `given` by the program.
    #[cfg(feature = "this-machine")]
    pub(crate) fn kind(&self) -> &'static str {
        match (&self.given, self.pinned && crate::cpu::seats::may_bind()) {
            (Some(_), _) => "given",
            (None, true) => "pinned",
            (None, false) => "free",
        }
    }

    /// The most threads that an algorithm may have, its caller's among them, where a program's pool says so.
    pub(crate) fn most(&self) -> Option<u32> {
        #[cfg(feature = "parallel")]
        return self.given.as_ref().map(|(threads, _)| threads.saturating_add(1));
        #[cfg(not(feature = "parallel"))]
        None
    }

    /// Why an algorithm can't have `threads` threads, if it can't.
    pub(crate) fn unavailable(&self, threads: u32) -> Option<Unavailable> {
        if threads > 1 && !cfg!(feature = "parallel") {
            return Some(Unavailable::NotParallel);
        }
        let most = self.most().filter(|&most| threads > most)?;
        Some(Unavailable::PoolTooSmall { pool: most - 1 })
    }

    /// A pool of `count` threads that help a caller. More than `count` where the program gave one.
    ///
    /// # Errors
    /// [`Unavailable::ThreadsRefused`].
    #[cfg(feature = "parallel")]
    pub(crate) fn helpers(&self, count: u32) -> Result<Arc<Helpers>, Unavailable> {
        if let Some((_, given)) = &self.given {
            return Ok(Arc::clone(given));
        }
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pools.get(&count) {
            return Ok(Arc::clone(pool));
        }
        let pool = Arc::new(Helpers::new(count, self.pinned)?);
        pools.insert(count, Arc::clone(&pool));
        Ok(pool)
    }
}
