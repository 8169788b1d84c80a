//! A progress bar on standard error for work that takes over a second.

use crate::{interrupt, output};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use sapwise_lab::progress::Interrupted;
pub(crate) use sapwise_lab::progress::Progress as Steps;
use std::fmt::{self, Write};
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time before the bar appears: shorter work needs none.
const DELAY: Duration = Duration::from_secs(1);

/// Interval of redrawing while no step is done, so that the seconds go on.
const TICK: Duration = Duration::from_secs(1);

/// Characters that every terminal and every encoding has. The time left follows from the speed of the latest steps.
const TEMPLATE: &str = "{percent:>3} % {elapsed}{left}  {wide_msg}";

/// A bar that shows itself after a second, and not at all when standard error is no terminal.
///
/// If the steps take different times, count milliseconds or bytes instead.
pub(crate) struct Progress {
    bar: ProgressBar,
    /// Shows the bar after the delay, unless the sender is gone by then.
    showing: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    /// Creates a bar of this number of steps.
    pub(crate) fn new(steps: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.with_key("left", left));
        }
        let showing = std::io::stderr().is_terminal().then(|| show_later(bar.clone())).flatten();
        Self { bar, showing }
    }

    /// Sets the number of steps that are done.
    pub(crate) fn position(&self, steps: u64) {
        self.bar.set_position(steps);
    }

    /// Prints something while the bar is out of the way.
    pub(crate) fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }
}

/// Writes the time left; nothing before the first step, when it is unknown.
fn left(state: &ProgressState, out: &mut dyn Write) {
    let written: fmt::Result =
        if state.pos() == 0 { Ok(()) } else { write!(out, ", {:#} left", HumanDuration(state.eta())) };
    // A bar that can't be written has no one to report it to.
    let _ = written;
}

/// Shows the bar after the delay on another thread, because the working thread may be waiting for a driver. Without a
/// thread there is no bar.
fn show_later(bar: ProgressBar) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (alive, ended) = channel();
    let show = move || {
        if ended.recv_timeout(DELAY) == Err(RecvTimeoutError::Timeout) {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
            bar.tick();
        }
    };
    let thread = std::thread::Builder::new().name("progress".to_owned()).spawn(show).ok()?;
    Some((alive, thread))
}

impl Steps for Progress {
    fn start(&self, steps: u64) {
        self.bar.set_position(0);
        self.bar.set_length(steps);
    }

    fn advance(&self, steps: u64) {
        self.bar.inc(steps);
    }

    fn message(&self, text: &str) {
        self.bar.set_message(text.to_owned());
    }

    fn warn(&self, text: &str) {
        self.aside(|| output::warn(text));
    }

    fn check(&self) -> Result<(), Interrupted> {
        if interrupt::requested() { Err(Interrupted) } else { Ok(()) }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((alive, thread)) = self.showing.take() {
            drop(alive);
            // A bar that was shown after the end would stay on the screen.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::InMemoryTerm;

    #[test]
    fn the_bar_is_plain_and_fits_on_one_line() {
        let terminal = InMemoryTerm::new(10, 60);
        let bar = ProgressBar::with_draw_target(Some(3), ProgressDrawTarget::term_like(Box::new(terminal.clone())));
        bar.set_style(ProgressStyle::with_template(TEMPLATE).unwrap().with_key("left", left));
        bar.set_message("clustered: 20000 objects, a message that is longer than this terminal is wide");
        bar.inc(1);
        bar.force_draw();
        let shown = terminal.contents();
        assert!(shown.lines().count() == 1 && shown.len() <= 60, "{shown:?}");
        assert!(shown.is_ascii() && shown.contains("33 %"), "{shown:?}");
    }
}
