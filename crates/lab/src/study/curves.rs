//! Figures 4, 6 and 7 of the paper: time over objects, CPU against GPU, on 1..k GPUs, on 1..k threads.

use super::entry::{Entry, SOFTWARE, best_of_machines};
use crate::Report;
use crate::data::usual_scenario;
use crate::data_table::{Cell, DataTable};
use crate::figures::{Band, CrossoverLine, Curve, CurvePanel, CurvePoint, Curves};
use crate::fit::measured_tuning;
use crate::sweep::median;
use sapwise::stats::quantile;
use sapwise::{AlgorithmId, Backend, BackendClass, Crossover, Tuning};
use std::collections::{BTreeMap, BTreeSet};

/// Machines in one picture.
const MOST_PANELS: usize = 4;

/// Which processors a picture compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compared {
    /// One core, all cores, GPUs: Figure 4.
    CpuAndGpu,
    /// Numbers of GPUs: Figure 6.
    Gpus,
    /// Numbers of threads: Figure 7.
    Threads,
}

impl Compared {
    pub(super) const ALL: [Self; 3] = [Self::CpuAndGpu, Self::Gpus, Self::Threads];

    /// Whether a report has more than one side to compare.
    fn is_in(self, entry: &Entry) -> bool {
        let timed = entry.profile.points.iter().flat_map(|p| &p.medians).map(|m| entry.profile.id(m.0));
        let widths: BTreeSet<(BackendClass, Vec<u32>)> = timed.map(|id| side(id.backend())).collect();
        let count = |class| widths.iter().filter(|w| w.0 == class).count();
        match self {
            Self::CpuAndGpu => count(BackendClass::Cpu) > 0 && count(BackendClass::Gpu) > 0,
            Self::Gpus => widths.iter().any(|w| w.0 == BackendClass::Gpu && w.1.len() > 1),
            Self::Threads => count(BackendClass::Cpu) > 1,
        }
    }

    fn takes(self, id: &AlgorithmId, threads: u32) -> bool {
        match (self, id.backend()) {
            (Self::CpuAndGpu, Backend::Cpu(k)) => *k == 1 || *k == threads,
            (Self::CpuAndGpu, _) => true,
            (_, backend) => (backend.class() == BackendClass::Gpu) == (self == Self::Gpus),
        }
    }

    /// The reports that it is drawn of: of each physical machine the one that has most of it, up to four.
    pub(super) fn drawn(self, entries: &[Entry], wanted: &[usize]) -> Vec<usize> {
        let among = wanted.iter().copied().filter(|&k| entries[k].studied.is_ok() && self.is_in(&entries[k]));
        let all = best_of_machines(entries, among, |e| (self.sides(e), e.wholeness()));
        // Of many machines some, evenly taken.
        let step = all.len().div_ceil(MOST_PANELS).max(1);
        all.into_iter().step_by(step).collect()
    }

    fn sides(self, entry: &Entry) -> usize {
        let ids = entry.profile.algorithms.iter().map(|t| &t.id).filter(|id| self.takes(id, entry.threads()));
        ids.map(|id| side(id.backend())).collect::<BTreeSet<_>>().len()
    }

    pub(super) fn title(self) -> &'static str {
        match self {
            Self::CpuAndGpu => "CPU against GPU",
            Self::Gpus => "On one and more GPUs",
            Self::Threads => "On one and more threads",
        }
    }

    pub(super) fn id(self) -> &'static str {
        match self {
            Self::CpuAndGpu => "figure-4-cpu-gpu",
            Self::Gpus => "figure-6-gpus",
            Self::Threads => "figure-7-threads",
        }
    }

    /// The picture of these reports, each a panel. The time of each side is that of its fastest algorithm at each size.
    pub(super) fn figure(self, drawn: &[(usize, &Entry, &Report)]) -> Curves {
        let mut sides: BTreeSet<(BackendClass, Vec<u32>)> = BTreeSet::new();
        for (_, entry, report) in drawn {
            let ids = report.algorithms.iter().map(|t| &t.id).filter(|id| self.takes(id, entry.threads()));
            sides.extend(ids.map(|id| side(id.backend())));
        }
        let sides: Vec<_> = sides.into_iter().collect();
        let panels = drawn.iter().map(|(_, entry, report)| self.panel(entry, report, &sides)).collect();
        Curves { title: self.title().to_owned(), panels }
    }

    fn panel(self, entry: &Entry, report: &Report, sides: &[(BackendClass, Vec<u32>)]) -> CurvePanel {
        let (threads, software_gpus) = (entry.threads(), entry.software_gpus());
        let name = |side: &(BackendClass, Vec<u32>)| name(side, &software_gpus);
        let scenario = usual_scenario(report).to_owned();
        let own = only(report, |id| self.takes(id, threads) && entry.profile.position(id).is_some());
        let style = |id: &AlgorithmId| sides.iter().position(|s| *s == side(id.backend())).unwrap_or_default();
        let mut series: Vec<Curve> = Vec::new();
        for (k, of) in sides.iter().enumerate() {
            let points = envelope(&own, &scenario, |id| side(id.backend()) == *of);
            if !points.is_empty() {
                series.push(Curve { name: name(of), style: k, points });
            }
        }
        let (fields, crossovers) = match measured_tuning(&own, &scenario, None) {
            Ok(tuning) => (bands(&tuning, style, |k| name(&sides[k])), crossover_lines(&tuning)),
            // Too few sizes for curves; the points are drawn all the same.
            Err(_) => (Vec::new(), Vec::new()),
        };
        CurvePanel { title: format!("{} ({scenario})", entry.name), series, fields, crossovers }
    }
}

