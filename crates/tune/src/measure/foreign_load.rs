//! The share of the CPU that other programs take.
//!
//! On a machine whose second core was taken by another program, a fork and join measured 40 µs instead of 22 µs, and
//! triad 8 GB/s instead of 22 GB/s. Such values look like a slower machine.

use std::time::{Duration, Instant};

/// Ticks a second of `/proc/stat`: `USER_HZ`, 100 on every Linux architecture that Rust's standard library supports.
const TICKS_PER_SECOND: f64 = 100.0;

/// Ticks, over all CPUs, that a window must hold: with fewer, the rounding of two counters alone exceeds the
/// threshold.
const TICKS_PER_WINDOW: f64 = 40.0;

/// Watches what other programs take while the caller measures.
#[derive(Debug)]
pub struct Watch {
    /// `None` if foreign load is unknown here.
    pub(super) before: Option<Counters>,
    pub(super) began: Instant,
}

impl Watch {
    /// Begins to watch.
    #[must_use]
    pub fn begin() -> Self {
        Self { before: Counters::now(), began: Instant::now() }
    }

    /// Returns the time after which foreign load differs from rounding; zero if foreign load is unknown here.
    pub fn shortest(&self) -> Duration {
        self.before.map_or(Duration::ZERO, Counters::window)
    }

    /// Whether [`shortest`](Self::shortest) has passed.
    pub fn is_long_enough(&self) -> bool {
        self.began.elapsed() >= self.shortest()
    }

    /// Returns the share of the CPU, 0 to 1, that other programs have taken since the begin. `None` if unknown.
    pub fn foreign_load(&self) -> Option<f64> {
        self.before.zip(Counters::now()).map(|(before, now)| before.foreign_share(now, self.began.elapsed()))
    }
}

/// Counters of the kernel since its start, in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Counters {
    cpus: u32,
    /// Idle time over all CPUs. Time that the hypervisor steals is not included, so it counts as foreign.
    idle: u64,
    /// Time of this process over all threads.
    own: u64,
}

impl Counters {
    /// `None` without `/proc`.
    fn now() -> Option<Self> {
        let (cpus, idle) = parse_stat(&std::fs::read_to_string("/proc/stat").ok()?)?;
        let own = parse_own_time(&std::fs::read_to_string("/proc/self/stat").ok()?)?;
        Some(Self { cpus, idle, own })
    }

    fn window(self) -> Duration {
        let seconds = TICKS_PER_WINDOW / TICKS_PER_SECOND / f64::from(self.cpus.max(1));
        Duration::from_secs_f64(seconds.max(0.05))
    }

    /// Share of the CPU, 0 to 1, that other programs and the hypervisor took between these counters and later ones.
    ///
    /// Busy time is the wall clock without idle time: the kernel keeps idle time to the nanosecond but samples user
    /// and system time once a tick, which misjudges a program that sleeps and wakes within one.
    fn foreign_share(self, later: Self, elapsed: Duration) -> f64 {
        let capacity = elapsed.as_secs_f64() * TICKS_PER_SECOND * f64::from(self.cpus.max(1));
        let known = later.idle.saturating_sub(self.idle) + later.own.saturating_sub(self.own);
        let share = (capacity - known as f64) / capacity;
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Number of CPUs, and the ticks that they were idle or waited for a disk, from the text of `/proc/stat`.
fn parse_stat(text: &str) -> Option<(u32, u64)> {
    let total = text.lines().find_map(|line| line.strip_prefix("cpu "))?;
    let field = |index: usize| total.split_ascii_whitespace().nth(index)?.parse::<u64>().ok();
    // user nice system idle iowait irq softirq steal
    let idle = field(3)?.saturating_add(field(4).unwrap_or(0));
    let is_cpu =
        |line: &&str| line.strip_prefix("cpu").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    let cpus = u32::try_from(text.lines().filter(is_cpu).count()).ok()?;
    (cpus > 0).then_some((cpus, idle))
}

/// User and system ticks of a process from the text of `/proc/self/stat`.
fn parse_own_time(text: &str) -> Option<u64> {
    // The second field is the program's name in brackets, which may hold blanks and brackets.
    let (_, after_name) = text.rsplit_once(')')?;
    let field = |index: usize| after_name.split_ascii_whitespace().nth(index)?.parse::<u64>().ok();
    Some(field(11)?.saturating_add(field(12)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parses_stat() {
        let text = "cpu  7678 0 1137 159442 219 0 15 59 0 0\ncpu0 4000 0 600 79000 100 0 8 30 0 0\n\
                    cpu1 3678 0 537 80442 119 0 7 29 0 0\nintr 123 0 0\nctxt 1\nbtime 2\n";
        assert_eq!(parse_stat(text), Some((2, 159_661)));
        for wrong in ["", "cpu  a b c d\ncpu0 1\n", "cpu  1 2 3 4\n"] {
            assert_eq!(parse_stat(wrong), None);
        }
    }

    #[test]
    fn parses_own_time_behind_a_name_with_brackets() {
        let text = "42 (a) b (c)) R 1 42 42 0 -1 4194304 100 0 0 0 31 7 0 0 20 0 3 0 1000 0 0";
        assert_eq!(parse_own_time(text), Some(38));
        assert_eq!(parse_own_time("42 name R 1"), None);
        assert_eq!(parse_own_time("42 (name) R 1"), None);
    }

    #[test]
    fn share_of_others() {
        let before = Counters { cpus: 2, idle: 100, own: 10 };
        let second = Duration::from_secs(1);
        // 200 ticks of capacity: 100 idle, 60 own, so 40 are foreign.
        assert_eq!(before.foreign_share(Counters { cpus: 2, idle: 200, own: 70 }, second), 0.2);
        // More known than there was: rounding, not a negative load.
        assert_eq!(before.foreign_share(Counters { cpus: 2, idle: 300, own: 12 }, second), 0.0);
        // Counters that ran backwards, and no time at all.
        assert_eq!(before.foreign_share(Counters { cpus: 2, idle: 0, own: 0 }, second), 1.0);
        assert_eq!(before.foreign_share(before, Duration::ZERO), 0.0);
    }
}
