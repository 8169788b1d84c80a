//! Latencies of a GPU: three times that differ by orders of magnitude.

use std::time::Instant;

use super::bench::{Bench, Result, broken};
use crate::hardware::{GpuParameterId, Parameter};
use sapwise_gpu::{GpuError, GpuErrorKind};

pub(super) const SOURCE: &str = include_str!("shaders/latency.wgsl");

/// Dispatches in the long pass beyond the first one. A sample lasts a millisecond, so that a report holds a few
/// hundred at most.
const CHAIN: u32 = 500;

/// The same on a software adapter.
const CHAIN_SOFTWARE: u32 = 50;

pub(super) const NAMES: [GpuParameterId; 3] =
    [GpuParameterId::RoundTripNs, GpuParameterId::DispatchNs, GpuParameterId::ReadBackNs];

/// Proves that the GPU executes what it is given. Other failures are no error here; they show in what is measured
/// next.
///
/// # Errors
/// [`GpuErrorKind::Inert`] if the GPU executes nothing.
pub(super) fn proof(bench: &Bench<'_>) -> std::result::Result<(), GpuError> {
    const STEPS: u32 = 3;
    let counted = || {
        let count = bench.storage(16)?;
        bench.time_dispatches(&bench.bind(SOURCE, "step", &[(0, &count)])?, 1, STEPS)?;
        bench.read_word(&count, &bench.word()?)
    };
    let proved = match counted() {
        Ok(steps) if steps != STEPS => Err(bench.gpu.inert()),
        _ => bench.gpu.check(),
    };
    proved.or_else(|e| if e.kind() == GpuErrorKind::Inert { Err(e) } else { Ok(()) })
}

pub(super) fn measure(bench: &Bench<'_>) -> Result<Vec<Parameter>> {
    let count = bench.storage(16)?;
    let empty = bench.bind(SOURCE, "empty", &[])?;
    let step = bench.bind(SOURCE, "step", &[(0, &count)])?;
    let staging = bench.word()?;
    let chain = bench.pick(CHAIN, CHAIN_SOFTWARE);
    let dispatch_method = format!(
        "pass of {} dispatches that each read what the previous one wrote, minus a pass of one, per dispatch",
        1 + chain
    );
    let named = [
        (NAMES[0], "recording, submission and wait of one empty dispatch".to_owned()),
        (NAMES[1], dispatch_method),
        (NAMES[2], "recording, copy of 4 bytes into a kept buffer, wait, mapping and reading".to_owned()),
    ];
    let mut steps = 0_u32;
    let parameters = bench.options.plan(40, bench.pick(250, 400)).measure(named, || {
        let round_trip = bench.time_dispatches(&empty, 1, 1)?;
        let one = bench.time_dispatches(&step, 1, 1)?;
        let long = bench.time_dispatches(&step, 1, 1 + chain)?;
        steps = steps.wrapping_add(chain + 2);
        let start = Instant::now();
        bench.read_word(&count, &staging)?;
        let read_back = start.elapsed();
        Ok([round_trip, long.saturating_sub(one) / chain, read_back].map(|time| time.as_nanos() as f64))
    })?;
    // Each dispatch adds one to what it reads: if two had overlapped, some would be lost.
    match bench.read_word(&count, &staging)? {
        counted if counted == steps => Ok(parameters),
        counted => Err(broken(format!("of {steps} dependent dispatches {counted} took effect"))),
    }
}
