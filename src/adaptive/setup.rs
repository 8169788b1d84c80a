//! How an [`Adaptive`](super::Adaptive) came to its tuning, and where what it learns is kept.

use super::instances::Instances;
use crate::hardware::Measurement;
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
    /// When and how the hardware was measured, or when the tuning of its kind was first taken; `None` for tuning that was given, and for the usual one.
    pub measured: Option<Measurement>,
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
    /// From the folder with tunings of kinds of machines: [`StartOptions::tunings`](crate::StartOptions::tunings).
    Shipped,
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
    /// Keeps it in place of what is there. Frames took so many times what was predicted since the start.
    fn keep(&self, tuning: Tuning, over_predicted: f64) -> Result<(), SaveError>;
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
    /// Keeps what was learned: tuning, and how many times what was predicted frames took. `false` where there is nothing that could have been
    /// corrected.
    pub(super) fn save(&self, learned: impl FnOnce() -> (Tuning, f64)) -> Result<bool, SaveError> {
        match (&self.keeper, self.setup.origin) {
            (Some(keeper), _) => {
                let (tuning, over_predicted) = learned();
                keeper.keep(tuning, over_predicted).map(|()| true)
            }
            (None, Origin::Given) => Err(SaveError::Given),
            (None, Origin::Awaited | Origin::Usual) => Ok(false),
            (None, Origin::Shipped | Origin::Cached | Origin::Probed) => Err(SaveError::NoCache),
        }
    }

    /// What the thread in the background has made, once it is there. One look at a flag until then, and nothing after.
    pub(super) fn arrived(&mut self) -> Option<(Tuning, Instances)> {
        let handover = &self.awaited.as_ref().filter(|a| a.handover.ready.load(Ordering::Acquire))?.handover;
        let (arrival, is_last) = handover.take();
        if is_last {
            self.awaited = None;
        }
        let arrival = arrival?;
        // What came before stays in use, with its keeper.
        if arrival.tuning.is_none() && self.setup.origin == Origin::Cached {
            self.setup.remarks = arrival.setup.remarks;
            return None;
        }
        (self.setup, self.keeper) = (arrival.setup, arrival.keeper);
        arrival.tuning
    }
}

/// Where the thread in the background leaves what it has made.
#[derive(Debug, Default)]
pub(crate) struct Handover {
    /// Something was left that nobody has taken yet.
    ready: AtomicBool,
    left: Mutex<Left>,
    filled: Condvar,
}

/// What was left, and whether nothing comes after it.
#[derive(Debug, Default)]
struct Left {
    arrival: Option<Arrival>,
    is_last: bool,
}

impl Handover {
    fn left(&self) -> MutexGuard<'_, Left> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Leaves what will do until more comes.
    pub(crate) fn leave(&self, arrival: Arrival) {
        self.fill(Left { arrival: Some(arrival), is_last: false });
    }

    /// Leaves what was made; once, and last of all.
    pub(crate) fn leave_last(&self, arrival: Arrival) {
        self.fill(Left { arrival: Some(arrival), is_last: true });
    }

    fn fill(&self, new: Left) {
        let mut left = self.left();
        *left = new;
        // Under the lock, so that nobody looks before it and goes to sleep after it.
        self.ready.store(true, Ordering::Release);
        drop(left);
        self.filled.notify_all();
    }

    /// Takes what was left, and tells whether nothing comes after it.
    fn take(&self) -> (Option<Arrival>, bool) {
        let mut left = self.left();
        self.ready.store(false, Ordering::Release);
        (left.arrival.take(), left.is_last)
    }

    /// Waits until the last was left, but no longer than that. Whether it was.
    fn wait(&self, at_most: Duration) -> bool {
        let waited = self.filled.wait_timeout_while(self.left(), at_most, |left| !left.is_last);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }
}

/// How long who ends waits for the thread in the background. It looks whether it is to stop after each sample, of which the longest take
/// tenths of a second; the driver of a GPU may hold it longer.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// The thread in the background. It ends with who waits for it.
#[derive(Debug)]
pub(crate) struct Awaited {
    pub(crate) handover: Arc<Handover>,
    pub(crate) pace: Arc<AtomicBool>,
    pub(crate) thread: Option<JoinHandle<()>>,
}

impl Awaited {
    /// Waits for it while it does nothing else, but no longer than that; from then on it leaves most of the time to the program.
    pub(crate) fn wait(&self, at_most: Duration) {
        self.handover.wait(at_most);
    }
}

impl Drop for Awaited {
    fn drop(&mut self) {
        self.pace.store(true, Ordering::Relaxed);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measurement_that_brings_nothing_leaves_what_came_before_it() {
        let arrival = |remark: &str| {
            let setup = Setup { origin: Origin::Usual, remarks: vec![remark.to_owned()], ..Setup::default() };
            Arrival { setup, keeper: None, tuning: None }
        };
        for (before, after) in [(Origin::Cached, Origin::Cached), (Origin::Awaited, Origin::Usual)] {
            let handover = Arc::new(Handover::default());
            handover.leave(arrival("first"));
            handover.leave_last(arrival("last"));
            let awaited = Awaited { handover, pace: Arc::default(), thread: None };
            awaited.wait(Duration::MAX);
            let setup = Setup { origin: before, ..Setup::default() };
            let mut start = Start { setup, keeper: None, awaited: Some(awaited) };
            assert!(start.arrived().is_none() && start.awaited.is_none() && start.arrived().is_none());
            assert_eq!((start.setup.origin, &start.setup.remarks[..]), (after, &["last".to_owned()][..]));
        }
    }
}
