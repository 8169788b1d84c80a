//! Takes samples in windows and throws away the windows in which other programs took the CPU.
//!
//! On a machine whose second core was taken by another program, a fork-join measured 40 us instead of 22, and triad 8 GB/s
//! instead of 22. Such a figure looks like a slower machine, so every window is judged before its samples count.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::hardware::{How, Parameter, Statistic};
use crate::stats;

/// Ticks a second of `/proc/stat`: `USER_HZ`, 100 on every Linux architecture that Rust's standard library runs on.
const TICKS_PER_SECOND: f64 = 100.0;

/// Ticks, over all CPUs, that a window must hold: with fewer, the rounding of two counters alone exceeds the threshold.
const TICKS_PER_WINDOW: f64 = 40.0;

/// How many samples are wanted, and when to stop asking.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    /// Clean samples wanted. Sampling goes on to the end of the window in which they are reached.
    pub(super) samples: usize,
    /// No new window begins that would end after this time. At least one sample is always taken.
    pub(super) limit: Duration,
    /// Ends sampling with the sample that is being taken, once it is set.
    pub(super) stop: Option<Arc<AtomicBool>>,
}

impl Plan {
    fn is_stopped(&self) -> bool {
        super::is_set(self.stop.as_ref())
    }
}

/// The samples of one figure.
#[derive(Debug, Clone, Default)]
pub(super) struct Figure {
    pub(super) samples: Vec<f64>,
    pub(super) spoiled: u32,
    pub(super) foreign_load: Option<f64>,
}

impl Figure {
    /// The median of the samples as a parameter.
    pub(super) fn into_parameter(self, name: impl AsRef<str>, method: &str) -> Parameter {
        self.into_parameter_by(Statistic::Median, name, method)
    }

    /// What a statistic makes of the samples, as a parameter.
    pub(super) fn into_parameter_by(self, statistic: Statistic, name: impl AsRef<str>, method: &str) -> Parameter {
        let raw = self.usable();
        // From the rounded samples, so that a reader computes this very value.
        let value = statistic.of(&raw);
        Parameter { statistic, raw: raw.clone(), ..self.parameter(value, &raw, name, method) }
    }

    /// A value that was fitted to more than these samples, which tell its dispersion only and are not kept.
    #[cfg(feature = "measure-gpu")]
    pub(super) fn into_fitted(self, value: f64, name: impl AsRef<str>, method: &str) -> Parameter {
        let raw = self.usable();
        Parameter { statistic: Statistic::Fit, ..self.parameter(Some(value), &raw, name, method) }
    }

    /// What is a number, in as many digits as are kept. A failed division, or a clock that did not move, yields none.
    fn usable(&self) -> Vec<f64> {
        self.samples.iter().filter(|x| x.is_finite()).map(|&x| six_digits(x)).collect()
    }

    fn parameter(&self, value: Option<f64>, raw: &[f64], name: impl AsRef<str>, method: &str) -> Parameter {
        let none = Parameter::missing(name, &format!("no usable sample: {method}"));
        if value.is_none() {
            return none;
        }
        Parameter {
            value,
            dispersion: stats::relative_iqr(raw),
            samples: u32::try_from(raw.len()).unwrap_or(u32::MAX),
            spoiled: self.spoiled,
            foreign_load: self.foreign_load,
            how: How::Measured,
            source: method.to_owned(),
            ..none
        }
    }
}

