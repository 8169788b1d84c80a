//! The cost model of a method on one class of processor, shared by all machines, thread counts and GPUs.

use crate::data::Profile;
use crate::fit::late_helpers::{self, Called};
use crate::fit::load_residual::{self, Remainder};
use crate::fit::method_rows::rows_by_method;
use crate::fit::min_of_two::MinOfTwo;
use crate::fit::robust::Problem;
use crate::fit::rows::Row;
use crate::fit::terms::{Component, components, fallback_method, is_incremental};
use crate::fit::weights::weights;
use crate::report::Label;
use anyhow::Result;
use ndarray::{Array1, Array2, Axis};
use sapwise::hardware::ParameterId;
use sapwise::model::{FallbackModel, HelpersModel, MethodModel, ModelTerm, PredictError, ThreadFigures};
use sapwise::stats::robust_deviation;
use sapwise::{AlgorithmId, Backend, BackendClass, Fallback, GpuKind, Hardware, Places, Work};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Points on one thread, or on GPUs, that a method needs on all machines together.
const FEWEST_POINTS: usize = 3;
/// Timings on several threads that the figures of helpers are fitted to, at most.
const MOST_CALLED: usize = 1000;

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

/// What a model is fitted to: profiles, and scenarios of them.
#[derive(Debug, Clone, Copy)]
pub struct TrainingSet<'a> {
    /// For each profile whether it is one.
    pub profiles: &'a [bool],
    /// The scenario that is left out, if one is.
    pub without: Option<&'a str>,
    /// Where residuals are to be known; `None`: at the places that tell most about the loads of the profiles.
    pub places: Option<&'a Arc<Places>>,
}

/// The models of the methods.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// One for each method on each class of processor.
    pub methods: Vec<MethodModel>,
    /// Where their residuals are known.
    pub places: Arc<Places>,
    /// What was left out and why.
    pub notes: Vec<String>,
}

/// The rows of one method.
#[derive(Debug)]
struct Design {
    method: String,
    class: BackendClass,
    components: Vec<Component>,
    /// Those on one thread, or on GPUs.
    rows: Vec<Row>,
    /// Nanoseconds for one unit of each component, shape (rows, components).
    values: Array2<f64>,
    /// Those that were measured on several threads, with what their machines have of these.
    called: Vec<(Row, ThreadFigures)>,
    /// It was never timed on one thread, so that what it takes on several counts as its work.
    never_alone: bool,
}

impl<'a> TrainingSet<'a> {
    /// These profiles with all of their scenarios.
    pub fn of(profiles: &'a [bool]) -> Self {
        Self { profiles, without: None, places: None }
    }

    fn holds(&self, row: &Row, all: &[Profile]) -> bool {
        let scenario = || &all[row.profile].points[row.spot as usize].scenario;
        self.profiles[row.profile] && self.without.is_none_or(|without| scenario() != without)
    }
}

impl<'a> Designs<'a> {
    /// The rows of all methods, with the terms that reports name for one, else with the usual ones.
    pub fn new(profiles: &'a [Profile]) -> Self {
        Self::with(profiles, &components)
    }

    /// The same with other terms in place of the usual ones, which tells what a term is worth.
    pub fn with(profiles: &'a [Profile], components: &ComponentsOf) -> Self {
        let mut notes = Vec::new();
        let mut by_method: Vec<_> = rows_by_method(profiles).into_iter().collect();
        // What falls back to another method is fitted after that.
        by_method.sort_by_key(|((_, method), _)| fallback_method(method).is_some());
        let methods = by_method
            .into_iter()
            .map(|((class, method), rows)| {
                let own = reported_terms(profiles, &method, class).unwrap_or_else(|| components(&method, class));
                Design::new(method, class, own, rows, profiles, &mut notes)
            })
            .collect();
        Self { profiles, machines: machines(profiles), methods, notes }
    }

