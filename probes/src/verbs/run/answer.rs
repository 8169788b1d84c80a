//! The answer for machines.

use super::tuning::{Origin, OriginKind};
use crate::replay::{Outcome, ReplaySettings, SHARE, Segment};
use sapwise::{AlgorithmId, Source};
use serde::Serialize;
use std::collections::BTreeMap;

#[derive(Serialize)]
pub(super) struct Answer<'a> {
    /// The name of the scenario, or of the file of a stream.
    pub(super) scenario: &'a str,
    pub(super) frames: usize,
    pub(super) objects: Extent,
    pub(super) repeats: usize,
    seed: u64,
    pub(super) interrupted: bool,
    /// Median over the frames of the share of the CPU that other programs took; null where that can't be told.
    pub(super) foreign_load: Option<f64>,
    /// Where the tuning came from.
    source: Source,
    tuning: OfTuning<'a>,
    extrapolated: bool,
    /// Of the tuning, and of algorithms that are left out.
    pub(super) warnings: Vec<String>,
    pub(super) learning: bool,
    pub(super) exploring: bool,
    pub(super) oracle: Oracle,
    pub(super) total_ms: Totals,
    /// In how many frames of the last repeat each algorithm ran, exploration included; those that never ran are left out.
    pub(super) frames_run: BTreeMap<String, usize>,
    /// The fixed algorithms that were not timed at all frames, by their ids.
    pub(super) left_out: BTreeMap<String, LeftOut>,
    #[serde(flatten)]
    pub(super) figures: Figures,
    /// The regret of each repeat by itself, from single samples.
    regret_of_repeats: Vec<f64>,
    /// The best fixed algorithm, and the time of the adaptive choice over its time.
    pub(super) best_fixed: String,
    pub(super) over_best_fixed: f64,
    /// The same figures of the frames between the cuts.
    pub(super) parts: Vec<SegmentAnswer>,
    pub(super) co_runner: Option<Slowed>,
    /// What the last repeat ran from which frame on.
    decisions: Vec<Decision<'a>>,
}

#[derive(Serialize)]
pub(super) struct Extent {
    pub(super) min: usize,
    pub(super) max: usize,
}

#[derive(Serialize)]
struct OfTuning<'a> {
    from: OriginKind,
    model: &'a Option<String>,
    /// The processor of the other machine whose report they come from.
    other_machine: &'a Option<String>,
    /// Algorithms with more threads than this machine has cores, which are left out.
    too_many_threads: Vec<&'a AlgorithmId>,
}

/// How the oracle knows which algorithm is the best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Oracle {
    /// By one half of the repeats, while its time is that of the other.
    Halves,
    /// It has the least time of every frame: there is one repeat only.
    Optimistic,
}

#[derive(Serialize)]
pub(super) struct Totals {
    pub(super) adaptive: f64,
    pub(super) oracle: f64,
    /// Of those that ran every frame.
    pub(super) fixed: BTreeMap<String, f64>,
}

/// A fixed algorithm that was too slow to be timed at every frame, or failed.
#[derive(Serialize)]
pub(super) struct LeftOut {
    /// The last frame before the first at which it was not timed; null where that is the first of all.
    pub(super) after_frame: Option<usize>,
    /// At how many it was not timed.
    pub(super) frames: usize,
    /// The total of the others.
    pub(super) at_least_ms: f64,
}

/// The figures of some frames.
#[derive(Serialize)]
pub(super) struct Figures {
    pub(super) regret: f64,
    /// Median of the regrets of single repeats; null with fewer than four.
    pub(super) regret_median: Option<f64>,
    /// Their quartiles.
    pub(super) regret_quartiles: Option<[f64; 2]>,
    /// Against the best algorithm of every 32 frames together.
    pub(super) window_regret: f64,
    /// In the last repeat, frames that explore aside.
    pub(super) switches: usize,
    /// Frames that explored, in the last repeat.
    pub(super) explored: usize,
    /// The worst frame outside exploration, over the oracle's, and which it is.
    pub(super) worst_frame: Option<f64>,
    pub(super) worst_frame_at: Option<usize>,
}

#[derive(Serialize)]
pub(super) struct SegmentAnswer {
    pub(super) from_frame: usize,
    /// The last one.
    pub(super) to_frame: usize,
    #[serde(flatten)]
    pub(super) figures: Figures,
}

/// What the co-runner did.
#[derive(Serialize)]
pub(super) struct Slowed {
    pub(super) from_frame: usize,
    pub(super) threads: u32,
    /// Of the CPU that they want.
    share: f64,
    /// Mean time after over mean time before of a loop beside the frames; null where there was no frame before.
    pub(super) slowdown: Option<f64>,
}