/// A figure in six significant digits: as many as a file keeps of a sample.
fn six_digits(x: f64) -> f64 {
    // What can't be read back stays as it is.
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// Figures as parameters, each with its name and method.
pub(super) fn into_parameters(
    figures: Vec<Figure>,
    named: impl IntoIterator<Item = (impl AsRef<str>, String)>,
) -> Vec<Parameter> {
    figures.into_iter().zip(named).map(|(figure, (name, method))| figure.into_parameter(name, &method)).collect()
}

/// Calls `sample` in windows until enough clean samples are there or the time is over; each call returns one value per figure.
///
/// Where too few clean samples were got in time, the least spoiled windows are kept too, and `foreign_load` says so.
pub(super) fn collect(plan: Plan, mut sample: impl FnMut() -> Vec<f64>) -> Vec<Figure> {
    let Ok(figures) = try_collect(plan, || Ok::<_, Infallible>(sample()));
    figures
}

/// [`collect`] for samples that can fail: the first failure ends it.
pub(super) fn try_collect<E>(plan: Plan, mut sample: impl FnMut() -> Result<Vec<f64>, E>) -> Result<Vec<Figure>, E> {
    let start = Instant::now();
    let mut windows: Vec<Window> = Vec::new();
    loop {
        let before = Counters::now();
        let length = before.map_or(Duration::ZERO, Counters::window);
        let began = Instant::now();
        let mut rows = Vec::new();
        loop {
            rows.push(sample()?);
            let enough = began.elapsed() >= length && (before.is_some() || rows.len() >= plan.samples);
            if enough || start.elapsed() >= plan.limit || plan.is_stopped() {
                break;
            }
        }
        let share = before.zip(Counters::now()).map(|(before, after)| before.foreign_share(after, began.elapsed()));
        windows.push(Window { rows, share });
        let clean: usize = windows.iter().filter(|w| w.is_clean()).map(|w| w.rows.len()).sum();
        let over = start.elapsed() + began.elapsed() > plan.limit;
        if clean >= plan.samples || over || plan.is_stopped() {
            return Ok(keep_the_cleanest(windows, plan.samples));
        }
    }
}

/// Watches what other programs take while the caller measures, for sampling that is not done by this module.
#[derive(Debug)]
pub struct Watch {
    before: Option<Counters>,
    began: Instant,
}

impl Watch {
    /// Share of the CPU above which a measurement counts as spoiled.
    pub const SPOILING: f64 = Parameter::SPOILING;

    /// Begins to watch.
    #[must_use]
    pub fn begin() -> Self {
        Self { before: Counters::now(), began: Instant::now() }
    }

    /// How long it must go on to tell foreign load from rounding; zero where it can't be told at all.
    #[must_use]
    pub fn shortest(&self) -> Duration {
        self.before.map_or(Duration::ZERO, Counters::window)
    }

    /// Whether enough time has passed to tell foreign load from rounding; always where it can't be told at all.
    #[must_use]
    pub fn is_long_enough(&self) -> bool {
        self.began.elapsed() >= self.shortest()
    }

    /// Share of the CPU, 0 to 1, that other programs have taken since it began. `None` where that can't be told.
    #[must_use]
    pub fn foreign_load(&self) -> Option<f64> {
        self.before.zip(Counters::now()).map(|(before, now)| before.foreign_share(now, self.began.elapsed()))
    }
}

struct Window {
    /// One row per sample, one column per figure.
    rows: Vec<Vec<f64>>,
    share: Option<f64>,
}

impl Window {
    fn is_clean(&self) -> bool {
        self.share.is_none_or(|share| share <= Parameter::SPOILING)
    }
}

/// Every clean window, and the least spoiled others while fewer than `wanted` samples are kept; in the order they were taken.
fn keep_the_cleanest(windows: Vec<Window>, wanted: usize) -> Vec<Figure> {
    let mut cleanest: Vec<usize> = (0..windows.len()).collect();
    cleanest.sort_by(|&a, &b| windows[a].share.unwrap_or(0.0).total_cmp(&windows[b].share.unwrap_or(0.0)));
    let (mut keep, mut kept) = (vec![false; windows.len()], 0);
    for k in cleanest {
        keep[k] = windows[k].is_clean() || kept < wanted;
        kept += if keep[k] { windows[k].rows.len() } else { 0 };
    }
    let columns = windows.iter().flat_map(|w| &w.rows).map(Vec::len).max().unwrap_or(0);
    let mut figures = vec![Figure::default(); columns];
    for (window, keep) in windows.into_iter().zip(keep) {
        for row in window.rows {
            for (figure, value) in figures.iter_mut().zip(row) {
                if keep {
                    figure.samples.push(value);
                    figure.foreign_load = worse(figure.foreign_load, window.share);
                } else {
                    figure.spoiled += 1;
                }
            }
        }
    }
    figures
}

/// The higher of two shares that may be unknown.
fn worse(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

/// What the kernel has counted since it started, in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counters {
    cpus: u32,
    /// Time that no program ran, over all CPUs. Time stolen by the hypervisor is not in it, so it counts as foreign.
    idle: u64,
    /// Time that this process ran, all its threads.
    own: u64,
}

impl Counters {
    /// `None` where there is no `/proc`.
    fn now() -> Option<Self> {
        let (cpus, idle) = parse_stat(&std::fs::read_to_string("/proc/stat").ok()?)?;
        let own = parse_own_time(&std::fs::read_to_string("/proc/self/stat").ok()?)?;
        Some(Self { cpus, idle, own })
    }

    /// How long a window must be, so that the share of others can be told from rounding.
    fn window(self) -> Duration {
        let seconds = TICKS_PER_WINDOW / TICKS_PER_SECOND / f64::from(self.cpus.max(1));
        Duration::from_secs_f64(seconds.max(0.05))
    }

    /// Share of the CPU, 0 to 1, that other programs and the hypervisor took in `elapsed`, between these counters and later ones.
    ///
    /// Busy time is what is left of the wall clock without idle time: the kernel keeps idle time to the nanosecond, but samples
    /// user and system time once a tick, which misjudges a program that sleeps and wakes within one.
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
    // user nice system idle iowait irq softirq steal. Kernels before 2.5.41 have no iowait.
    let idle = field(3)?.saturating_add(field(4).unwrap_or(0));
    let is_cpu =
        |line: &&str| line.strip_prefix("cpu").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    let cpus = u32::try_from(text.lines().filter(is_cpu).count()).ok()?;
    (cpus > 0).then_some((cpus, idle))
}

/// User and system ticks of a process from the text of `/proc/self/stat`.
fn parse_own_time(text: &str) -> Option<u64> {
    // The second field is the program's name in brackets, and may hold blanks and brackets itself.
    let (_, after_name) = text.rsplit_once(')')?;
    let field = |index: usize| after_name.split_ascii_whitespace().nth(index)?.parse::<u64>().ok();
    Some(field(11)?.saturating_add(field(12)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAT: &str = "cpu  7678 0 1137 159442 219 0 15 59 0 0\n\
                        cpu0 4000 0 600 79000 100 0 8 30 0 0\n\
                        cpu1 3678 0 537 80442 119 0 7 29 0 0\n\
                        intr 123 0 0\nctxt 1\nbtime 2\n";

    #[test]
    fn parses_stat() {
        assert_eq!(parse_stat(STAT), Some((2, 159_661)));
        assert_eq!(parse_stat("cpu  1 2 3 4\ncpu0 1 2 3 4\n"), Some((1, 4)));
        assert_eq!(parse_stat(""), None);
        assert_eq!(parse_stat("cpu  a b c d\ncpu0 1\n"), None);
        assert_eq!(parse_stat("cpu  1 2 3 4\n"), None);
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

    fn window(value: f64, share: f64) -> Window {
        Window { rows: vec![vec![value]; 3], share: Some(share) }
    }

    #[test]
    fn spoiled_windows_are_thrown_away() {
        let figures = keep_the_cleanest(vec![window(9.0, 0.4), window(1.0, 0.01), window(2.0, 0.02)], 4);
        assert_eq!(figures.len(), 1);
        assert_eq!(figures[0].samples, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        assert_eq!((figures[0].spoiled, figures[0].foreign_load), (3, Some(0.02)));
        // In the order they were taken, and not in that of their share.
        let figures = keep_the_cleanest(vec![window(1.0, 0.03), window(9.0, 0.4), window(2.0, 0.0)], 4);
        assert_eq!(figures[0].samples, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    }

    #[test]
    fn six_digits_of_any_size() {
        assert_eq!(
            [123_456_789.0, 0.000_123_456_78, 0.0, -2.0].map(six_digits),
            [123_457_000.0, 0.000_123_457, 0.0, -2.0]
        );
    }

    #[test]
    fn a_parameter_follows_from_its_raw_samples() {
        let samples = vec![3.000_000_4, f64::NAN, 1.0, 1_234.567_89, f64::INFINITY, 2.0];
        let figure = Figure { samples, spoiled: 1, foreign_load: Some(0.01) };
        let p = figure.clone().into_parameter("x_ns", "test");
        assert_eq!(p.raw, [3.0, 1.0, 1234.57, 2.0]);
        assert_eq!((p.value, p.samples, p.disagreement()), (Some(2.5), 4, None));
        let p = figure.clone().into_parameter_by(Statistic::FastestQuarterMedian, "x_ghz", "test");
        assert_eq!((p.value, p.recomputed(), p.disagreement()), (Some(1234.57), Some(1234.57), None));
        let p = Figure { samples: vec![f64::NAN], ..figure }.into_parameter("x_ns", "test");
        assert_eq!((p.how, p.samples, p.raw.len()), (How::Missing, 0, 0));
    }

    #[test]
    fn without_clean_windows_the_least_spoiled_is_kept_and_said() {
        let figures = keep_the_cleanest(vec![window(9.0, 0.4), window(5.0, 0.3)], 2);
        assert_eq!(figures[0].samples, [5.0; 3]);
        assert_eq!((figures[0].spoiled, figures[0].foreign_load), (3, Some(0.3)));
    }

    #[test]
    fn a_failure_ends_the_sampling() {
        let mut left = 2;
        let result = try_collect(Plan { samples: 9, limit: Duration::from_secs(60), stop: None }, || {
            left -= 1;
            if left == 0 { Err("broken") } else { Ok(vec![1.0]) }
        });
        assert_eq!((result.err(), left), (Some("broken"), 0));
    }

    #[test]
    fn one_sample_even_without_time() {
        let figures = collect(Plan { samples: 9, limit: Duration::ZERO, stop: None }, || vec![1.0, 2.0]);
        assert_eq!(figures.len(), 2);
        assert_eq!(figures[1].samples, [2.0]);
    }
}
