//! The cost model of a method on one class of processor, shared by all machines, thread counts and GPUs.

use crate::data::Profile;
use crate::fit::min_of_two::MinOfTwo;
use crate::fit::residual::{Residuals, Ridge};
use crate::fit::robust::Problem;
use crate::fit::rows::{Row, rows};
use crate::fit::terms::{Component, components, fallback_method};
use crate::report::Label;
use anyhow::Result;
use ndarray::{Array1, Array2, Axis};
use sapwise::hardware::ParameterId;
use sapwise::model::{Feature, MethodModel, ModelTerm, PredictError, Scale};
use sapwise::stats::robust_deviation;
use sapwise::{AlgorithmId, Backend, BackendClass, GpuKind, Hardware, Term};
use std::collections::BTreeMap;

/// Points that a method needs on all machines together.
const FEWEST_POINTS: usize = 8;
/// Cold forks and joins of a frame on several threads where none was timed: it forks and joins at least once.
const UNSEEN_FORK_JOINS: f64 = 1.0;
/// Rows of a method, about. Its dozen coefficients need no more, and a fit takes time in proportion to them: of many reports each
/// adds a few rows, other ones than the next.
const MOST_ROWS: usize = 6000;
/// Rows of a method for each profile at least.
const FEWEST_OF_PROFILE: usize = 2;

/// What the time of a method on a class of processor may consist of.
pub type ComponentsOf = dyn Fn(&str, BackendClass) -> Vec<Component>;

/// The rows of every method with all that a fit needs of them, worked out once for all fits to parts of the profiles.
#[derive(Debug)]
pub struct Designs<'a> {
    profiles: &'a [Profile],
    /// Position of the physical machine of each profile, counted in the order of their first profiles.
    machines: Vec<usize>,
    methods: Vec<Design>,
    /// What was left out because a parameter is missing.
    pub notes: Vec<String>,
}

/// The rows of one method.
#[derive(Debug)]
struct Design {
    method: String,
    class: BackendClass,
    components: Vec<Component>,
    rows: Vec<Row>,
    /// Nanoseconds for one unit of each component, shape (rows, components).
    values: Array2<f64>,
    /// Shape (rows, features of the class).
    features: Array2<f64>,
    /// Components of the method that this one falls back to, and their values; none where there is no such method.
    other_components: Vec<Component>,
    other_values: Array2<f64>,
}

impl<'a> Designs<'a> {
    /// The rows of all methods, with the terms that reports name for one, else with the usual ones.
    pub fn new(profiles: &'a [Profile]) -> Self {
        Self::with(profiles, &components)
    }

    /// The same with other terms in place of the usual ones, which tells what a term is worth.
    pub fn with(profiles: &'a [Profile], components: &ComponentsOf) -> Self {
        let most = (MOST_ROWS / profiles.len().max(1)).max(FEWEST_OF_PROFILE);
        let mut by_method: BTreeMap<(BackendClass, String), Vec<Row>> = BTreeMap::new();
        for (k, profile) in profiles.iter().enumerate() {
            let mut own: BTreeMap<(BackendClass, &str), Vec<Row>> = BTreeMap::new();
            for row in rows(profile, k) {
                let id = profile.id(row.algorithm);
                own.entry((id.backend().class(), id.method())).or_default().push(row);
            }
            for ((class, method), rows) in own {
                by_method.entry((class, method.to_owned())).or_default().extend(thinned(rows, most, k));
            }
        }
        let mut notes = Vec::new();
        let mut by_method: Vec<_> = by_method.into_iter().collect();
        // What falls back to another method is fitted after that.
        by_method.sort_by_key(|((_, method), _)| fallback_method(method).is_some());
        let methods = by_method
            .into_iter()
            .map(|((class, method), rows)| {
                let own = reported_terms(profiles, &method, class).unwrap_or_else(|| components(&method, class));
                let other = fallback_method(&method).map_or_else(Vec::new, |other| components(other, class));
                Design::new(method, class, [own, other], rows, profiles, &mut notes)
            })
            .collect();
        Self { profiles, machines: machines(profiles), methods, notes }
    }

