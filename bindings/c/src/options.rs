//! How pairs are searched.

use crate::{Failure, sw_status::*, text};
use sapwise::{Adaptive, AlgorithmId, Error, Registry, Tuning};
use sapwise_tune::{SaveError, StartOptions};
use std::ffi::c_char;
use std::sync::Arc;

/// How pairs are searched. All zero: the usual costs, on all cores that the process may use.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_options {
    /// The most threads, the calling one included. 0: as many as the process may use. 1: only the calling thread.
    pub threads: u32,
    /// SW_MEASURE and so on, joined by |.
    pub flags: u32,
    /// Always this algorithm, such as "bvh@cpu1", in place of the cheapest. NULL: the cheapest.
    pub algorithm: *const c_char,
    /// Folder of the costs that were measured before, in UTF-8. NULL: sapwise in the user's cache folder, for
    /// SW_MEASURE.
    pub cache_folder: *const c_char,
}

/// Loads the costs of this machine, or measures for two seconds if none are kept. Without it, costs are only loaded,
/// and only if there is a cache_folder.
pub const SW_MEASURE: u32 = 1;
/// Does that before the constructor returns. Without it, a background thread does, and usual costs decide meanwhile.
pub const SW_WAIT: u32 = 2;
/// Does not correct expected costs by the times of updates.
pub const SW_NO_LEARNING: u32 = 4;
/// Never tries an algorithm to learn its cost.
pub const SW_NO_EXPLORING: u32 = 8;

const ALL: u32 = SW_MEASURE | SW_WAIT | SW_NO_LEARNING | SW_NO_EXPLORING;

impl sw_options {
    pub(crate) const USUAL: Self =
        Self { threads: 0, flags: 0, algorithm: std::ptr::null(), cache_folder: std::ptr::null() };

    pub(crate) fn registry(&self) -> Registry {
        if self.threads == 0 { Registry::new() } else { Registry::with_cores(self.threads) }
    }

    /// # Safety
    /// The texts are NULL or end with a zero.
    pub(crate) unsafe fn adaptive(&self, registry: Registry) -> Result<Adaptive, Failure> {
        let invalid = |text: String| Err(Failure::new(SW_INVALID_ARGUMENT, text));
        if self.flags & !ALL != 0 {
            return invalid(format!("the flags of sw_options are {:#x}; use SW_MEASURE and so on", self.flags));
        }
        // SAFETY: of the caller.
        let (algorithm, cache) = unsafe {
            (text::read(self.algorithm, "algorithm of sw_options")?, text::read(self.cache_folder, "cache_folder")?)
        };
        let has = |flag| self.flags & flag != 0;
        let mut adaptive = match algorithm {
            Some(_) if cache.is_some() || has(SW_MEASURE) => {
                return invalid("sw_options has an algorithm and costs to choose by; drop one of the two".to_owned());
            }
            Some(name) => Adaptive::only(parse(name, &registry)?, &registry)?,
            None if cache.is_none() && !has(SW_MEASURE) => Adaptive::new(Tuning::usual(&registry), &registry)?,
            None => {
                let start = StartOptions::new().background(!has(SW_WAIT)).registry(Arc::new(registry));
                let start = if let Some(folder) = cache { start.cache(Some(folder.into())) } else { start };
                sapwise_tune::for_this_machine(&if has(SW_MEASURE) { start } else { start.measure(None) })?
            }
        };
        adaptive.set_learning(!has(SW_NO_LEARNING));
        adaptive.set_exploring(!has(SW_NO_EXPLORING));
        Ok(adaptive)
    }
}

fn parse(name: &str, registry: &Registry) -> Result<AlgorithmId, Failure> {
    name.parse().map_err(|_| {
        let known: Vec<String> = registry.available().iter().map(|entry| entry.id.to_string()).collect();
        let hint = format!("known here: {}", known.join(", "));
        Error::UnknownAlgorithm { text: name.to_owned(), hint }.into()
    })
}

/// Saves what a search has learned.
pub(crate) fn save(search: &Adaptive) -> Result<(), Failure> {
    let why = match search.save() {
        Ok(true) => return Ok(()),
        Ok(false) => "there are no costs to keep: sw_space_describe and sw_search_describe have the reason".to_owned(),
        Err(SaveError::NoCache) => "there is no cache; set SW_MEASURE or cache_folder in sw_options".to_owned(),
        Err(error) => std::error::Error::source(&error).map_or(error.to_string(), |why| format!("{error}: {why}")),
    };
    Err(Failure::new(SW_CACHE, why))
}