    /// A cost model for each method and class of processor that the training holds enough timings of.
    ///
    /// # Errors
    /// When a residual can't be solved for.
    pub fn fit(&self, training: TrainingSet<'_>) -> Result<Fitted> {
        let (mut models, mut notes): (Vec<MethodModel>, _) = (Vec::new(), Vec::new());
        let chosen = self.profiles.iter().zip(training.profiles).filter(|(_, chosen)| **chosen).map(|(p, _)| p);
        let places = training.places.map_or_else(|| load_residual::places(chosen, training.without), Arc::clone);
        for design in &self.methods {
            let other = fallback_method(&design.method)
                .and_then(|other| models.iter().find(|m| m.method == other && m.backend == design.class))
                .cloned();
            let mut rows: Vec<usize> =
                (0..design.rows.len()).filter(|&k| training.holds(&design.rows[k], self.profiles)).collect();
            let name = design.name();
            if design.leave_out_software(&mut rows, self.profiles) {
                notes.push(format!(
                    "{name}: timings on software adapters are left out, there being timings on real GPUs"
                ));
            }
            let fitted = design.fit(&rows, self.profiles, &self.machines, other.as_ref(), &places)?;
            match fitted {
                Some(mut model) => {
                    design.call_helpers(
                        &mut model,
                        other.as_ref(),
                        training,
                        self.profiles,
                        &self.machines,
                        &places,
                    )?;
                    models.push(model);
                }
                // None of the chosen profiles knows it.
                None if rows.is_empty() => {}
                None => {
                    notes.push(format!(
                        "{name} is left out: fewer than {FEWEST_POINTS} points, or no term explains its time"
                    ));
                }
            }
        }
        Ok(Fitted { methods: models, places, notes })
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

impl Design {
    /// Leaves out, with a note, the profiles that lack a hardware parameter.
    fn new(
        method: String,
        class: BackendClass,
        components: Vec<Component>,
        [alone, called]: [Vec<Row>; 2],
        profiles: &[Profile],
        notes: &mut Vec<String>,
    ) -> Self {
        let (mut kept, mut values) = (Vec::new(), Vec::new());
        let mut told: Vec<(usize, String)> = Vec::new();
        let mut tell = |row: &Row, why: String| {
            // A profile may hold several GPUs, of which one lacks a parameter.
            if told.contains(&(row.profile, why.clone())) {
                return;
            }
            let (profile, id) = (&profiles[row.profile], profiles[row.profile].id(row.algorithm).to_string());
            let what = if class == BackendClass::Cpu { &method } else { &id };
            notes.push(format!("{} is left out for {what}: {why}", profile.file));
            told.push((row.profile, why));
        };
        let never_alone = alone.is_empty();
        let (alone, called) = if never_alone { (called, Vec::new()) } else { (alone, called) };
        for row in alone {
            let profile = &profiles[row.profile];
            match nanoseconds(&components, &profile.hardware, profile.id(row.algorithm), &row) {
                Ok(ns) => {
                    values.extend(ns);
                    kept.push(row);
                }
                Err(why) => tell(&row, why.to_string()),
            }
        }
        let mut with_figures = Vec::new();
        for row in called.into_iter().filter(|r| !r.floor) {
            let profile = &profiles[row.profile];
            match ThreadFigures::of(&profile.hardware, profile.id(row.algorithm).threads()) {
                Ok(figures) => with_figures.push((row, figures)),
                Err(why) => tell(&row, why.to_string()),
            }
        }
        let values = Array2::from_shape_vec((kept.len(), components.len()), values).unwrap_or_default();
        Self { method, class, components, rows: kept, values, called: with_figures, never_alone }
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

    /// The model of some of the rows, without its helpers; `other` is that of the method that this one falls back to.
    fn fit(
        &self,
        rows: &[usize],
        profiles: &[Profile],
        machines: &[usize],
        other: Option<&MethodModel>,
        places: &Arc<Places>,
    ) -> Result<Option<MethodModel>> {
        let measured: Vec<usize> = (0..rows.len()).filter(|&k| !self.rows[rows[k]].floor).collect();
        let Some(first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let row = |k: usize| &self.rows[rows[k]];
        let all: Vec<&Row> = rows.iter().map(|&k| &self.rows[k]).collect();
        let problem = Problem {
            terms: self.values.select(Axis(0), rows),
            ns: all.iter().map(|r| r.ns).collect(),
            weights: weights(&all, profiles, machines),
            floors: all.iter().map(|r| r.floor).collect(),
            groups: all.iter().map(|r| r.profile).collect(),
        };
        let other_ns = other.map(|other| self.other_ns(&all, other, profiles, places)).transpose()?;
        let min_of_two = other_ns.as_ref().map(|other_ns| MinOfTwo::fit(&problem, other_ns));
        let units = Array1::from(min_of_two.as_ref().map_or_else(|| problem.units(), |found| found.units.clone()));
        let modelled = match min_of_two.as_ref().zip(other_ns.as_ref()) {
            Some((min_of_two, other_ns)) => min_of_two.modelled(&problem, other_ns),
            None => problem.terms.dot(&units),
        };
        if measured.iter().any(|&k| modelled[k] <= 0.0) {
            return Ok(None);
        }
        let remainder = |&k: &usize| Remainder {
            load: row(k).load,
            ln: (row(k).ns / modelled[k]).ln(),
            behind: row(k).behind,
            contended: profiles[row(k).profile].label == Label::RealContended,
        };
        let remainders: Vec<Remainder> = measured.iter().map(remainder).collect();
        let by_motion = is_incremental(&self.method);
        let mut gpu_kinds: Vec<GpuKind> = rows.iter().flat_map(|&k| self.gpu_kinds(k, profiles)).collect();
        gpu_kinds.sort_unstable();
        gpu_kinds.dedup();
        // What software adapters are off by is their CPU's, and twice as much on one machine as on another: no function of the load.
        let residual = match gpu_kinds[..] {
            [GpuKind::Software] => Vec::new(),
            _ => load_residual::weights(places, &remainders, by_motion)?,
        };
        let likeness = |r: &Remainder| places.likeness(&r.load, by_motion);
        let left = |r: &Remainder| r.ln - likeness(r).iter().zip(&residual).map(|(k, w)| k * w).sum::<f64>();
        let spread_ln = robust_deviation(&remainders.iter().map(left).collect::<Vec<f64>>()).unwrap_or(0.0);
        let used = self.components.iter().zip(&units).filter(|(_, u)| **u > 0.0);
        let width = |&k: &usize| self.id(rows[k], profiles).backend().width();
        let revision = profiles[row(*first).profile].algorithms[usize::from(row(*first).algorithm)].revision;
        let mut model = MethodModel::new(&self.method, self.class, revision);
        model.max_threads = measured.iter().map(width).max().unwrap_or(1);
        model.gpu_kinds = gpu_kinds;
        model.terms = used
            .flat_map(|(component, &unit)| {
                component.0.iter().map(move |&(times, term, scale)| ModelTerm { term, scale, unit: unit * times })
            })
            .collect();
        model.fallback =
            min_of_two.zip(other).map(|(found, o)| FallbackModel { method: o.method.clone(), factor: found.factor });
        (model.residual, model.residual_by_motion, model.spread_ln) = (residual, by_motion, spread_ln);
        Ok(Some(model))
    }

    /// Fits to the timings on several threads what helpers make of the work of one.
    ///
    /// # Errors
    /// When the model can't predict a profile that it was fitted to.
    fn call_helpers(
        &self,
        model: &mut MethodModel,
        other: Option<&MethodModel>,
        training: TrainingSet<'_>,
        profiles: &[Profile],
        machines: &[usize],
        places: &Arc<Places>,
    ) -> Result<()> {
        if self.never_alone {
            model.helpers = (self.class == BackendClass::Cpu).then_some(HelpersModel::new(0.0, 0.0, 1.0, 0));
            return Ok(());
        }
        let held = self.called.iter().filter(|(row, _)| training.holds(row, profiles));
        let (all, figures): (Vec<&Row>, Vec<ThreadFigures>) = held.map(|(row, figures)| (row, *figures)).unzip();
        let weights = weights(&all, profiles, machines);
        let mut works: BTreeMap<usize, Work> = BTreeMap::new();
        let step = all.len().div_ceil(MOST_CALLED).max(1);
        let mut called = Vec::new();
        for k in (0..all.len()).step_by(step) {
            let (row, profile) = (all[k], &profiles[all[k].profile]);
            let work = match works.entry(row.profile) {
                std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
                std::collections::btree_map::Entry::Vacant(new) => {
                    let on = (&profile.hardware, &Backend::Cpu(1));
                    let fallback = match (&model.fallback, other) {
                        (Some(f), Some(other)) => {
                            Some(Fallback { work: Arc::new(other.work(on.0, on.1, places, None)?), factor: f.factor })
                        }
                        _ => None,
                    };
                    new.insert(model.work(on.0, on.1, places, fallback)?)
                }
            };
            let threads = profile.id(row.algorithm).threads();
            model.max_threads = model.max_threads.max(threads);
            called.push(Called {
                objects: row.load.objects,
                threads,
                work_ns: work.ns(&row.load),
                ns: row.ns,
                weight: weights[k],
                figures: figures[k],
            });
        }
        model.helpers = late_helpers::fit(&called);
        Ok(())
    }

    /// What the method that this one falls back to costs in some rows.
    ///
    /// # Errors
    /// When a machine lacks a parameter for it.
    fn other_ns(
        &self,
        rows: &[&Row],
        other: &MethodModel,
        profiles: &[Profile],
        places: &Arc<Places>,
    ) -> Result<Vec<f64>, PredictError> {
        // Several GPUs of a profile have each their own.
        let mut works: Vec<(usize, &Backend, Work)> = Vec::new();
        let mut all = Vec::with_capacity(rows.len());
        for row in rows {
            let (profile, backend) = (&profiles[row.profile], profiles[row.profile].id(row.algorithm).backend());
            let known = works.iter().position(|w| w.0 == row.profile && w.1 == backend);
            let at = match known {
                Some(at) => at,
                None => {
                    works.push((row.profile, backend, other.work(&profile.hardware, backend, places, None)?));
                    works.len() - 1
                }
            };
            all.push(works[at].2.ns(&row.load));
        }
        Ok(all)
    }
}

/// Nanoseconds for one unit of each component in a row.
fn nanoseconds(
    components: &[Component],
    hardware: &Hardware,
    id: &AlgorithmId,
    row: &Row,
) -> Result<Vec<f64>, PredictError> {
    let backend = id.backend();
    let cache = hardware.value(ParameterId::CacheLlcBytes).filter(|c| *c > 0.0);
    let cache = match backend.class() {
        BackendClass::Cpu => cache
            .ok_or_else(|| PredictError::Missing { parameter: ParameterId::CacheLlcBytes.to_string(), why: None })?,
        BackendClass::Gpu => 0.0,
    };
    let sum = |component: &Component| -> Result<f64, PredictError> {
        component
            .0
            .iter()
            .map(|&(times, term, scale)| {
                Ok(times * term.count(&row.load, cache) * scale.nanoseconds(hardware, backend)?)
            })
            .sum()
    };
    components.iter().map(sum).collect()
}

#[cfg(test)]
mod tests;
