//! The card of a model: what it was trained on and how well it did.

use crate::train::Learning;
use sapwise::model::{MethodModel, Validation};
use sapwise::{BackendClass, Model};

/// What every model of this kind is, whatever it was trained on.
const USE: &str = "
Predicts, from the hardware parameters of a machine, what each broad-phase algorithm costs under a load; `predict` derives
from that which algorithm is fastest where. The time of a frame is a sum of physical terms with non-negative units (calls,
fork-joins, objects and how far they move, comparisons of a sort, objects outside the cache, pairs and candidates tested), each
scaled by the parameter that it depends on (clock, SIMD lanes, scaling over threads, memory bandwidth, fork-join latency), times
the exponential of a ridge residual. The units are fitted on relative error, robustly, and are shared by all machines and
thread counts.

Regret is the time of the choice over the time of the best choice, less one, on reports that the fit did not see: the mean in
each quarter of a decade of each scenario, and the mean over these. A choice that was not timed at a point is charged what it cost,
relative to the best, at the nearest size of the scenario at which it was timed, up to twice as many objects or half as many;
beyond that, because the algorithm had left the race, ten times the best.

Not for timing promises: a cost may be off by more than the choice that follows from it.";

/// Of a model without GPUs, after [`USE`].
const NO_GPUS: &str = "Not for GPUs.\n";

/// Of a model with GPUs, after [`USE`].
const GPUS: &str = "
On GPUs the terms are round trips, dependent dispatches, bytes up and down, bytes moved within the GPU's memory, operations for
the candidates, and the cycles that the CPU spends on boxes and pairs; several GPUs count with the slowest latency and the sum of
their rates, no more than what the group was measured to gain. Timings on programs that act as GPUs serve only where there is no
real GPU in the training, and a prediction for a kind of GPU that was not in it says so.
";

/// Of a model that was trained on simulated machines, before [`USE`].
const SIMULATED: &str = "
**Trained on simulated machines**, whose timings a cost model made up: nothing here is evidence of how well a prediction does on a
real machine, and `predict` warns of it.
";

/// The card as a page of Markdown.
pub(crate) fn page(model: &Model, notes: &[String], learning: &[Learning]) -> String {
    let mut text = format!("# The model {}\n\nMade by `sapwise train`; this page is generated with it.\n", model.name);
    if model.is_simulated() {
        text.push_str(SIMULATED);
    }
    text.push_str(USE);
    let on_gpus: Vec<&MethodModel> = model.methods.iter().filter(|m| m.backend == BackendClass::Gpu).collect();
    text.push_str(&gpus(&on_gpus));
    text.push_str("\n## Trained on\n\n| report | physical machine | label |\n|---|---|---|\n");
    for report in &model.trained_on {
        // The label as it stands in the report.
        let label = serde_json::to_string(&report.label).unwrap_or_default();
        text.push_str(&format!("| {} | {} | {} |\n", report.file, report.physical_id, label.trim_matches('"')));
    }
    text.push_str("\n## Validation\n\n");
    text.push_str(&scores(&model.validation, markdown));
    if !learning.is_empty() {
        text.push_str(&format!("\n## Number of machines\n\n{}", course(learning, markdown)));
    }
    text.push_str("\n## Ranges\n\nA machine outside is extrapolated, and `predict` says so.\n\n");
    let mut rows = vec![["parameter", "lowest", "highest"].map(str::to_owned).to_vec()];
    for range in &model.ranges {
        rows.push(vec![range.parameter.clone(), format!("{:.4}", range.min), format!("{:.4}", range.max)]);
    }
    text.push_str(&markdown(&rows));
    if !notes.is_empty() {
        text.push_str("\n## Notes\n\n");
        notes.iter().for_each(|note| text.push_str(&format!("- {note}\n")));
    }
    text
}

/// What the model knows of GPUs.
fn gpus(methods: &[&MethodModel]) -> String {
    if methods.is_empty() {
        return format!(" {NO_GPUS}");
    }
    let mut kinds: Vec<String> = methods.iter().flat_map(|m| &m.gpu_kinds).map(ToString::to_string).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let most = methods.iter().map(|m| m.max_threads).max().unwrap_or(1);
    format!("\n{GPUS}\nKinds of GPU in the training: {}; at most {most} together.\n", kinds.join(", "))
}

/// What was held out, and the scores as a table that `draw` draws.
pub(crate) fn scores(validation: &Validation, draw: impl Fn(&[Vec<String>]) -> String) -> String {
    let Validation { held_out, physical_machines, profiles, methods } = validation;
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let data = format!("{} in {}", count(*physical_machines, "physical machine"), count(*profiles, "profile"));
    if methods.is_empty() {
        return format!("{data}; not validated.\n");
    }
    let doubt = if *physical_machines < 2 { " This says little about machines never seen." } else { "" };
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let head = ["way to choose", "mean regret", "95th percentile", "points over 10 %", "gap closed"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(methods.iter().map(|m| {
        let figures = [m.mean_regret, m.p95_regret, m.share_over_10_percent, m.closed_gap].map(percent);
        [vec![m.name.clone()], figures.to_vec()].concat()
    }));
    format!("{data}; each {held_out} left out in turn.{doubt}\n\n{}", draw(&rows))
}

/// How accuracy grows with the number of simulated machines, as a table that `draw` draws.
pub(crate) fn course(learning: &[Learning], draw: impl Fn(&[Vec<String>]) -> String) -> String {
    let names = learning.first().map_or(&[][..], |l| &l.mean_regrets);
    let head = ["way to choose".to_owned()].into_iter().chain(learning.iter().map(|l| format!("{} machines", l.machines)));
    let mut rows = vec![head.collect::<Vec<_>>()];
    rows.extend(names.iter().map(|(name, _)| {
        let of = |l: &Learning| l.mean_regrets.iter().find(|r| r.0 == *name).map(|r| format!("{:.1} %", r.1 * 100.0));
        [name.clone()].into_iter().chain(learning.iter().map(|l| of(l).unwrap_or_default())).collect()
    }));
    let subsets: Vec<String> = learning.iter().map(|l| l.subsets.to_string()).collect();
    format!(
        "Simulated: mean regret in random subsets of the machines ({} subsets), each machine left out in turn.\n\n{}",
        subsets.join(", "),
        draw(&rows)
    )
}

/// Rows as a Markdown table, the first its head.
pub(crate) fn markdown(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (k, row) in rows.iter().enumerate() {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
        if k == 0 {
            text.push_str(&format!("|{}\n", "---|".repeat(row.len())));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::columns;
    use sapwise::model::MethodScore;

    #[test]
    fn scores_tell_what_they_do_not_say() {
        let score = MethodScore {
            name: "physics".to_owned(),
            mean_regret: 0.05,
            p95_regret: 0.125,
            share_over_10_percent: 0.0,
            closed_gap: 0.9,
            mean_regret_in_games: Some(0.04),
        };
        let mut validation =
            Validation { held_out: "profile".to_owned(), physical_machines: 1, profiles: 2, methods: vec![score] };
        let text = scores(&validation, markdown);
        assert!(text.contains("1 physical machine in 2 profiles") && text.contains("says little"), "{text}");
        assert!(text.contains("|---|---|---|---|---|\n| physics | 5.0 % | 12.5 % | 0.0 % | 90.0 % |"), "{text}");
        validation.methods.clear();
        assert_eq!(scores(&validation, columns), "1 physical machine in 2 profiles; not validated.\n");
    }
}
