//! An algorithm that gets ready, on a thread of its own where that may wait for a driver.

use crate::broad_phase::BroadPhase;
use crate::clock::Instant;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

/// How long who ends waits for an algorithm that is getting ready: a driver may hold it longer, up to the limit of
/// its GPU. The thread then ends by itself, and what it holds with it.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// Where an algorithm is.
pub(super) enum Place {
    Here(Box<dyn BroadPhase>),
    /// On the thread that gets it ready and returns it.
    Away(Away),
    /// It panicked while it got ready.
    Gone,
}

/// An algorithm on a thread.
pub(super) struct Away {
    thread: Option<JoinHandle<Option<Box<dyn BroadPhase>>>>,
}

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
        match std::mem::replace(self, Self::Gone) {
            Self::Here(algorithm) => {
                let Ok(thread) = std::thread::Builder::new().name("sapwise-warm".to_owned()).spawn(run) else {
                    *self = Self::Here(algorithm);
                    return;
                };
                // Handed over only now: a closure that can't be started is dropped with all that it holds.
                *self = match hand_over.send(algorithm) {
                    Ok(()) => Self::Away(Away { thread: Some(thread) }),
                    Err(mpsc::SendError(algorithm)) => Self::Here(algorithm),
                };
            }
            other => *self = other,
        }
    }

    /// Takes the algorithm back if it is ready.
    pub(super) fn take_back(&mut self) {
        if matches!(self, Self::Away(away) if away.is_done()) {
            self.wait();
        }
    }

    /// Takes the algorithm back, however long that takes.
    pub(super) fn wait(&mut self) {
        if let Self::Away(away) = self {
            let returned = away.thread.take().and_then(|thread| thread.join().ok().flatten());
            *self = returned.map_or(Self::Gone, Self::Here);
        }
    }

    pub(super) fn is_away(&self) -> bool {
        matches!(self, Self::Away(_))
    }
}

impl Away {
    fn is_done(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Away {
    fn drop(&mut self) {
        let began = Instant::now();
        while !self.is_done() && began.elapsed() < LAST_WAIT {
            std::thread::sleep(Duration::from_millis(1));
        }
        if self.is_done() {
            // A panic of it was reported when it happened.
            let _ = self.thread.take().map(JoinHandle::join);
        }
    }
}
