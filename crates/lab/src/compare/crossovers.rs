//! How far the crossovers between fields move from report to report.

use crate::fit::measured_tuning;
use crate::report::{Point, Report};
use crate::sweep;
use sapwise::stats::{median, relative_iqr};
use sapwise::{AlgorithmId, Crossover, Tuning};
use serde::Serialize;
use std::collections::BTreeMap;

/// A crossover over several reports.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CrossoverSpread {
    /// Name of the scenario.
    pub scenario: String,
    /// The faster algorithm with fewer objects.
    pub below: AlgorithmId,
    /// The faster algorithm with more objects.
    pub above: AlgorithmId,
    /// Reports that have it.
    pub reports: usize,
    /// Median of its positions, in objects.
    pub objects: f64,
    /// Largest distance of a position from the median, over the median.
    pub largest_deviation: f64,
    /// Interquartile range over median; `None` below four reports.
    pub dispersion: Option<f64>,
    /// Share of the reports whose own 90 % interval of the crossover holds the median.
    pub own_interval_holds_median: f64,
    /// What the wrong side costs at half or at twice the objects of the crossover, as a share: 0.1 is 10 %. From how the ratio of the two
    /// times grows with the number of objects around the crossover; `None` where fewer than three points tell it.
    pub cost_of_factor_two: Option<f64>,
}

/// Points within this factor of a crossover tell how steep it is.
const AROUND: f64 = 4.0;

/// The crossovers of every scenario that all reports have, where at least half of the reports have them.
pub(super) fn crossovers(reports: &[&Report]) -> Vec<CrossoverSpread> {
    let mut found: Vec<CrossoverSpread> = Vec::new();
    for scenario in scenarios(reports) {
        let all: Vec<Tuning> = reports.iter().filter_map(|r| measured_tuning(r, scenario, None).ok()).collect();
        // A pair can cross more than once; the k-th crossing of one report is compared with the k-th of the others.
        let mut groups: BTreeMap<(AlgorithmId, AlgorithmId, usize), Vec<&Crossover>> = BTreeMap::new();
        for tuning in &all {
            let mut counts: BTreeMap<(&AlgorithmId, &AlgorithmId), usize> = BTreeMap::new();
            for crossover in &tuning.crossovers {
                let count = counts.entry((&crossover.below, &crossover.above)).or_default();
                groups.entry((crossover.below.clone(), crossover.above.clone(), *count)).or_default().push(crossover);
                *count += 1;
            }
        }
        let mut of_scenario: Vec<CrossoverSpread> = groups
            .into_iter()
            .filter(|(_, group)| 2 * group.len() >= reports.len())
            .filter_map(|((below, above, _), group)| crossover(reports, scenario, below, above, &group))
            .collect();
        of_scenario.sort_by(|a, b| a.objects.total_cmp(&b.objects));
        found.append(&mut of_scenario);
    }
    found
}

fn scenarios<'a>(reports: &[&'a Report]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for point in reports.iter().take(1).flat_map(|r| &r.points) {
        let everywhere = reports.iter().all(|r| r.points.iter().any(|p| p.scenario == point.scenario));
        if everywhere && !names.contains(&point.scenario.as_str()) {
            names.push(&point.scenario);
        }
    }
    names
}

fn crossover(
    reports: &[&Report],
    scenario: &str,
    below: AlgorithmId,
    above: AlgorithmId,
    group: &[&Crossover],
) -> Option<CrossoverSpread> {
    let positions: Vec<f64> = group.iter().map(|b| b.objects).collect();
    let objects = median(&positions)?;
    let holding =
        group.iter().filter(|b| b.interval().is_some_and(|(low, high)| (low..=high).contains(&objects))).count();
    let points = reports.iter().flat_map(|r| &r.points).filter(|p| p.scenario == scenario);
    Some(CrossoverSpread {
        scenario: scenario.to_owned(),
        reports: group.len(),
        objects,
        largest_deviation: positions.iter().map(|p| (p / objects - 1.0).abs()).fold(0.0, f64::max),
        dispersion: relative_iqr(&positions),
        own_interval_holds_median: holding as f64 / group.len() as f64,
        cost_of_factor_two: slope(points, objects, &below, &above).map(|slope| slope.abs().exp2() - 1.0),
        below,
        above,
    })
}

/// The exponent of the ratio of two costs, by least squares over the medians of the points around a crossover.
fn slope<'a>(
    points: impl Iterator<Item = &'a Point>,
    objects: f64,
    below: &AlgorithmId,
    above: &AlgorithmId,
) -> Option<f64> {
    let mut at: Vec<(f64, f64)> = Vec::new();
    for point in points {
        let x = (f64::from(point.load.objects) / objects).ln();
        let of = |id: &AlgorithmId| sweep::median(&point.timings.iter().find(|t| t.algorithm == *id)?.samples_ns);
        if let (true, Some(first), Some(second)) = (x.abs() <= AROUND.ln(), of(below), of(above)) {
            at.push((x, (first / second).ln()));
        }
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| at.iter().map(of).sum::<f64>() / at.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let variance: f64 = at.iter().map(|p| (p.0 - x).powi(2)).sum();
    let covariance: f64 = at.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (at.len() >= 3 && variance > 0.0).then(|| covariance / variance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    #[test]
    fn the_slope_is_the_difference_of_the_exponents() {
        let mut points = Machine::family()[0].clone().exact().report().points;
        points.retain(|p| p.scenario == "uniform");
        let [a, b] = ["brute@cpu1", "grid-sap@cpu1"].map(|id| id.parse::<AlgorithmId>().unwrap());
        for point in &mut points {
            let n = f64::from(point.load.objects);
            for timing in &mut point.timings {
                let ns = if timing.algorithm == a { n.powf(1.9) } else { 100.0 * n };
                timing.samples_ns.fill((1000.0 * ns) as u64);
            }
        }
        let slope = slope(points.iter(), 166.0, &a, &b).unwrap();
        assert!((slope - 0.9).abs() < 0.01, "{slope}");
    }
}