    /// A cost model for each method and class of processor that the chosen profiles hold enough timings of, and what was left
    /// out and why.
    ///
    /// # Errors
    /// When the regression of a residual fails.
    pub fn fit(&self, chosen: &[bool]) -> Result<(Vec<MethodModel>, Vec<String>)> {
        let (mut models, mut notes): (Vec<MethodModel>, _) = (Vec::new(), Vec::new());
        for design in &self.methods {
            let other = fallback_method(&design.method)
                .and_then(|other| models.iter().find(|m| m.method == other && m.backend == design.class))
                .map(|m| m.terms.clone());
            let mut rows: Vec<usize> = (0..design.rows.len()).filter(|&k| chosen[design.rows[k].profile]).collect();
            let name = design.name();
            if design.leave_out_software(&mut rows, self.profiles) {
                notes.push(format!("{name}: timings on software adapters are left out, there being timings on real GPUs"));
            }
            match design.fit(&rows, self.profiles, &self.machines, other.as_deref())? {
                Some(model) => models.push(model),
                // None of the chosen profiles knows it.
                None if rows.is_empty() => {}
                None => {
                    notes.push(format!(
                        "{name} is left out: fewer than {FEWEST_POINTS} points, or no term explains its time"
                    ));
                }
            }
        }
        Ok((models, notes))
    }
}

/// The terms that the reports name for a method, each once in the order of the first that has it; `None` where no report names any.
fn reported_terms(profiles: &[Profile], method: &str, class: BackendClass) -> Option<Vec<Component>> {
    let timed = profiles.iter().flat_map(|p| &p.algorithms);
    let own = timed.filter(|t| t.id.method() == method && t.id.backend().class() == class).flat_map(|t| &t.terms);
    let mut components: Vec<Component> = Vec::new();
    for component in own.map(|t| Component::of(t.term, t.scale)) {
        if !components.contains(&component) {
            components.push(component);
        }
    }
    Some(components).filter(|c| !c.is_empty())
}

/// Position of the physical machine of each profile.
fn machines(profiles: &[Profile]) -> Vec<usize> {
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    profiles
        .iter()
        .map(|p| {
            let next = known.len();
            *known.entry(p.machine()).or_insert(next)
        })
        .collect()
}

/// At most so many of the rows, evenly spaced, from a place that differs with `turn`.
pub(crate) fn thinned(rows: Vec<Row>, most: usize, turn: usize) -> Vec<Row> {
    let all = rows.len();
    if all <= most {
        return rows;
    }
    let shift = turn % all;
    let kept = |k: usize| (k * most) / all != ((k + 1) * most) / all;
    rows.into_iter().enumerate().filter(|(k, _)| kept((k + shift) % all)).map(|(_, row)| row).collect()
}

impl Design {
    /// Leaves out, with a note, the profiles that lack a hardware parameter.
    fn new(
        method: String,
        class: BackendClass,
        [components, other_components]: [Vec<Component>; 2],
        rows: Vec<Row>,
        profiles: &[Profile],
        notes: &mut Vec<String>,
    ) -> Self {
        let all = [&components[..], &other_components].concat();
        let (mut kept, mut values, mut features) = (Vec::new(), Vec::new(), Vec::new());
        let mut told: Vec<(usize, String)> = Vec::new();
        for row in rows {
            let profile = &profiles[row.profile];
            let id = profile.id(row.algorithm);
            match nanoseconds(&all, &profile.hardware_at(row.core_to_core_ns), id, &row) {
                Ok((ns, of_residual)) => {
                    values.extend(ns);
                    features.extend(of_residual);
                    kept.push(row);
                }
                // A profile may hold several GPUs, of which one lacks a parameter.
                Err(why) if told.contains(&(row.profile, why.to_string())) => {}
                Err(why) => {
                    let what = if class == BackendClass::Cpu { &method } else { &id.to_string() };
                    notes.push(format!("{} is left out for {what}: {why}", profile.file));
                    told.push((row.profile, why.to_string()));
                }
            }
        }
        let values = Array2::from_shape_vec((kept.len(), all.len()), values).unwrap_or_default();
        let (values, other_values) = values.view().split_at(Axis(1), components.len());
        let (values, other_values) = (values.to_owned(), other_values.to_owned());
        let features = Array2::from_shape_vec((kept.len(), Feature::of(class).len()), features).unwrap_or_default();
        Self { method, class, components, rows: kept, values, features, other_components, other_values }
    }

    fn name(&self) -> String {
        if self.class == BackendClass::Cpu { self.method.clone() } else { format!("{} on GPUs", self.method) }
    }

