//! Why a search finds no answer.

mod gpu;

use crate::algorithm::AlgorithmId;
use crate::space::Handle;
use std::fmt;

pub use crate::algorithm::ParseIdError;
pub use crate::cost::CurveError;
pub use crate::named::UnknownName;
pub use crate::ray::RayDefect;
pub use crate::tuning::TuningError;
pub use gpu::{GpuError, GpuErrorKind};

/// Why a broad phase returned no answer. The content of the pairs is unspecified after an error.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A box that can't be ordered.
    InvalidBox {
        /// Position of the first such box in the input.
        index: usize,
        /// What is wrong with it.
        defect: BoxDefect,
    },
    /// More boxes than the 32-bit members of a pair can name.
    TooManyObjects {
        /// Boxes in the input.
        objects: usize,
    },
    /// More wanted pairs than [`Pairs::set_limit`](crate::Pairs::set_limit) allows. The search ended there.
    TooManyPairs {
        /// The limit that was set.
        limit: usize,
    },
    /// A member of a pair without an id in [`Changes::update`](crate::Changes::update).
    MissingId {
        /// The position of the member in the input.
        position: u32,
        /// Number of ids.
        ids: usize,
    },
    /// A handle that names no body of the [`Space`](crate::Space): the body was removed, or the handle is of another
    /// space.
    StaleHandle {
        /// The handle that was given.
        handle: Handle,
    },
    /// A box that can't be ordered, for a body of a [`Space`](crate::Space).
    InvalidBody {
        /// The body.
        handle: Handle,
        /// What is wrong with its box.
        defect: BoxDefect,
    },
    /// A ray, a motion or a point that can't be searched along or from.
    InvalidRay {
        /// What is wrong with it.
        defect: RayDefect,
    },
    /// Starts of [`Worlds`](crate::Worlds) that do not begin with 0, ascend and end with the number of boxes.
    InvalidStarts {
        /// Position of the first wrong start.
        index: usize,
        /// That start.
        start: usize,
        /// Number of boxes.
        boxes: usize,
    },
    /// An allocation was refused.
    OutOfMemory {
        /// What the elements are.
        what: &'static str,
        /// How many were asked for.
        elements: usize,
    },
    /// The algorithm is known but can't run here. [`Adaptive`](crate::Adaptive) then runs another one in the same
    /// frame.
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
        /// What is accepted.
        hint: String,
    },
    /// The tuning names no algorithm.
    NoAlgorithm,
}

/// What makes a box invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoxDefect {
    /// A bound is not a number.
    NotANumber,
    /// A minimum is above its maximum.
    Inverted,
}

/// Why an algorithm can't run here.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unavailable {
    /// It needs threads and the feature `parallel`.
    NotParallel,
    /// It needs more threads than the program's pool has, plus the calling one.
    PoolTooSmall {
        /// Threads of the pool.
        pool: u32,
    },
    /// It needs more threads than this machine has cores, or than
    /// [`Registry::with_cores`](crate::Registry::with_cores) allows.
    TooFewCores {
        /// Threads that it needs.
        threads: u32,
        /// The most that are allowed.
        most: u32,
    },
    /// The system refuses the threads.
    ThreadsRefused {
        /// Threads that were asked for.
        threads: u32,
        /// The error of the system.
        message: String,
    },
    /// It runs on a fixed number of threads.
    FixedThreads {
        /// Another number that was wanted.
        wanted: u32,
    },
    /// The tuning has the cost of another revision.
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
    Gpu(GpuError),
    /// Another reason, in a sentence: for your own algorithms.
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

impl fmt::Display for BoxDefect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotANumber => "has a bound that is not a number (NaN)",
            Self::Inverted => "is inverted: a minimum is above its maximum",
        })
    }
}

impl fmt::Display for Unavailable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotParallel => f.write_str("built without the feature `parallel`"),
            Self::PoolTooSmall { pool } => {
                write!(
                    f,
                    "needs more than the {pool} threads of the given pool and the calling one; give a larger pool"
                )
            }
            Self::TooFewCores { threads, most } => {
                write!(
                    f,
                    "needs {threads} threads, but this machine has {most}; run `sapwise predict` again or raise \
                     `Registry::with_cores`"
                )
            }
            Self::ThreadsRefused { threads, message } => write!(f, "{threads} threads can't be started: {message}"),
            Self::FixedThreads { wanted } => write!(f, "can't run on {wanted} threads"),
            Self::OtherRevision { cost, build } => {
                write!(f, "the tuning knows revision {cost}, this build has {build}; run `sapwise predict` again")
            }
            Self::FailedBefore => f.write_str("failed in an earlier frame"),
            Self::AllFailed => f.write_str("every algorithm of the tuning has failed"),
            Self::Gpu(error) => error.fmt(f),
            Self::Other(text) => f.write_str(text),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::InvalidBox { index, defect } => {
                write!(f, "box {index} {defect}; correct it or leave it out")
            }
            Error::TooManyObjects { objects } => {
                write!(
                    f,
                    "{objects} boxes are more than the {} that 32-bit pair members can name; split the scene",
                    u32::MAX
                )
            }
            Error::TooManyPairs { limit } => {
                write!(f, "more pairs than the limit of {limit}; raise the limit or thin out the scene")
            }
            Error::MissingId { position, ids } => {
                write!(f, "box {position} is in a pair, but there are {ids} ids; give one for each box")
            }
            Error::StaleHandle { handle } => {
                write!(f, "handle {handle} names no body of this space; it was removed, or is of another space")
            }
            Error::InvalidBody { handle, defect } => {
                write!(f, "the box for body {handle} {defect}; the body keeps its previous box")
            }
            Error::InvalidRay { defect } => write!(f, "the ray {defect}; correct it or leave the query out"),
            Error::InvalidStarts { index, start, boxes } => {
                write!(
                    f,
                    "start {index} of the worlds is {start}; begin with 0, ascend, and end with the {boxes} boxes as \
                     the last start"
                )
            }
            Error::OutOfMemory { what, elements } => {
                write!(f, "no memory for {elements} {what}; set a limit on the pairs or use fewer boxes")
            }
            Error::Unavailable { algorithm, reason } => {
                write!(f, "{algorithm} can't run here: ")?;
                // With the same flags: `{:#}` adds the words of a driver.
                reason.fmt(f)
            }
            Error::UnknownAlgorithm { text, hint } => {
                write!(f, "no algorithm is called {text:?}; {hint}")
            }
            Error::NoAlgorithm => f.write_str("the tuning names no algorithm; make one with `sapwise predict`"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            // This text contains that of the error, but not that of its source.
            Self::Unavailable { reason: Unavailable::Gpu(error), .. } => error.source(),
            _ => None,
        }
    }
}
