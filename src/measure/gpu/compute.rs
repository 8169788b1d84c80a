//! Arithmetic, atomic additions, and how many workgroups run at the same time.

use std::time::Duration;

use super::bench::{Bench, Bound, Kernel, calibrate, or_missing, per_ns, record};
use super::fits;
use crate::hardware::{GpuParameterId, Parameter};
use crate::stats;

const SOURCE: &str = include_str!("shaders/compute.wgsl");
const ATOMIC_SOURCE: &str = include_str!("shaders/atomic.wgsl");

/// Operations of one invocation in one round of the kernel: 256 multiply-adds.
const OPERATIONS: f64 = 512.0;

/// Rounds in a dispatch, at most: 2^20 take seconds on the slowest GPU, and its driver would give up.
const MOST_ROUNDS: u32 = 1 << 20;

/// Workgroups that are looked at for a step, at most. No GPU has more processors.
const MOST_GROUPS: u32 = 2048;

pub(super) fn measure(bench: &Bench<'_>) -> Vec<Parameter> {
    let mut parameters = or_missing(&[GpuParameterId::ArithmeticGflopPerS], arithmetic(bench));
    if bench.options.limit.is_some() {
        return parameters;
    }
    parameters.extend(or_missing(&[GpuParameterId::AtomicGPerS], atomics(bench)));
    parameters.extend(or_missing(&[GpuParameterId::ParallelUnits], units(bench)));
    parameters
}

/// A dispatch of multiply-adds that keeps the whole GPU busy.
pub(super) struct Arithmetic {
    kernel: Kernel,
    sink: wgpu::Buffer,
    groups: u32,
}

impl Arithmetic {
    pub(super) fn new(bench: &Bench<'_>) -> Result<Self, String> {
        let kernel = bench.kernel(SOURCE, "multiply_add", &[])?;
        // A million invocations: several times what the largest GPU holds at once.
        Ok(Self { kernel, sink: bench.storage(16)?, groups: bench.pick(4096, 64) })
    }

    pub(super) fn bind(&self, bench: &Bench<'_>, rounds: u32) -> Result<Bound, String> {
        bench.bind(&self.kernel, &[(0, &shape(bench, rounds)?), (1, &self.sink)])
    }

    /// Rounds for a dispatch of about `target`.
    pub(super) fn calibrate(&self, bench: &Bench<'_>, target: Duration) -> Result<u32, String> {
        calibrate(target, MOST_ROUNDS, |rounds| bench.time_dispatches(&self.bind(bench, rounds)?, self.groups, 1))
    }

    /// Operations a nanosecond of `count` dispatches.
    pub(super) fn rate(&self, bench: &Bench<'_>, bound: &Bound, rounds: u32, count: u32) -> Result<f64, String> {
        let time = bench.time_dispatches(bound, self.groups, count)?;
        Ok(per_ns(OPERATIONS * 256.0 * f64::from(self.groups) * f64::from(rounds) * f64::from(count), time))
    }

    /// Submits `count` dispatches and does not wait.
    pub(super) fn submit(&self, bench: &Bench<'_>, bound: &Bound, count: u32) -> Result<wgpu::SubmissionIndex, String> {
        bench.submit(|encoder| record(bound, encoder, self.groups, count))
    }
}

fn shape(bench: &Bench<'_>, rounds: u32) -> Result<wgpu::Buffer, String> {
    bench.uniform(&[rounds, 0.5_f32.to_bits()])
}

fn target(bench: &Bench<'_>, hardware_us: u64, software_us: u64) -> Duration {
    let us = bench.pick(hardware_us, software_us);
    Duration::from_micros(if bench.options.brief { us / 8 } else { us })
}

