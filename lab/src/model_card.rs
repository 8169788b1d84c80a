//! The card of a model: what it was trained on and how well it did.

use crate::text::count as counted;
use sapwise::model::{Coverage, FEWEST_MACHINES, Learning, LearningScore, MethodModel, TrainingCount, Validation};
use crate::report::Label;
use sapwise::{BackendClass, Model};

const COVERED: &str = "see the coverage in the validation, where there is one.";

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

/// What the columns of the scores mean, below them.
const COLUMNS: &str = "
- **mean regret**, **95th percentile**: over the held-out reports, each physical machine counting the same.
- **over 10 %**: share of the points at which the choice cost a tenth more than the best, or worse.
- **gap closed**: how much of the way from the best single algorithm (0 %) to the oracle, which always knows the best (100 %); below
  zero is worse than that single algorithm.
- **in games**: the mean regret and its 95th percentile where each number of objects counts as often as games have it. That is an
  assumption, not a count: log-normal around 800 objects, two thirds of the frames within 220 to 2800.
- **borders off by**: octaves between the measured border of two tuning in the scenario `uniform` and where the predicted costs of the
  same two algorithms cross, the median; one octave is a factor of two in objects. Where they do not cross in the measured sizes, the
  distance to the end of these, a lower bound. **within 1/2 octave**: the share of the borders. Both only for what predicts costs. A
  border between two algorithms that cost nearly the same is vague and harmless: the regret tells what it costs.

";

/// What the ways to choose are, below the scores.
const WAYS: &str = "
`physics + ridge` is what `predict --samples 0` does; `physics` the same without the residual; `ours + 8 samples` what `predict` does,
on at most 64 of the held-out reports: the samples are of one scenario and replayed from the timings by which the choice is judged, so that they
are as exact as these. A held-out machine is taken with its cores as far apart as they were at half of its points, which `predict` sees only
as they are in the seconds of its measurement. `random forest` predicts each method's time from
load and hardware parameters and knows no physics. `direct regression` is the paper's: the position of each border as a power law of
hardware parameters, and a choice by the number of objects alone. Notes say how many of its borders are means: there were no more
machines with that crossing than parameters to regress it on. `frozen constants` are what engines ship (64 colliders in nexus, 1000 bodies in
mujoco_warp), `default machine` the measured thresholds of the first report in the training, whatever the machine, `nearest machine` the measured
costs of the machine of the training with the most similar parameters. `full sweep` has measured the held-out machine
itself, and is judged by those same timings.
";

/// The card as a page of Markdown.
pub(crate) fn page(model: &Model, notes: &[String]) -> String {
    let mut text = format!("# The model {}\n\nMade by `sapwise train`; this page is generated with it.\n", model.name);
    if model.is_simulated() {
        text.push_str(SIMULATED);
    }
    text.push_str(USE);
    let on_gpus: Vec<&MethodModel> = model.methods.iter().filter(|m| m.backend == BackendClass::Gpu).collect();
    text.push_str(&gpus(&on_gpus));
    text.push_str(&trained_on(model));
    text.push_str("\n## Validation\n\n");
    text.push_str(&scores(&model.validation, markdown));
    if !model.validation.methods.is_empty() {
        text.push_str(COLUMNS.trim_end());
        text.push('\n');
        text.push_str(WAYS);
    }
    if !model.validation.learning.is_empty() {
        let course = course(&model.validation.learning, model.is_simulated(), markdown);
        text.push_str(&format!("\n## Number of machines\n\n{course}"));
    }
    text.push_str("\n## Ranges\n\nA machine outside is extrapolated, and `predict` says so.\n\n");
    let mut rows = vec![["parameter", "lowest", "highest"].map(str::to_owned).to_vec()];
    for range in &model.ranges {
        rows.push(vec![range.parameter.clone(), format!("{:.4}", range.min), format!("{:.4}", range.max)]);
    }
    text.push_str(&markdown(&rows));
    text.push_str(&format!("\n## Intervals\n\n{}\n", intervals(model)));
    if !notes.is_empty() {
        text.push_str("\n## Notes\n\n");
        notes.iter().for_each(|note| text.push_str(&format!("- {note}\n")));
    }
    text
}

