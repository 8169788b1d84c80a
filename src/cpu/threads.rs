//! Thread pools, shared by all algorithms of the same width.

#[cfg(feature = "parallel")]
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// One rayon pool for each number of threads that was asked for, made on first use.
#[derive(Debug, Default)]
pub(crate) struct Threads {
    #[cfg(feature = "parallel")]
    pools: Mutex<BTreeMap<u32, Arc<rayon::ThreadPool>>>,
}

impl Threads {
    /// The pool of `threads` threads.
    ///
    /// # Errors
    /// The reason, when the system refuses the threads.
    #[cfg(feature = "parallel")]
    pub(crate) fn pool(&self, threads: u32) -> Result<Arc<rayon::ThreadPool>, String> {
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pools.get(&threads) {
            return Ok(Arc::clone(pool));
        }
        let named = move |k| format!("sapwise-{threads}-{k}");
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(named).build();
        let pool = Arc::new(built.map_err(|e| format!("{threads} threads can't be started: {e}"))?);
        pools.insert(threads, Arc::clone(&pool));
        Ok(pool)
    }
}
