//! The regret of each choice on a report.

use crate::data::{Profile, Spot};
use crate::spread::range;
use sapwise::AlgorithmId;
use sapwise::algorithm::Load;
use sapwise_tune::stats::mean;
use std::collections::BTreeMap;

/// Chooses an algorithm of a machine for a load; `None` if it knows none of them.
pub type Strategy<'a> = Box<dyn Fn(&Load) -> Option<AlgorithmId> + 'a>;

/// Assumed cost over the best for an algorithm that was not timed nearby. A hopeless algorithm is slower than this,
/// but when time is short an algorithm leaves the sweep at three times the best already.
pub const NOT_TIMED: f64 = 10.0;

/// Cells a decade of the number of objects.
const PER_DECADE: f64 = 4.0;
/// Rounds of taking means over algorithms and over points in turn. The values hardly change after a few rounds.
const ROUNDS: usize = 8;
/// Mean and standard deviation of the base-10 logarithm of the number of objects in games, an assumption: the 64
/// colliders at which nexus leaves brute force and the 10 000 bodies of a large scene lie two standard deviations to
/// either side.
const USUAL_OBJECTS: (f64, f64) = (2.9, 0.55);

/// The cost of each algorithm of a report in each cell, a quarter of a decade of a scenario, over the best.
///
/// A sweep visits most often the sizes at which two algorithms take about the same time. Every choice costs little
/// there, so counting these points one by one would flatter any strategy. And the least of several medians is too low
/// by their errors, which averaging over a cell reduces.
#[derive(Debug, Clone)]
pub struct RegretTable {
    cells: Vec<Cell>,
    algorithms: usize,
}

#[derive(Debug, Clone)]
struct Cell {
    scenario: String,
    /// Base-10 logarithm of the number of objects.
    decade: f64,
    /// The loads of its points.
    loads: Vec<Load>,
    /// Cost over the least in the cell, for each algorithm of the profile.
    over_best: Vec<f64>,
}

/// Regret of a strategy on one report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Regret {
    /// For each cell, the mean over its points.
    pub cells: Vec<f64>,
    /// How often games have that number of objects, in proportion.
    pub weights: Vec<f64>,
    /// Mean over the cells.
    pub mean: f64,
    /// Mean over the cells with these weights.
    pub as_in_games: f64,
}

impl Regret {
    /// Averages cells with weights.
    fn of(cells: Vec<f64>, weights: Vec<f64>) -> Self {
        let total: f64 = weights.iter().sum();
        let weighted: f64 = cells.iter().zip(&weights).map(|(r, w)| r * w).sum();
        Self { mean: mean(&cells), as_in_games: if total > 0.0 { weighted / total } else { 0.0 }, cells, weights }
    }

    /// Averages the cells of both.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.cells.extend(other.cells);
        self.weights.extend(other.weights);
        Self::of(self.cells, self.weights)
    }

    /// Returns the least and the largest regret of a cell.
    pub fn range(&self) -> Option<[f64; 2]> {
        range(&self.cells)
    }
}

impl RegretTable {
    /// Makes the table of a report by the medians over frames.
    pub fn new(profile: &Profile) -> Self {
        Self::by(profile, |spot| spot.medians.clone())
    }

    /// Makes the table of a report by the means over frames, for which a user waits. One interrupted frame moves them.
    pub fn by_means(profile: &Profile) -> Self {
        Self::by(profile, |spot| spot.medians.iter().zip(&spot.means).map(|(m, mean)| (m.0, *mean)).collect())
    }

