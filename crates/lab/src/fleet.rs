//! The reports of many nodes: which are of one kind, and which can't be believed.
//!
//! Nodes of one kind have the same hardware. Their reports are not averaged: one that differs from the others of its kind was shared, throttled or set
//! up otherwise, and would make the model of all a little worse without a word.

use crate::data::host;
use crate::label_text;
use crate::report::{Label, Report, Restricted};
use sapwise::ParameterId;
use sapwise::stats::median;
use serde::Serialize;
use std::collections::BTreeMap;

/// A node whose algorithms take so many times what they take on the others of its kind is not like them. The two machines of `datasets/` that were
/// measured twice are 1.00 and 1.02 of themselves; a program beside them that takes memory or cache makes that 1.00 to 1.36.
pub const SLOW: f64 = 1.15;

/// Reports of nodes, sorted into kinds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Fleet {
    /// Each kind of node once, the most frequent first.
    pub kinds: Vec<Kind>,
    /// One for each report, by kind and file name.
    pub nodes: Vec<Node>,
}

/// Hardware that several nodes may have.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct Kind {
    /// The name of the CPU.
    pub cpu: String,
    /// Usable cores.
    pub cores: u32,
    /// SIMD level in use.
    pub simd: String,
    /// The names of the GPUs.
    pub gpus: Vec<String>,
    /// CPU model, caches and host clock, as [`host`] tells them apart.
    pub host: String,
    /// What was taken from it on purpose.
    pub taken: Vec<Restricted>,
}

/// The report of one node.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Node {
    /// The name of its file.
    pub file: String,
    /// Its place in [`Fleet::kinds`].
    pub kind: usize,
    /// The clock of one busy core, GHz.
    pub clock_ghz: Option<f64>,
    /// As [`Report::foreign_load`].
    pub foreign_load: Option<f64>,
    /// Geometric mean of its times over the medians of those that the other nodes of its kind took for the same. `None` where there is no other, or
    /// none has measured the same.
    pub over_its_kind: Option<f64>,
    /// Why it can't be believed; `None` where it can.
    pub problem: Option<String>,
}

impl Fleet {
    /// Sorts reports into kinds, and compares each with the others of its kind.
    #[must_use]
    pub fn of(reports: &[(String, Report)]) -> Self {
        let mut members: BTreeMap<Kind, Vec<usize>> = BTreeMap::new();
        for (k, (_, report)) in reports.iter().enumerate() {
            members.entry(Kind::of(report)).or_default().push(k);
        }
        let mut kinds: Vec<(Kind, Vec<usize>)> = members.into_iter().collect();
        kinds.sort_by_key(|(_, members)| std::cmp::Reverse(members.len()));
        let mut nodes = Vec::new();
        for (kind, (_, members)) in kinds.iter_mut().enumerate() {
            members.sort_by_key(|&k| &reports[k].0);
            // What was cut short or shared tells nothing of the others.
            let times: Vec<Option<Times>> =
                members.iter().map(|&k| sound(&reports[k].1).then(|| times(&reports[k].1))).collect();
            for (at, &k) in members.iter().enumerate() {
                let others =
                    times.iter().enumerate().filter(|(other, _)| *other != at).filter_map(|(_, times)| times.as_ref());
                nodes.push(Node::of(&reports[k], kind, &others.collect::<Vec<_>>()));
            }
        }
        Self { kinds: kinds.into_iter().map(|(kind, _)| kind).collect(), nodes }
    }
}

impl Kind {
    fn of(report: &Report) -> Self {
        let hardware = &report.hardware;
        let cores = report.provenance.threads.map(f64::from).or_else(|| hardware.value(ParameterId::UsableCores));
        Self {
            cpu: hardware.machine.cpu.clone(),
            cores: cores.unwrap_or(0.0) as u32,
            simd: hardware.machine.simd.clone(),
            gpus: hardware.gpus.iter().map(|g| g.gpu.name.clone()).collect(),
            host: host(hardware),
            taken: report.provenance.restriction.as_ref().map_or(Vec::new(), |r| r.kinds.clone()),
        }
    }
}

impl Node {
    fn of((file, report): &(String, Report), kind: usize, others: &[&Times]) -> Self {
        let over_its_kind = over(&times(report), others);
        let foreign_load = report.foreign_load();
        let problem = if !is_measured(report) {
            Some(format!("{}: {}; leave it out", label_text::kind(report.label), label_text::meaning(report.label)))
        } else if report.is_unfinished() {
            Some("unfinished: the node failed, or its job was ended; measure it again".to_owned())
        } else if is_shared(report) {
            let share = foreign_load.map_or(String::new(), |share| format!(" took {:.0} % of its CPU", 100.0 * share));
            Some(format!("shared: other programs{share}; measure it alone"))
        } else {
            over_its_kind.filter(|&ratio| ratio > SLOW).map(|ratio| {
                format!("slow: it takes {ratio:.2} of the time of its kind; look whether it is throttled, shared or set up otherwise")
            })
        };
        let clock_ghz = report.hardware.value(ParameterId::ClockMeasuredGhz);
        Self { file: file.clone(), kind, clock_ghz, foreign_load, over_its_kind, problem }
    }
}

