//! Where one side of a pair of algorithms overtakes the other on a machine, by cost curves.

use crate::data::Profile;
use crate::fit::measured_costs;
use sapwise::{AlgorithmCost, AlgorithmId, Backend, BackendClass, Load};

/// One side of a crossover: the cheapest of its algorithms counts.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Side(Vec<AlgorithmId>);

/// Two sides of which either may be the cheaper one.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Pair {
    /// The same on every machine, whatever its number of threads.
    name: String,
    first: Side,
    second: Side,
}

/// The pairs that a machine has among its algorithms: each two methods on one thread, each method on one thread and on all, the CPU
/// and its GPUs.
fn pairs(available: &[AlgorithmId]) -> Vec<Pair> {
    let on_cpu = |id: &&AlgorithmId| id.backend().class() == BackendClass::Cpu;
    let of = |wanted: &dyn Fn(&AlgorithmId) -> bool| Side(available.iter().filter(|id| wanted(id)).cloned().collect());
    let mut methods: Vec<&str> = available.iter().filter(on_cpu).map(AlgorithmId::method).collect();
    methods.sort_unstable();
    methods.dedup();
    let threads = available.iter().filter(on_cpu).map(AlgorithmId::threads).max().unwrap_or(1);
    let on = |method: &str, threads: u32| of(&|id| id.method() == method && *id.backend() == Backend::Cpu(threads));
    let mut pairs = Vec::new();
    for (k, a) in methods.iter().enumerate() {
        for b in &methods[k + 1..] {
            pairs.push(Pair { name: format!("{a}@cpu1, {b}@cpu1"), first: on(a, 1), second: on(b, 1) });
        }
    }
    if threads > 1 {
        for method in &methods {
            let name = format!("{method}@cpu1, {method} on all threads");
            pairs.push(Pair { name, first: on(method, 1), second: on(method, threads) });
        }
    }
    let class = |class: BackendClass| of(&|id| id.backend().class() == class);
    pairs.push(Pair { name: "CPU, GPU".to_owned(), first: class(BackendClass::Cpu), second: class(BackendClass::Gpu) });
    pairs.retain(|p| !p.first.0.is_empty() && !p.second.0.is_empty());
    pairs
}

/// Every pair whose crossover was measured, by name, with the place of the crossover in octaves of the slice.
pub(super) fn measured_crossovers(profile: &Profile) -> Vec<(String, f64)> {
    let (slice, measured) = (profile.slice(profile.usual_scenario()), measured_costs(profile).0);
    let at = |pair: Pair| Some((pair.octaves(&measured, &slice)?, pair.name));
    pairs(&profile.available()).into_iter().filter_map(at).map(|(octaves, name)| (name, octaves)).collect()
}

impl Pair {
    /// Octaves of the slice in which the first side is the cheaper one: the distance of the crossover from the smallest size. Where one
    /// side is always cheaper the crossover counts as lying at an end of the slice, and of several crossovers all count. `None` where
    /// no cost of a side is known.
    fn octaves(&self, costs: &[AlgorithmCost], slice: &[Load]) -> Option<f64> {
        let of = |side: &Side| costs.iter().filter(|c| side.0.contains(&c.algorithm)).collect::<Vec<_>>();
        let (first, second) = (of(&self.first), of(&self.second));
        if first.is_empty() || second.is_empty() || slice.len() < 2 {
            return None;
        }
        let least = |side: &[&AlgorithmCost], load: &Load| {
            side.iter().map(|c| c.curve.cost_ns(load)).min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
        };
        let ratio = |load: &Load| (least(&first, load) / least(&second, load)).ln();
        let places: Vec<(f64, f64)> = slice.iter().map(|l| (f64::from(l.objects).log2(), ratio(l))).collect();
        let below = |pair: &[(f64, f64)]| {
            let ((x, a), (y, b)) = (pair[0], pair[1]);
            let share = match (a < 0.0, b < 0.0) {
                (true, true) => 1.0,
                (false, false) => 0.0,
                (true, false) => a / (a - b),
                (false, true) => b / (b - a),
            };
            (y - x) * share
        };
        Some(places.windows(2).map(below).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::{CostCurve, CostTerm, Term};

    fn cost(id: &str, call: f64, object: f64) -> AlgorithmCost {
        let term = |term, unit_ns| CostTerm { term, unit_ns };
        let terms = vec![term(Term::Call, call), term(Term::Objects, object)];
        AlgorithmCost::new(id.parse().unwrap(), 1, CostCurve::new(terms), 0.1)
    }

    #[test]
    fn crossovers_are_found_and_those_that_are_not_there_lie_at_the_ends() {
        let ids: Vec<AlgorithmId> = ["brute@cpu1", "brute@cpu4", "grid-sap@cpu1", "grid-sap@cpu4", "grid-sap@gpu0"]
            .map(|id| id.parse().unwrap())
            .into();
        let pairs = pairs(&ids);
        let names: Vec<&str> = pairs.iter().map(|p| p.name.as_str()).collect();
        let all = ["brute@cpu1, brute on all threads", "grid-sap@cpu1, grid-sap on all threads"];
        assert_eq!(names, ["brute@cpu1, grid-sap@cpu1", all[0], all[1], "CPU, GPU"]);
        let slice: Vec<Load> = (3..=13).map(|k| Load::of_objects(1 << k)).collect();
        // 10 n = 1000 + 5 n at n = 200, which is 4.64 octaves above 8.
        let costs =
            [cost("brute@cpu1", 0.0, 10.0), cost("grid-sap@cpu1", 1000.0, 5.0), cost("grid-sap@cpu4", 900.0, 1.0)];
        assert!((pairs[0].octaves(&costs, &slice).unwrap() - (200.0_f64 / 8.0).log2()).abs() < 0.05);
        assert_eq!(pairs[1].octaves(&costs, &slice), None);
        // All threads are always cheaper, a GPU never is.
        assert_eq!(pairs[2].octaves(&costs, &slice), Some(0.0));
        let gpu = [&costs[..], &[cost("grid-sap@gpu0", 1e9, 1.0)]].concat();
        assert_eq!(pairs[3].octaves(&gpu, &slice), Some(10.0));
    }
}