/// A side by its class of processor and the numbers of the GPUs, or as one number that of the threads.
fn side(backend: &Backend) -> (BackendClass, Vec<u32>) {
    match backend {
        Backend::Gpu(gpus) => (BackendClass::Gpu, gpus.clone()),
        other => (other.class(), vec![other.width()]),
    }
}

fn name((class, numbers): &(BackendClass, Vec<u32>), software_gpus: &[u32]) -> String {
    match class {
        BackendClass::Gpu if numbers.iter().any(|g| software_gpus.contains(g)) => {
            format!("{}{SOFTWARE}", Backend::Gpu(numbers.clone()))
        }
        BackendClass::Cpu if numbers[..] == [1] => "1 thread".to_owned(),
        BackendClass::Cpu => format!("{} threads", numbers[0]),
        BackendClass::Gpu => Backend::Gpu(numbers.clone()).to_string(),
    }
}

/// The report with some of its algorithms only.
fn only(report: &Report, takes: impl Fn(&AlgorithmId) -> bool) -> Report {
    let mut own = report.clone();
    keep(&mut own, takes);
    own
}

/// Takes all but some algorithms out of a report.
pub(super) fn keep(report: &mut Report, takes: impl Fn(&AlgorithmId) -> bool) {
    report.algorithms.retain(|t| takes(&t.id));
    report.points.iter_mut().for_each(|p| p.timings.retain(|t| takes(&t.algorithm)));
}

/// At each size the median and the quartiles of the fastest of the algorithms, over the rounds.
fn envelope(report: &Report, scenario: &str, of: impl Fn(&AlgorithmId) -> bool) -> Vec<CurvePoint> {
    let mut sizes: BTreeMap<u32, BTreeMap<&AlgorithmId, Vec<u64>>> = BTreeMap::new();
    for point in report.points.iter().filter(|p| p.scenario == scenario && p.load.objects > 0) {
        for timing in point.timings.iter().filter(|t| of(&t.algorithm) && t.error.is_none() && !t.samples_ns.is_empty())
        {
            let samples = sizes.entry(point.load.objects).or_default().entry(&timing.algorithm).or_default();
            samples.extend(&timing.samples_ns);
        }
    }
    let fastest = |(objects, algorithms): (u32, BTreeMap<&AlgorithmId, Vec<u64>>)| {
        let medians = algorithms.into_values().filter_map(|samples| Some((median(&samples)?, samples)));
        let (ns, samples) = medians.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let samples: Vec<f64> = samples.into_iter().map(|ns| ns as f64).collect();
        let [low_ns, high_ns] = [0.25, 0.75].map(|share| quantile(&samples, share).unwrap_or(ns));
        Some(CurvePoint { objects: f64::from(objects), ns, low_ns, high_ns })
    };
    sizes.into_iter().filter_map(fastest).collect()
}

/// The steps of the slice, those in a row that are of the same side joined.
fn bands(tuning: &Tuning, style: impl Fn(&AlgorithmId) -> usize, name: impl Fn(usize) -> String) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    for step in &tuning.steps {
        let (from, style) = (f64::from(step.from_objects), style(&step.algorithm));
        match bands.last_mut() {
            Some(last) if last.style == style => {}
            last => {
                if let Some(last) = last {
                    last.to = from;
                }
                bands.push(Band { from, to: f64::INFINITY, style, name: name(style) });
            }
        }
    }
    bands
}

