//! The model card: what a model was trained on and how well it did.

use crate::label_text::kind;
use crate::text::count;
use crate::{Regrets, Split, Training, Validation};
use sapwise::hardware::with_unit;
use sapwise::model::MethodModel;
use sapwise::{BackendClass, Model};

/// What every model of this kind is, whatever it was trained on.
const USE: &str = "
Predicts, from the hardware parameters of a machine, what each broad-phase algorithm costs under a load; `predict` derives
from that which algorithm is fastest where. The time of a frame on one thread is a sum of physical terms with non-negative units (calls,
objects and how far they move, comparisons of a sort, objects outside the cache, pairs and candidates tested), each
scaled by the parameter that it depends on (clock, SIMD lanes, memory bandwidth), times the exponential of a residual: a Gaussian process over the
load, which the hardware does not enter. `pair-cache` takes the less of its own terms and of what `bvh` takes. On several threads a frame takes what it
costs to call the helpers and the less of the work of one thread and of that work, with what is lost while they wake, divided by their speed-up: a
helper that comes too late costs its call only. All figures are fitted on relative error, robustly, and are shared by all machines and thread counts.

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
their rates, no more than what the group was measured to gain. Timings on software adapters serve only where there is no
real GPU in the training, and a prediction for a kind of GPU that was not in it says so.
";

/// Of a model that was trained on simulated machines, before [`USE`].
const SIMULATED: &str = "
**Trained on simulated machines**, whose timings a cost model made up: nothing here is evidence of how well a prediction does on a
real machine, and `predict` warns of it.
";

/// What the columns of the scores mean, below them.
const COLUMNS: &str = "
Each figure is the mean regret over all sizes and, in parentheses, where each number of objects counts as often as games have it. The latter is an
assumption, not a count: log-normal around 800 objects, two thirds of the frames within 220 to 2800. Every physical machine counts the same.

- **unseen scenario**: the machine was held out, and the scenario too. A user's scene is none of ours, so that this is the figure that counts.
- **seen scenario**: the machine was held out alone. **least to largest**: of the machine that was served best and of the one that was served worst; of
  the held-out reports where all are of one machine.
- **one thread**, **several**: the same two figures on reports in which no algorithm ran on several threads, and on the others.
- **by means**: all reports, judged by the mean over the frames of a timing in place of their median. It holds the frames in which an incremental algorithm makes
  again what it keeps, and those that another program interrupted.
- **crossovers off by**: octaves between the measured crossover of two algorithms in the scenario `uniform` and where their predicted costs
  cross, the median; one octave is a factor of two in objects. Where they do not cross in the measured sizes, the
  distance to the end of these, a lower bound. Only for what predicts costs. A crossover of two algorithms that cost nearly the same is vague and
  harmless: the regret tells what it costs.
- **over 10 %**: share of the points, in scenarios seen, at which the choice cost a tenth more than the best, or worse.
- **floor** is what is lost by chance: whoever was best in the same cell of another run of the same machine. **another run's full sweep** chooses by the
  costs that were measured in that run. Both are of as many pairs of runs as they say, and no strategy can be told from another by less.
";

/// What the strategies are, below the scores.
const STRATEGIES: &str = "
`physics + load` is what `predict` does; `physics` the same without the residual. `random forest` predicts each method's time from
load and hardware parameters and knows no physics. `direct regression` is the paper's: the position of each crossover as a power law of
hardware parameters, and a choice by the number of objects alone. Notes say how many of its crossovers are means: there were no more
machines with that crossing than parameters to regress it on. `frozen constants (64)` and `(1000)` switch from brute force at the number of
objects that engines have written down (64 colliders in nexus, 1000 bodies in mujoco_warp), `default machine` at the measured thresholds of
the first report in the training, whatever the machine; `nearest machine` takes the measured costs of the machine of the training with the most
similar parameters. `full sweep` has measured the held-out machine itself, and is judged by those same timings; of an unseen scenario it has measured
all the others on that machine, so that what it still loses there is what a load does not tell of a scene.
";

