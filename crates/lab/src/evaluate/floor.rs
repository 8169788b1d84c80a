//! The noise floor: two runs of one machine, each judged on the other.

use super::baselines::by_costs;
use super::regret_table::{Regret, RegretTable};
use super::scores::{Part, split};
use crate::data::Profile;
use crate::training::Floor;
use rayon::prelude::*;
use sapwise::tuning::AlgorithmCost;
use std::collections::BTreeMap;

/// Fewest points of a run that counts: a run with fewer is not a whole sweep.
const FEWEST_POINTS: usize = 100;

/// Returns the floor over all profiles that repeat each other; `None` if none does.
pub(super) fn floor<'a>(
    profiles: &[Profile],
    table: impl Fn(usize) -> &'a RegretTable + Sync,
    costs: impl Fn(usize) -> &'a [AlgorithmCost] + Sync,
) -> Option<Floor> {
    let mut alike: BTreeMap<(&str, &str, String), Vec<usize>> = BTreeMap::new();
    for (k, p) in profiles.iter().enumerate().filter(|(_, p)| p.points.len() >= FEWEST_POINTS && p.has_cpu()) {
        let algorithms: Vec<String> = p.algorithms.iter().map(|t| t.id.to_string()).collect();
        alike.entry((p.machine(), &p.setup, algorithms.join(" "))).or_default().push(k);
    }
    // Each with the next one, in both directions.
    let pairs: Vec<(usize, usize)> =
        alike.values().flat_map(|all| all.windows(2).flat_map(|w| [(w[0], w[1]), (w[1], w[0])])).collect();
    let judged = |&(from, on): &(usize, usize)| -> (Regret, Regret) {
        let available = profiles[on].available();
        let cells = table(on).by_cells_of(&profiles[on], table(from), &profiles[from]);
        (cells, table(on).regret(&profiles[on], &by_costs(costs(from).to_vec(), &available)))
    };
    let regrets: Vec<(Regret, Regret)> = pairs.par_iter().map(judged).collect();
    let mean = |of: fn(&(Regret, Regret)) -> &Regret| {
        let part = |(&(_, on), both): (&(usize, usize), _)| {
            let (machine, several_threads) = (profiles[on].machine(), profiles[on].has_threads());
            Part { machine, several_threads, regret: of(both) }
        };
        split(&pairs.iter().zip(&regrets).map(part).collect::<Vec<_>>())
    };
    Some(Floor { pairs: pairs.len() / 2, cells: mean(|r| &r.0)?, full_sweep: mean(|r| &r.1)? })
}