    fn id<'p>(&self, row: usize, profiles: &'p [Profile]) -> &'p AlgorithmId {
        let row = &self.rows[row];
        profiles[row.profile].id(row.algorithm)
    }

    /// Leaves out the rows on software adapters, where others are left. They are bound by the CPU, so that what they
    /// share with a GPU is the interface only. Whether any was left out.
    fn leave_out_software(&self, rows: &mut Vec<usize>, profiles: &[Profile]) -> bool {
        if self.class == BackendClass::Cpu {
            return false;
        }
        let software = |&k: &usize| self.gpu_kinds(k, profiles).contains(&GpuKind::Software);
        let (adapters, real): (Vec<usize>, Vec<usize>) = rows.drain(..).partition(software);
        let some_real = real.iter().any(|&k| !self.rows[k].floor);
        let some_left_out = some_real && !adapters.is_empty();
        *rows = if some_real { real } else { adapters };
        some_left_out
    }

    /// The kinds of the GPUs that a row was timed on; none on the CPU.
    fn gpu_kinds(&self, row: usize, profiles: &[Profile]) -> Vec<GpuKind> {
        let hardware = &profiles[self.rows[row].profile].hardware;
        match self.id(row, profiles).backend() {
            Backend::Gpu(indices) => indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind).collect(),
            _ => Vec::new(),
        }
    }

    /// The model of some of the rows; `other` are the terms with units of the method that this one falls back to.
    fn fit(
        &self,
        rows: &[usize],
        profiles: &[Profile],
        machines: &[usize],
        other: Option<&[ModelTerm]>,
    ) -> Result<Option<MethodModel>> {
        let measured: Vec<usize> = (0..rows.len()).filter(|&k| !self.rows[rows[k]].floor).collect();
        let Some(first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let row = |k: usize| &self.rows[rows[k]];
        let weights = self.weights(rows, profiles, machines);
        let problem = Problem {
            terms: self.values.select(Axis(0), rows),
            ns: (0..rows.len()).map(|k| row(k).ns).collect(),
            weights: weights.clone(),
            floors: (0..rows.len()).map(|k| row(k).floor).collect(),
            groups: (0..rows.len()).map(|k| row(k).profile).collect(),
        };
        let other_ns = other.map(|other| self.other_ns(rows, other)).filter(|ns| ns.iter().all(|ns| *ns > 0.0));
        let min_of_two = other_ns.as_ref().map(|other_ns| MinOfTwo::fit(&problem, other_ns));
        let mut units = Array1::from(min_of_two.as_ref().map_or_else(|| problem.units(), |found| found.units.clone()));
        // Timings of one thread tell nothing of a fork and join, and without it several threads would be the best choice everywhere.
        for (unit, (values, component)) in units.iter_mut().zip(problem.terms.columns().into_iter().zip(&self.components)) {
            if component.has(Scale::ForkJoin) && values.iter().all(|v| *v == 0.0) {
                *unit = UNSEEN_FORK_JOINS;
            }
        }
        let modelled = match min_of_two.as_ref().zip(other_ns.as_ref()) {
            Some((min_of_two, other_ns)) => min_of_two.modelled(&problem, other_ns),
            None => problem.terms.dot(&units),
        };
        if measured.iter().any(|&k| modelled[k] <= 0.0) {
            return Ok(None);
        }
        let ln_ratios: Vec<f64> = measured.iter().map(|&k| (row(k).ns / modelled[k]).ln()).collect();
        // A point that the terms miss by far is a term that is missing, or a disturbed measurement: either way no slope.
        let reach = 3.0 * robust_deviation(&ln_ratios).unwrap_or(0.0).max(0.01);
        let residuals = Residuals {
            names: Feature::of(self.class),
            features: self.features.select(Axis(0), &measured.iter().map(|&k| rows[k]).collect::<Vec<_>>()),
            ln_ratios: ln_ratios.into_iter().map(|r| r.clamp(-reach, reach)).collect(),
            weights: measured.iter().map(|&k| weights[k]).collect(),
            groups: measured.iter().map(|&k| machines[row(k).profile]).collect(),
        };
        let ridge = residuals.ridge()?;
        let left: Vec<f64> = (0..measured.len()).map(|k| residuals.ln_ratios[k] - residuals.at(&ridge, k)).collect();
        let spread_ln = robust_deviation(&left).unwrap_or(0.0);
        let used = self.components.iter().zip(&units).filter(|(_, u)| **u > 0.0);
        let objects = || measured.iter().map(|&k| row(k).load.objects);
        let mut gpu_kinds: Vec<GpuKind> = rows.iter().flat_map(|&k| self.gpu_kinds(k, profiles)).collect();
        gpu_kinds.sort_unstable();
        gpu_kinds.dedup();
        let Ridge { intercept, terms } = ridge;
        let width = |&k: &usize| self.id(rows[k], profiles).backend().width();
        let revision = profiles[row(*first).profile].algorithms[usize::from(row(*first).algorithm)].revision;
        let mut model = MethodModel::new(&self.method, self.class, revision);
        model.max_threads = measured.iter().map(width).max().unwrap_or(1);
        model.gpu_kinds = gpu_kinds;
        model.min_objects = objects().min().unwrap_or(1);
        model.max_objects = objects().max().unwrap_or(1);
        model.terms = used
            .flat_map(|(component, &unit)| {
                component.0.iter().map(move |&(times, term, scale)| ModelTerm { term, scale, unit: unit * times })
            })
            .collect();
        if let Some((found, other)) = min_of_two.zip(other) {
            model.fallback_terms = other.iter().map(|t| ModelTerm { unit: t.unit * found.factor, ..*t }).collect();
        }
        (model.residual_intercept, model.residual, model.spread_ln) = (intercept, terms, spread_ln);
        Ok(Some(model))
    }

    /// What the method that this one falls back to costs in some of the rows, without its residual.
    fn other_ns(&self, rows: &[usize], other: &[ModelTerm]) -> Vec<f64> {
        let unit = |component: &Component| {
            let found = component.0.first().and_then(|&(times, term, scale)| {
                other.iter().find(|t| (t.term, t.scale) == (term, scale)).map(|t| t.unit / times)
            });
            found.unwrap_or(0.0)
        };
        let units: Vec<f64> = self.other_components.iter().map(unit).collect();
        self.other_values.select(Axis(0), rows).dot(&Array1::from(units)).to_vec()
    }

    /// Every physical machine counts the same, however many profiles it has: what a machine has of its own, which no parameter
    /// tells, stands in all of its profiles, so that twenty of one machine would pass off its own for what machines share. Within a
    /// machine every profile counts the same, and within that every octave of the number of objects. A contended profile counts a
    /// quarter of the others of its machine: what other programs take changes from one second to the next, so that its parameters
    /// say little about its timings. On the first one a cold fork and join was measured 800 times as long as a parallel frame took.
    /// And a row counts the less the further it lies behind the best of its point: nobody chooses the algorithm there.
    fn weights(&self, rows: &[usize], profiles: &[Profile], machines: &[usize]) -> Vec<f64> {
        let octave = |k: &usize| (self.rows[*k].profile, self.rows[*k].load.objects.ilog2());
        let mut counts: BTreeMap<(usize, u32), f64> = BTreeMap::new();
        for k in rows {
            *counts.entry(octave(k)).or_default() += 1.0;
        }
        let own = |k: &usize| 1.0 / (counts[&octave(k)] * self.rows[*k].behind);
        let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
        for k in rows {
            *sums.entry(self.rows[*k].profile).or_default() += own(k);
        }
        let trust = |profile: usize| if profiles[profile].label == Label::RealContended { 0.25 } else { 1.0 };
        let mut trusts: BTreeMap<usize, f64> = BTreeMap::new();
        for &profile in sums.keys() {
            *trusts.entry(machines[profile]).or_default() += trust(profile);
        }
        let weight = |k: &usize| {
            let profile = self.rows[*k].profile;
            trust(profile) / trusts[&machines[profile]] * own(k) / sums[&profile]
        };
        rows.iter().map(weight).collect()
    }
}