fn arithmetic(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    let work = Arithmetic::new(bench)?;
    let rounds = work.calibrate(bench, target(bench, 4000, 12_000))?;
    let bound = work.bind(bench, rounds)?;
    let figures =
        bench.collect(bench.plan(9, bench.pick(150, 250)), || Ok(vec![work.rate(bench, &bound, rounds, 1)?]))?;
    let method =
        "multiply-adds in eight independent chains of four lanes an invocation, each counted as two operations";
    Ok(figures.into_iter().map(|f| f.into_parameter(GpuParameterId::ArithmeticGflopPerS, method)).collect())
}

fn atomics(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    let words: u32 = bench.pick(1 << 20, 1 << 16);
    let buffer = bench.storage(u64::from(words) * 4)?;
    let kernel = bench.kernel(ATOMIC_SOURCE, "add", &[])?;
    let groups = words / 1024;
    let bind = |rounds: u32| bench.bind(&kernel, &[(0, &bench.uniform(&[rounds, words - 1])?), (1, &buffer)]);
    let mut added = 0_u32;
    let mut run = |bound: &Bound, rounds: u32| {
        added = added.wrapping_add(rounds);
        bench.time_dispatches(bound, groups, 1)
    };
    let rounds = calibrate(target(bench, 4000, 8000), MOST_ROUNDS, |rounds| run(&bind(rounds)?, rounds))?;
    let bound = bind(rounds)?;
    let figures = bench.collect(bench.plan(9, bench.pick(150, 250)), || {
        Ok(vec![per_ns(f64::from(words) * f64::from(rounds), run(&bound, rounds)?)])
    })?;
    // Every word is added to once a round.
    let counted = bench.first_word(&buffer)?;
    if counted != added {
        return Err(format!("of {added} atomic additions {counted} took effect: the driver is broken"));
    }
    let method = format!(
        "atomicAdd of 1 to {words} words in turn, neighbouring invocations to neighbouring words, result not used"
    );
    Ok(figures.into_iter().map(|f| f.into_parameter(GpuParameterId::AtomicGPerS, &method)).collect())
}

/// Workgroups of the largest size, each of which fills a processor as far as limits let it.
struct Staircase<'b> {
    bench: &'b Bench<'b>,
    kernel: Kernel,
    sink: wgpu::Buffer,
}

impl Staircase<'_> {
    fn bind(&self, rounds: u32) -> Result<Bound, String> {
        self.bench.bind(&self.kernel, &[(0, &shape(self.bench, rounds)?), (1, &self.sink)])
    }
}

fn units(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    let limits = bench.gpu.limits();
    let lanes = limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
    let bytes = limits.max_compute_workgroup_storage_size;
    let constants = [("workgroup_lanes", f64::from(lanes)), ("shared_words", f64::from(bytes / 4))];
    let stairs = Staircase { bench, kernel: bench.kernel(SOURCE, "one_unit", &constants)?, sink: bench.storage(16)? };
    // Long against a round trip, which every time contains.
    let target = target(bench, 400, 700);
    let rounds = calibrate(target, MOST_ROUNDS, |rounds| bench.time_dispatches(&stairs.bind(rounds)?, 1, 1))?;
    let bound = stairs.bind(rounds)?;
    let time = |groups: u32| bench.time_dispatches(&bound, groups, 1).map(|t| t.as_nanos() as f64);
    let counts = choose_counts(time)?;
    let mut figures = bench.collect(bench.plan(5, bench.pick(200, 400)), || {
        let row = counts.iter().map(|&n| time(n)).collect::<Result<Vec<_>, _>>()?;
        let points: Vec<(u32, f64)> = counts.iter().copied().zip(row.iter().copied()).collect();
        let units = fits::parallel_units(&points).map_or(f64::NAN, f64::from);
        Ok([row, vec![units]].concat())
    })?;
    let samples = figures.pop().unwrap_or_default();
    // One fit through the medians is steadier than the median of the fits.
    let medians: Vec<(u32, f64)> =
        counts.iter().zip(&figures).filter_map(|(&n, f)| Some((n, stats::median(&f.samples)?))).collect();
    let last = counts.last().copied().unwrap_or(0);
    let Some(units) = fits::parallel_units(&medians) else {
        return Err(format!("the time shows no step up to {last} workgroups of {lanes} invocations"));
    };
    let method = format!(
        "least-error fit of b * ceil(n / U) to the time of {} numbers of workgroups up to {last}, each of {lanes} \
         invocations and {bytes} bytes of shared memory; several such workgroups may share a processor",
        counts.len()
    );
    Ok(vec![samples.into_fitted(f64::from(units), GpuParameterId::ParallelUnits, &method)])
}