    fn by(profile: &Profile, times: impl Fn(&Spot) -> Vec<(u16, f64)>) -> Self {
        let mut groups: BTreeMap<(&str, i64), Vec<&Spot>> = BTreeMap::new();
        for spot in &profile.points {
            let quarter = (PER_DECADE * f64::from(spot.load.objects.max(1)).log10()).round() as i64;
            groups.entry((&spot.scenario, quarter)).or_default().push(spot);
        }
        let algorithms = profile.algorithms.len();
        // Over the best of each cell.
        let over = |spots: &Vec<&Spot>| -> Vec<Option<f64>> {
            let ln = ln_costs(&spots.iter().map(|s| times(s)).collect::<Vec<_>>(), algorithms);
            let least = ln.iter().flatten().copied().fold(f64::INFINITY, f64::min);
            ln.into_iter().map(|ln| Some((ln? - least).exp())).collect()
        };
        let costs: BTreeMap<(&str, i64), Vec<Option<f64>>> = groups.iter().map(|(&at, s)| (at, over(s))).collect();
        let over_best = |at: (&str, i64), k: usize| costs.get(&at).and_then(|cell| cell[k]);
        let cells = groups.iter().map(|(&(scenario, quarter), spots)| Cell {
            scenario: scenario.to_owned(),
            decade: quarter as f64 / PER_DECADE,
            loads: spots.iter().map(|s| s.load).collect(),
            // An algorithm that was not timed here is assumed to be as far behind as in a neighbouring cell.
            over_best: (0..algorithms)
                .map(|k| {
                    [0, -1, 1].into_iter().find_map(|d| over_best((scenario, quarter + d), k)).unwrap_or(NOT_TIMED)
                })
                .collect(),
        });
        Self { cells: cells.collect(), algorithms }
    }

    /// Returns the regret of a strategy on this profile.
    pub fn regret(&self, profile: &Profile, choose: &Strategy<'_>) -> Regret {
        self.regret_in(None, profile, choose)
    }

    /// Returns the same for one scenario, or for all.
    pub fn regret_in(&self, scenario: Option<&str>, profile: &Profile, choose: &Strategy<'_>) -> Regret {
        let of = |cell: &Cell, load: &Load| {
            let chosen = choose(load).and_then(|id| profile.position(&id));
            chosen.map_or(NOT_TIMED, |k| cell.over_best[usize::from(k)]) - 1.0
        };
        let cells = self.cells.iter().filter(|c| scenario.is_none_or(|s| c.scenario == s));
        summed(cells, |cell| mean(&cell.loads.iter().map(|load| of(cell, load)).collect::<Vec<f64>>()))
    }

    /// Returns the regret of always choosing each algorithm, over all scenarios but one, or over all.
    pub fn always(&self, without: Option<&str>) -> Vec<Regret> {
        let cells = || self.cells.iter().filter(|c| without.is_none_or(|w| c.scenario != w));
        (0..self.algorithms).map(|k| summed(cells(), |cell| cell.over_best[k] - 1.0)).collect()
    }

    /// Returns the regret of choosing in each cell the algorithm that is best in the same cell of another table. Cells
    /// that the other table lacks don't count.
    pub fn by_cells_of(&self, profile: &Profile, other: &Self, of_other: &Profile) -> Regret {
        let alike = |cell: &Cell| other.cells.iter().find(|c| c.scenario == cell.scenario && c.decade == cell.decade);
        let chosen = |cell: &Cell| -> Option<f64> {
            let theirs = alike(cell)?;
            let best =
                (0..theirs.over_best.len()).min_by(|&a, &b| theirs.over_best[a].total_cmp(&theirs.over_best[b]))?;
            let own = profile.position(&of_other.algorithms[best].id)?;
            Some(cell.over_best[usize::from(own)] - 1.0)
        };
        let cells = self.cells.iter().filter_map(|c| Some((chosen(c)?, in_games(c.decade))));
        let (regrets, weights) = cells.unzip();
        Regret::of(regrets, weights)
    }
}

fn summed<'a>(cells: impl Iterator<Item = &'a Cell>, of: impl Fn(&Cell) -> f64) -> Regret {
    let (regrets, weights): (Vec<f64>, Vec<f64>) = cells.map(|c| (of(c), in_games(c.decade))).unzip();
    Regret::of(regrets, weights)
}

