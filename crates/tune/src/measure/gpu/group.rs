//! Speed of several GPUs together over their speed alone: they may share a bus, power, or the cores of one CPU.

use std::sync::Barrier;
use std::time::{Duration, Instant};

use super::arithmetic::Arithmetic;
use super::bench::{Bench, Bound, Result, broken, or_missing, record};
use super::latency;
use super::transfer::Transfer;
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::Options;
use sapwise_gpu::Gpu;

/// Bytes of one upload.
const UPLOAD_BYTES: u64 = 8 << 20;

/// Round trips of a sample. One alone takes so little time that a report would hold thousands.
const ROUND_TRIPS: u32 = 10;

pub(super) fn measure(gpus: &[Gpu], options: &Options) -> Vec<Parameter> {
    let group = Group { benches: gpus.iter().map(|gpu| Bench { gpu, options }).collect(), options };
    [
        or_missing(&[GpuParameterId::GroupUploadRatio], group.uploads()),
        or_missing(&[GpuParameterId::GroupRoundTripRatio], group.round_trips()),
        or_missing(&[GpuParameterId::GroupArithmeticRatio], group.arithmetic()),
    ]
    .concat()
}

struct Group<'a> {
    benches: Vec<Bench<'a>>,
    options: &'a Options,
}

impl Group<'_> {
    /// Returns the value for this kind of GPU; one software adapter makes the group slow.
    fn pick<T>(&self, hardware: T, software: T) -> T {
        if self.benches.iter().any(Bench::is_software) { software } else { hardware }
    }

    /// Returns the time for which each GPU works for one rate.
    fn slice(&self) -> Duration {
        Duration::from_millis(if self.options.brief { 1 } else { self.pick(6, 20) })
    }

    /// Measures one ratio.
    fn ratio(
        &self,
        samples: usize,
        id: GpuParameterId,
        method: String,
        mut sample: impl FnMut() -> Result<f64>,
    ) -> Result<Vec<Parameter>> {
        self.options.plan(samples, self.pick(250, 500)).measure([(id, method)], || Ok([sample()?]))
    }

    fn uploads(&self) -> Result<Vec<Parameter>> {
        let mut jobs = self.benches.iter().map(|b| Transfer::new(b, UPLOAD_BYTES)).collect::<Result<Vec<_>>>()?;
        let time = self.slice();
        let run = |job: &mut Transfer<'_>| job.upload_rate(UPLOAD_BYTES, time);
        // First use of the pages.
        together(&mut jobs, run)?;
        let mib = UPLOAD_BYTES >> 20;
        let method =
            format!("uploads of {mib} MiB in the same time, a thread for each GPU, over the fastest one alone");
        self.ratio(6, GpuParameterId::GroupUploadRatio, method, || over_the_fastest(&mut jobs, run))
    }

    fn arithmetic(&self) -> Result<Vec<Parameter>> {
        let time = self.slice();
        let work = |bench| Ok((bench, Arithmetic::new(bench, time / 4)?));
        let mut jobs = self.benches.iter().map(work).collect::<Result<Vec<_>>>()?;
        let run = |(bench, work): &mut (&Bench<'_>, Arithmetic)| {
            let (start, mut sum, mut count) = (Instant::now(), 0.0, 0.0);
            // At least one: a dispatch may take longer than the time.
            while count == 0.0 || start.elapsed() < time {
                // Times per operation add up, rates don't.
                sum += 1.0 / work.rate(bench)?;
                count += 1.0;
            }
            Ok(count / sum)
        };
        let method = "multiply-adds in the same time, a thread for each GPU, over the fastest one alone".to_owned();
        self.ratio(6, GpuParameterId::GroupArithmeticRatio, method, || over_the_fastest(&mut jobs, run))
    }

    fn round_trips(&self) -> Result<Vec<Parameter>> {
        let bound = |bench: &Bench<'_>| bench.bind(latency::SOURCE, "empty", &[]);
        let bound = self.benches.iter().map(bound).collect::<Result<Vec<Bound>>>()?;
        let jobs = || self.benches.iter().zip(&bound);
        let method =
            "empty dispatch submitted to each GPU in turn by one thread, then waited for, over the slowest one alone";
        self.ratio(40, GpuParameterId::GroupRoundTripRatio, method.to_owned(), || {
            let (mut alone, mut together) = (vec![Duration::ZERO; bound.len()], Duration::ZERO);
            for _ in 0..ROUND_TRIPS {
                for ((bench, bound), alone) in jobs().zip(&mut alone) {
                    *alone += bench.time_dispatches(bound, 1, 1)?;
                }
                let start = Instant::now();
                let submit = |(bench, bound): (&Bench<'_>, _)| bench.submit(|encoder| record(bound, encoder, 1, 1));
                let submissions = jobs().map(submit).collect::<Result<Vec<_>>>()?;
                for (bench, submission) in self.benches.iter().zip(submissions) {
                    bench.gpu.wait(submission)?;
                }
                together += start.elapsed();
            }
            let slowest = alone.into_iter().max().unwrap_or_default();
            Ok(together.as_secs_f64() / slowest.as_secs_f64())
        })
    }
}

/// The sum of the rates of all at once over the highest of each alone.
fn over_the_fastest<J: Send>(jobs: &mut [J], run: impl Fn(&mut J) -> Result<f64> + Sync) -> Result<f64> {
    let alone = jobs.iter_mut().map(&run).collect::<Result<Vec<f64>>>()?;
    let all: f64 = together(jobs, run)?.iter().sum();
    Ok(all / alone.into_iter().fold(0.0, f64::max))
}

/// Runs every job at the same time, each on a thread of its own.
fn together<J: Send>(jobs: &mut [J], run: impl Fn(&mut J) -> Result<f64> + Sync) -> Result<Vec<f64>> {
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
        threads.into_iter().map(|t| t.join().map_err(|_| broken("a thread panicked".to_owned()))?).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_rates() {
        let mut jobs = [2.0, 4.0];
        assert_eq!(over_the_fastest(&mut jobs, |job| Ok(*job)), Ok(1.5));
        assert!(over_the_fastest(&mut jobs, |_| Err(broken("lost".to_owned()))).is_err());
        assert_eq!(together(&mut jobs, |job| Ok(*job)), Ok(vec![2.0, 4.0]));
    }
}
