//! 32-bit floating-point operations of the whole GPU.

use std::time::Duration;

use super::bench::{Bench, Bound, Result, calibrate, per_ns, record};
use crate::hardware::{GpuParameterId, Parameter};

pub(super) const NAMES: [GpuParameterId; 1] = [GpuParameterId::ArithmeticGflopPerS];

const SOURCE: &str = include_str!("shaders/arithmetic.wgsl");

/// Operations of one invocation in one round of the kernel: 256 multiply-adds.
const OPERATIONS: f64 = 512.0;

/// Most rounds in a dispatch: 2^20 take seconds on the slowest GPU, after which its driver gives up.
const MOST_ROUNDS: u32 = 1 << 20;

pub(super) fn measure(bench: &Bench<'_>) -> Result<Vec<Parameter>> {
    let target = Duration::from_micros(bench.pick(4000, 12_000) / if bench.options.brief { 8 } else { 1 });
    let work = Arithmetic::new(bench, target)?;
    let method =
        "multiply-adds in eight independent chains of four lanes an invocation, each counted as two operations";
    let named = [(NAMES[0], method.to_owned())];
    bench.options.plan(9, bench.pick(150, 250)).measure(named, || Ok([work.rate(bench)?]))
}

/// A dispatch of multiply-adds that keeps the whole GPU busy.
pub(super) struct Arithmetic {
    bound: Bound,
    groups: u32,
    rounds: u32,
}

impl Arithmetic {
    /// Makes a dispatch of about `target`.
    pub(super) fn new(bench: &Bench<'_>, target: Duration) -> Result<Self> {
        // A million invocations: several times what the largest GPU holds at once.
        let groups = bench.pick(4096, 64);
        let sink = bench.storage(16)?;
        let bind = |rounds| {
            let shape = bench.uniform([rounds, 0.5_f32.to_bits()])?;
            bench.bind(SOURCE, "multiply_add", &[(0, &shape), (1, &sink)])
        };
        let rounds = calibrate(target, MOST_ROUNDS, |rounds| bench.time_dispatches(&bind(rounds)?, groups, 1))?;
        Ok(Self { bound: bind(rounds)?, groups, rounds })
    }

    /// Runs one dispatch and returns its operations a nanosecond.
    pub(super) fn rate(&self, bench: &Bench<'_>) -> Result<f64> {
        let time = bench.time_dispatches(&self.bound, self.groups, 1)?;
        Ok(per_ns(OPERATIONS * 256.0 * f64::from(self.groups) * f64::from(self.rounds), time))
    }

    /// Submits `count` dispatches and does not wait.
    pub(super) fn submit(&self, bench: &Bench<'_>, count: u32) -> Result<wgpu::SubmissionIndex> {
        bench.submit(|encoder| record(&self.bound, encoder, self.groups, count))
    }
}
