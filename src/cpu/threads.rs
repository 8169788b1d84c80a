//! Thread pools, shared by all algorithms of the same width.

#[cfg(feature = "parallel")]
use crate::cpu::helpers::Helpers;
#[cfg(feature = "parallel")]
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// One rayon pool for each number of helpers that was asked for, made on first use.
#[derive(Debug, Default)]
pub(crate) struct Threads {
    /// Whether pools made from now on are pinned; see [`Registry::pin_threads`](crate::Registry::pin_threads).
    pub(crate) pinned: bool,
    #[cfg(feature = "parallel")]
    pools: Mutex<BTreeMap<u32, Arc<Helpers>>>,
}

impl Threads {
    /// Pools that are pinned.
    #[cfg(feature = "measure")]
    pub(crate) fn pinned() -> Self {
        Self { pinned: true, ..Self::default() }
    }

    /// A pool of `count` threads that help a caller.
    ///
    /// # Errors
    /// The reason, when the system refuses the threads.
    #[cfg(feature = "parallel")]
    pub(crate) fn helpers(&self, count: u32) -> Result<Arc<Helpers>, String> {
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pools.get(&count) {
            return Ok(Arc::clone(pool));
        }
        let pool = Arc::new(Helpers::new(count, self.pinned)?);
        pools.insert(count, Arc::clone(&pool));
        Ok(pool)
    }
}

/// A pool of `threads` threads, each bound to a core of its own, from core number `first` on, where that is wanted and there
/// are enough.
///
/// # Errors
/// The reason, when the system refuses the threads.
#[cfg(feature = "parallel")]
pub(crate) fn build_pool(threads: u32, first: usize, pinned: bool) -> Result<rayon::ThreadPool, String> {
    let cores = if pinned { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
    let bind = move |k: usize| {
        if let Some(&core) = cores.get(first + k).filter(|_| cores.len() >= first + threads as usize) {
            // A refusal leaves the thread to the scheduler, as without pinning.
            core_affinity::set_for_current(core);
        }
    };
    let named = move |k| format!("sapwise-{threads}-{k}");
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(named).start_handler(bind);
    builder.build().map_err(|e| format!("{threads} threads can't be started: {e}"))
}
