//! The curves of costs and of timings over the number of objects.

use super::{Axis, Chart, Series};
use crate::sweep::median;
use sapwise::report::Timing;
use sapwise::{Tuning, Load, Report};

/// Curves in a chart, at most: beyond that they can't be told apart.
const MOST: usize = 6;

/// A curve is drawn where it takes this many times the least at most: those of a scene in which all boxes are compared with all others
/// would take half of the height.
const FARTHEST: f64 = 100.0;

/// The predicted or fitted time of a frame over the objects of a slice, for the algorithms that hold a field and those that come next.
///
/// `None` of tuning without costs.
pub(crate) fn costs(tuning: &Tuning, loads: &[Load]) -> Option<Chart> {
    let all = tuning.costs.iter().map(|cost| {
        let points = loads.iter().map(|load| (f64::from(load.objects), cost.curve.cost_ns(load) / 1e3)).collect();
        Series { name: cost.algorithm.to_string(), points }
    });
    chart(&tuning.scenario, &all.collect::<Vec<_>>(), "expected")
}

/// The same of what a report measured in a scenario.
pub(crate) fn timings(report: &Report, scenario: &str) -> Option<Chart> {
    let mut all: Vec<Series> =
        report.algorithms.iter().map(|t| Series { name: t.id.to_string(), points: Vec::new() }).collect();
    for point in report.points.iter().filter(|p| p.scenario == scenario) {
        let sound = |t: &&Timing| t.error.is_none();
        for timing in point.timings.iter().filter(sound) {
            let Some(ns) = median(&timing.samples_ns) else { continue };
            let own = report.algorithms.iter().position(|t| t.id == timing.algorithm);
            if let Some(k) = own {
                all[k].points.push((f64::from(point.load.objects), ns / 1e3));
            }
        }
    }
    for Series { points, .. } in &mut all {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Several visits to a size are one point: the least disturbed.
        points.dedup_by(|next, kept| next.0 == kept.0 && (kept.1 = kept.1.min(next.1), true).1);
    }
    chart(scenario, &all, "measured")
}

/// The curves that come nearest to the least time somewhere, those that are the least at most places first.
fn chart(scenario: &str, all: &[Series], how: &str) -> Option<Chart> {
    let mut objects: Vec<f64> = all.iter().flat_map(|s| s.points.iter().map(|p| p.0)).collect();
    objects.sort_by(f64::total_cmp);
    objects.dedup();
    let mut ranked: Vec<(f64, usize, Series)> = Vec::new();
    let least = |x: f64| all.iter().filter_map(|s| at(&s.points, x)).fold(f64::INFINITY, f64::min);
    let least: Vec<f64> = objects.iter().map(|&x| least(x)).collect();
    for Series { name, points } in all {
        // By place: how much longer than the least time it takes.
        let over: Vec<f64> = objects.iter().zip(&least).filter_map(|(&x, least)| Some(at(points, x)? / least)).collect();
        let Some(nearest) = over.iter().copied().min_by(f64::total_cmp) else { continue };
        let first = over.iter().filter(|&&ratio| ratio <= 1.0).count();
        let near = |p: &&(f64, f64)| objects.iter().zip(&least).any(|(&x, least)| x == p.0 && p.1 <= FARTHEST * least);
        let points = points.iter().filter(near).copied().collect();
        ranked.push((nearest, first, Series { name: name.clone(), points }));
    }
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let series: Vec<Series> = ranked.into_iter().take(MOST).map(|r| r.2).collect();
    let title = format!("{scenario}: {how} time of a frame (us) over objects, the cheapest algorithms");
    (!series.is_empty()).then_some(Chart { title, across: Axis::Logarithmic, series })
}

fn at(points: &[(f64, f64)], x: f64) -> Option<f64> {
    points.iter().find(|p| p.0 == x).map(|p| p.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, points: &[(f64, f64)]) -> Series {
        Series { name: name.to_owned(), points: points.to_vec() }
    }

    #[test]
    fn the_cheapest_come_first_and_what_is_far_from_them_is_cut_off() {
        let all = vec![
            curve("brute@cpu1", &[(10.0, 2.0), (100.0, 200.0), (1000.0, 20_000.0)]),
            curve("sap@cpu1", &[(10.0, 3.0), (100.0, 30.0), (1000.0, 300.0)]),
            curve("pair-cache@cpu1", &[(10.0, 1.0), (100.0, 10.0), (1000.0, 105.0)]),
            curve("pair-cache@cpu2", &[(10.0, 9.0), (100.0, 12.0), (1000.0, 100.0)]),
            curve("sap@cpu2", &[]),
        ];
        let chart = chart("uniform", &all, "measured").unwrap();
        let named: Vec<(&str, usize)> = chart.series.iter().map(|s| (&s.name[..], s.points.len())).collect();
        assert_eq!(named, [("pair-cache@cpu1", 3), ("pair-cache@cpu2", 3), ("brute@cpu1", 2), ("sap@cpu1", 3)]);
        assert!(chart.title.starts_with("uniform: measured time") && chart.across == Axis::Logarithmic);
    }

    #[test]
    fn there_are_six_at_most_and_none_without_costs() {
        let many: Vec<Series> =
            (1..=9).map(|k| curve(&format!("brute@cpu{k}"), &[(10.0, f64::from(k)), (20.0, f64::from(k))])).collect();
        let chart = chart("uniform", &many, "expected").unwrap();
        assert_eq!(chart.series.iter().map(|s| &s.name[..]).collect::<Vec<_>>().last(), Some(&"brute@cpu6"));
        let step = sapwise::Step { from_objects: 0, algorithm: "brute@cpu1".parse().unwrap() };
        assert_eq!(costs(&Tuning::from_steps(vec![step]).unwrap(), &[]), None);
    }
}
