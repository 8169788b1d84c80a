//! Why a search finds no answer.

mod gpu;

use crate::algorithm::AlgorithmId;
use crate::space::Handle;

pub use crate::algorithm::ParseIdError;
pub use crate::cost::CurveError;
pub use crate::named::UnknownName;
pub use crate::ray::RayDefect;
pub use crate::tuning::TuningError;
pub use gpu::{GpuError, GpuErrorKind};

crate::described! {
    /// Why a broad phase returned no answer. The content of the pairs is unspecified after an error.
    ///
    /// ```
    /// use sapwise::error::BoxDefect;
    /// use sapwise::{Aabb, BroadPhase, Error, Pairs, Registry};
    ///
    /// let mut brute = Registry::new().create(&"brute@cpu1".parse().unwrap())?;
    /// let wrong = Aabb::cube([f32::NAN; 3], 1.0);
    /// let told = brute.find_pairs(&[wrong], &mut Pairs::new());
    /// assert_eq!(told, Err(Error::InvalidBox { index: 0, defect: BoxDefect::NotANumber }));
    /// # Ok::<(), sapwise::Error>(())
    /// ```
    #[derive(Debug, Clone, PartialEq)]
    #[non_exhaustive]
    pub enum Error {
        /// A box that can't be ordered.
        InvalidBox {
            /// Position of the first such box in the input.
            index: usize,
            /// What is wrong with it.
            defect: BoxDefect,
        } = "box {index} {defect}; correct it or leave it out",
        /// More boxes than the 32-bit members of a pair can name.
        TooManyObjects {
            /// Boxes in the input.
            objects: usize,
        } = "{objects} boxes are more than the 4294967295 that 32-bit pair members can name; split the scene",
        /// More wanted pairs than [`Pairs::set_limit`](crate::Pairs::set_limit) allows. The search ended there.
        TooManyPairs {
            /// The limit that was set.
            limit: usize,
        } = "more pairs than the limit of {limit}; raise the limit or thin out the scene",
        /// A member of a pair without an id in [`Changes::update`](crate::Changes::update).
        MissingId {
            /// The position of the member in the input.
            position: u32,
            /// Number of ids.
            ids: usize,
        } = "box {position} is in a pair, but there are {ids} ids; give one for each box",
        /// A handle that names no body of the [`Space`](crate::Space): the body was removed, or the handle is of
        /// another space.
        StaleHandle {
            /// The handle that was given.
            handle: Handle,
        } = "handle {handle} names no body of this space; it was removed, or is of another space",
        /// A box that can't be ordered, for a body of a [`Space`](crate::Space).
        InvalidBody {
            /// The body.
            handle: Handle,
            /// What is wrong with its box.
            defect: BoxDefect,
        } = "the box for body {handle} {defect}; the body keeps its previous box",
        /// A ray, a motion or a point that can't be searched along or from.
        InvalidRay {
            /// What is wrong with it.
            defect: RayDefect,
        } = "the ray {defect}; correct it or leave the query out",
        /// Starts of [`Worlds`](crate::Worlds) that do not begin with 0, ascend and end with the number of boxes.
        InvalidStarts {
            /// Position of the first wrong start.
            index: usize,
            /// That start.
            start: usize,
            /// Number of boxes.
            boxes: usize,
        } = "start {index} of the worlds is {start}; begin with 0, ascend, and end with the {boxes} boxes as the \
             last start",
        /// An allocation was refused.
        OutOfMemory {
            /// What the elements are.
            what: &'static str,
            /// How many were asked for.
            elements: usize,
        } = "no memory for {elements} {what}; set a limit on the pairs or use fewer boxes",
        /// The algorithm is known but can't run here. [`Adaptive`](crate::Adaptive) then runs another one in the same
        /// frame.
        Unavailable {
            /// The algorithm that was asked for.
            algorithm: AlgorithmId,
            /// Why it can't run.
            reason: Unavailable,
        } = "{algorithm} can't run here: {reason}" | "{algorithm} can't run here: {reason:#}",
        /// No algorithm of this name is registered.
        UnknownAlgorithm {
            /// The text that was given.
            text: String,
            /// What is accepted.
            hint: String,
        } = "no algorithm is called {text:?}; {hint}",
        /// The tuning names no algorithm.
        NoAlgorithm = "the tuning names no algorithm; make one with `sapwise predict`",
    }
}

crate::described! {
    /// What makes a box invalid.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum BoxDefect {
        /// A bound is not a number.
        NotANumber = "has a bound that is not a number (NaN)",
        /// A minimum is above its maximum.
        Inverted = "is inverted: a minimum is above its maximum",
    }
}

crate::described! {
    /// Why an algorithm can't run here.
    ///
    /// ```
    /// use sapwise::error::{Error, Unavailable};
    /// use sapwise::Registry;
    ///
    /// let told = Registry::with_cores(2).create(&"sap@cpu4".parse().unwrap()).err();
    /// use Unavailable::TooFewCores;
    /// assert!(matches!(told, Some(Error::Unavailable { reason: TooFewCores { threads: 4, .. }, .. })));
    /// ```
    #[derive(Debug, Clone, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Unavailable {
        /// It needs threads and the feature `parallel`.
        NotParallel = "built without the feature `parallel`",
        /// It needs more threads than the program's pool has, plus the calling one.
        PoolTooSmall {
            /// Threads of the pool.
            pool: u32,
        } = "needs more than the {pool} threads of the given pool and the calling one; give a larger pool",
        /// It needs more threads than this machine has cores, or than
        /// [`Registry::with_cores`](crate::Registry::with_cores) allows.
        TooFewCores {
            /// Threads that it needs.
            threads: u32,
            /// The most that are allowed.
            most: u32,
        } = "needs {threads} threads, but this machine has {most}; run `sapwise predict` again or raise \
             `Registry::with_cores`",
        /// The system refuses the threads.
        ThreadsRefused {
            /// Threads that were asked for.
            threads: u32,
            /// The error of the system.
            message: String,
        } = "{threads} threads can't be started: {message}",
        /// The tuning has the cost of another revision.
        OtherRevision {
            /// The revision of the cost.
            cost: u32,
            /// The revision of this build.
            build: u32,
        } = "the tuning knows revision {cost}, this build has {build}; run `sapwise predict` again",
        /// It failed in an earlier frame.
        FailedBefore = "failed in an earlier frame",
        /// Every algorithm of the tuning failed.
        AllFailed = "every algorithm of the tuning has failed",
        /// Its GPU can't run it.
        Gpu(error: GpuError) = "{error}" | "{error:#}",
        /// Another reason, in a sentence: for your own algorithms.
        Other(text: String) = "{text}",
    }
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

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            // This text contains that of the error, but not that of its source.
            Self::Unavailable { reason: Unavailable::Gpu(error), .. } => error.source(),
            _ => None,
        }
    }
}
