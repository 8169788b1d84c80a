//! What it costs to ask a GPU for anything: four figures that differ by orders of magnitude, so that none stands for
//! another.

use std::time::Instant;

use super::bench::{Bench, or_missing, record, words};
use crate::gpu::GpuErrorKind;
use crate::hardware::{GpuParameterId, Parameter};

const SOURCE: &str = include_str!("shaders/latency.wgsl");

/// Dispatches in the long pass, beyond the first one. As many as make a sample last a millisecond, so that a few hundred samples at
/// most stand in a report.
const CHAIN: u32 = 500;

/// The same on a software adapter.
const CHAIN_SOFTWARE: u32 = 50;

const NAMES: [GpuParameterId; 4] =
    [GpuParameterId::SubmitNs, GpuParameterId::RoundTripNs, GpuParameterId::DispatchNs, GpuParameterId::ReadBackNs];

pub(super) fn measure(bench: &Bench<'_>) -> Vec<Parameter> {
    or_missing(&NAMES, latencies(bench))
}

/// That the GPU executes what it is given. `Err` says that it does not; whatever else goes wrong shows in what is measured next.
pub(super) fn proof(bench: &Bench<'_>) -> Result<(), String> {
    const STEPS: u32 = 3;
    let counted = || -> Result<u32, String> {
        let count = bench.storage(16)?;
        let step = bench.bind(&bench.kernel(SOURCE, "step", &[])?, &[(0, &count)])?;
        bench.time_dispatches(&step, 1, STEPS)?;
        bench.first_word(&count)
    };
    let told = match counted() {
        Ok(steps) if steps != STEPS => Err(bench.gpu.inert()),
        _ => bench.gpu.check(),
    };
    told.or_else(|e| if e.kind() == GpuErrorKind::Inert { Err(e.to_string()) } else { Ok(()) })
}

fn latencies(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    let count = bench.storage(16)?;
    let (empty, step) = (bench.kernel(SOURCE, "empty", &[])?, bench.kernel(SOURCE, "step", &[])?);
    let (empty, step) = (bench.bind(&empty, &[])?, bench.bind(&step, &[(0, &count)])?);
    let staging = bench.buffer(4, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)?;
    let chain = bench.pick(CHAIN, CHAIN_SOFTWARE);
    let mut steps = 0_u32;
    let mut figures = bench
        .collect(bench.plan(40, bench.pick(250, 400)), || {
            let start = Instant::now();
            let submission = bench.submit(|encoder| record(&empty, encoder, 1, 1))?;
            let submit = start.elapsed();
            bench.gpu.wait(submission).map_err(words)?;
            let round_trip = start.elapsed();
            let one = bench.time_dispatches(&step, 1, 1)?;
            let long = bench.time_dispatches(&step, 1, 1 + chain)?;
            steps = steps.wrapping_add(chain + 2);
            let start = Instant::now();
            bench.read_word(&count, &staging)?;
            let read_back = start.elapsed();
            let dispatch = long.saturating_sub(one) / chain;
            Ok([submit, round_trip, dispatch, read_back].map(|time| time.as_nanos() as f64).to_vec())
        })?
        .into_iter();
    // Each dispatch adds one to what it reads: had two of them overlapped, some would be lost.
    let counted = bench.first_word(&count)?;
    if counted != steps {
        return Err(format!("of {steps} dependent dispatches {counted} took effect: the driver is broken"));
    }
    let methods = [
        "recording and submission of one empty dispatch, without waiting; time of the CPU".to_owned(),
        "recording, submission and wait of one empty dispatch".to_owned(),
        format!(
            "pass of {} dispatches that each read what the one before wrote, minus a pass of one, per dispatch",
            1 + chain
        ),
        "recording, copy of 4 bytes into a kept buffer, wait, mapping and reading".to_owned(),
    ];
    let named = NAMES.into_iter().zip(methods);
    Ok(named.map(|(name, method)| figures.next().unwrap_or_default().into_parameter(name, &method)).collect())
}