/// Returns how often games have a number of objects with this base-10 logarithm, in proportion.
fn in_games(decade: f64) -> f64 {
    (-((decade - USUAL_OBJECTS.0) / USUAL_OBJECTS.1).powi(2) / 2.0).exp()
}

/// Returns the natural logarithm of the cost of each algorithm over the points of a cell, up to a common constant:
/// the logarithm of a time is the sum of a part of the algorithm and a part of the point, since not every algorithm
/// was timed at every point.
fn ln_costs(spots: &[Vec<(u16, f64)>], algorithms: usize) -> Vec<Option<f64>> {
    let mut costs: Vec<Option<f64>> = vec![None; algorithms];
    let mut shared = vec![0.0; spots.len()];
    for _ in 0..ROUNDS {
        let mut sums = vec![(0.0, 0.0); algorithms];
        for (spot, shared) in spots.iter().zip(&shared) {
            for &(k, ns) in spot {
                let sum = &mut sums[usize::from(k)];
                *sum = (sum.0 + ns.ln() - shared, sum.1 + 1.0);
            }
        }
        costs = sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect();
        for (spot, shared) in spots.iter().zip(&mut shared) {
            let left: Vec<f64> =
                spot.iter().map(|&(k, ns)| ns.ln() - costs[usize::from(k)].unwrap_or_default()).collect();
            *shared = mean(&left);
        }
    }
    costs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::by_costs;
    use crate::fit::measured_costs;
    use crate::synthetic::Machine;

    fn regret(profile: &Profile, choose: &Strategy<'_>) -> Regret {
        RegretTable::new(profile).regret(profile, choose)
    }

    #[test]
    fn what_was_not_timed_costs_what_it_did_nearby_or_ten_times_the_best() {
        let report = Machine::family()[0].report();
        let profile = Profile::of("", &report);
        let never: Strategy<'_> = Box::new(|_| None);
        assert!(regret(&profile, &never).cells.iter().all(|r| (r - 9.0).abs() < 1e-9));
        let mut twice = report.clone();
        let id = twice.points[0].timings[0].algorithm.clone();
        let mut again = twice.points[0].clone();
        again.timings.remove(0);
        twice.points.push(again);
        let always: Strategy<'_> = Box::new(|_| Some(id.clone()));
        // And a size that was visited again counts once.
        let (once, twice) = (regret(&profile, &always), regret(&Profile::of("", &twice), &always));
        assert!(once.cells.iter().zip(&twice.cells).all(|(a, b)| (a - b).abs() < 1e-9));
        let place = usize::from(profile.position(&id).unwrap());
        assert!((RegretTable::new(&profile).always(None)[place].mean - once.mean).abs() < 1e-12);
        let available = profile.available();
        let sweep = regret(&profile, &by_costs(measured_costs(&profile).0, &available));
        assert!(sweep.mean < 0.02 && sweep.as_in_games < 0.02, "{sweep:?}");
    }

    #[test]
    fn points_with_other_algorithms_and_sizes_are_put_on_one_scale() {
        // The second point is three times as large and lacks the first algorithm, the third lacks the second.
        let spots = [vec![(0, 10.0), (1, 20.0), (2, 40.0)], vec![(1, 60.0), (2, 120.0)], vec![(0, 10.0), (2, 40.0)]];
        let costs: Vec<f64> = ln_costs(&spots, 3).into_iter().flatten().collect();
        assert!(((costs[1] - costs[0]).exp() - 2.0).abs() < 1e-3 && ((costs[2] - costs[0]).exp() - 4.0).abs() < 1e-3);
    }

    #[test]
    fn games_weigh_a_thousand_objects_most() {
        assert!(in_games(3.0) > in_games(2.0) && in_games(3.0) > in_games(4.0) && in_games(6.0) < 1e-6);
    }
}
