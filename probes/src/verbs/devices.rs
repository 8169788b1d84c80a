//! `sapwise devices`: what this machine can run.

use crate::args::Devices;
use crate::exit::Outcome;
use crate::gpus::{self, Limits, Seen, look};
use crate::output;
use crate::table::{bytes, columns};
use sapwise::{AlgorithmId, GpuIdentity, Registry, SimdLevel, usable_cores};
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

pub(crate) fn run(arguments: &Devices) -> anyhow::Result<Outcome> {
    let seen = if arguments.no_gpus { Seen::default() } else { look()? };
    let mut adapters = Vec::new();
    for identity in &seen.identities {
        let limits = gpus::limits(identity.index)?;
        let refused = limits.as_ref().err().cloned();
        adapters.push(Adapter { identity: identity.clone(), limits: limits.ok(), refused });
    }
    let answer = Answer { algorithms: algorithms(&seen, &adapters), adapters, remark: seen.remark };
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        output::print(&text(&answer, arguments.no_gpus))?;
    }
    Ok(Outcome::Done)
}

/// Those of the CPU, then those of the GPUs that were seen.
fn algorithms(seen: &Seen, adapters: &[Adapter]) -> Vec<Algorithm> {
    let mut registry = Registry::new();
    // Nothing is opened by this, so that a driver that ends the process that opens it does no harm here.
    let unloaded = match seen.load() {
        Ok(gpus) => {
            registry.add_gpus(&gpus);
            None
        }
        Err(why) => Some(why),
    };
    let entry = |id: &AlgorithmId| registry.entries().iter().find(|e| e.id == *id);
    let refused = |id: &AlgorithmId| {
        let of =
            |k: &u32| adapters.iter().find(|a| a.identity.index == *k)?.refused.clone().map(|why| format!("gpu{k}: {why}"));
        gpus::uses(id).iter().find_map(of)
    };
    let cpu = registry.entries().iter().filter(|e| gpus::uses(&e.id).is_empty()).map(|e| (e.id.clone(), e.revision));
    let gpu = sapwise::gpu::algorithms(&seen.identities);
    let algorithm = |(id, revision): (AlgorithmId, u32)| {
        let reason = refused(&id).or_else(|| match (entry(&id), &unloaded) {
            (Some(entry), _) => entry.unavailable.clone(),
            (None, Some(why)) => Some(why.clone()),
            (None, None) => Some("it is not in this build".to_owned()),
        });
        Algorithm { id: id.to_string(), revision, available: reason.is_none(), reason }
    };
    cpu.chain(gpu).map(algorithm).collect()
}

fn text(answer: &Answer, no_gpus: bool) -> String {
    let mut text = gpu_table(&answer.adapters);
    let mut rows = vec![["algorithm", "revision", "runs here"].map(str::to_owned).to_vec()];
    for a in &answer.algorithms {
        let here = a.reason.as_ref().map_or_else(|| "yes".to_owned(), |reason| format!("no: {reason}"));
        rows.push(vec![a.id.clone(), a.revision.to_string(), here]);
    }
    let cores = usable_cores();
    let plural = if cores == 1 { "" } else { "s" };
    text += &format!("{}\n{cores} usable core{plural}, vector instructions: {}.", columns(&rows), SimdLevel::in_use());
    if let Some(remark) = &answer.remark {
        text += &format!("\n{remark}.");
    } else if answer.adapters.is_empty() && !no_gpus {
        text += "\nNo GPU was found; everything else works on the CPU.";
    }
    text
}

/// Nothing without GPUs.
fn gpu_table(adapters: &[Adapter]) -> String {
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
    format!("{}{refusals}\n", columns(&rows))
}
