//! The rows of one method on one class of processor, and the cost model that is fitted to some of them. All machines,
//! thread counts and GPUs share it.

use crate::data::Profile;
use crate::fit::late_helpers::{self, Called};
use crate::fit::load_residual::{Basis, Groups, Remainder};
use crate::fit::min_of_two::MinOfTwo;
use crate::fit::robust::Problem;
use crate::fit::rows::Row;
use crate::fit::terms::{Component, is_incremental};
use crate::fit::weights::weights;
use anyhow::Result;
use ndarray::{Array1, Array2, ShapeBuilder};
use sapwise::AlgorithmId;
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::internals::stats::robust_deviation;
use sapwise::internals::{Fallback, Places, Work};
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::model::{
    FallbackModel, GroupResidual, HelpersModel, MethodModel, ModelTerm, PredictError, ThreadFigures,
};
use sapwise_tune::{GpuKind, Hardware};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

/// Points on one thread, or on GPUs, that a method needs on all machines together.
pub(super) const FEWEST_POINTS: usize = 3;
/// Timings on several threads that the parameters of helpers are fitted to, at most.
const MOST_CALLED: usize = 1000;

/// The rows of one method.
#[derive(Debug)]
pub(super) struct Design {
    pub(super) method: String,
    pub(super) class: BackendClass,
    components: Vec<Component>,
    /// The rows on one thread, or on GPUs.
    pub(super) rows: Vec<Row>,
    /// Nanoseconds for one unit of each component, shape (rows, components).
    values: Array2<f64>,
    /// The rows on several threads, with what their machines make of these.
    called: Vec<(Row, ThreadFigures)>,
    /// The groups of both for residuals.
    groups: [Groups; 2],
    /// The method was never timed on one thread, so that its time on several counts as its work.
    never_alone: bool,
}

impl Design {
    /// Collects the rows. Leaves out, with a note, the profiles that lack a hardware parameter.
    pub(super) fn new(
        method: String,
        class: BackendClass,
        components: Vec<Component>,
        [alone, called]: [Vec<Row>; 2],
        (profiles, machines): (&[Profile], &[usize]),
        basis: &Basis,
        notes: &mut Vec<String>,
    ) -> Self {
        let (mut kept, mut values) = (Vec::new(), Vec::new());
        let mut of_groups = [Vec::new(), Vec::new()];
        let mut note = |row: &Row, why: PredictError| {
            let (profile, id) = (&profiles[row.profile], profiles[row.profile].id(row.algorithm).to_string());
            // Of several GPUs one may lack a parameter.
            let what = if class == BackendClass::Cpu { &method } else { &id };
            let note = format!("{} is left out for {what}: {why}", profile.file);
            if !notes.contains(&note) {
                notes.push(note);
            }
        };
        let never_alone = alone.is_empty();
        let (alone, called) = if never_alone { (called, Vec::new()) } else { (alone, called) };
        for row in alone {
            let profile = &profiles[row.profile];
            let at = || match class {
                BackendClass::Cpu => GroupResidual::of_one_thread(&profile.hardware),
                BackendClass::Gpu => Ok(Vec::new()),
            };
            let ns = nanoseconds(&components, &profile.hardware, profile.id(row.algorithm), &row);
            match ns.and_then(|ns| Ok((ns, at()?))) {
                Ok((ns, at)) => {
                    values.extend(ns);
                    of_groups[0].push((row.load, at, machines[row.profile]));
                    kept.push(row);
                }
                Err(why) => note(&row, why),
            }
        }
        let mut with_figures = Vec::new();
        for row in called.into_iter().filter(|r| !r.floor) {
            let profile = &profiles[row.profile];
            let threads = profile.id(row.algorithm).threads();
            let at = || GroupResidual::of_threads(&profile.hardware, threads);
            match ThreadFigures::of(&profile.hardware, threads).and_then(|figures| Ok((figures, at()?))) {
                Ok((figures, at)) => {
                    of_groups[1].push((row.load, at, machines[row.profile]));
                    with_figures.push((row, figures));
                }
                Err(why) => note(&row, why),
            }
        }
        let values = Array2::from_shape_vec((kept.len(), components.len()), values).unwrap_or_default();
        let groups = of_groups.map(|rows| Groups::new(&rows, basis, is_incremental(&method)));
        Self { method, class, components, rows: kept, values, called: with_figures, groups, never_alone }
    }

