//! What the parameters of a machine don't tell: factors that belong to a part, or to a method on a part.
//!
//! Each is drawn from the seed, the name of the part and its own name, so that a CPU is the same CPU in every machine. None of them
//! stands in a report. The deviations are guesses at how far machines of equal parameters differ.

use sapwise_scenes::Random;

/// A factor of a part: log-normal, median 1, `sigma` in natural logarithms.
pub(super) fn factor(seed: u64, part: &str, what: &str, sigma: f64) -> f64 {
    Random::named(seed, &[part, what]).log_normal(sigma)
}

/// A share of a part, even between two bounds.
pub(super) fn share(seed: u64, part: &str, what: &str, low: f64, high: f64) -> f64 {
    low + (high - low) * Random::named(seed, &[part, what]).uniform()
}

/// The hidden factors of a CPU.
#[derive(Debug, Clone)]
pub(super) struct CpuFactors {
    /// Cycles of scalar work, over those of the cost model: 4 % less with every year from 2017 on, and more before, apart from
    /// what belongs to the microarchitecture.
    pub(super) cycles: f64,
    /// Operations of vector lanes: wide units that work in halves, or at a lower clock.
    pub(super) lanes: f64,
    /// Bytes moved beyond the last-level cache.
    pub(super) bytes: f64,
    /// Pairs written: branches mispredicted.
    pub(super) pairs: f64,
    /// Boxes gathered in the order of the sort: how many loads are on their way at a time.
    pub(super) gather: f64,
    /// Fork and join within an algorithm, over the measured one.
    pub(super) fork_join: f64,
    /// Share of the last-level cache that a frame gets.
    pub(super) cache_share: f64,
    /// How suddenly that cache stops helping: the exponent of the fall-off.
    pub(super) cache_sharpness: f64,
    /// What the second thread of a core adds to an algorithm, which is not what it adds to arithmetic.
    pub(super) second_thread: f64,
    /// Deviation of the logarithm of a sample.
    pub(super) noise: f64,
    /// Share of samples that something else disturbs.
    pub(super) outliers: f64,
}

impl CpuFactors {
    pub(super) fn new(seed: u64, name: &str, year: f64) -> Self {
        let factor = |what: &str, sigma: f64| factor(seed, name, what, sigma);
        let share = |what: &str, low: f64, high: f64| share(seed, name, what, low, high);
        Self {
            cycles: factor("hidden cycles", 0.2) * (0.04 * (2017.0 - year)).exp(),
            lanes: factor("hidden lanes", 0.25),
            bytes: factor("hidden bytes", 0.15),
            pairs: factor("hidden pairs", 0.25),
            gather: factor("hidden gather", 0.3),
            fork_join: factor("hidden fork and join", 0.3),
            cache_share: share("hidden share of the cache", 0.4, 1.0),
            cache_sharpness: share("hidden sharpness of the cache", 1.0, 4.0),
            second_thread: share("hidden second thread", 0.0, 0.35),
            noise: 0.02 * factor("hidden noise", 0.4),
            outliers: share("hidden outliers", 0.0, 0.03),
        }
    }
}

/// The hidden factors of a GPU.
#[derive(Debug, Clone)]
pub(super) struct GpuFactors {
    /// Latencies within an algorithm, over the measured ones: the driver tracks more buffers.
    pub(super) driver: f64,
    /// Operations, over the measured arithmetic.
    pub(super) operations: f64,
    /// Bytes of scattered accesses, over those read one after the other.
    pub(super) memory: f64,
}

impl GpuFactors {
    pub(super) fn new(seed: u64, name: &str) -> Self {
        let factor = |what: &str, sigma: f64| factor(seed, name, what, sigma);
        Self {
            driver: factor("hidden driver", 0.25),
            operations: factor("hidden operations", 0.3),
            memory: factor("hidden memory", 0.25),
        }
    }
}

/// The hidden factor of a method on a part: what compilers and branch predictors make of its code.
pub(super) fn of_method(seed: u64, part: &str, method: &str) -> f64 {
    factor(seed, part, &format!("hidden method {method}"), 0.08)
}