/// Nanoseconds for one unit of each component in a row, and the features of its residual.
fn nanoseconds(
    components: &[Component],
    hardware: &Hardware,
    id: &AlgorithmId,
    row: &Row,
) -> Result<(Vec<f64>, Vec<f64>), PredictError> {
    let backend = id.backend();
    let cache = hardware.value(ParameterId::CacheLlcBytes).filter(|c| *c > 0.0);
    let cache = match backend.class() {
        BackendClass::Cpu => {
            cache.ok_or_else(|| PredictError::Missing { parameter: ParameterId::CacheLlcBytes.to_string(), why: None })?
        }
        BackendClass::Gpu => 0.0,
    };
    let features = Feature::of(backend.class()).iter().map(|f| f.value(hardware, backend, &row.load));
    // The residual needs its parameters even where no term does.
    let features = features.collect::<Result<Vec<f64>, PredictError>>()?;
    let one = |&(times, term, scale): &(f64, Term, Scale)| {
        Ok(times * term.count(&row.load, cache) * scale.nanoseconds(hardware, backend)?)
    };
    let sum = |component: &Component| component.0.iter().map(one).sum::<Result<f64, PredictError>>();
    Ok((components.iter().map(sum).collect::<Result<_, PredictError>>()?, features))
}

#[cfg(test)]
mod tests;
