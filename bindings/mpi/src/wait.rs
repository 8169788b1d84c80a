//! Waits for MPI operations with a time limit.

use mpi::request::{Request, RequestCollection, Scope};
use mpi::traits::Communicator;
use std::thread;
use std::time::{Duration, Instant};

/// Until this time a rank polls without a pause, as MPI libraries do; then it yields the core.
const EAGER: Duration = Duration::from_micros(20);
/// After this time it sleeps between two polls, because the rank that it waits for may need its core.
const BRIEF: Duration = Duration::from_millis(2);
const NAP: Duration = Duration::from_micros(50);

/// Waits for `request`, and ends the job after `limit`. `what` names what is awaited.
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

/// The same for several requests.
pub(crate) fn all_within<D: ?Sized>(
    limit: Duration,
    communicator: &impl Communicator,
    what: &str,
    requests: &mut RequestCollection<'_, D>,
) {
    let mut done = Vec::new();
    until(limit, communicator, what, || requests.test_all(&mut done));
}

/// Polls until `is_done`, and ends the job after `limit`.
fn until(limit: Duration, communicator: &impl Communicator, what: &str, mut is_done: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_done() {
        let waited = began.elapsed();
        if waited > limit {
            let (rank, seconds) = (communicator.rank(), limit.as_secs_f64());
            let waited = format!("rank {rank} has waited for {seconds} s for {what} of the others");
            end(communicator, &format!("{waited}: one of them hangs or is gone"));
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
