//! The preparation of an algorithm, on a thread of its own if it may wait for a driver.

use crate::broad_phase::BroadPhase;
use crate::clock::Instant;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest wait of a drop for a thread. A driver may hold the thread longer, up to the limit of its GPU; then the
/// thread ends by itself and drops the algorithm.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// The place of an algorithm.
pub(super) enum Place {
    Here(Box<dyn BroadPhase>),
    /// On the thread that prepares it and returns it.
    Away(Preparing),
    /// It could not be made, it failed, or its preparation panicked.
    Gone,
}

/// An algorithm on a thread.
pub(super) struct Preparing(Option<JoinHandle<Option<Box<dyn BroadPhase>>>>);

impl Place {
    /// Returns the algorithm, `None` if it is away or gone.
    pub(super) fn here(&mut self) -> Option<&mut Box<dyn BroadPhase>> {
        match self {
            Self::Here(algorithm) => Some(algorithm),
            Self::Away(_) | Self::Gone => None,
        }
    }

    /// Prepares the algorithm for `objects` objects on another thread. If no thread can be started, the algorithm
    /// stays unprepared, and its first frame takes longer.
    pub(super) fn send(&mut self, objects: usize) {
        let (hand_over, taken) = mpsc::channel::<Box<dyn BroadPhase>>();
        let run = move || {
            let mut algorithm = taken.recv().ok()?;
            algorithm.prepare(objects);
            Some(algorithm)
        };
        *self = match std::mem::replace(self, Self::Gone) {
            Self::Here(algorithm) => match std::thread::Builder::new().name("sapwise-warm".to_owned()).spawn(run) {
                // Handed over only now: if the thread can't be started, the closure is dropped with its content.
                Ok(thread) => match hand_over.send(algorithm) {
                    Ok(()) => Self::Away(Preparing(Some(thread))),
                    Err(mpsc::SendError(algorithm)) => Self::Here(algorithm),
                },
                Err(_) => Self::Here(algorithm),
            },
            other => other,
        };
    }

    /// Takes the algorithm back from its thread if it is ready. With `patience`, waits until it is. Returns whether the
    /// thread has ended.
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

/// Waits up to [`LAST_WAIT`] for a thread whose result is not needed any more.
pub(super) fn end<T>(thread: Option<JoinHandle<T>>) {
    let Some(thread) = thread else { return };
    let began = Instant::now();
    while !thread.is_finished() {
        if began.elapsed() > LAST_WAIT {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    // A panic was reported when it happened.
    let _ = thread.join();
}
