//! The origin of the tuning of an [`Adaptive`](super::Adaptive), and the cache to which `save` writes.

use super::instances::Instances;
use super::warming::end;
use crate::tuning::Tuning;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// The origin of the tuning of an [`Adaptive`](crate::Adaptive).
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Setup {
    /// Source of the tuning.
    pub origin: Origin,
    /// Problems, one sentence each: an unreadable cache, a GPU that can't be measured. Frames run all the same.
    pub remarks: Vec<String>,
    /// Seconds from the call of the constructor until the algorithms of the tuning were ready.
    pub seconds: f64,
    /// The cache file of the tuning, also if it could not be written; `None` without a cache.
    pub file: Option<PathBuf>,
}

/// The source of the tuning of an [`Adaptive`](crate::Adaptive).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Origin {
    /// From the program: [`Adaptive::new`](crate::Adaptive::new).
    #[default]
    Given,
    /// A background thread still reads or measures. [`Tuning::usual`](crate::Tuning::usual) decides meanwhile, and
    /// every frame checks whether the thread has ended.
    Awaited,
    /// From the cache.
    Cached,
    /// Predicted from a measurement of the hardware.
    Probed,
    /// [`Tuning::usual`](crate::Tuning::usual) for good, because nothing could be predicted; the remarks say why.
    Usual,
}

/// Why [`Adaptive::save`](crate::Adaptive::save) wrote nothing.
#[derive(Debug)]
#[non_exhaustive]
pub enum SaveError {
    /// The program gave the tuning, or started without a cache folder.
    NoCache,
    /// The file can't be written.
    Write {
        /// The file.
        file: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCache => f.write_str(
                "this tuning has no cache file; start with `StartOptions::cache`, or write `Adaptive::learned` with \
                 `json::write_tuning`",
            ),
            Self::Write { file, .. } => write!(f, "{} can't be written", file.display()),
        }
    }
}

impl std::error::Error for SaveError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Write { source, .. } => Some(source),
            Self::NoCache => None,
        }
    }
}

/// Writes a tuning to the cache. Returns `false` if the tuning must not be kept.
pub(super) type Save = Arc<dyn Fn(&Tuning) -> Result<bool, SaveError> + Send + Sync>;

/// The state of an [`Adaptive`](super::Adaptive) that depends on its start.
#[derive(Default)]
pub struct Start {
    /// The origin of the tuning.
    pub setup: Setup,
    /// Saves a learned tuning; `None` without a cache.
    pub save: Option<Save>,
    /// The thread that still measures.
    pub background: Option<Background>,
}

/// The result of a start. Without a tuning the usual one stays.
pub type Arrival = (Start, Option<(Tuning, Instances)>);

impl Start {
    /// Returns the start of a clone, for which nothing will arrive.
    pub(super) fn twin(&self) -> Self {
        let (mut setup, save) = (self.setup.clone(), self.save.clone());
        if setup.origin == Origin::Awaited {
            setup.origin = Origin::Usual;
            setup.remarks.push("cloned before the measurement ended: the usual tuning stays".to_owned());
        }
        Self { setup, save, background: None }
    }

    /// Saves the learned tuning. Returns `false` if the tuning has not arrived, could not be predicted, or must not be
    /// kept.
    pub(super) fn save(&self, learned: impl FnOnce() -> Tuning) -> Result<bool, SaveError> {
        match (&self.save, self.setup.origin) {
            (Some(save), _) => save(&learned()),
            (None, Origin::Awaited | Origin::Usual) => Ok(false),
            (None, _) => Err(SaveError::NoCache),
        }
    }

    /// Takes the result of the background thread if the thread has ended. Until then a call loads one flag.
    pub(super) fn arrived(&mut self) -> Option<(Tuning, Instances)> {
        let thread = self.background.as_mut()?.thread.take_if(|thread| thread.is_finished())?;
        self.background = None;
        let Ok((start, tuning)) = thread.join() else {
            self.setup.origin = Origin::Usual;
            self.setup.remarks.push("the background thread panicked: the usual tuning stays".to_owned());
            return None;
        };
        *self = start;
        tuning
    }
}

/// The thread that measures while frames run. Dropping the [`Adaptive`](super::Adaptive) stops it.
pub struct Background {
    /// The thread; `None` after it was joined.
    pub thread: Option<JoinHandle<Arrival>>,
    /// Whether the thread should stop.
    pub stop: Arc<AtomicBool>,
}

impl Drop for Background {
    // The thread reads the flag after each sample. The longest samples take tenths of a second.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        end(self.thread.take());
    }
}