/// The model card as a page of Markdown, with the notes of the training.
#[must_use]
pub fn page(model: &Model, training: &Training, notes: &[String]) -> String {
    let mut text = format!("# The model {}\n\nMade by `sapwise train`; this page is generated with it.\n", model.name);
    if model.simulated {
        text.push_str(SIMULATED);
    }
    text.push_str(USE);
    let on_gpus: Vec<&MethodModel> = model.methods.iter().filter(|m| m.backend == BackendClass::Gpu).collect();
    text.push_str(&gpus(&on_gpus));
    text.push_str("\n## Validation\n\n");
    text.push_str(&scores(&training.validation, markdown));
    if !training.validation.methods.is_empty() {
        text.push_str(COLUMNS);
        text.push_str(STRATEGIES);
    }
    text.push_str(&trained_on(training));
    text.push_str(
        "\n## Ranges\n\nA machine outside is extrapolated, and `predict` says so. It looks at each parameter by itself.\n\n",
    );
    let mut rows = vec![["parameter", "lowest", "highest"].map(str::to_owned).to_vec()];
    for range in &model.ranges {
        let name = range.parameter.to_string();
        let [lowest, highest] = [range.min, range.max].map(|value| with_unit(&name, value));
        rows.push(vec![name, lowest, highest]);
    }
    text.push_str(&markdown(&rows));
    text.push_str("\n## Intervals\n\n");
    text.push_str(&intervals(&training.validation));
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

/// The reports behind a model, or their counts.
fn trained_on(training: &Training) -> String {
    let mut rows = vec![["report", "host", "label"].map(str::to_owned).to_vec()];
    rows.extend(training.trained_on.iter().map(|r| vec![r.file.clone(), r.host.clone(), kind(r.label).to_owned()]));
    if !training.trained_on_counts.is_empty() {
        rows = vec![["reports", "physical machines", "label"].map(str::to_owned).to_vec()];
        let counts = training.trained_on_counts.iter();
        rows.extend(
            counts.map(|c| vec![c.reports.to_string(), c.physical_machines.to_string(), kind(c.label).to_owned()]),
        );
    }
    format!("\n## Trained on\n\n{}", markdown(&rows))
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

/// How far predictions may be off.
fn intervals(validation: &Validation) -> String {
    let Some(c) = validation.coverage else {
        return "None are claimed: fewer than two machines were held out, so that nobody knows how far a prediction may be off.\n".to_owned();
    };
    format!(
        "On {} held out, nine of ten times lay within a factor of {:.2} of their prediction, and nine of ten ratios of the two fastest algorithms of a \
         load within {:.2}: the intervals of predicted crossovers are made of the latter. By the factor that the other machines tell, {} of the times of a \
         machine and {} of the ratios lay within.\n",
        count(c.physical_machines, "physical machine"),
        c.times_90_ln.exp(),
        c.ratios_90_ln.exp(),
        percent(c.times),
        percent(c.ratios)
    )
}

/// Over all sizes and, in parentheses, as games have them.
fn regrets(regrets: Option<Regrets>) -> String {
    regrets.map_or_else(|| "-".to_owned(), |r| format!("{:.1} % ({:.1})", 100.0 * r.all, 100.0 * r.in_games))
}

/// A [`Split`] as three cells.
fn split(split: Option<&Split>) -> [String; 3] {
    let of = |which: fn(&Split) -> Option<Regrets>| regrets(split.and_then(which));
    [of(|s| Some(s.all)), of(|s| s.one_thread), of(|s| s.several_threads)]
}

/// What was held out, and the scores as a table that `draw` draws.
pub fn scores(validation: &Validation, draw: impl Fn(&[Vec<String>]) -> String) -> String {
    let Validation { held_out, physical_machines, cpu_models, profiles, methods, floor, .. } = validation;
    let of_models = format!("{} of {}", count(*physical_machines, "physical machine"), count(*cpu_models, "CPU model"));
    let data = format!("{of_models} in {}", count(*profiles, "profile"));
    if methods.is_empty() {
        return format!("{data}; not validated.\n");
    }
    let doubt = if *physical_machines < 2 { " This says little about machines never seen." } else { "" };
    let head = [
        "strategy",
        "unseen scenario",
        "unseen, one thread",
        "unseen, several",
        "seen scenario",
        "least to largest",
        "seen, one thread",
        "seen, several",
        "by means",
        "crossovers off by",
        "over 10 %",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for m in methods {
        let seen = Regrets { all: m.mean_regret, in_games: m.mean_regret_in_games.unwrap_or_default() };
        let octaves =
            m.crossing_error_octaves.map_or_else(|| "-".to_owned(), |octaves| format!("{octaves:.2} octaves"));
        let range =
            m.regret_range().map_or_else(|| "-".to_owned(), |[a, b]| format!("{:.1} to {:.1}", 100.0 * a, 100.0 * b));
        let mut row = vec![m.name.clone()];
        row.extend(split(m.unseen_scenario.as_ref()));
        row.extend([
            regrets(Some(seen)),
            range,
            regrets(m.one_thread),
            regrets(m.several_threads),
            regrets(m.by_means),
        ]);
        row.extend([octaves, percent(m.share_over_10_percent)]);
        rows.push(row);
    }
    if let Some(f) = floor {
        for (name, of) in [("floor", &f.cells), ("another run's full sweep", &f.full_sweep)] {
            let [all, one, several] = split(Some(of));
            let name = format!("{name}, {}", count(f.pairs, "pair"));
            rows.push([&name, "-", "-", "-", &all, "-", &one, &several, "-", "-", "-"].map(str::to_owned).to_vec());
        }
    }
    format!("{data}; each {held_out} held out in turn.{doubt}\n\n{}", draw(&rows))
}

/// Rows as a Markdown table, the first its head.
pub fn markdown(rows: &[Vec<String>]) -> String {
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
    use crate::MethodScore;
    use crate::text::columns;

    #[test]
    fn scores_tell_what_they_do_not_say() {
        let score = |name: &str, closed_gap| MethodScore {
            name: name.to_owned(),
            mean_regret: 0.05,
            least_regret: Some(0.004),
            largest_regret: Some(0.3),
            p95_regret: 0.125,
            closed_gap,
            mean_regret_in_games: Some(0.04),
            crossing_error_octaves: Some(0.25),
            ..MethodScore::default()
        };
        let several = Split { all: Regrets { all: 0.02, in_games: 0.01 }, ..Split::default() };
        let mut validation = Validation {
            held_out: "profile".to_owned(),
            physical_machines: 1,
            cpu_models: 1,
            profiles: 2,
            methods: vec![score("physics", 0.9), score("frozen constants (64)", -10.7)],
            floor: Some(crate::Floor { pairs: 1, cells: several, full_sweep: several }),
            coverage: None,
        };
        let text = scores(&validation, markdown);
        assert!(
            text.contains("1 physical machine of 1 CPU model in 2 profiles") && text.contains("says little"),
            "{text}"
        );
        let row = "| physics | - | - | - | 5.0 % (4.0) | 0.4 to 30.0 | - | - | - | 0.25 octaves | 0.0 % |";
        assert!(text.contains(row) && text.contains("| floor, 1 pair | - | - | - | 2.0 % (1.0) |"), "{text}");
        validation.methods.clear();
        assert_eq!(scores(&validation, columns), "1 physical machine of 1 CPU model in 2 profiles; not validated.\n");
        assert!(intervals(&validation).starts_with("None are claimed"));
    }

    #[test]
    fn figures_have_units_and_intervals_say_what_they_are_made_of() {
        let mut model = Model::built_in().unwrap();
        // A range of its own: that of the built-in model changes with each host in its training.
        let cache = model.ranges.iter_mut().find(|r| r.parameter == "cache_llc_bytes").unwrap();
        (cache.min, cache.max) = (32.0 * 1024.0 * 1024.0, 260.0 * 1024.0 * 1024.0);
        let text = page(&model, &Training::default(), &["a note".to_owned()]);
        assert!(text.contains("| cache_llc_bytes | 32 MiB | 260 MiB |") && text.contains("GHz"), "{text}");
        assert!(text.contains("None are claimed") && text.ends_with("- a note\n"), "{text}");
        let coverage =
            crate::Coverage { physical_machines: 3, times_90_ln: 0.5, times: 0.91, ratios_90_ln: 0.2, ratios: 0.88 };
        let told = intervals(&Validation { coverage: Some(coverage), ..Validation::default() });
        assert!(
            told.contains("3 physical machines") && told.contains("within 1.22") && told.contains("88.0 %"),
            "{told}"
        );
    }
}
