//! The cost model of a method, shared by all machines and thread counts.

use super::residual::{FEATURES, Residuals, Ridge};
use super::robust::{Problem, spread};
use super::rows::{Profile, Row, rows};
use anyhow::Result;
use ndarray::{Array1, Array2};
use sapwise::hardware::parameter;
use sapwise::model::{MethodModel, ModelTerm, Scale};
use sapwise::report::Label;
use sapwise::{Backend, Hardware, Term};
use std::collections::BTreeMap;

/// Points that a method needs on all machines together.
const FEWEST_POINTS: usize = 8;

/// A cost model for each method that the profiles hold enough timings of, and what was left out and why.
///
/// # Errors
/// When the regression of a residual fails.
pub(crate) fn methods(profiles: &[&Profile]) -> Result<(Vec<MethodModel>, Vec<String>)> {
    let mut notes = Vec::new();
    let mut by_method: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for (k, profile) in profiles.iter().enumerate() {
        for row in rows(&profile.report, k) {
            if matches!(row.algorithm.backend(), Backend::Cpu(_)) {
                by_method.entry(row.algorithm.method().to_owned()).or_default().push(row);
            }
        }
    }
    let mut methods = Vec::new();
    for (method, rows) in by_method {
        match Shared::new(&method, rows, profiles, &mut notes).model()? {
            Some(model) => methods.push(model),
            None => {
                notes.push(format!("{method} is left out: fewer than {FEWEST_POINTS} points, or no term explains its time"));
            }
        }
    }
    Ok((methods, notes))
}

/// The physical terms that a method's time may consist of, with one thread and with several.
fn terms(method: &str) -> Vec<(Term, Scale)> {
    use {Scale::*, Term::*};
    let tests: &[Term] = match method {
        "brute" => &[AllPairs],
        "sweep" => &[AxisCandidates],
        "strips" => &[StripCandidates],
        _ => &[AllPairs, AxisCandidates, StripCandidates],
    };
    // Of columns that can't be told apart the first one is used: work of the lanes before work of the cycles, and divided
    // work before serial work, so that the order matters where all machines have the same lanes or one thread.
    let mut list = vec![(Call, Cycle), (Call, ForkJoin), (Objects, SharedCycle)];
    if method != "brute" {
        list.extend([(Sort, SharedCycle), (ColdObjects, Byte)]);
    }
    list.extend(tests.iter().flat_map(|&t| [(t, SharedLane), (t, SharedCycle)]));
    list.extend([(Pairs, SharedCycle), (Objects, Cycle)]);
    if method != "brute" {
        list.push((Sort, Cycle));
    }
    list
}

/// The rows of one method with their terms in nanoseconds for one unit.
struct Shared<'a> {
    method: &'a str,
    rows: Vec<Row>,
    profiles: &'a [&'a Profile],
    terms: Vec<(Term, Scale)>,
    design: Array2<f64>,
}