/// How sure its predictions can be, and by what it tells a machine unlike those of training.
fn intervals(model: &Model) -> String {
    let machines = model.validation.physical_machines;
    let claimed = match model.folds.len() {
        _ if machines < FEWEST_MACHINES as usize => format!(
            "None can be claimed: the training holds {}, and a 90 % interval takes {FEWEST_MACHINES}.",
            counted(machines, "physical machine")
        ),
        0 => "None can be claimed: no fold was kept.".to_owned(),
        folds => format!(
            "90 % by the jackknife+ over {} of {machines} physical machines, left out of the fit in {} (with more machines than \
             parts that is CV+). Errors are those under all loads and not those near a border, so that no share is guaranteed of \
             borders; {COVERED}",
            model.folds.iter().map(|f| f.machines).sum::<u32>(),
            counted(folds, "part")
        ),
    };
    let clouds: Vec<String> = model.clouds.iter().map(|c| format!("{} {}s", c.points, c.processor)).collect();
    let together = match clouds.len() {
        0 => {
            "by the range of each parameter alone; all parameters together take two more machines than parameters".to_owned()
        }
        _ => format!("by the range of each parameter, and by all of them together against {}", clouds.join(" and ")),
    };
    format!("{claimed}\n\nA machine unlike those of training is told {together}.")
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

/// The reports behind a model, or their counts.
fn trained_on(model: &Model) -> String {
    // The label as it stands in the report.
    let label = |label: Label| serde_json::to_string(&label).unwrap_or_default().trim_matches('"').to_owned();
    let mut rows = vec![["report", "physical machine", "label"].map(str::to_owned).to_vec()];
    rows.extend(model.trained_on.iter().map(|r| vec![r.file.clone(), r.physical_id.clone(), label(r.label)]));
    if !model.trained_on_counts.is_empty() {
        rows = vec![["reports", "physical machines", "label"].map(str::to_owned).to_vec()];
        let count = |c: &TrainingCount| vec![c.reports.to_string(), c.physical_machines.to_string(), label(c.label)];
        rows.extend(model.trained_on_counts.iter().map(count));
    }
    format!("\n## Trained on\n\n{}", markdown(&rows))
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

/// What was held out, and the scores as a table that `draw` draws.
pub(crate) fn scores(validation: &Validation, draw: impl Fn(&[Vec<String>]) -> String) -> String {
    let Validation { held_out, physical_machines, profiles, methods, coverage, .. } = validation;
    let data = format!("{} in {}", counted(*physical_machines, "physical machine"), counted(*profiles, "profile"));
    if methods.is_empty() {
        return format!("{data}; not validated.\n");
    }
    let doubt = if *physical_machines < 2 { " This says little about machines never seen." } else { "" };
    let head = [
        "way to choose",
        "mean regret",
        "95th percentile",
        "over 10 %",
        "gap closed",
        "mean in games",
        "95th in games",
        "borders off by",
        "within 1/2 octave",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(methods.iter().map(|m| {
        let known = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), percent);
        let octaves = m.crossing_error_octaves.map_or_else(|| "-".to_owned(), |octaves| format!("{octaves:.2} octaves"));
        vec![
            m.name.clone(),
            percent(m.mean_regret),
            percent(m.p95_regret),
            percent(m.share_over_10_percent),
            percent(m.closed_gap),
            known(m.mean_regret_in_games),
            known(m.p95_regret_in_games),
            octaves,
            known(m.crossings_within_half_octave),
        ]
    }));
    let covered = coverage.as_ref().map_or_else(String::new, covered);
    format!("{data}; each {held_out} left out in turn.{doubt}\n\n{}{covered}", draw(&rows))
}

/// How often the 90 % intervals held what was measured.
fn covered(coverage: &Coverage) -> String {
    let Coverage { times, times_count, crossings, crossings_count } = coverage;
    let borders = crossings.map_or_else(String::new, |share| {
        format!(", and {} of {crossings_count} measured borders in those of the borders", percent(share))
    });
    format!(
        "\n{} of {times_count} measured times lie in the 90 % intervals that were predicted for them{borders}.\n",
        percent(*times)
    )
}

/// How accuracy grows with the number of machines, as a table that `draw` draws.
pub(crate) fn course(learning: &[Learning], simulated: bool, draw: impl Fn(&[Vec<String>]) -> String) -> String {
    let names = learning.first().map_or(&[][..], |l| &l.methods);
    let head = ["way to choose".to_owned()].into_iter().chain(learning.iter().map(|l| counted(l.machines, "machine")));
    let mut rows = vec![head.collect::<Vec<_>>()];
    rows.extend(names.iter().map(|LearningScore { name, .. }| {
        let of = |l: &Learning| {
            let score = l.methods.iter().find(|m| m.name == *name)?;
            let [low, high] = [score.low, score.high].map(|r| format!("{:.1}", r * 100.0));
            Some(format!("{} ({low} to {high})", percent(score.mean_regret)))
        };
        [name.clone()].into_iter().chain(learning.iter().map(|l| of(l).unwrap_or_default())).collect()
    }));
    let trainings: Vec<String> = learning.iter().map(|l| l.trainings.to_string()).collect();
    let evidence = if simulated { "Simulated machines, which are no evidence: mean" } else { "Mean" };
    format!(
        "{evidence} regret on machines that were left out, after training on so many others; in brackets from the 5th to the 95th \
         percentile over the random trainings ({} of them).\n\n{}",
        trainings.join(", "),
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
    use crate::text::columns;
    use sapwise::model::MethodScore;

    #[test]
    fn a_card_says_whether_intervals_can_be_claimed() {
        let mut model = Model::built_in().unwrap();
        (model.folds, model.clouds) = (Vec::new(), Vec::new());
        for (machines, text) in [(3, "holds 3 physical machines, and a 90 % interval takes 10"), (12, "no fold was kept")] {
            model.validation.physical_machines = machines;
            assert!(page(&model, &[]).contains(text), "{}", intervals(&model));
        }
        model.folds = vec![sapwise::model::Fold { machines: 12, methods: Vec::new(), errors: Vec::new() }];
        assert!(intervals(&model).contains("12 physical machines, left out of the fit in 1 part "));
        assert!(intervals(&model).contains("each parameter alone"));
    }

    #[test]
    fn scores_tell_what_they_do_not_say() {
        let score = MethodScore {
            name: "physics".to_owned(),
            mean_regret: 0.05,
            p95_regret: 0.125,
            closed_gap: 0.9,
            mean_regret_in_games: Some(0.04),
            crossing_error_octaves: Some(0.25),
            ..MethodScore::default()
        };
        let mut validation = Validation {
            held_out: "profile".to_owned(),
            physical_machines: 1,
            profiles: 2,
            methods: vec![score],
            ..Validation::default()
        };
        let text = scores(&validation, markdown);
        assert!(text.contains("1 physical machine in 2 profiles") && text.contains("says little"), "{text}");
        let row = "|---|\n| physics | 5.0 % | 12.5 % | 0.0 % | 90.0 % | 4.0 % | - | 0.25 octaves | - |";
        assert!(text.contains(row) && !text.contains("intervals"), "{text}");
        let coverage = Coverage { times: 0.91, times_count: 300, crossings: Some(0.8), crossings_count: 20 };
        validation.coverage = Some(coverage);
        let text = scores(&validation, markdown);
        assert!(text.contains("91.0 % of 300 measured times") && text.contains("80.0 % of 20 measured borders"), "{text}");
        validation.methods.clear();
        assert_eq!(scores(&validation, columns), "1 physical machine in 2 profiles; not validated.\n");
    }

    #[test]
    fn the_course_tells_ranges_and_what_is_simulated() {
        let score = LearningScore { name: "physics".to_owned(), mean_regret: 0.05, low: 0.02, high: 0.11 };
        let course_of = |simulated| {
            let of = |machines| Learning { machines, trainings: 8, methods: vec![score.clone()] };
            course(&[of(2), of(6)], simulated, markdown)
        };
        let text = course_of(false);
        assert!(text.contains("| physics | 5.0 % (2.0 to 11.0) | 5.0 %") && text.contains("| 6 machines |"), "{text}");
        assert!(text.starts_with("Mean regret") && course_of(true).starts_with("Simulated machines, which are no evidence"));
    }
}
