//! Which hardware parameters go with which algorithm and which crossover, by two methods.

use super::entry::{Entry, representatives};
use super::rank::{self, Rank};
use super::side_crossovers::measured_crossovers;
use super::speed::slownesses;
use crate::evaluate::{Effect, Importance, Verdict};
use rayon::prelude::*;
use sapwise::Backend;
use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::model::GPU_PREFIX;
use std::collections::{BTreeMap, BTreeSet};

/// Machines that are looked at, at most, evenly taken.
const MOST_MACHINES: usize = 200;

/// What an influence is on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum On {
    /// The time of an algorithm, by what it is called on every machine.
    Algorithm(String),
    /// The times of a method on a class of processor, on any number of threads or GPUs, over what is predicted for it.
    Method(String),
    /// The place of a crossover between two sides.
    Crossover(String),
    /// The regret of what is chosen.
    Choice,
}

/// One parameter and one outcome.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Link {
    /// Its name, that of a GPU with `gpu/` before it.
    pub(super) parameter: String,
    pub(super) on: On,
    /// Between machines; none of too few, or where one of both does not vary.
    pub(super) rank: Option<Rank>,
    /// What it is worth to predictions; none of what the model of this outcome does not read.
    pub(super) effect: Option<Effect>,
    /// That of the effect, or else that of the ranks.
    pub(super) verdict: Verdict,
}

/// Every link that was looked at.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Influence {
    pub(super) links: Vec<Link>,
    /// Physical machines that are studied.
    pub(super) machines: usize,
    /// The reports that stand for those behind the ranks, by position; of many machines some, evenly taken.
    pub(super) reports: Vec<usize>,
}

/// The parameters whose ranks are taken: every one of the machine and of its first GPU that is no software adapter.
pub(super) fn parameters() -> Vec<String> {
    let of_gpu = GpuParameterId::OF_ONE.into_iter().map(|name| format!("{GPU_PREFIX}{name}"));
    ParameterId::ALL.into_iter().map(String::from).chain(of_gpu).collect()
}

impl Influence {
    /// Of the studied entries; each physical machine is one, by the report that has most of it.
    pub(super) fn new(entries: &[Entry], importance: Option<&Importance>) -> Self {
        let all = representatives(entries);
        let machines: BTreeSet<&str> = all.iter().map(|&k| entries[k].machine()).collect();
        // Reports of one machine alone are not many machines.
        let reports = if machines.len() > 1 { all } else { all.into_iter().take(1).collect() };
        let machines = machines.len();
        let step = reports.len().div_ceil(MOST_MACHINES).max(1);
        let reports: Vec<usize> = reports.iter().copied().step_by(step).collect();
        let chosen: Vec<&Entry> = reports.iter().map(|&k| &entries[k]).collect();
        let mut outcomes: BTreeMap<On, Vec<Option<f64>>> =
            slownesses(&chosen).into_iter().map(|(name, values)| (On::Algorithm(name), values)).collect();
        let crossovers: Vec<BTreeMap<String, f64>> = chosen.par_iter().map(|e| crossovers_of(e)).collect();
        let names: BTreeSet<&String> = crossovers.iter().flat_map(BTreeMap::keys).collect();
        for name in names {
            outcomes.insert(On::Crossover(name.clone()), crossovers.iter().map(|b| b.get(name).copied()).collect());
        }
        let parameters = parameters();
        let values: Vec<Vec<Option<f64>>> =
            parameters.iter().map(|name| chosen.iter().map(|e| e.value(name)).collect()).collect();
        let cells: Vec<(usize, &On)> =
            (0..parameters.len()).flat_map(|k| outcomes.keys().map(move |on| (k, on))).collect();
        let mut ranks: Vec<Option<Rank>> = cells
            .par_iter()
            .map(|&(k, on)| {
                let both = values[k].iter().zip(&outcomes[on]).filter_map(|(x, y)| Some(((*x)?, (*y)?)));
                Rank::of(&both.collect::<Vec<_>>())
            })
            .collect();
        rank::judge(&mut ranks.iter_mut().flatten().collect::<Vec<_>>());
        let mut links: Vec<Link> = cells
            .into_iter()
            .zip(ranks)
            .map(|((k, on), rank)| link(&parameters[k], on.clone(), rank, importance))
            .collect();
        let methods: BTreeSet<&String> =
            importance.iter().flat_map(|i| &i.parameters).flat_map(|p| p.distance_rise_ln.keys()).collect();
        for method in methods {
            links.extend(
                parameters.iter().map(|parameter| link(parameter, On::Method(method.clone()), None, importance)),
            );
        }
        // Ranks see what goes together, whatever the cause; the effect what a parameter adds to those that predictions read.
        for link in &mut links {
            let verdicts = [link.effect.as_ref().map(|e| e.verdict), link.rank.map(|r| r.verdict)];
            link.verdict = verdicts.into_iter().flatten().next().unwrap_or(Verdict::CannotBeTold);
        }
        links.retain(|link| link.rank.is_some() || link.effect.is_some());
        for of in importance.iter().flat_map(|i| &i.parameters).filter(|p| p.regret_rise.is_told()) {
            let effect = of.regret_rise;
            let verdict = effect.verdict;
            let parameter = of.parameter.clone();
            links.push(Link { parameter, on: On::Choice, rank: None, effect: Some(effect), verdict });
        }
        Self { links, machines, reports }
    }

    /// The link of a parameter with an outcome, where it was looked at.
    pub(super) fn link(&self, parameter: &str, on: &On) -> Option<&Link> {
        self.links.iter().find(|l| l.parameter == parameter && l.on == *on)
    }
}

/// Where one side overtakes another on a machine. A software adapter is no side against the CPU.
fn crossovers_of(entry: &Entry) -> BTreeMap<String, f64> {
    let mut profile = entry.profile.clone();
    let software_gpus = entry.software_gpus();
    profile.retain(|t| !matches!(t.id.backend(), Backend::Gpu(gpus) if gpus.iter().any(|g| software_gpus.contains(g))));
    measured_crossovers(&profile).into_iter().collect()
}

fn link(parameter: &str, on: On, rank: Option<Rank>, importance: Option<&Importance>) -> Link {
    let of = importance.and_then(|i| i.parameters.iter().find(|p| p.parameter == parameter));
    let effect = of.and_then(|of| match &on {
        On::Method(name) => of.distance_rise_ln.get(name).copied(),
        On::Algorithm(_) | On::Crossover(_) | On::Choice => None,
    });
    let effect = effect.filter(Effect::is_told);
    Link { parameter: parameter.to_owned(), on, rank, effect, verdict: Verdict::CannotBeTold }
}
