//! What the cost model loses where one of its physical terms is withheld, on machines that were left out.

use super::baselines::{available, by_costs};
use super::fit::{Designs, TermsOf};
use super::model::model;
use super::partition::Partition;
use super::profile::Profile;
use super::terms::terms;
use super::yardstick::{NOT_TIMED, Yardstick, average};
use crate::simulate;
use crate::table::columns;
use rayon::prelude::*;
use sapwise::model::{MethodModel, Scale};
use sapwise::{AlgorithmId, Model, Term};

/// What a model without one term may lose, over what the whole one loses.
const MOST_LOST: f64 = 1.5;

/// A physical term over all methods: the tests of each method are one.
type Withheld = (&'static str, fn(Term, Scale) -> bool);

const fn tests(term: Term) -> bool {
    matches!(term, Term::AllPairs | Term::AxisCandidates | Term::StripCandidates)
}

/// Every term of the list in `terms`.
const WITHHELD: [Withheld; 18] = [
    ("call, cycles", |t, s| t == Term::Call && s == Scale::Cycle),
    ("fork and join", |_, s| s == Scale::ForkJoin),
    ("objects, divided cycles", |t, s| t == Term::Objects && s == Scale::SharedCycle),
    ("sort, divided cycles", |t, s| t == Term::Sort && s == Scale::SharedCycle),
    ("bytes outside the cache", |_, s| s == Scale::Byte),
    ("tests, lanes", |t, s| tests(t) && s == Scale::SharedLane),
    ("tests, divided cycles", |t, s| tests(t) && s == Scale::SharedCycle),
    ("pairs, divided cycles", |t, s| t == Term::Pairs && s == Scale::SharedCycle),
    ("moved, divided cycles", |t, _| t == Term::Moved),
    ("lines between cores", |_, s| s == Scale::SharedLine),
    ("objects and sort, cycles", |t, s| matches!(t, Term::Objects | Term::Sort) && s == Scale::Cycle),
    ("GPU: round trip", |_, s| s == Scale::GpuRoundTrip),
    ("GPU: dispatches", |_, s| s == Scale::GpuDispatch),
    ("GPU: bytes up", |_, s| s == Scale::GpuUploadByte),
    ("GPU: bytes moved", |_, s| s == Scale::GpuMemoryByte),
    ("GPU: tests", |_, s| s == Scale::GpuOperation),
    ("GPU: bytes down", |_, s| s == Scale::GpuDownloadByte),
    ("pairs, cycles", |t, s| t == Term::Pairs && s == Scale::Cycle),
];

/// Mean regrets on machines left out, with the residual and without.
fn mean_regrets(profiles: &[Profile], partition: &Partition, terms: &TermsOf) -> (f64, f64) {
    let designs = Designs::with(profiles, terms);
    let of_fold = |fold: &Vec<usize>| -> Vec<(f64, f64)> {
        let chosen: Vec<bool> = (0..profiles.len()).map(|k| !fold.contains(&k)).collect();
        let (whole, _) = model(profiles, &designs, &chosen, "withheld").unwrap();
        let bare = |m: &MethodModel| MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..m.clone() };
        let physics = Model { methods: whole.methods.iter().map(bare).collect(), ..whole.clone() };
        fold.iter().map(|&k| (regret(&profiles[k], &whole), regret(&profiles[k], &physics))).collect()
    };
    let regrets: Vec<(f64, f64)> = partition.folds.iter().flat_map(of_fold).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| average(&regrets.iter().map(of).collect::<Vec<f64>>());
    (mean(|r| r.0), mean(|r| r.1))
}

fn regret(profile: &Profile, model: &Model) -> f64 {
    let available = available(profile);
    let revision = |id: &AlgorithmId| profile.algorithms.iter().find(|t| t.id == *id).map_or(0, |t| t.revision);
    let wanted: Vec<(AlgorithmId, u32)> = available.iter().map(|id| (id.clone(), revision(id))).collect();
    model.predict(&profile.hardware, &wanted).map_or(NOT_TIMED - 1.0, |prediction| {
        Yardstick::new(profile).regret(profile, &by_costs(prediction.costs, &available)).mean
    })
}

fn simulated(machines: usize) -> Vec<Profile> {
    let loads = simulate::Loads::of_a_sweep(1, Some(300_000)).unwrap();
    let reports = simulate::simulate(&simulate::built_in().unwrap(), machines, &loads, 1).unwrap();
    reports.into_iter().map(|(file, report)| Profile::of(&file, &report)).collect()
}

/// Regret with one term withheld after the other, over that of the whole model, in the order of [`WITHHELD`].
fn ratios(profiles: &[Profile]) -> Vec<f64> {
    let partition = Partition::of_machines(profiles, 6).unwrap();
    let whole = mean_regrets(profiles, &partition, &terms);
    let without: Vec<(f64, f64)> = WITHHELD
        .par_iter()
        .map(|(_, is)| {
            mean_regrets(profiles, &partition, &|method, class| {
                terms(method, class).into_iter().filter(|&(t, s)| !is(t, s)).collect()
            })
        })
        .collect();
    let percent = |share: f64| format!("{:.2} %", share * 100.0);
    let row = |name: &str, (ridge, physics): (f64, f64)| {
        let ratio = |a: f64, b: f64| format!("{:.2}", a / b);
        vec![name.to_owned(), percent(ridge), ratio(ridge, whole.0), percent(physics), ratio(physics, whole.0)]
    };
    let mut rows = vec![["withheld", "with the residual", "ratio", "terms alone", "ratio"].map(str::to_owned).to_vec()];
    rows.push(row("nothing", whole));
    rows.extend(WITHHELD.iter().zip(&without).map(|(withheld, &regrets)| row(withheld.0, regrets)));
    println!("{}", columns(&rows));
    without.into_iter().map(|(ridge, _)| ridge / whole.0).collect()
}

#[test]
#[ignore = "takes minutes; prints the table of all simulated machines"]
fn the_table_of_all_simulated_machines() {
    let most = ratios(&simulated(51)).into_iter().fold(0.0, f64::max);
    assert!(most <= MOST_LOST, "{most}");
}
