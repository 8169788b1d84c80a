//! The answer of a run, as JSON and as text.

use super::tuning::{Origin, OriginKind};
use crate::args::Run;
use crate::replay::{Outcome, Part, ReplaySettings, Times, WINDOW};
use crate::shell;
use crate::terminal::Terminal;
use sapwise::AlgorithmId;
use sapwise_lab::text::{count, grouped};
use sapwise_tune::hardware::with_unit;
use serde_json::{Map, Value, json};

/// A run with everything that is said about it.
pub(super) struct Answer<'a> {
    pub(super) settings: &'a ReplaySettings,
    pub(super) outcome: &'a Outcome,
    pub(super) origin: &'a Origin,
    /// Algorithms of the tuning with more threads than this machine has cores, which are left out.
    pub(super) too_wide: Vec<&'a AlgorithmId>,
    pub(super) whole: Part,
    /// The parts between the frames of `--after`.
    pub(super) parts: Vec<Part>,
}

impl Answer<'_> {
    /// Numbers of boxes in the smallest and the largest frame.
    fn objects(&self) -> (usize, usize) {
        let objects = || self.outcome.frames.iter().map(|f| f.objects);
        (objects().min().unwrap_or(0), objects().max().unwrap_or(0))
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = self.origin.tuning.warnings.clone();
        let other = self.origin.other_machine.as_ref();
        warnings.extend(other.map(|cpu| format!("the report was measured on another machine: {cpu}")));
        if !self.too_wide.is_empty() {
            let names = self.too_wide.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            warnings.push(format!("left out, because this machine has fewer cores than they have threads: {names}"));
        }
        warnings
    }

    fn best_fixed(&self) -> Option<String> {
        self.outcome.best_fixed().map(|k| self.outcome.fixed[k].to_string())
    }

    pub(super) fn json(&self) -> serde_json::Result<Value> {
        let Self { settings, outcome, origin, too_wide, whole, parts } = self;
        let of_each = |value: &dyn Fn(usize) -> Option<Value>| -> Map<String, Value> {
            let named = outcome.fixed.iter().map(ToString::to_string).enumerate();
            named.filter_map(|(k, id)| Some((id, value(k)?))).collect()
        };
        let (min, max) = self.objects();
        let mut answer = serde_json::to_value(whole)?;
        let more = json!({
            "scenario": settings.source.name(),
            "frames": outcome.frames.len(),
            "objects": { "min": min, "max": max },
            "repeats": outcome.repeats,
            "seed": settings.seed,
            "interrupted": outcome.interrupted,
            "foreign_load": outcome.foreign_load,
            "learning": settings.learning,
            "source": origin.tuning.source,
            "tuning": {
                "from": origin.from,
                "model": origin.tuning.model,
                "other_machine": origin.other_machine,
                "too_many_threads": too_wide,
            },
            "extrapolated": origin.tuning.extrapolated,
            "warnings": self.warnings(),
            "best_fixed": self.best_fixed(),
            "fixed": of_each(&|k| outcome.fixed_times(k).ok().map(|times| json!(times))),
            // The number of frames at which an algorithm was not timed: it failed, or was far slower than the best.
            "left_out": of_each(&|k| outcome.fixed_times(k).err().map(Value::from)),
            "frames_run": of_each(&|k| Some(outcome.frames_run(k)).filter(|ran| *ran > 0).map(Value::from)),
            "parts": parts,
        });
        if let (Value::Object(answer), Value::Object(more)) = (&mut answer, more) {
            answer.extend(more);
        }
        Ok(answer)
    }

    pub(super) fn text(&self, arguments: &Run, terminal: Terminal) -> String {
        let outcome = self.outcome;
        let (min, max) = self.objects();
        let least = if min == max { String::new() } else { format!("{} to ", grouped(min as u64)) };
        let objects = format!("{least}{} object{}", grouped(max as u64), if max == 1 { "" } else { "s" });
        let (frames, repeats) = (count(outcome.frames.len(), "frame"), count(outcome.repeats, "repeat"));
        let name = self.settings.source.name();
        let head = format!("{name}, {frames} of {objects}, medians of {repeats}, same pairs from all");
        let conclusion = match (self.whole.over_best_fixed, self.best_fixed()) {
            (Some(ratio), Some(id)) => format!("{ratio:.3} × the time of {id}, the best single algorithm."),
            _ => format!(
                "{:.3} × the time of the oracle; no single algorithm ran in all frames.",
                self.whole.over_windows
            ),
        };
        let mut lines = vec![terminal.head(&format!("Adaptive takes {conclusion}")), head];
        lines.extend([format!("{}\n", self.tuning()), self.totals(terminal)]);
        lines.push(self.comparison(terminal));
        for (k, id) in outcome.fixed.iter().enumerate() {
            let missed = outcome.fixed_times(k).err().map(|missed| count(missed, "frame"));
            lines.extend(
                missed.map(|m| format!("{id} was not timed in {m}: it failed or was far slower than the best.")),
            );
        }
        lines.push(format!(
            "The oracle runs the best algorithm of every {WINDOW} frames.\n{}",
            match outcome.repeats {
                1 => "With one repeat it chooses and is timed on the same frames: noise favours it.",
                _ => "It chooses on one half of the repeats and is timed on the other.",
            }
        ));
        if outcome.frames.len() < WINDOW {
            lines.push("So few frames tell little: the first ones build what later ones keep.".to_owned());
        }
        lines.extend(outcome.foreign_load.map(|load| format!("Other programs took {:.0} % of the CPU.", load * 100.0)));
        lines.extend(self.warnings().iter().map(|warning| format!("{} {warning}", terminal.warning("warning:"))));
        if outcome.interrupted {
            lines.push(format!("{} only complete repeats are shown.", terminal.warning("Interrupted:")));
        }
        let written = [("Recorded", &arguments.record), ("Traced", &arguments.trace), ("Drawn", &arguments.plot)];
        lines.extend(written.into_iter().filter_map(|(verb, p)| Some(format!("{verb} in {}.", p.as_ref()?.display()))));
        lines.extend(next_step(arguments, self.origin).map(|words| shell::next(&words)));
        lines.join("\n")
    }

    fn tuning(&self) -> String {
        let learning = if self.settings.learning { "Learning." } else { "Without learning." };
        format!("Tuning: {}. {learning}", self.origin.text())
    }

    /// The times of each algorithm, fastest first.
    fn totals(&self, terminal: Terminal) -> String {
        let outcome = self.outcome;
        let row = |name: &str, t: &Times, ran: String| {
            let times = [t.total_ms, t.median_ms, t.p99_ms, t.worst_ms].map(|ms| with_unit("_ns", ms * 1e6));
            [&[name.to_owned()], &times[..], &[ran]].concat()
        };
        let head = ["run by", "total", "median", "p99", "worst", "chosen in"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.push(row("oracle of windows", &self.whole.windows, String::new()));
        rows.push(row("adaptive", &self.whole.adaptive, String::new()));
        let mut fixed: Vec<(usize, Times)> =
            (0..outcome.fixed.len()).filter_map(|k| Some((k, outcome.fixed_times(k).ok()?))).collect();
        fixed.sort_by(|a, b| a.1.total_ms.total_cmp(&b.1.total_ms));
        let of_fixed = |(k, times): &(usize, Times)| {
            row(&outcome.fixed[*k].to_string(), times, count(outcome.frames_run(*k), "frame"))
        };
        rows.extend(fixed.iter().map(of_fixed));
        terminal.table(&rows)
    }

    /// The adaptive choice over all frames and over each part.
    fn comparison(&self, terminal: Terminal) -> String {
        let row = |frames: String, p: &Part| {
            let single = p.over_best_fixed.map_or("-".to_owned(), |ratio| format!("{ratio:.3}"));
            let times =
                [p.adaptive.median_ms, p.adaptive.p99_ms, p.adaptive.worst_ms].map(|ms| with_unit("_ns", ms * 1e6));
            let counts = [p.switches, p.explored].map(|n| n.to_string());
            [&[frames, single, format!("{:.3}", p.over_windows)][..], &times, &counts].concat()
        };
        let head = ["frames", "× single", "× oracle", "median", "p99", "worst", "switches", "explored"];
        let mut rows = vec![head.map(str::to_owned).to_vec(), row("all".to_owned(), &self.whole)];
        rows.extend(self.parts.iter().map(|p| row(format!("{} to {}", p.from_frame, p.to_frame), p)));
        terminal.table(&rows)
    }

    /// The text below the picture: ratios, source of the tuning, and the command that makes it again.
    pub(super) fn caption(&self) -> Vec<String> {
        let Part { over_best_fixed, over_windows, switches, explored, .. } = self.whole;
        let single = over_best_fixed.map_or(String::new(), |ratio| format!("{ratio:.3} × the best single algorithm, "));
        let (name, repeats) = (self.settings.source.name(), count(self.outcome.repeats, "repeat"));
        vec![
            format!("{name}: {single}{over_windows:.3} × the oracle of {WINDOW} frames"),
            format!("{switches} switches, {explored} frames explored, medians of {repeats}, choices of the last"),
            format!("{} {}, {}.", self.tuning(), sapwise_tune::measure::machine().cpu, crate::date::today()),
            format!("Made by: {}", shell::own_command()),
        ]
    }
}

/// The next command to try, if any.
fn next_step(arguments: &Run, origin: &Origin) -> Option<String> {
    match (origin.from, &arguments.plot) {
        (_, None) => Some(shell::again(&["--plot", "run.svg"])),
        (OriginKind::Prediction, _) => Some(format!("probe --out report.json{}", arguments.gpus.words())),
        (_, Some(_)) => None,
    }
}