impl<'a> Shared<'a> {
    /// Leaves out, with a note, the profiles that lack a hardware parameter.
    fn new(method: &'a str, rows: Vec<Row>, profiles: &'a [&'a Profile], notes: &mut Vec<String>) -> Self {
        let terms = terms(method);
        let (mut kept, mut values) = (Vec::new(), Vec::new());
        let mut told = Vec::new();
        for row in rows {
            let profile = profiles[row.profile];
            match nanoseconds(&terms, &profile.report.hardware, &row) {
                Ok(ns) => {
                    values.extend(ns);
                    kept.push(row);
                }
                Err(_) if told.contains(&row.profile) => {}
                Err(why) => {
                    told.push(row.profile);
                    notes.push(format!("{} is left out for {method}: {why}", profile.file));
                }
            }
        }
        let design = Array2::from_shape_vec((kept.len(), terms.len()), values).unwrap_or_default();
        Self { method, rows: kept, profiles, terms, design }
    }

    fn model(&self) -> Result<Option<MethodModel>> {
        let measured: Vec<usize> = (0..self.rows.len()).filter(|&k| !self.rows[k].floor).collect();
        let Some(first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let weights = self.weights();
        let problem = Problem {
            terms: self.design.clone(),
            ns: self.rows.iter().map(|r| r.ns).collect(),
            weights: weights.clone(),
            floors: self.rows.iter().map(|r| r.floor).collect(),
            groups: self.rows.iter().map(|r| r.profile).collect(),
        };
        let units = Array1::from(problem.units());
        let modelled = self.design.dot(&units);
        if measured.iter().any(|&k| modelled[k] <= 0.0) {
            return Ok(None);
        }
        let residuals = self.residuals(&measured, &modelled, &weights)?;
        let ridge = residuals.ridge()?;
        let left = (0..measured.len()).map(|k| residuals.ln_ratios[k] - ridge.at(&residuals.features.row(k).to_vec()));
        let spread_ln = spread(left.collect());
        let used = self.terms.iter().zip(&units).filter(|(_, u)| **u > 0.0);
        let objects = || measured.iter().map(|&k| self.rows[k].load.objects);
        let first = &self.rows[*first];
        let revision = self.profiles[first.profile].report.algorithms.iter().find(|t| t.id == first.algorithm);
        let Ridge { intercept, terms } = ridge;
        Ok(Some(MethodModel {
            method: self.method.to_owned(),
            revision: revision.map_or(0, |t| t.revision),
            max_threads: measured.iter().map(|&k| self.rows[k].algorithm.threads()).max().unwrap_or(1),
            min_objects: objects().min().unwrap_or(1),
            max_objects: objects().max().unwrap_or(1),
            terms: used.map(|(&(term, scale), &unit)| ModelTerm { term, scale, unit }).collect(),
            residual_intercept: intercept,
            residual: terms,
            spread_ln,
        }))
    }

    /// Every profile counts the same, and within it every octave of the number of objects. A contended one counts a quarter:
    /// what other programs take changes from one second to the next, so that its parameters say little about its timings. On
    /// the first one a cold fork and join was measured 800 times as long as a parallel frame took.
    fn weights(&self) -> Vec<f64> {
        let octave = |r: &Row| (r.profile, r.load.objects.ilog2());
        let mut rows: BTreeMap<(usize, u32), f64> = BTreeMap::new();
        for row in &self.rows {
            *rows.entry(octave(row)).or_default() += 1.0;
        }
        let mut octaves: BTreeMap<usize, f64> = BTreeMap::new();
        for (profile, _) in rows.keys() {
            *octaves.entry(*profile).or_default() += 1.0;
        }
        let trust = |r: &Row| if self.profiles[r.profile].report.label == Label::RealContended { 0.25 } else { 1.0 };
        self.rows.iter().map(|r| trust(r) / (rows[&octave(r)] * octaves[&r.profile])).collect()
    }

    fn residuals(&self, measured: &[usize], modelled: &Array1<f64>, weights: &[f64]) -> Result<Residuals> {
        let mut features = Vec::new();
        let mut machines: Vec<&str> = Vec::new();
        let mut groups = Vec::new();
        for &k in measured {
            let row = &self.rows[k];
            let hardware = &self.profiles[row.profile].report.hardware;
            for feature in FEATURES {
                features.push(feature.value(hardware, row.algorithm.threads(), &row.load).map_err(anyhow::Error::msg)?);
            }
            let machine = hardware.machine.physical_id.as_str();
            groups.push(machines.iter().position(|m| *m == machine).unwrap_or_else(|| {
                machines.push(machine);
                machines.len() - 1
            }));
        }
        let all: Vec<f64> = measured.iter().map(|&k| (self.rows[k].ns / modelled[k]).ln()).collect();
        // A point that the terms miss by far is a term that is missing, or a disturbed measurement: either way no slope.
        let reach = 3.0 * spread(all.clone()).max(0.01);
        Ok(Residuals {
            features: Array2::from_shape_vec((measured.len(), FEATURES.len()), features)?,
            ln_ratios: all.into_iter().map(|r| r.clamp(-reach, reach)).collect(),
            weights: measured.iter().map(|&k| weights[k]).collect(),
            groups,
        })
    }
}

/// Nanoseconds for one unit of each term in a row.
fn nanoseconds(terms: &[(Term, Scale)], hardware: &Hardware, row: &Row) -> Result<Vec<f64>, String> {
    let cache = hardware.value(parameter::CACHE_LLC_BYTES).filter(|c| *c > 0.0);
    let cache = cache.ok_or_else(|| format!("the hardware parameter {} is missing", parameter::CACHE_LLC_BYTES))?;
    // The residual needs the lanes even where no term does.
    FEATURES.iter().try_for_each(|f| f.value(hardware, row.algorithm.threads(), &row.load).map(|_| ()))?;
    let one = |&(term, scale): &(Term, Scale)| {
        Ok(term.count(&row.load, cache) * scale.nanoseconds(hardware, row.algorithm.threads())?)
    };
    terms.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Machine, truth};
    use super::*;

    fn profiles(machines: impl IntoIterator<Item = Machine>) -> Vec<Profile> {
        machines.into_iter().map(|m| Profile { file: format!("{}.json", m.name), report: m.report() }).collect()
    }

    #[test]
    fn coefficients_are_recovered_from_six_machines_and_predict_the_seventh() {
        let all = profiles(Machine::family().into_iter().map(Machine::exact));
        let training: Vec<&Profile> = all[..6].iter().collect();
        let (fitted, notes) = methods(&training).unwrap();
        assert!(notes.is_empty() && fitted.len() == 3, "{notes:?}");
        for truth in truth() {
            let found = fitted.iter().find(|m| m.method == truth.method).unwrap();
            for t in &truth.terms {
                let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
                assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
            }
            assert!(found.spread_ln < 0.005, "{found:?}");
            for row in rows(&all[6].report, 0).iter().filter(|r| r.algorithm.method() == truth.method && !r.floor) {
                let curve = found.curve(&all[6].report.hardware, row.algorithm.threads()).unwrap();
                assert!((curve.cost_ns(&row.load) / row.ns - 1.0).abs() < 0.02, "{row:?}");
            }
        }
    }

    #[test]
    fn the_residual_repairs_a_term_that_is_missing() {
        let mut all = profiles(Machine::family());
        for point in all.iter_mut().flat_map(|p| &mut p.report.points) {
            let factor = (-0.02 * (f64::from(point.load.objects).log2() - 11.0).powi(2)).exp();
            let samples = point.timings.iter_mut().flat_map(|t| &mut t.samples_ns);
            samples.for_each(|ns| *ns = (*ns as f64 * factor) as u64);
        }
        let (fitted, _) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        let mut errors = (0.0, 0.0);
        for method in fitted {
            let bare = MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..method.clone() };
            let error = |m: &MethodModel| {
                let rows: Vec<Row> =
                    rows(&all[3].report, 3).into_iter().filter(|r| r.algorithm.method() == m.method && !r.floor).collect();
                let curve = |r: &Row| m.curve(&all[3].report.hardware, r.algorithm.threads()).unwrap();
                rows.iter().map(|r| (curve(r).cost_ns(&r.load) / r.ns).ln().powi(2)).sum::<f64>()
            };
            errors = (errors.0 + error(&method), errors.1 + error(&bare));
        }
        assert!(errors.0 < 0.8 * errors.1, "{errors:?}");
    }

    #[test]
    fn machines_that_lack_a_parameter_are_told() {
        let mut all = profiles(Machine::family().into_iter().take(2));
        all[0].report.hardware.parameters.retain(|p| p.name != parameter::FORK_JOIN_COLD_NS);
        let (fitted, notes) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(fitted.len(), 3);
        assert!(notes.iter().any(|n| n.contains(parameter::FORK_JOIN_COLD_NS)), "{notes:?}");
    }
}
