//! An algorithm that gets ready, on a thread of its own where that may wait for a driver.

use crate::broad_phase::BroadPhase;
use crate::clock::Instant;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

/// How long a drop waits for a thread. A driver may hold it longer, up to the limit of its GPU: the thread then ends by
/// itself, and what it holds with it.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// Where an algorithm is.
pub(super) enum Place {
    Here(Box<dyn BroadPhase>),
    /// On the thread that gets it ready and returns it.
    Away(Preparing),
    /// It could not be made, failed, or panicked while it got ready.
    Gone,
}

/// An algorithm on a thread.
pub(super) struct Preparing(Option<JoinHandle<Option<Box<dyn BroadPhase>>>>);

impl Place {
    /// The algorithm, unless it is away or gone.
    pub(super) fn here(&mut self) -> Option<&mut Box<dyn BroadPhase>> {
        match self {
            Self::Here(algorithm) => Some(algorithm),
            Self::Away(_) | Self::Gone => None,
        }
    }

    /// Sends the algorithm away to get ready for that many objects. Where there are no threads it stays as it is, and
    /// its first frame pays.
    pub(super) fn send(&mut self, objects: usize) {
        let (hand_over, taken) = mpsc::channel::<Box<dyn BroadPhase>>();
        let run = move || {
            let mut algorithm = taken.recv().ok()?;
            algorithm.prepare(objects);
            Some(algorithm)
        };
        *self = match std::mem::replace(self, Self::Gone) {
            Self::Here(algorithm) => match std::thread::Builder::new().name("sapwise-warm".to_owned()).spawn(run) {
                // Handed over only now: a closure that can't be started is dropped with all that it holds.
                Ok(thread) => match hand_over.send(algorithm) {
                    Ok(()) => Self::Away(Preparing(Some(thread))),
                    Err(mpsc::SendError(algorithm)) => Self::Here(algorithm),
                },
                Err(_) => Self::Here(algorithm),
            },
            other => other,
        };
    }

    /// Takes the algorithm back from its thread if it is ready; with `patience` waits until it is. Returns whether it was
    /// away and is no longer.
    pub(super) fn take_back(&mut self, patience: bool) -> bool {
        let Self::Away(Preparing(thread)) = self else { return false };
        let Some(thread) = thread.take_if(|thread| patience || thread.is_finished()) else { return false };
        *self = thread.join().ok().flatten().map_or(Self::Gone, Self::Here);
        true
    }

    pub(super) fn is_here(&self) -> bool {
        matches!(self, Self::Here(_))
    }

    pub(super) fn is_away(&self) -> bool {
        matches!(self, Self::Away(_))
    }
}

impl Drop for Preparing {
    fn drop(&mut self) {
        end(self.0.take());
    }
}

/// Waits for a thread whose result nobody wants any more.
pub(super) fn end<T>(thread: Option<JoinHandle<T>>) {
    let Some(thread) = thread else { return };
    let began = Instant::now();
    while !thread.is_finished() {
        if began.elapsed() > LAST_WAIT {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    // A panic of it was reported when it happened.
    let _ = thread.join();
}