/// Numbers of workgroups to time: doubling until the time has risen fourfold, then halving down to the first step, then
/// evenly over three steps, so that the fit can overrule a step that another program made.
fn choose_counts(mut time: impl FnMut(u32) -> Result<f64, String>) -> Result<Vec<u32>, String> {
    // The quicker of two: a single spoiled time would end the search early.
    let mut best = |n: u32| Ok::<_, String>(time(n)?.min(time(n)?));
    let one = best(1)?;
    let (mut counts, mut below, mut above) = (vec![1], 1, None);
    let mut n = 1;
    while n < MOST_GROUPS {
        n *= 2;
        counts.push(n);
        let t = best(n)?;
        // Half way between one step and two.
        if t < 1.5 * one {
            below = n;
        } else if above.is_none() {
            above = Some(n);
        }
        if t >= 4.0 * one {
            break;
        }
    }
    // Where there is no step, the doubled numbers are what there is to show.
    let Some(mut above) = above.filter(|&above| above > below) else { return Ok(counts) };
    while above - below > 1 {
        let middle = below.midpoint(above);
        *(if best(middle)? < 1.5 * one { &mut below } else { &mut above }) = middle;
    }
    let last = 3 * below.max(4);
    let spread = (1..=12).map(|k| (last * k).div_ceil(12));
    let near = [2, 1].map(|d| below.saturating_sub(d)).into_iter().chain(below..=below + 2);
    let mut counts: Vec<u32> = spread.chain(near).chain([1, 2, 2 * below, 2 * below + 1]).filter(|&n| n > 0).collect();
    counts.sort_unstable();
    counts.dedup();
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stairs(units: u32) -> impl FnMut(u32) -> Result<f64, String> {
        // A tenth of overhead, as a round trip adds it.
        move |n| Ok(0.1 + f64::from(n.div_ceil(units)))
    }

    #[test]
    fn the_chosen_numbers_show_the_step() {
        for units in [1, 2, 3, 4, 6, 7, 12, 16, 20, 28, 60, 78, 84, 108, 128, 132, 142, 304] {
            let counts = choose_counts(stairs(units)).unwrap();
            let mut time = stairs(units);
            let points: Vec<(u32, f64)> = counts.iter().map(|&n| (n, time(n).unwrap())).collect();
            assert_eq!(fits::parallel_units(&points), Some(units), "{counts:?}");
            assert!(counts.len() <= 21 && counts.windows(2).all(|w| w[0] < w[1]), "{counts:?}");
        }
    }

    #[test]
    fn a_spoiled_time_is_outvoted() {
        // Every third time takes half as long again.
        let (mut turn, mut time) = (0, stairs(24));
        let counts = choose_counts(|n| {
            turn += 1;
            Ok(time(n)? * if turn % 3 == 0 { 1.5 } else { 1.0 })
        });
        let points: Vec<(u32, f64)> = counts.unwrap().iter().map(|&n| (n, time(n).unwrap())).collect();
        assert_eq!(fits::parallel_units(&points), Some(24));
    }

    #[test]
    fn without_a_step_the_search_ends() {
        assert_eq!(choose_counts(|_| Ok(1.0)).unwrap().last(), Some(&MOST_GROUPS));
        assert!(choose_counts(|_| Err("lost".to_owned())).is_err());
    }
}
