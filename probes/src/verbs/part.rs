//! `sapwise part`: one part of a measurement, in a process of its own. Hidden: other verbs start it.

use crate::algorithms::Algorithms;
use crate::args::Part;
use crate::exit::{Outcome, WrongUsage};
use crate::sweep::{SweepRequest, sweep};
use crate::{child, gpus, output};
use sapwise::algorithm::Backend;
use sapwise_tune::measure::Options;

pub(crate) fn run(part: Part, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    child::when_parent_ends(|| std::process::exit(1));
    match part {
        Part::Gpus => gpus::print_identities()?,
        Part::GpuAlgorithms => gpus::print_entries()?,
        Part::Gpu { index, threads } => gpus::print_parameters(index, &Options::default().with_threads(threads))?,
        Part::GpuGroup { gpus: Backend::Gpu(indices), threads } => {
            gpus::print_group(&indices, &Options::default().with_threads(threads))?;
        }
        Part::GpuGroup { gpus, .. } => return Err(WrongUsage(format!("{gpus} is no group of GPUs")).into()),
        Part::Sweep { request } => {
            let request: SweepRequest =
                serde_json::from_str(&request).map_err(|e| WrongUsage(format!("the request: {e}")))?;
            sweep(&request, algorithms, &mut |event| output::print_json(&event))?;
        }
    }
    Ok(Outcome::Done)
}
