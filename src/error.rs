//! What can go wrong while pairs are searched.

#[cfg(feature = "gpu")]
mod gpu;

use crate::algorithm::AlgorithmId;
use std::fmt;

#[cfg(feature = "gpu")]
pub use gpu::{GpuError, GpuErrorKind};

/// Why a broad phase returned no answer. The list of pairs is unspecified after an error and valid again after the next success.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A box that no algorithm can order.
    InvalidBox {
        /// Position of the first such box in the input.
        index: usize,
        /// What is wrong with it.
        defect: BoxDefect,
    },
    /// More boxes than pair members of 32 bits can name.
    TooManyObjects {
        /// Boxes in the input.
        objects: usize,
    },
    /// More wanted pairs than [`Pairs::set_limit`](crate::Pairs::set_limit) allows. The search ended there, so how many there are is not
    /// known.
    TooManyPairs {
        /// The limit that was set.
        limit: usize,
    },
    /// A pair has a member that has no id in [`Changes::update`](crate::Changes::update).
    MissingId {
        /// The position of the member in the input.
        position: u32,
        /// Ids that were given.
        ids: usize,
    },
    /// An allocation was refused.
    OutOfMemory {
        /// What the memory was for.
        what: &'static str,
        /// Elements that were asked for.
        elements: usize,
    },
    /// The algorithm is known but can't run here. [`Adaptive`](crate::Adaptive) then runs another one in the same frame.
    Unavailable {
        /// The algorithm that was asked for.
        algorithm: AlgorithmId,
        /// Why it can't run.
        reason: Unavailable,
    },
    /// No algorithm of this name is registered.
    UnknownAlgorithm {
        /// The text that was given.
        text: String,
        /// What would have been accepted.
        hint: String,
    },
    /// The tuning names no algorithm at all.
    NoAlgorithm,
}

/// What makes a box invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoxDefect {
    /// A bound is not a number.
    NotANumber,
    /// A minimum lies above its maximum.
    Inverted,
}

/// Why an algorithm can't run here.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unavailable {
    /// It needs threads, and the library was built without the feature `parallel`.
    NotParallel,
    /// It needs more threads than the program's pool and the calling one are.
    PoolTooSmall {
        /// Threads of the pool.
        pool: u32,
    },
    /// It needs more threads than this machine has cores, or than [`Registry::with_cores`](crate::Registry::with_cores) says.
    TooFewCores {
        /// Threads that it needs.
        threads: u32,
        /// The most that an algorithm may have.
        most: u32,
    },
    /// The system refuses the threads.
    ThreadsRefused {
        /// Threads that were asked for.
        threads: u32,
        /// What the system says.
        message: String,
    },
    /// It runs on a fixed number of threads, which is not the one that is wanted.
    FixedThreads {
        /// Threads that were wanted.
        wanted: u32,
    },
    /// Its cost is of another revision than this build has.
    OtherRevision {
        /// The revision of the cost.
        cost: u32,
        /// The revision of this build.
        build: u32,
    },
    /// It failed in an earlier frame.
    FailedBefore,
    /// Every algorithm of the tuning failed.
    AllFailed,
    /// Its GPU can't run it.
    #[cfg(feature = "gpu")]
    Gpu(GpuError),
    /// Anything else, in a sentence: for algorithms of the user's.
    Other(String),
}

impl From<&str> for Unavailable {
    fn from(text: &str) -> Self {
        Self::Other(text.to_owned())
    }
}

impl From<String> for Unavailable {
    fn from(text: String) -> Self {
        Self::Other(text)
    }
}

impl fmt::Display for Unavailable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotParallel => f.write_str("built without the feature `parallel`"),
            Self::PoolTooSmall { pool } => {
                write!(
                    f,
                    "the pool that the program gave has {pool} threads, with the calling one {}",
                    pool.saturating_add(1)
                )
            }
            Self::TooFewCores { threads, most } => {
                write!(
                    f,
                    "it has {threads} threads, and {most} threads are the most here; predict again on this machine, \
                     or ask for more with `Registry::with_cores`"
                )
            }
            Self::ThreadsRefused { threads, message } => write!(f, "{threads} threads can't be started: {message}"),
            Self::FixedThreads { wanted } => write!(f, "it can't run on {wanted} threads"),
            Self::OtherRevision { cost, build } => {
                write!(f, "its cost is of revision {cost}, this build has {build}; predict again")
            }
            Self::FailedBefore => f.write_str("it failed before"),
            Self::AllFailed => f.write_str("every algorithm of the tuning has failed"),
            #[cfg(feature = "gpu")]
            Self::Gpu(error) => error.fmt(f),
            Self::Other(text) => f.write_str(text),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::InvalidBox { index, defect } => {
                let what = match defect {
                    BoxDefect::NotANumber => "has a bound that is not a number (NaN)",
                    BoxDefect::Inverted => "is inverted: a minimum lies above its maximum",
                };
                write!(f, "box {index} {what}; correct or leave out this box")
            }
            Error::TooManyObjects { objects } => {
                write!(
                    f,
                    "{objects} boxes are more than the {} that 32-bit pair members can name; split the scene",
                    u32::MAX
                )
            }
            Error::TooManyPairs { limit } => {
                write!(f, "more pairs overlap than the limit of {limit}; raise the limit or thin out the scene")
            }
            Error::MissingId { position, ids } => {
                write!(f, "box {position} is in a pair and has no id: {ids} were given; give one for each box")
            }
            Error::OutOfMemory { what, elements } => {
                write!(f, "no memory for {elements} {what}; set a limit on the pairs or use fewer boxes")
            }
            Error::Unavailable { algorithm, reason } => {
                write!(f, "{algorithm} can't run here: ")?;
                // With the same flags: `{:#}` writes the words of a driver too.
                reason.fmt(f)
            }
            Error::UnknownAlgorithm { text, hint } => {
                write!(f, "no algorithm is called {text:?}; {hint}")
            }
            Error::NoAlgorithm => f.write_str("this tuning names no algorithm; make one with `sapwise predict`"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            #[cfg(feature = "gpu")]
            // Its text is part of this one, its source is not.
            Self::Unavailable { reason: Unavailable::Gpu(error), .. } => error.source(),
            _ => None,
        }
    }
}
