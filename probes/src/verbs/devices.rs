//! `sapwise devices`: the algorithms that this machine can run.

use crate::algorithms::Algorithms;
use crate::args::Devices;
use crate::exit::Outcome;
use crate::gpus::{self, Seen, look};
use crate::progress::{Progress, Steps as _};
use crate::terminal::Terminal;
use crate::{output, shell};
use sapwise::AlgorithmId;
use sapwise::algorithm::{SimdLevel, usable_cores};
use sapwise_lab::text::{count, once};
use sapwise_tune::GpuIdentity;
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    algorithms: Vec<Algorithm>,
    adapters: Vec<GpuIdentity>,
    /// Why no GPUs could be looked for, if they could not.
    remark: Option<String>,
    /// Adapters that execute nothing, one sentence each.
    inert: Vec<String>,
}

#[derive(Serialize)]
struct Algorithm {
    id: String,
    revision: u32,
    available: bool,
    /// Why it is not available, if it is not.
    reason: Option<String>,
}

pub(crate) fn run(arguments: &Devices, known: &Algorithms) -> anyhow::Result<Outcome> {
    let progress = Progress::new(0);
    progress.message("looking for GPUs");
    let seen = if arguments.no_gpus { Seen::default() } else { look()? };
    progress.message("algorithms on the GPUs");
    let (algorithms, inert) = algorithms(&seen, known)?;
    let answer = Answer { algorithms, adapters: seen.identities, remark: seen.remark, inert };
    drop(progress);
    output::answer(arguments.json, &answer, || text(&answer, arguments.no_gpus, Terminal::of_standard_output()))
}

/// Returns the algorithms on the CPU and on the GPUs, and a sentence for each GPU that executes nothing. Only other
/// processes load drivers.
///
/// # Errors
/// When no process can be started.
fn algorithms(seen: &Seen, known: &Algorithms) -> anyhow::Result<(Vec<Algorithm>, Vec<String>)> {
    let (on_gpus, failure) = if seen.identities.is_empty() { (Vec::new(), None) } else { gpus::entries()? };
    let reason = |id: &AlgorithmId| match on_gpus.iter().find(|e| e.id == *id) {
        Some(entry) => entry.unavailable.clone(),
        None => failure.clone().or_else(|| Some("it is not in this build".to_owned())),
    };
    let algorithm = |id: &AlgorithmId, revision: u32, reason: Option<String>| Algorithm {
        id: id.to_string(),
        revision,
        available: reason.is_none(),
        reason,
    };
    let registry = known.registry(usable_cores());
    let mut list: Vec<Algorithm> = registry
        .entries()
        .iter()
        .map(|e| algorithm(&e.id, e.revision, e.unavailable.as_ref().map(|why| format!("{why:#}"))))
        .collect();
    for sapwise::algorithm::Entry { id, revision, .. } in sapwise_gpu::algorithms(&seen.identities) {
        list.push(algorithm(&id, revision, reason(&id)));
    }
    Ok((list, once(on_gpus.iter().filter_map(|e| e.inert.clone()))))
}

fn text(answer: &Answer, no_gpus: bool, terminal: Terminal) -> String {
    let mut text = gpu_table(&answer.adapters, terminal);
    let mut rows = vec![["algorithm", "revision", "runs here"].map(str::to_owned).to_vec()];
    for a in &answer.algorithms {
        let here = a.reason.as_ref().map_or_else(|| "yes".to_owned(), |reason| format!("no: {reason}"));
        rows.push(vec![a.id.clone(), a.revision.to_string(), here]);
    }
    let cores = count(usable_cores() as usize, "usable core");
    text += &format!("{}\n{cores}, vector instructions: {}.", terminal.table(&rows), SimdLevel::in_use());
    if let Some(remark) = &answer.remark {
        text += &format!("\n{}", terminal.warning(&format!("{remark}.")));
    } else if answer.adapters.is_empty() && !no_gpus {
        text += "\nNo GPU was found; the algorithms on the CPU are not affected.";
    }
    for sentence in &answer.inert {
        text += &format!("\n{}", terminal.warning(&format!("{sentence}.")));
    }
    text + "\n" + &shell::next(if no_gpus { "predict --no-gpus" } else { "predict" })
}

/// Draws the GPUs as a table; nothing without any. Their drivers are in the JSON.
fn gpu_table(adapters: &[GpuIdentity], terminal: Terminal) -> String {
    if adapters.is_empty() {
        return String::new();
    }
    let mut rows = vec![["gpu", "kind", "api", "name"].map(str::to_owned).to_vec()];
    let row = |g: &GpuIdentity| vec![format!("gpu{}", g.index), g.kind.to_string(), g.api.clone(), g.name.clone()];
    rows.extend(adapters.iter().map(row));
    format!("{}\n", terminal.table(&rows))
}
