//! What it does to each algorithm when one thing is taken from a machine: pairs of its own reports that differ in nothing else.
//!
//! Between machines parameters go together. Here one thing is changed on purpose. Pairs also differ in when they were measured, so a link
//! needs several of them, each with a report of its own to compare with.

use super::entry::{Entry, ON_ALL_CORES};
use super::speed::{LARGE, speed_ups};
use crate::evaluate::Verdict;
use crate::report::{Proof, Restricted};
use std::collections::{BTreeMap, BTreeSet};

/// Pairs of reports that a verdict needs: two drift the same way by chance in every second case.
const FEWEST_PAIRS: usize = 3;
/// A change of a time that matters, as a natural logarithm: 5 %. Reports of one machine differ by 2 to 3 % by themselves.
const LEAST_LN: f64 = 0.05;

/// What taking one thing does to one algorithm, over all pairs of reports of a machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Effect {
    /// What was taken, with how much of it where there are several levels.
    pub(super) taken: String,
    pub(super) algorithm: String,
    /// Whether of frames with 1000 objects or more, or of those with fewer.
    pub(super) large: bool,
    /// Time with it taken over time without: geometric mean, least and most over the pairs.
    pub(super) slowdown: f64,
    pub(super) least: f64,
    pub(super) most: f64,
    pub(super) pairs: usize,
    pub(super) verdict: Verdict,
    /// Positions of the reports.
    pub(super) reports: Vec<usize>,
}

/// How far a parameter shows that something was taken: its value with over that without, over the pairs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shown {
    pub(super) taken: String,
    pub(super) parameter: String,
    /// Geometric mean, least and most over the pairs.
    pub(super) ratio: f64,
    pub(super) least: f64,
    pub(super) most: f64,
    pub(super) pairs: usize,
    /// Positions of the reports.
    pub(super) reports: Vec<usize>,
}

/// The machine, what was taken, the algorithm, and whether of large frames.
type Key<'a> = (&'a str, String, String, bool);

/// Two reports of which the second one has one thing less.
#[derive(Clone)]
struct Pair {
    taken: Restricted,
    /// With its level.
    name: String,
    without: usize,
    with: usize,
}

/// The effects of every restriction on every algorithm, and what the parameters show of them. Pairs whose parameters do not show that
/// anything was taken are left out: what they lack can't be told from what they have.
pub(super) fn effects(entries: &[Entry]) -> (Vec<Effect>, Vec<Shown>) {
    let mut found: BTreeMap<Key<'_>, Vec<(f64, Pair)>> = BTreeMap::new();
    let mut shown: BTreeMap<(String, String), (Vec<f64>, BTreeSet<usize>)> = BTreeMap::new();
    for pair in pairs(entries) {
        let (without, with) = (&entries[pair.without], &entries[pair.with]);
        for (parameter, ratio) in shown_by(with, pair.taken) {
            let (ratios, reports) = shown.entry((pair.name.clone(), parameter)).or_default();
            ratios.push(ratio.ln());
            reports.extend([pair.without, pair.with]);
        }
        if !is_shown(with, pair.taken) {
            continue;
        }
        // On one core all cores are that one, which has rows of its own.
        let one_core = without.threads() == 1 && with.threads() == 1;
        for (sizes, large) in [(0..LARGE, false), (LARGE..u32::MAX, true)] {
            for (algorithm, speed_up) in speed_ups(without, with, sizes) {
                if one_core && algorithm.ends_with(ON_ALL_CORES) {
                    continue;
                }
                let key = (with.machine(), pair.name.clone(), algorithm, large);
                found.entry(key).or_default().push((-speed_up.median.ln(), pair.clone()));
            }
        }
    }
    let effects = found.into_iter().map(|((_, taken, algorithm, large), seen)| {
        let effects: Vec<f64> = seen.iter().map(|s| s.0).collect();
        let [slowdown, least, most] = over_pairs(&effects);
        // Two that share a report share its disturbances.
        let apart = |of: fn(&Pair) -> usize| seen.iter().map(|s| of(&s.1)).collect::<BTreeSet<_>>();
        let (without, with) = (apart(|p| p.without), apart(|p| p.with));
        let verdict = verdict(&effects, without.len().min(with.len()));
        let reports = without.union(&with).copied().collect();
        Effect { taken, algorithm, large, slowdown, least, most, pairs: seen.len(), verdict, reports }
    });
    let shown = shown.into_iter().map(|((taken, parameter), (logs, reports))| {
        let [ratio, least, most] = over_pairs(&logs);
        Shown { taken, parameter, ratio, least, most, pairs: logs.len(), reports: reports.into_iter().collect() }
    });
    (effects.collect(), shown.collect())
}

/// Geometric mean, least and most of ratios whose logarithms these are.
fn over_pairs(logs: &[f64]) -> [f64; 3] {
    let (least, most) = logs.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), ln| (a.min(*ln), b.max(*ln)));
    [logs.iter().sum::<f64>() / logs.len() as f64, least, most].map(f64::exp)
}

