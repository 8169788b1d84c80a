//! Waits for an operation for a bounded time.

use mpi::request::{Request, RequestCollection, Scope};
use mpi::traits::Communicator;
use std::thread;
use std::time::{Duration, Instant};

/// Below this a rank that waits asks again at once, as MPI libraries do; beyond it others get the core first.
const EAGER: Duration = Duration::from_micros(20);
/// Beyond this it sleeps between two questions: it may wait for a rank that needs its core.
const BRIEF: Duration = Duration::from_millis(2);
const NAP: Duration = Duration::from_micros(50);

/// Waits until `request` is done, and ends the job when it is not within `limit`. `what` says what is awaited.
pub(crate) fn within<'a, D: ?Sized, S: Scope<'a>>(
    limit: Duration,
    communicator: &impl Communicator,
    what: &str,
    request: Request<'a, D, S>,
) {
    let mut waiting = Some(request);
    until(limit, communicator, what, || {
        waiting = waiting.take().and_then(|request| request.test().err());
        waiting.is_none()
    });
}

/// The same for all of some requests.
pub(crate) fn all_within<D: ?Sized>(
    limit: Duration,
    communicator: &impl Communicator,
    what: &str,
    requests: &mut RequestCollection<'_, D>,
) {
    let mut done = Vec::new();
    until(limit, communicator, what, || requests.test_all(&mut done));
}

/// Asks until the answer is yes, or for so long.
fn until(limit: Duration, communicator: &impl Communicator, what: &str, mut is_done: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_done() {
        let waited = began.elapsed();
        if waited > limit {
            let (rank, seconds) = (communicator.rank(), limit.as_secs_f64());
            end(
                communicator,
                &format!(
                    "rank {rank} has waited for {seconds} s for {what} of the others: one of them hangs or is gone"
                ),
            );
        }
        if waited > BRIEF {
            thread::sleep(NAP);
        } else if waited > EAGER {
            thread::yield_now();
        }
    }
}

/// Ends the job with a message.
pub(crate) fn end(communicator: &impl Communicator, message: &str) -> ! {
    eprintln!("sapwise-mpi: {message}; the job ends here");
    communicator.abort(1)
}
