//! The hardware parameters that a page can measure.

use crate::clock::milliseconds;
use sapwise_scenes::Random;
use sapwise_tune::hardware::Statistic;
use sapwise_tune::{Hardware, Machine, Parameter, ParameterId};
use std::hint::black_box;

/// Links of a chain between two readings of the clock.
const LINKS: u32 = 100_000;
/// Elements of each of the three arrays of the triad: 32 MiB.
const TRIAD: usize = 4 << 20;
/// Loads between two readings of the clock.
const LOADS: usize = 16_384;
/// Samples of the clock, of each latency and of the bandwidth.
const CHAINS: usize = 20;
const SAMPLES: usize = 6;
/// Working sets of this size and above are left out: a page may get little memory.
const LARGEST_KIB: u32 = 131_072;

/// What is measured one after the other, a few samples in each step.
pub(super) struct Parameters {
    /// Milliseconds of a sample, at least.
    pub(super) least_ms: f64,
    done: Vec<Parameter>,
    chains: Vec<f64>,
}

/// A cache line that names the next one.
#[derive(Clone)]
#[repr(C, align(64))]
struct Line(*const Line);

impl Parameters {
    /// Number of steps.
    pub(super) const STEPS: usize = CHAINS + ParameterId::LATENCIES.len() + 1;

    pub(super) fn new(least_ms: f64) -> Self {
        Self { least_ms, done: Vec::new(), chains: Vec::new() }
    }

    /// Measures what stands at a step. Returns it in words.
    pub(super) fn step(&mut self, step: usize) -> &'static str {
        if step < CHAINS {
            self.chains.push(self.clock_ghz());
            if step + 1 == CHAINS {
                let method = "chain of dependent exclusive ors and additions on one thread; value is the median of the \
                              fastest quarter";
                self.add(ParameterId::ClockMeasuredGhz, Statistic::FastestQuarterMedian, self.chains.clone(), method);
            }
            return "Measuring the clock";
        }
        if let Some(&(kib, id)) = ParameterId::LATENCIES.get(step - CHAINS) {
            let method = "dependent loads around a random cycle of 64-byte lines";
            self.add(id, Statistic::Median, self.latencies(kib), method);
            return "Measuring the latency of memory";
        }
        let method = "STREAM triad on 1 thread, three arrays of 32 MiB";
        self.add(ParameterId::BandwidthOneThreadGbPerS, Statistic::Median, self.bandwidths(), method);
        "Measuring the bandwidth of memory"
    }

    fn add(&mut self, id: ParameterId, statistic: Statistic, raw: Vec<f64>, method: &str) {
        if raw.is_empty() {
            return;
        }
        let six_digits = |x: &f64| format!("{x:.5e}").parse().unwrap_or(*x);
        let method = format!("{method}, each sample at least {} ms", self.least_ms);
        self.done.push(Parameter::from_samples(id, statistic, raw.iter().map(six_digits).collect(), &method));
    }

    /// Repeats work until the clock can time it. Returns the nanoseconds of one repetition.
    fn each_ns(&self, mut work: impl FnMut()) -> f64 {
        let (started, mut times) = (milliseconds(), 0.0);
        loop {
            work();
            times += 1.0;
            let ms = milliseconds() - started;
            if ms >= self.least_ms {
                return ms * 1e6 / times;
            }
        }
    }

    /// Cycles a nanosecond: each link is two operations of a cycle, and no compiler can shorten the chain.
    fn clock_ghz(&self) -> f64 {
        let (mut sum, mask, addend) = (black_box(1_u32), black_box(0x5a5a_a5a5), black_box(3));
        let ns = self.each_ns(|| {
            for _ in 0..LINKS {
                sum = (sum ^ mask).wrapping_add(addend);
            }
            black_box(sum);
        });
        f64::from(2 * LINKS) / ns
    }

    /// Nanoseconds a load; none without the memory.
    fn latencies(&self, kib: u32) -> Vec<f64> {
        let count = kib as usize * 1024 / size_of::<Line>();
        let mut lines: Vec<Line> = Vec::new();
        if kib >= LARGEST_KIB || lines.try_reserve_exact(count).is_err() {
            return Vec::new();
        }
        // One cycle through all lines, by Sattolo's algorithm.
        let mut order: Vec<u32> = (0..count as u32).collect();
        let mut random = Random::new(1);
        (1..count).rev().for_each(|k| order.swap(k, random.bits() as usize % k));
        lines.resize(count, Line(std::ptr::null()));
        let first = lines.as_ptr();
        for (line, &next) in lines.iter_mut().zip(&order) {
            line.0 = first.wrapping_add(next as usize);
        }
        let mut at = first;
        let mut walk = |loads: usize| {
            for _ in 0..loads {
                // SAFETY: each line names another one of the vector, which nobody changes meanwhile.
                at = unsafe { (*at).0 };
            }
            black_box(at);
        };
        walk(count);
        (0..SAMPLES).map(|_| self.each_ns(|| walk(LOADS)) / LOADS as f64).collect()
    }

    /// Gigabytes a second; none without the memory.
    fn bandwidths(&self) -> Vec<f64> {
        let filled = |value: f64| {
            let mut array = Vec::new();
            array.try_reserve_exact(TRIAD).ok()?;
            array.resize(TRIAD, value);
            Some(array)
        };
        let [Some(mut a), Some(b), Some(c)] = [0.0, 1.0, 2.0].map(filled) else { return Vec::new() };
        let mut pass = || {
            let scalar = black_box(3.0);
            a.iter_mut().zip(&b).zip(&c).for_each(|((a, b), c)| *a = b + scalar * c);
            black_box(&mut a);
        };
        pass();
        (0..SAMPLES).map(|_| (3 * TRIAD * size_of::<f64>()) as f64 / self.each_ns(&mut pass)).collect()
    }

    /// Returns all parameters of a report, in its order.
    pub(super) fn hardware(&self, machine: Machine) -> Hardware {
        let found = |id: ParameterId| self.done.iter().find(|p| p.name == id);
        let sets = ParameterId::LATENCIES.into_iter();
        let sets: Vec<_> = sets.filter_map(|(kib, id)| Some((f64::from(kib), found(id)?.value?))).collect();
        let within = sets.iter().rev().find(|set| sets.last().is_some_and(|last| set.1 <= 0.5 * last.1));
        let simd = (if super::SIMD { 4.0 } else { 1.0 }, "floats of a vector of WebAssembly, as built");
        let llc = "largest working set with at most half the latency of the largest one of all";
        let parameter = |id| match (id, found(id), within) {
            (_, Some(found), _) => found.clone(),
            (ParameterId::UsableCores, ..) => Parameter::reported(id, 1.0, "the thread of the page or worker"),
            (ParameterId::SimdLanes, ..) => Parameter::reported(id, simd.0, simd.1),
            (ParameterId::CacheLlcBytes, _, Some(set)) => Parameter::measured(id, 1024.0 * set.0, llc),
            _ => Parameter::missing(id, "a page can't measure it"),
        };
        Hardware::new(machine, ParameterId::ALL.into_iter().map(parameter).collect())
    }
}
