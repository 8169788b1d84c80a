//! `sapwise part`: one part of a measurement, in a process of its own. Hidden: other verbs start it.

use crate::algorithms::Algorithms;
use crate::args::{Part, PartKind};
use crate::exit::{Outcome, WrongUsage};
use crate::sweep::{Order, sweep};
use crate::{child, gpus, output, samples};
use sapwise::Backend;
use sapwise::measure::{self, Family, Options};

pub(crate) fn run(arguments: Part, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    // Whoever takes samples reads orders from the pipe of which the others await the end only.
    if !matches!(arguments.part, PartKind::Samples { .. }) {
        child::end_with_parent();
    }
    match arguments.part {
        PartKind::Hardware { family, threads } => {
            let family: Family = family.parse().map_err(WrongUsage)?;
            let parameters = measure::family(family, &Options { threads, ..Options::default() });
            output::print_json(&parameters)?;
        }
        PartKind::Gpus => gpus::print_identities()?,
        PartKind::GpuAlgorithms => gpus::print_entries()?,
        PartKind::GpuLimits { index } => output::print_json(&gpus::limits_of(index)?)?,
        PartKind::Gpu { index, threads } => gpus::print_parameters(index, &Options { threads, ..Options::default() })?,
        PartKind::GpuGroup { gpus: Backend::Gpu(indices), threads } => {
            gpus::print_group(&indices, &Options { threads, ..Options::default() })?;
        }
        PartKind::GpuGroup { gpus, .. } => return Err(WrongUsage(format!("{gpus} is no group of GPUs")).into()),
        PartKind::Samples { order } => {
            let order = serde_json::from_str(&order).map_err(|e| WrongUsage(format!("the order: {e}")))?;
            samples::take(&order, algorithms)?;
        }
        PartKind::Sweep { order } => {
            let order: Order = serde_json::from_str(&order).map_err(|e| WrongUsage(format!("the order: {e}")))?;
            sweep(&order, algorithms, &mut |event| output::print_json(&event))?;
        }
    }
    Ok(Outcome::Done)
}
