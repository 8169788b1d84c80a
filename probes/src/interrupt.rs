//! Ctrl-C, SIGTERM and SIGHUP: the first signal asks the verb to stop and keep its results, the second ends the
//! program.

use anyhow::Context;
use sapwise_lab::progress::Interrupted;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering::SeqCst};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The number of the first signal; 0 before it.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// From now on signals set a flag instead of ending the program. For verbs that poll [`requested`].
///
/// A signal that the parent process had ignored stays ignored: `nohup` ignores SIGHUP, shells the SIGINT of
/// background jobs.
///
/// # Errors
/// When the system refuses the handler.
pub(crate) fn listen() -> anyhow::Result<()> {
    on_signal(|signal| {
        // The number first: a verb that sees the request may end at once.
        let first = SIGNAL.compare_exchange(0, signal, SeqCst, SeqCst).is_ok();
        if REQUESTED.swap(true, SeqCst) && !first {
            // Child processes notice the closed pipe and end too.
            end_by(signal);
        }
        crate::output::complain("interrupted: about to stop; press Ctrl-C again to end at once");
    })
    .context("Ctrl-C can't be caught")
}

/// Asks the verb to stop, as the first Ctrl-C does.
pub(crate) fn request() {
    REQUESTED.store(true, SeqCst);
}

/// Returns whether the user asked to stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(SeqCst)
}

/// Returns the exit status after a signal, 128 plus its number as in shells; `None` without a signal.
pub(crate) fn exit_status() -> Option<u8> {
    let signal = SIGNAL.load(SeqCst);
    (signal > 0).then_some(128 + signal)
}

/// Returns an error when the user asked to stop, for verbs that have nothing to keep.
///
/// # Errors
/// When a signal has come since [`listen`].
pub(crate) fn check() -> anyhow::Result<()> {
    if requested() { Err(Interrupted.into()) } else { Ok(()) }
}

/// Calls `caught` on a thread of its own with the number of each signal that comes.
#[cfg(unix)]
fn on_signal(mut caught: impl FnMut(u8) + Send + 'static) -> io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|&signal| !is_ignored(signal));
    let mut signals = signal_hook::iterator::Signals::new(heard)?;
    let forward = move || signals.forever().for_each(|signal| caught(signal as u8));
    std::thread::Builder::new().name("signals".to_owned()).spawn(forward)?;
    Ok(())
}

/// Returns whether the parent process had ignored a signal.
#[cfg(unix)]
fn is_ignored(signal: libc::c_int) -> bool {
    let mut found = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: without a new action this only fills in the present one, for which there is room.
    let asked = unsafe { libc::sigaction(signal, std::ptr::null(), found.as_mut_ptr()) };
    // SAFETY: all zero bits are a valid value, whether it was filled in or not.
    let action = unsafe { found.assume_init() };
    asked == 0 && action.sa_sigaction == libc::SIG_IGN
}

/// Ends the program as if it had never caught the signal, so that its parent sees which one it was.
#[cfg(unix)]
fn end_by(signal: u8) {
    let _ = signal_hook::low_level::emulate_default_handler(signal.into());
}

#[cfg(windows)]
fn on_signal(mut caught: impl FnMut(u8) + Send + 'static) -> io::Result<()> {
    ctrlc::set_handler(move || caught(SIGINT)).map_err(io::Error::other)
}

/// The number of Ctrl-C in shells: Windows has none.
#[cfg(windows)]
const SIGINT: u8 = 2;

#[cfg(windows)]
fn end_by(signal: u8) {
    std::process::exit(128 + i32::from(signal));
}
