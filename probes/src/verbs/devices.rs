//! `sapwise devices`: what this machine can run.

use crate::algorithms::Algorithms;
use crate::args::Devices;
use crate::exit::Outcome;
use crate::gpus::{self, Limits, OnGpus, Seen, look};
use crate::output;
use crate::progress::Progress;
use crate::terminal::Terminal;
use sapwise::{AlgorithmId, GpuIdentity, SimdLevel, usable_cores};
use sapwise_lab::text::{bytes, count};
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    algorithms: Vec<Algorithm>,
    adapters: Vec<Adapter>,
    /// What went wrong while looking for GPUs.
    remark: Option<String>,
}

#[derive(Serialize)]
struct Algorithm {
    id: String,
    revision: u32,
    available: bool,
    /// Why it is not available.
    reason: Option<String>,
}

/// A GPU.
#[derive(Serialize)]
struct Adapter {
    #[serde(flatten)]
    identity: GpuIdentity,
    /// `None` when it can't be opened.
    limits: Option<Limits>,
    /// Why it can't be opened.
    refused: Option<String>,
}

pub(crate) fn run(arguments: &Devices, known: &Algorithms) -> anyhow::Result<Outcome> {
    let progress = Progress::new(0);
    progress.message("looking for GPUs");
    let seen = if arguments.no_gpus { Seen::default() } else { look()? };
    // One more for the algorithms on them.
    progress.steps(seen.identities.len() as u64 + 1);
    let mut adapters = Vec::new();
    for identity in &seen.identities {
        progress.message(format!("opening gpu{}", identity.index));
        let limits = gpus::limits(identity.index)?;
        let refused = limits.as_ref().err().cloned();
        adapters.push(Adapter { identity: identity.clone(), limits: limits.ok(), refused });
        progress.advance(1);
    }
    progress.message("algorithms on the GPUs");
    let answer = Answer { algorithms: algorithms(&seen, &adapters, known)?, adapters, remark: seen.remark };
    drop(progress);
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        output::print(&text(&answer, arguments.no_gpus, Terminal::of_standard_output()))?;
    }
    Ok(Outcome::Done)
}

/// Those of the CPU, then those of the GPUs that were seen. Drivers are loaded into processes of their own only.
///
/// # Errors
/// When no process can be started.
fn algorithms(seen: &Seen, adapters: &[Adapter], known: &Algorithms) -> anyhow::Result<Vec<Algorithm>> {
    let on_gpus = if adapters.is_empty() { Ok(Vec::new()) } else { gpus::entries()? };
    let refused = |id: &AlgorithmId| {
        let refusal = |k: &u32| adapters.iter().find(|a| a.identity.index == *k)?.refused.clone();
        gpus::uses(id).iter().find_map(|k| refusal(k).map(|why| format!("gpu{k}: {why}")))
    };
    let entry = |id: &AlgorithmId| match &on_gpus {
        Ok(list) => list
            .iter()
            .find(|e| e.id == *id)
            .cloned()
            .map_or_else(|| Some("it is not in this build".to_owned()), |OnGpus { unavailable, .. }| unavailable),
        Err(why) => Some(why.clone()),
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
    for sapwise::Entry { id, revision, .. } in sapwise::gpu::algorithms(&seen.identities) {
        list.push(algorithm(&id, revision, refused(&id).or_else(|| entry(&id))));
    }
    Ok(list)
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
    text + "\nNext: sapwise predict"
}

/// Nothing without GPUs.
fn gpu_table(adapters: &[Adapter], terminal: Terminal) -> String {
    if adapters.is_empty() {
        return String::new();
    }
    let head = ["gpu", "kind", "api", "binding", "buffer", "workgroup", "shared", "subgroup", "name", "driver"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let mut refusals = String::new();
    for Adapter { identity: g, limits, refused } in adapters {
        let mut row = vec![format!("gpu{}", g.index), g.kind.to_string(), g.api.clone()];
        row.extend(match limits {
            Some(l) => [
                bytes(l.binding_bytes as f64),
                bytes(l.buffer_bytes as f64),
                l.workgroup_invocations.to_string(),
                bytes(f64::from(l.workgroup_memory_bytes)),
                match l.subgroup_lanes {
                    [low, high] if low == high => low.to_string(),
                    [low, high] => format!("{low} to {high}"),
                },
            ],
            None => ["-"; 5].map(str::to_owned),
        });
        row.extend([g.name.clone(), g.driver.clone()]);
        rows.push(row);
        if let Some(why) = refused {
            refusals += &format!("gpu{} can't be used: {why}\n", g.index);
        }
    }
    format!("{}{refusals}\n", terminal.table(&rows))
}
