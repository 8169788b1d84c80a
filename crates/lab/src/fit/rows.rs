//! From profiles to the rows of a regression.

use crate::data::{Profile, Spot};
use sapwise::algorithm::{BackendClass, Load};
use std::collections::BTreeMap;

/// The median time of one algorithm at one point.
#[derive(Debug, Clone)]
pub struct Row {
    /// Position of the profile in the list that the rows were made from.
    pub profile: usize,
    /// Position of the algorithm in [`Profile::algorithms`].
    pub algorithm: u16,
    /// Position of the point in [`Profile::points`].
    pub spot: u32,
    /// The load of the point.
    pub load: Load,
    /// Median over the frames.
    pub ns: f64,
    /// That time over the best of the point.
    pub behind: f64,
    /// Whether the time is a lower bound: the algorithm had left the sweep before this point.
    pub floor: bool,
}

/// An algorithm that left the sweep is assumed to be at least this many times slower than the best at larger sizes,
/// or half of its last ratio: it may gain a little on a best algorithm that outgrows the caches.
const LEFT_BEHIND: f64 = 2.0;

/// Returns a row for each algorithm and point, and a lower bound for each point of a scenario beyond the last one at
/// which the algorithm was timed. Leaves out the scenario `without`. `position` is that of the profile.
pub fn rows(profile: &Profile, position: usize, without: Option<&str>) -> Vec<Row> {
    let held = |(_, spot): &(usize, &Spot)| Some(spot.scenario.as_str()) != without;
    let mut rows = Vec::new();
    let bests: Vec<Option<f64>> = profile.points.iter().map(Spot::best).collect();
    for (algorithm, timed) in profile.algorithms.iter().enumerate() {
        let algorithm = algorithm as u16;
        // The time over the best at each size of each scenario.
        let mut ratios: BTreeMap<&str, BTreeMap<u32, f64>> = BTreeMap::new();
        let row = |(k, spot): (usize, &Spot), best: f64, behind: f64, floor: bool| Row {
            profile: position,
            algorithm,
            spot: k as u32,
            load: spot.load,
            ns: best * behind,
            behind,
            floor,
        };
        for (k, spot) in profile.points.iter().enumerate().filter(held) {
            let (Some(ns), Some(best)) = (spot.of_position(algorithm), bests[k]) else { continue };
            rows.push(row((k, spot), best, ns / best, false));
            ratios.entry(&spot.scenario).or_default().insert(spot.load.objects, ns / best);
        }
        let on_gpu = timed.id.backend().class() == BackendClass::Gpu;
        // A GPU has a large fixed cost: it starts far behind and gains. One that left while it gained, because time
        // ran out, may be ahead at larger sizes.
        ratios.retain(|_, course| !(on_gpu && gains(course)));
        for (k, spot) in profile.points.iter().enumerate().filter(held) {
            let course = ratios.get(spot.scenario.as_str());
            let Some((&objects, behind)) = course.and_then(BTreeMap::last_key_value) else { continue };
            if let Some(best) = bests[k].filter(|_| spot.load.objects > objects) {
                rows.push(row((k, spot), best, (behind / 2.0).max(LEFT_BEHIND), true));
            }
        }
    }
    rows
}

/// Returns whether an algorithm came nearer to the best from the last size but one to the last.
fn gains(course: &BTreeMap<u32, f64>) -> bool {
    let mut from_the_last = course.values().rev();
    matches!((from_the_last.next(), from_the_last.next()), (Some(last), Some(before)) if last < before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Report;
    use crate::synthetic::Machine;

    #[test]
    fn a_gpu_that_gained_when_it_left_has_no_floor_beyond() {
        let mut report = Machine::family_with_gpus()[1].report();
        let left = |report: &Report| {
            let profile = Profile::of("", report);
            let own = profile.position(&"grid-sap@gpu0".parse().unwrap()).unwrap();
            rows(&profile, 0, None).iter().any(|r| r.algorithm == own && r.floor)
        };
        let on_gpu = |id: &sapwise::AlgorithmId| id.to_string() == "grid-sap@gpu0";
        assert!(!left(&report));
        // For want of time it leaves at 500 objects.
        for point in report.points.iter_mut().filter(|p| p.load.objects > 500) {
            point.timings.retain(|t| !on_gpu(&t.algorithm));
        }
        assert!(!left(&report));
        // And the same when it fell behind before.
        for point in report.points.iter_mut().filter(|p| (300..=500).contains(&p.load.objects)) {
            let own = point.timings.iter_mut().find(|t| on_gpu(&t.algorithm)).unwrap();
            own.samples_ns.iter_mut().for_each(|ns| *ns *= 10);
        }
        assert!(left(&report));
    }

    #[test]
    fn what_left_the_race_has_floors_beyond() {
        let profile = Profile::of("", &Machine::family()[0].report());
        let rows = rows(&profile, 3, None);
        // Half of the rows are of the other scenario, in which it left the race at another size.
        let brute = rows.iter().filter(|r| profile.id(r.algorithm).to_string() == "brute@cpu1");
        let brute: Vec<&Row> = brute.filter(|r| r.load.pairs == f64::from(r.load.objects)).collect();
        let largest = brute.iter().filter(|r| !r.floor).map(|r| r.load.objects).max().unwrap();
        assert!(brute.iter().any(|r| r.floor) && brute.iter().all(|r| r.floor == (r.load.objects > largest)));
        assert!(rows.iter().all(|r| r.profile == 3 && r.ns > 0.0));
    }
}