    pub(super) fn name(&self) -> String {
        if self.class == BackendClass::Cpu { self.method.clone() } else { format!("{} on GPUs", self.method) }
    }

    fn id<'p>(&self, row: usize, profiles: &'p [Profile]) -> &'p AlgorithmId {
        let row = &self.rows[row];
        profiles[row.profile].id(row.algorithm)
    }

    /// Drops the rows on software adapters if there are others, and returns whether it dropped any. A software
    /// adapter is bound by the CPU and shares only its interface with a GPU.
    pub(super) fn leave_out_software(&self, rows: &mut Vec<usize>, profiles: &[Profile]) -> bool {
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

    /// Returns the kinds of the GPUs that a row was timed on; none on the CPU.
    fn gpu_kinds(&self, row: usize, profiles: &[Profile]) -> Vec<GpuKind> {
        let hardware = &profiles[self.rows[row].profile].hardware;
        match self.id(row, profiles).backend() {
            Backend::Gpu(indices) => indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind).collect(),
            _ => Vec::new(),
        }
    }

    /// Fits a model to some of the rows, without its helpers. `other` is the model of the method that this one falls
    /// back to.
    ///
    /// # Errors
    /// When the residual can't be solved for.
    pub(super) fn fit(
        &self,
        rows: &[usize],
        profiles: &[Profile],
        machines: &[usize],
        other: Option<&MethodModel>,
        basis: &Basis,
    ) -> Result<Option<MethodModel>> {
        let measured: Vec<usize> = (0..rows.len()).filter(|&k| !self.rows[rows[k]].floor).collect();
        let Some(first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let row = |k: usize| &self.rows[rows[k]];
        let all: Vec<&Row> = rows.iter().map(|&k| &self.rows[k]).collect();
        let problem = Problem {
            terms: Array2::from_shape_fn((rows.len(), self.components.len()).f(), |(k, j)| self.values[[rows[k], j]]),
            ns: all.iter().map(|r| r.ns).collect(),
            weights: weights(&all, machines),
            floors: all.iter().map(|r| r.floor).collect(),
        };
        let other_ns = other.map(|other| self.other_ns(&all, other, profiles, &basis.places)).transpose()?;
        let min_of_two = other_ns.as_ref().map(|other_ns| MinOfTwo::fit(&problem, other_ns));
        let units = Array1::from(min_of_two.as_ref().map_or_else(|| problem.units(), |found| found.units.clone()));
        let modelled = match min_of_two.as_ref().zip(other_ns.as_ref()) {
            Some((min_of_two, other_ns)) => min_of_two.modelled(&problem, other_ns),
            None => problem.terms.dot(&units),
        };
        if measured.iter().any(|&k| modelled[k] <= 0.0) {
            return Ok(None);
        }
        let mut gpu_kinds: Vec<GpuKind> = rows.iter().flat_map(|&k| self.gpu_kinds(k, profiles)).collect();
        gpu_kinds.sort_unstable();
        gpu_kinds.dedup();
        // The error on a software adapter is that of its CPU, twice as large on one machine as on another: no
        // function of the load.
        let ln = |k: usize| (row(k).ns / modelled[k]).ln();
        let (residual, left) = match gpu_kinds[..] {
            [GpuKind::Software] => (Vec::new(), measured.iter().map(|&k| ln(k)).collect()),
            _ => {
                let remainder = |&k: &usize| Remainder { row: rows[k], ln: ln(k), behind: row(k).behind };
                self.groups[0].residual(basis, &measured.iter().map(remainder).collect::<Vec<_>>())?
            }
        };
        let spread_ln = robust_deviation(&left).unwrap_or(0.0);
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
        (model.residual, model.residual_by_motion, model.spread_ln) = (residual, is_incremental(&self.method), spread_ln);
        Ok(Some(model))
    }

    /// Fits to the rows on several threads what helpers make of the work of one, as measured where it was timed too,
    /// and the residual of that.
    ///
    /// # Errors
    /// When the model can't predict a profile that it was fitted to.
    pub(super) fn call_helpers(
        &self,
        model: &mut MethodModel,
        other: Option<&MethodModel>,
        chosen: &[bool],
        profiles: &[Profile],
        machines: &[usize],
        basis: &Basis,
    ) -> Result<()> {
        if self.never_alone {
            model.helpers = (self.class == BackendClass::Cpu).then_some(HelpersModel::new(0.0, 0.0, 1.0, 0));
            return Ok(());
        }
        let held: Vec<usize> =
            (0..self.called.len()).filter(|&k| chosen[self.called[k].0.profile]).collect();
        let all: Vec<&Row> = held.iter().map(|&k| &self.called[k].0).collect();
        let weights = weights(&all, machines);
        let mut works: BTreeMap<usize, Work> = BTreeMap::new();
        let mut called = Vec::new();
        for (k, row) in all.iter().enumerate() {
            let profile = &profiles[row.profile];
            if let Entry::Vacant(place) = works.entry(row.profile) {
                let one = &Backend::Cpu(1);
                let fallback = match (&model.fallback, other) {
                    (Some(f), Some(other)) => {
                        let work = Arc::new(other.work(&profile.hardware, one, &basis.places, None)?);
                        Some(Fallback { work, factor: f.factor })
                    }
                    _ => None,
                };
                place.insert(model.work(&profile.hardware, one, &basis.places, fallback)?);
            }
            let threads = profile.id(row.algorithm).threads();
            model.max_threads = model.max_threads.max(threads);
            called.push(Called {
                objects: row.load.objects,
                threads,
                work_ns: self.alone_ns(row, profile).unwrap_or_else(|| works[&row.profile].ns(&row.load)),
                ns: row.ns,
                weight: weights[k],
                figures: self.called[held[k]].1,
            });
        }
        let step = called.len().div_ceil(MOST_CALLED).max(1);
        model.helpers = late_helpers::fit(&called.iter().step_by(step).copied().collect::<Vec<_>>());
        let Some(helpers) = model.helpers else { return Ok(()) };
        let remainder = |(k, c): (usize, &Called)| {
            let modelled_ns = helpers.with(c.figures, c.threads).cost_ns(c.objects, c.work_ns);
            Remainder { row: held[k], ln: (c.ns / modelled_ns).ln(), behind: all[k].behind }
        };
        let remainders: Vec<Remainder> = called.iter().enumerate().map(remainder).collect();
        model.thread_residual = self.groups[1].residual(basis, &remainders)?.0;
        Ok(())
    }

    /// Returns the time of this method on one thread at the point of a row.
    fn alone_ns(&self, row: &Row, profile: &Profile) -> Option<f64> {
        let alone = profile.position(&AlgorithmId::new(&self.method, Backend::Cpu(1)).ok()?)?;
        profile.points[row.spot as usize].of_position(alone)
    }

    /// Returns the modelled cost of the method that this one falls back to, in each row.
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
        // Each GPU of a profile has its own.
        let mut works: BTreeMap<(usize, &Backend), Work> = BTreeMap::new();
        let mut all = Vec::with_capacity(rows.len());
        for row in rows {
            let (profile, backend) = (&profiles[row.profile], profiles[row.profile].id(row.algorithm).backend());
            let at = (row.profile, backend);
            let work = match works.entry(at) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => place.insert(other.work(&profile.hardware, backend, places, None)?),
            };
            all.push(work.ns(&row.load));
        }
        Ok(all)
    }
}

/// Returns the nanoseconds for one unit of each component in a row.
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
        let terms = component.0.iter();
        terms
            .map(|&(times, term, scale)| {
                Ok(times * term.count(&row.load, cache) * scale.nanoseconds(hardware, backend)?)
            })
            .sum()
    };
    components.iter().map(sum).collect()
}