#[derive(Serialize)]
struct Decision<'a> {
    from_frame: usize,
    objects: usize,
    algorithm: &'a AlgorithmId,
    /// To learn what it costs.
    explored: bool,
}

impl<'a> Answer<'a> {
    pub(super) fn new(
        settings: &'a ReplaySettings,
        outcome: &'a Outcome,
        origin: &'a Origin,
        too_wide: Vec<&'a AlgorithmId>,
        segments: &[Segment],
    ) -> Self {
        let objects = || outcome.frames.iter().map(|f| f.objects);
        let whole = outcome.whole();
        let named = || outcome.fixed.iter().map(ToString::to_string).enumerate();
        let missed = named().filter_map(|(k, id)| {
            let missed = outcome.missed(k)?;
            let after_frame = missed.first.checked_sub(1);
            Some((id, LeftOut { after_frame, frames: missed.frames, at_least_ms: missed.at_least_ms }))
        });
        let frames_run = outcome.frames_run();
        let adaptive = outcome.adaptive_ms();
        let best = outcome.best_fixed();
        let segment = |p: &Segment| SegmentAnswer {
            from_frame: p.frames.start,
            to_frame: p.frames.end - 1,
            figures: Figures::new(p),
        };
        let repeats = outcome.repeats.len();
        let mut warnings = origin.tuning.warnings.clone();
        warnings.extend(warnings_of(origin, &too_wide));
        Self {
            scenario: settings.source.name(),
            frames: outcome.frames.len(),
            objects: Extent { min: objects().min().unwrap_or(0), max: objects().max().unwrap_or(0) },
            repeats,
            seed: settings.seed,
            interrupted: outcome.interrupted,
            foreign_load: outcome.foreign_load,
            source: origin.tuning.source,
            tuning: OfTuning {
                from: origin.from,
                model: &origin.tuning.model,
                other_machine: &origin.other_machine,
                too_many_threads: too_wide,
            },
            extrapolated: origin.tuning.extrapolated,
            warnings,
            learning: settings.learning,
            exploring: settings.exploring,
            oracle: if repeats > 1 { Oracle::Halves } else { Oracle::Optimistic },
            total_ms: Totals {
                adaptive,
                oracle: outcome.oracle_ms(),
                fixed: named().filter_map(|(k, id)| Some((id, outcome.fixed_ms(k)?))).collect(),
            },
            frames_run: named().map(|(k, id)| (id, frames_run[k])).filter(|ran| ran.1 > 0).collect(),
            left_out: missed.collect(),
            figures: Figures::new(&whole),
            regret_of_repeats: whole.of_repeats,
            best_fixed: best.map_or_else(String::new, |(k, _)| outcome.fixed[k].to_string()),
            over_best_fixed: best.map_or(1.0, |(_, ms)| adaptive / ms),
            parts: segments.iter().map(segment).collect(),
            co_runner: outcome.slowdown.as_ref().map(|slowdown| Slowed {
                from_frame: slowdown.co_runner.from_frame,
                threads: slowdown.co_runner.threads(),
                share: SHARE,
                slowdown: slowdown.of_a_loop,
            }),
            decisions: decisions(outcome),
        }
    }
}

impl Figures {
    fn new(segment: &Segment) -> Self {
        Self {
            regret: segment.regret,
            regret_median: segment.quartiles().map(|[_, median, _]| median),
            regret_quartiles: segment.quartiles().map(|[low, _, high]| [low, high]),
            window_regret: segment.window_regret,
            switches: segment.switches,
            explored: segment.explored,
            worst_frame: segment.worst_frame.map(|w| w.0),
            worst_frame_at: segment.worst_frame.map(|w| w.1),
        }
    }
}

/// What the reader should know about tuning that was not made for this machine.
fn warnings_of(origin: &Origin, too_wide: &[&AlgorithmId]) -> Vec<String> {
    let mut warnings = Vec::new();
    warnings
        .extend(origin.other_machine.as_ref().map(|cpu| format!("the report was measured on another machine: {cpu}")));
    if !too_wide.is_empty() {
        let names: Vec<String> = too_wide.iter().map(ToString::to_string).collect();
        let names = names.join(", ");
        warnings
            .push(format!("the tuning names more threads than this machine has cores, which are left out: {names}"));
    }
    warnings
}

fn decisions(outcome: &Outcome) -> Vec<Decision<'_>> {
    let taken = outcome.last_taken();
    let begins = |at: usize| at == 0 || taken[at - 1] != taken[at];
    let decision = |at: usize| {
        let algorithm = &outcome.fixed[taken[at].chosen?];
        Some(Decision { from_frame: at, objects: outcome.frames[at].objects, algorithm, explored: taken[at].explored })
    };
    (0..taken.len()).filter(|&at| begins(at)).filter_map(decision).collect()
}
