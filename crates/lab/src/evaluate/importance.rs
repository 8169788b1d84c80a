//! The influence of hardware parameters on crossovers: how much worse the direct regression fits when one parameter
//! is permuted.

use super::direct::{Line, Role, RoleOutcome, role_outcomes};
use crate::data::{Profile, figure};
use anyhow::Result;
use ndarray::{Array2, Axis};
use rayon::prelude::*;
use sapwise_scenes::Random;
use sapwise_tune::stats::mean;
use std::collections::{BTreeMap, BTreeSet};

/// Permutations of each parameter, and their seed.
const PERMUTATIONS: usize = 30;
const SEED: u64 = 1;
/// Hosts below which a regression on host parameters says nothing.
const FEWEST_HOSTS: usize = 3;

/// What each parameter is worth to the regression of one crossover.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// The two sides, the one that is cheaper with fewer objects first.
    pub crossover: String,
    /// Reports in which it was measured.
    pub reports: usize,
    /// Mean distance of the fitted from the measured crossovers in octaves.
    pub error_octaves: f64,
    /// For each parameter that the regression reads, the mean rise of that distance over the permutations, in octaves.
    pub rises: Vec<(&'static str, f64)>,
}

/// The crossover that several profiles share.
type Crossings<'a> = BTreeMap<(&'a Role, &'a Role), (&'a RoleOutcome, Vec<(&'a Profile, f64)>)>;

/// Regresses every crossover that was measured on three hosts or more, and permutes each parameter. The crossovers of
/// most reports come first.
///
/// # Errors
/// When linfa refuses a fit.
pub fn influences(profiles: &[Profile]) -> Result<Vec<Influence>> {
    let outcomes: Vec<Vec<RoleOutcome>> = profiles.par_iter().map(role_outcomes).collect();
    let mut crossings = Crossings::new();
    for (profile, outcomes) in profiles.iter().zip(&outcomes) {
        for outcome in outcomes {
            let Some((ln_objects, first_below)) = outcome.last_crossover() else { continue };
            let (first, second) = (&outcome.first, &outcome.second);
            let sides = if first_below { (first, second) } else { (second, first) };
            crossings.entry(sides).or_insert((outcome, Vec::new())).1.push((profile, ln_objects));
        }
    }
    let mut found = Vec::new();
    for ((below, above), (outcome, rows)) in crossings {
        let hosts: BTreeSet<&str> = rows.iter().map(|r| r.0.machine()).collect();
        if hosts.len() >= FEWEST_HOSTS {
            found.extend(influence(format!("{below}, {above}"), &outcome.parameters(), &rows)?);
        }
    }
    found.sort_by_key(|i: &Influence| std::cmp::Reverse(i.reports));
    Ok(found)
}

/// `None` when the regression is a mean, which reads no parameter.
fn influence(crossover: String, names: &[&'static str], rows: &[(&Profile, f64)]) -> Result<Option<Influence>> {
    let ln = |profile: &Profile, name: &str| figure(&profile.hardware, name).filter(|v| *v > 0.0).map(f64::ln);
    let names: Vec<&'static str> =
        names.iter().copied().filter(|name| rows.iter().all(|(profile, _)| ln(profile, name).is_some())).collect();
    let table = Array2::from_shape_fn((rows.len(), names.len()), |(k, j)| ln(rows[k].0, names[j]).unwrap_or_default());
    let values: Vec<f64> = rows.iter().map(|r| r.1).collect();
    let line = Line::least_squares(&table, &values)?;
    if line.columns.kept.is_empty() {
        return Ok(None);
    }
    let error = |table: &Array2<f64>| {
        let off = table.rows().into_iter().zip(&values).map(|(row, value)| (line.at(&row.to_vec()) - value).abs());
        mean(&off.collect::<Vec<f64>>()) / std::f64::consts::LN_2
    };
    let error_octaves = error(&table);
    let rise = |&column: &usize| {
        let mut random = Random::named(SEED, &[&crossover, names[column]]);
        let mut permuted = |_| {
            let mut other = table.clone();
            other.column_mut(column).assign(&table.column(column).select(Axis(0), &random.shuffled(rows.len())));
            error(&other) - error_octaves
        };
        (names[column], mean(&(0..PERMUTATIONS).map(&mut permuted).collect::<Vec<f64>>()))
    };
    let rises = line.columns.kept.iter().map(rise).collect();
    Ok(Some(Influence { crossover, reports: rows.len(), error_octaves, rises }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    #[test]
    fn the_parameter_that_moves_a_crossover_is_worth_most() {
        let machines = Machine::family().into_iter().cycle().take(14).enumerate();
        let profiles: Vec<Profile> = machines.map(|(k, m)| Profile::of(&k.to_string(), &m.report())).collect();
        // A crossover that goes down with the lanes, and with nothing else.
        let lanes = |p: &Profile| figure(&p.hardware, "simd_lanes").unwrap().ln();
        let rows: Vec<(&Profile, f64)> = profiles.iter().map(|p| (p, 7.0 - lanes(p))).collect();
        let found = influence("a, b".to_owned(), &["clock_measured_ghz", "simd_lanes"], &rows).unwrap().unwrap();
        assert!(found.error_octaves < 1e-6 && found.reports == 14, "{found:?}");
        let rise = |name: &str| found.rises.iter().find(|r| r.0 == name).unwrap().1;
        assert!(rise("simd_lanes") > 0.3 && rise("clock_measured_ghz") < 0.01, "{found:?}");
    }

    #[test]
    fn crossovers_of_too_few_hosts_are_left_out() {
        let profiles: Vec<Profile> = Machine::family().iter().map(|m| Profile::of(m.name, &m.report())).collect();
        assert!(influences(&profiles[..2]).unwrap().is_empty());
        let all = influences(&profiles).unwrap();
        assert!(!all.is_empty() && all.windows(2).all(|w| w[0].reports >= w[1].reports), "{all:?}");
    }
}