/// The crossovers between sides.
fn crossover_lines(tuning: &Tuning) -> Vec<CrossoverLine> {
    let apart = tuning.crossovers.iter().filter(|b| side(b.below.backend()) != side(b.above.backend()));
    let line = |b: &Crossover| {
        let (low, high) = b.interval().unwrap_or((b.objects, b.objects));
        CrossoverLine { objects: b.objects, low, high }
    };
    apart.map(line).collect()
}

/// What the panels show as tables: the times, the fields and the crossovers. `drawn` are the reports of the panels, by position.
pub(super) fn tables(figure: &Curves, drawn: &[(usize, &Entry, &Report)]) -> [DataTable; 3] {
    let heads = [("machine", "machine"), ("scenario", "scenario")];
    let mut times = DataTable::new([
        heads[0],
        heads[1],
        ("on", "side"),
        ("objects", "objects"),
        ("median time (ns)", "median_ns"),
        ("lower quartile (ns)", "lower_quartile_ns"),
        ("upper quartile (ns)", "upper_quartile_ns"),
    ]);
    let mut fields = DataTable::new([
        heads[0],
        heads[1],
        ("on", "side"),
        ("from (objects)", "from_objects"),
        ("to (objects)", "to_objects"),
    ]);
    let mut crossovers = DataTable::new([
        heads[0],
        heads[1],
        ("crossover (objects)", "objects"),
        ("interval from (objects)", "low_objects"),
        ("interval to (objects)", "high_objects"),
    ]);
    for (panel, (k, entry, report)) in figure.panels.iter().zip(drawn) {
        let heads = || [&entry.name[..], usual_scenario(report)].map(Cell::text).to_vec();
        for curve in &panel.series {
            for p in &curve.points {
                let figures = [p.objects, p.ns, p.low_ns, p.high_ns].map(Cell::exact);
                times.push([heads(), vec![Cell::text(&curve.name)], figures.to_vec()].concat(), &[*k]);
            }
        }
        for field in &panel.fields {
            let figures = [field.from, field.to].map(Cell::exact);
            fields.push([heads(), vec![Cell::text(&field.name)], figures.to_vec()].concat(), &[*k]);
        }
        for crossover in &panel.crossovers {
            let figures = [crossover.objects, crossover.low, crossover.high].map(Cell::exact);
            crossovers.push([heads(), figures.to_vec()].concat(), &[*k]);
        }
    }
    [times, fields, crossovers]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn entry(machine: &Machine) -> (Entry, Report) {
        let report = machine.report();
        (Entry::new(std::path::Path::new("a.json"), "a.json", report.clone(), Ok(())), report)
    }

    #[test]
    fn sides_are_their_fastest_algorithm_with_the_fields_behind() {
        let (entry, report) = entry(&Machine::family()[2]);
        let curves = Compared::Threads.figure(&[(0, &entry, &report)]);
        let panel = &curves.panels[0];
        let names: Vec<&str> = panel.series.iter().map(|s| s.name.as_str()).collect();
        assert!(names.len() > 1 && names[0] == "1 thread", "{names:?}");
        for point in &panel.series[0].points {
            let of = |p: &&crate::report::Point| {
                f64::from(p.load.objects) == point.objects && p.scenario == usual_scenario(&report)
            };
            let timings = report.points.iter().filter(of).flat_map(|p| &p.timings);
            let single = timings.filter(|t| *t.algorithm.backend() == Backend::Cpu(1));
            let least = single.filter_map(|t| median(&t.samples_ns)).min_by(f64::total_cmp).unwrap();
            assert!(
                point.ns <= least * 1.001 && point.low_ns <= point.ns && point.ns <= point.high_ns,
                "{point:?} {least}"
            );
        }
        // Bands follow each other, and between two of them is a crossover.
        assert!(
            panel.fields.len() > 1 && panel.fields.windows(2).all(|w| w[0].to == w[1].from && w[0].style != w[1].style)
        );
        assert!(panel.crossovers.len() >= panel.fields.len() - 1);
        assert!(!Compared::Gpus.is_in(&entry) && !Compared::CpuAndGpu.is_in(&entry) && Compared::Threads.is_in(&entry));
    }

    #[test]
    fn of_a_machine_the_report_with_most_sides_is_drawn() {
        let (mut few, _) = entry(&Machine::family()[2]);
        few.profile.retain(|t| t.id.threads() == 1);
        let (all, _) = entry(&Machine::family()[2]);
        assert_eq!(Compared::Threads.drawn(&[few, all], &[0, 1]), [1]);
    }
}
