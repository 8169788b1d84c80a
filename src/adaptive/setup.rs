//! How an [`Adaptive`](super::Adaptive) came to its tuning, and where what it learns is kept.

use super::instances::Instances;
use crate::measure::Pace;
use crate::tuning::Tuning;
use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// How an [`Adaptive`](crate::Adaptive) came to its tuning.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Setup {
    /// Where the tuning came from.
    pub origin: Origin,
    /// What went otherwise than it should have, in words: an unreadable cache, a GPU that can't be measured. Nothing of it keeps frames
    /// from being run.
    pub remarks: Vec<String>,
    /// From the call of the constructor until the algorithms of the tuning were ready, in seconds.
    pub seconds: f64,
    /// The file of the cache, where there is one to be.
    pub file: Option<PathBuf>,
}

/// Where the tuning of an [`Adaptive`](crate::Adaptive) came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Origin {
    /// The program gave it: [`Adaptive::new`](crate::Adaptive::new).
    #[default]
    Given,
    /// It is on its way; the usual tuning decides meanwhile. Looked for at every frame.
    Awaited,
    /// From the cache.
    Cached,
    /// From a measurement of the hardware and a prediction.
    Probed,
    /// [`Tuning::usual`](crate::Tuning::usual) for good, since there was no prediction: the remarks say why.
    Usual,
}

/// Why [`Adaptive::save`](crate::Adaptive::save) has stored nothing.
#[derive(Debug)]
#[non_exhaustive]
pub enum SaveError {
    /// The program gave the tuning, and keeps it itself.
    Given,
    /// There is no cache to keep it in.
    NoCache,
    /// The tuning can't be written as JSON.
    Encode(Box<dyn std::error::Error + Send + Sync>),
    /// The file can't be written.
    Write {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Given => f.write_str(
                "the tuning was given by the program; write `Adaptive::learned` to a file with `json::write_tuning`",
            ),
            Self::NoCache => f.write_str("there is no cache to keep it in; `Adaptive::setup` and the options say why"),
            Self::Encode(_) => f.write_str("the tuning can't be written as JSON"),
            Self::Write { file, .. } => write!(f, "{} can't be written", file.display()),
        }
    }
}

impl std::error::Error for SaveError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Encode(source) => Some(&**source),
            Self::Write { source, .. } => Some(source),
            _ => None,
        }
    }
}

/// Where tuning is kept for the next start.
pub(crate) trait Keeper: fmt::Debug + Send + Sync {
    /// Keeps it in place of what is there.
    fn keep(&self, tuning: Tuning) -> Result<(), SaveError>;
}

/// What an [`Adaptive`](super::Adaptive) keeps of its start.
#[derive(Debug, Default)]
pub(crate) struct Start {
    pub(crate) setup: Setup,
    /// Keeps tuning that holds for this machine.
    pub(crate) keeper: Option<Box<dyn Keeper>>,
    pub(crate) awaited: Option<Awaited>,
}

impl Start {
    /// Keeps what was learned. `false` where there is nothing that could have been corrected.
    pub(super) fn save(&self, learned: impl FnOnce() -> Tuning) -> Result<bool, SaveError> {
        match (&self.keeper, self.setup.origin) {
            (Some(keeper), _) => keeper.keep(learned()).map(|()| true),
            (None, Origin::Given) => Err(SaveError::Given),
            (None, Origin::Awaited | Origin::Usual) => Ok(false),
            (None, Origin::Cached | Origin::Probed) => Err(SaveError::NoCache),
        }
    }

    /// What the thread in the background has made, once it is there. One look at a flag until then, and nothing after.
    pub(super) fn arrived(&mut self) -> Option<(Tuning, Instances)> {
        let awaited = self.awaited.take_if(|a| a.handover.ready.load(Ordering::Acquire))?;
        let arrival = awaited.handover.slot().take()?;
        (self.setup, self.keeper) = (arrival.setup, arrival.keeper);
        arrival.tuning
    }
}

/// Where the thread in the background leaves what it has made.
#[derive(Debug, Default)]
pub(crate) struct Handover {
    /// The slot is filled and will not be touched by that thread again.
    ready: AtomicBool,
    slot: Mutex<Option<Arrival>>,
    filled: Condvar,
}

impl Handover {
    fn slot(&self) -> MutexGuard<'_, Option<Arrival>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Leaves what was made; once, and last of all.
    pub(crate) fn leave(&self, arrival: Arrival) {
        let mut slot = self.slot();
        *slot = Some(arrival);
        // Under the lock, so that nobody looks before it and goes to sleep after it.
        self.ready.store(true, Ordering::Release);
        drop(slot);
        self.filled.notify_all();
    }

    /// Waits until something was left, but no longer than that. Whether there was.
    fn wait(&self, at_most: Duration) -> bool {
        let waits = |_: &mut Option<Arrival>| !self.ready.load(Ordering::Acquire);
        drop(self.filled.wait_timeout_while(self.slot(), at_most, waits));
        self.ready.load(Ordering::Acquire)
    }
}

/// How long who ends waits for the thread in the background. It looks whether it is to stop after each sample, of which the longest take
/// tenths of a second; the driver of a GPU may hold it longer.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// The thread in the background. It ends with who waits for it.
#[derive(Debug)]
pub(crate) struct Awaited {
    pub(crate) handover: Arc<Handover>,
    pub(crate) pace: Arc<Pace>,
    pub(crate) thread: Option<JoinHandle<()>>,
}

impl Awaited {
    /// Waits for it while it does nothing else, but no longer than that; from then on it leaves most of the time to the program.
    pub(crate) fn wait(&self, at_most: Duration) {
        self.handover.wait(at_most);
        self.pace.go_gently();
    }
}

impl Drop for Awaited {
    fn drop(&mut self) {
        self.pace.stop();
        if self.handover.wait(LAST_WAIT) {
            // It has nothing left to do. Its panics were caught.
            let _ = self.thread.take().map(JoinHandle::join);
        }
    }
}

/// What becomes of the usual tuning.
pub(crate) struct Arrival {
    pub(crate) setup: Setup,
    pub(crate) keeper: Option<Box<dyn Keeper>>,
    /// `None`: the usual one stays.
    pub(crate) tuning: Option<(Tuning, Instances)>,
}

impl fmt::Debug for Arrival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Arrival").field("setup", &self.setup).finish_non_exhaustive()
    }
}