/// Whether the parameters of a report show that this was taken.
fn is_shown(entry: &Entry, taken: Restricted) -> bool {
    let mut proofs = entry.provenance.restriction.iter().flat_map(|r| &r.proof);
    proofs.any(|p| p.kind == taken && p.shows)
}

/// Linked where the same is seen in every pair, and not linked where nothing is seen in any. A few pairs can't be told from chance; `apart`
/// are those that share no report.
fn verdict(effects: &[f64], apart: usize) -> Verdict {
    let all = |holds: &dyn Fn(f64) -> bool| apart >= FEWEST_PAIRS && effects.iter().all(|e| holds(*e));
    if all(&|e| e >= LEAST_LN) || all(&|e| e <= -LEAST_LN) {
        Verdict::Linked
    } else if all(&|e| e.abs() < LEAST_LN) {
        Verdict::NotLinked
    } else {
        Verdict::CannotBeTold
    }
}

/// The parameters that must show what was taken, with over without.
fn shown_by(entry: &Entry, taken: Restricted) -> Vec<(String, f64)> {
    let proofs = entry.provenance.restriction.iter().flat_map(|r| &r.proof);
    let of = |p: &Proof| {
        let (with, without) = p.with.zip(p.without).filter(|(with, without)| *with > 0.0 && *without > 0.0)?;
        let of_gpu = p.gpu.map_or(String::new(), |k| format!("gpu{k}/"));
        Some((format!("{of_gpu}{}", p.parameter), with / without))
    };
    proofs.filter(|p| p.kind == taken).filter_map(of).collect()
}

/// Every two studied reports of a machine that differ in one thing that was taken.
fn pairs(entries: &[Entry]) -> Vec<Pair> {
    let mut machines: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, entry) in entries.iter().enumerate().filter(|(_, e)| e.studied.is_ok()) {
        machines.entry(entry.machine()).or_default().push(k);
    }
    let mut found = Vec::new();
    for own in machines.into_values() {
        for &without in &own {
            for &with in &own {
                let taken = taken(&entries[without], &entries[with]);
                found.extend(taken.map(|taken| Pair { taken, name: name(taken, &entries[with]), without, with }));
            }
        }
    }
    found
}

/// What the second report has less than the first, where that is one thing and all else is the same.
fn taken(without: &Entry, with: &Entry) -> Option<Restricted> {
    let gpus = |e: &Entry| e.hardware.gpus.iter().map(|g| g.gpu.name.clone()).collect::<Vec<_>>();
    if gpus(without) != gpus(with) {
        return None;
    }
    let (before, after) = (kinds(without), kinds(with));
    let more: Vec<Restricted> = after.iter().filter(|k| !before.contains(k)).copied().collect();
    let [taken] = more[..] else { return None };
    // Nothing else may differ: neither what was taken besides, nor how much of it.
    let others_stay = before.iter().all(|k| after.contains(k));
    let level = |e: &Entry, kind| match kind {
        Restricted::Threads => e.provenance.threads.map(|t| t.to_string()),
        Restricted::Simd => e.provenance.simd.clone(),
        Restricted::GpuThreads => e.provenance.gpu_threads.map(|t| t.to_string()),
        Restricted::ContendedMemory | Restricted::ContendedCache => None,
    };
    (others_stay && before.iter().all(|kind| level(without, *kind) == level(with, *kind))).then_some(taken)
}

/// What was taken, and down to which level.
fn name(taken: Restricted, with: &Entry) -> String {
    let level = match taken {
        Restricted::Threads => with.provenance.threads.map(|k| k.to_string()),
        Restricted::Simd => with.provenance.simd.clone(),
        Restricted::GpuThreads => with.provenance.gpu_threads.map(|k| k.to_string()),
        Restricted::ContendedMemory | Restricted::ContendedCache => None,
    };
    level.map_or_else(|| taken.to_string(), |level| format!("{taken}: {level} left"))
}

fn kinds(entry: &Entry) -> Vec<Restricted> {
    entry.provenance.restriction.as_ref().map_or(Vec::new(), |r| r.kinds.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_seen_in_every_pair() {
        assert_eq!(verdict(&[0.2, 0.06, 0.4], 3), Verdict::Linked);
        assert_eq!(verdict(&[-0.2, -0.06, -0.1], 3), Verdict::Linked);
        assert_eq!(verdict(&[0.02, -0.01, 0.0], 3), Verdict::NotLinked);
        for unclear in [&[0.2, 0.2][..], &[0.2, 0.1, 0.01], &[0.2, 0.1, -0.2], &[]] {
            assert_eq!(verdict(unclear, unclear.len()), Verdict::CannotBeTold);
        }
        // Three pairs with one report in common.
        assert_eq!(verdict(&[0.2, 0.06, 0.4], 1), Verdict::CannotBeTold);
    }
}