/// Median times in nanoseconds by scenario, number of objects and algorithm.
type Times<'a> = BTreeMap<(&'a str, u32, String), f64>;

fn sound(report: &Report) -> bool {
    is_measured(report) && !report.is_unfinished() && !is_shared(report)
}

/// Whether it is of a machine that there is.
fn is_measured(report: &Report) -> bool {
    !matches!(report.label, Label::Simulated | Label::Published)
}

/// Whether other programs disturbed it than those that it was measured beside on purpose.
fn is_shared(report: &Report) -> bool {
    let kinds = report.provenance.restriction.iter().flat_map(|r| &r.kinds);
    let mut contended = kinds.filter(|k| matches!(k, Restricted::ContendedMemory | Restricted::ContendedCache));
    report.label == Label::RealContended && contended.next().is_none()
}

fn times(report: &Report) -> Times<'_> {
    let mut times = Times::new();
    for point in &report.points {
        for timing in &point.timings {
            let samples: Vec<f64> = timing.samples_ns.iter().map(|&ns| ns as f64).collect();
            if let Some(ns) = median(&samples) {
                times.insert((&point.scenario, point.load.objects, timing.algorithm.to_string()), ns);
            }
        }
    }
    times
}

/// Geometric mean of the own times over the medians of the others'.
fn over(own: &Times<'_>, others: &[&Times<'_>]) -> Option<f64> {
    let ratio = |(key, ns): (&(&str, u32, String), &f64)| {
        let theirs: Vec<f64> = others.iter().filter_map(|times| times.get(key).copied()).collect();
        Some((ns / median(&theirs)?).ln())
    };
    let logs: Vec<f64> = own.iter().filter_map(ratio).collect();
    (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn named(name: &str, report: &Report) -> (String, Report) {
        (format!("{name}.json"), report.clone())
    }

    /// The same with all times that many times as long.
    fn scaled(report: &Report, by: f64) -> Report {
        let mut report = report.clone();
        let samples = report.points.iter_mut().flat_map(|p| &mut p.timings).flat_map(|t| &mut t.samples_ns);
        samples.for_each(|ns| *ns = (*ns as f64 * by) as u64);
        report
    }

    #[test]
    fn nodes_are_compared_with_the_others_of_their_kind_alone() {
        let [a, b] = [0, 2].map(|k| Machine::family()[k].report());
        let reports = [named("z", &a), named("b", &b), named("a", &scaled(&a, 1.5)), named("c", &scaled(&a, 1.02))];
        let fleet = Fleet::of(&reports);
        assert_eq!(fleet.kinds.len(), 2);
        let seen: Vec<(&str, usize)> = fleet.nodes.iter().map(|n| (n.file.as_str(), n.kind)).collect();
        assert_eq!(seen, [("a.json", 0), ("c.json", 0), ("z.json", 0), ("b.json", 1)]);
        let ratio = fleet.nodes[0].over_its_kind.unwrap();
        assert!((ratio - 1.5 / 1.01).abs() < 0.01, "{ratio}");
        assert!(fleet.nodes[0].problem.as_ref().unwrap().starts_with("slow: it takes 1.4"));
        assert!(fleet.nodes[1..].iter().all(|n| n.problem.is_none()), "{:?}", fleet.nodes);
        assert_eq!(fleet.nodes[3].over_its_kind, None);
    }

    #[test]
    fn what_was_shared_or_cut_short_is_told_and_nothing_is_compared_with_it() {
        let whole = Machine::family()[1].report();
        let mut shared = scaled(&whole, 3.0);
        shared.label = Label::RealContended;
        let mut cut = scaled(&whole, 0.2);
        cut.remarks.push("interrupted after 3 of 9 scenarios".to_owned());
        let fleet = Fleet::of(&[named("a", &shared), named("b", &cut), named("c", &whole)]);
        let problems: Vec<&str> =
            fleet.nodes.iter().map(|n| n.problem.as_deref().unwrap_or("good").split(':').next().unwrap()).collect();
        assert_eq!(problems, ["shared", "unfinished", "good"]);
        assert_eq!(fleet.nodes[2].over_its_kind, None);
        assert!(Fleet::of(&[]).nodes.is_empty());
    }
}
