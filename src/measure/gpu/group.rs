//! What GPUs do together, over what they do alone: they may share a bus, power, or the cores of one CPU.

use std::sync::Barrier;
use std::time::{Duration, Instant};

use super::bench::{Bench, Bound, Kernel, or_missing, record, words};
use super::compute::Arithmetic;
use super::transfer::Transfer;
use crate::gpu::Gpu;
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::Options;
use crate::measure::foreign_load::{self, Figure, Plan};

/// Bytes of one upload.
const UPLOAD_BYTES: u64 = 8 << 20;

/// Round trips of a sample. One alone is over in so short a time that thousands of samples would stand in a report.
const ROUND_TRIPS: u32 = 10;

pub(super) fn measure(gpus: &[Gpu], options: &Options) -> Vec<Parameter> {
    let benches: Vec<Bench<'_>> = gpus.iter().map(|gpu| Bench::new(gpu, options)).collect();
    let mut parameters = or_missing(&[GpuParameterId::GroupUploadRatio], uploads(&benches));
    parameters.extend(or_missing(&[GpuParameterId::GroupRoundTripRatio], round_trips(&benches)));
    parameters.extend(or_missing(&[GpuParameterId::GroupArithmeticRatio], arithmetic(&benches)));
    parameters
}

fn plan(benches: &[Bench<'_>], samples: usize) -> Plan {
    let slow = benches.iter().any(Bench::is_software);
    let options = benches.first().map(|bench| bench.options.clone()).unwrap_or_default();
    options.plan(samples, if slow { 500 } else { 250 })
}

fn slice(benches: &[Bench<'_>]) -> Duration {
    let brief = benches.iter().any(|bench| bench.options.brief);
    let slow = benches.iter().any(Bench::is_software);
    Duration::from_millis(if brief {
        1
    } else if slow {
        20
    } else {
        6
    })
}

fn one(figures: Vec<Figure>, id: GpuParameterId, method: &str) -> Vec<Parameter> {
    figures.into_iter().map(|figure| figure.into_parameter(id, method)).collect()
}

fn uploads(benches: &[Bench<'_>]) -> Result<Vec<Parameter>, String> {
    let mut jobs = benches.iter().map(|b| Transfer::new(b, UPLOAD_BYTES)).collect::<Result<Vec<_>, _>>()?;
    let time = slice(benches);
    let run = |job: &mut Transfer<'_>| job.upload_rate(UPLOAD_BYTES, time);
    // First use of the pages.
    together(&mut jobs, run)?;
    let figures = foreign_load::try_collect(plan(benches, 6), || ratio(&mut jobs, run))?;
    let mib = UPLOAD_BYTES >> 20;
    let method = format!("uploads of {mib} MiB in the same time, a thread for each GPU, over the fastest one alone");
    Ok(one(figures, GpuParameterId::GroupUploadRatio, &method))
}

/// Arithmetic on one GPU.
struct Work<'a> {
    bench: &'a Bench<'a>,
    arithmetic: Arithmetic,
    rounds: u32,
}

impl Work<'_> {
    /// Operations a nanosecond, dispatch after dispatch for `time`.
    fn rate(&self, time: Duration) -> Result<f64, String> {
        let bound = self.arithmetic.bind(self.bench, self.rounds)?;
        let (start, mut sum, mut count) = (Instant::now(), 0.0, 0.0);
        // At least one: a dispatch may take longer than the time.
        while count == 0.0 || start.elapsed() < time {
            // Times per operation add up, rates don't.
            sum += 1.0 / self.arithmetic.rate(self.bench, &bound, self.rounds, 1)?;
            count += 1.0;
        }
        Ok(count / sum)
    }
}

fn arithmetic(benches: &[Bench<'_>]) -> Result<Vec<Parameter>, String> {
    let time = slice(benches);
    let work = |bench| {
        let arithmetic = Arithmetic::new(bench)?;
        let rounds = arithmetic.calibrate(bench, time / 4)?;
        Ok(Work { bench, arithmetic, rounds })
    };
    let mut jobs = benches.iter().map(work).collect::<Result<Vec<_>, String>>()?;
    let run = |job: &mut Work<'_>| job.rate(time);
    let figures = foreign_load::try_collect(plan(benches, 6), || ratio(&mut jobs, run))?;
    let method = "multiply-adds in the same time, a thread for each GPU, over the fastest one alone";
    Ok(one(figures, GpuParameterId::GroupArithmeticRatio, method))
}

/// One sample: the sum of the rates of all at once over the highest of each alone.
fn ratio<J: Send>(jobs: &mut [J], run: impl Fn(&mut J) -> Result<f64, String> + Sync) -> Result<Vec<f64>, String> {
    let alone = jobs.iter_mut().map(&run).collect::<Result<Vec<f64>, _>>()?;
    let all: f64 = together(jobs, run)?.iter().sum();
    Ok(vec![all / alone.into_iter().fold(0.0, f64::max)])
}

/// Runs every job at the same time, each on a thread of its own.
fn together<J: Send>(jobs: &mut [J], run: impl Fn(&mut J) -> Result<f64, String> + Sync) -> Result<Vec<f64>, String> {
    let barrier = Barrier::new(jobs.len());
    std::thread::scope(|scope| {
        let start = |job| {
            let (barrier, run) = (&barrier, &run);
            scope.spawn(move || {
                barrier.wait();
                run(job)
            })
        };
        // All are started before the first is waited for.
        let threads: Vec<_> = jobs.iter_mut().map(start).collect();
        threads.into_iter().map(|t| t.join().map_err(|_| "a driver panicked".to_owned())?).collect()
    })
}

fn round_trips(benches: &[Bench<'_>]) -> Result<Vec<Parameter>, String> {
    let source = include_str!("shaders/latency.wgsl");
    let kernels = benches.iter().map(|b| b.kernel(source, "empty", &[])).collect::<Result<Vec<Kernel>, _>>()?;
    let bind = |(bench, kernel): (&Bench<'_>, _)| bench.bind(kernel, &[]);
    let bound = benches.iter().zip(&kernels).map(bind).collect::<Result<Vec<Bound>, _>>()?;
    let figures = foreign_load::try_collect(plan(benches, 40), || {
        let (mut alone, mut together) = (vec![Duration::ZERO; benches.len()], Duration::ZERO);
        for _ in 0..ROUND_TRIPS {
            for ((bench, bound), alone) in benches.iter().zip(&bound).zip(&mut alone) {
                *alone += bench.time_dispatches(bound, 1, 1)?;
            }
            let start = Instant::now();
            let submissions: Vec<_> = benches
                .iter()
                .zip(&bound)
                .map(|(bench, bound)| bench.submit(|encoder| record(bound, encoder, 1, 1)))
                .collect::<Result<_, _>>()?;
            for (bench, submission) in benches.iter().zip(submissions) {
                bench.gpu.wait(submission).map_err(words)?;
            }
            together += start.elapsed();
        }
        let slowest = alone.into_iter().max().unwrap_or_default();
        Ok::<_, String>(vec![together.as_secs_f64() / slowest.as_secs_f64()])
    })?;
    let method =
        "empty dispatch submitted to each GPU in turn by one thread, then waited for, over the slowest one alone";
    Ok(one(figures, GpuParameterId::GroupRoundTripRatio, method))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_rates() {
        let mut jobs = [2.0, 4.0];
        assert_eq!(ratio(&mut jobs, |job| Ok(*job)), Ok(vec![1.5]));
        assert!(ratio(&mut jobs, |_| Err("lost".to_owned())).is_err());
        assert_eq!(together(&mut jobs, |job| Ok(*job)), Ok(vec![2.0, 4.0]));
    }
}
