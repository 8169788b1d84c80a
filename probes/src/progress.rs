//! A progress bar on standard error for whatever takes over a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// Nothing is drawn before this: work that is done by then needs no bar.
const DELAY: Duration = Duration::from_secs(1);

/// A bar that shows itself after a second, and not at all when standard error is no terminal.
pub(crate) struct Progress {
    bar: ProgressBar,
    began: Instant,
    shown: AtomicBool,
}

impl Progress {
    /// A bar of that many steps.
    pub(crate) fn new(steps: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} {elapsed} {wide_msg}") {
            bar.set_style(style);
        }
        Self { bar, began: Instant::now(), shown: AtomicBool::new(false) }
    }

    /// Says what is being done.
    pub(crate) fn message(&self, text: impl Into<String>) {
        self.bar.set_message(text.into());
        self.show();
    }

    /// Some steps are done.
    pub(crate) fn advance(&self, steps: u64) {
        self.bar.inc(steps);
        self.show();
    }

    /// That many steps are done in all.
    pub(crate) fn position(&self, steps: u64) {
        self.bar.set_position(steps);
        self.show();
    }

    /// Prints something while the bar is out of the way.
    pub(crate) fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }

    fn show(&self) {
        if self.began.elapsed() >= DELAY && !self.shown.swap(true, Relaxed) {
            // A draw target that is no terminal draws nothing by itself.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
