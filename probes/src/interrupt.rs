//! Ctrl-C and SIGTERM: the first asks the verb to stop and keep what it has, the second ends the program at once.

use anyhow::Context;
use sapwise_lab::progress::Interrupted;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit status after a second Ctrl-C, as shells report it: 128 + SIGINT.
const ENDED_BY_SIGINT: i32 = 130;

/// From now on signals set a flag instead of ending the program. For verbs that poll [`requested`].
///
/// # Errors
/// When the system refuses the handler.
pub(crate) fn listen() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            // Child processes notice the closed pipe and end too.
            std::process::exit(ENDED_BY_SIGINT);
        }
        crate::output::complain("interrupted: about to stop; press Ctrl-C again to end at once");
    })
    .context("Ctrl-C can't be caught")
}

/// Does what a first Ctrl-C does, however often.
pub(crate) fn request() {
    REQUESTED.store(true, Ordering::SeqCst);
}

/// Whether the user asked to stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// An error when the user asked to stop, for verbs that have nothing to keep.
///
/// # Errors
/// When a signal has come since [`listen`].
pub(crate) fn check() -> anyhow::Result<()> {
    if requested() { Err(Interrupted.into()) } else { Ok(()) }
}
