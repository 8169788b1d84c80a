//! The rows of one method on one class of processor, and the cost model that is fitted to some of them. All machines,
//! thread counts and GPUs share it.

use crate::data::Profile;
use crate::fit::designs::Designs;
use crate::fit::late_helpers::{self, Called};
use crate::fit::load_residual::{Features, Groups};
use crate::fit::method_rows::thinned;
use crate::fit::min_of_two::MinOfTwo;
use crate::fit::robust::Problem;
use crate::fit::rows::Row;
use crate::fit::terms::{Component, is_incremental};
use crate::fit::weights::weights;
use anyhow::Result;
use ndarray::{Array1, Array2, ShapeBuilder};
use sapwise::AlgorithmId;
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::internals::{Fallback, Work};
use sapwise::tuning::Term;
use sapwise_scenes::Random;
use sapwise_tune::GpuKind;
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::model::{
    FallbackModel, GroupResidual, HelpersModel, MethodModel, ModelTerm, PredictError, Scale, ThreadFigures,
};
use sapwise_tune::stats::robust_deviation;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Fewest points on one thread, or on GPUs, that a method needs over all machines.
pub(super) const FEWEST_POINTS: usize = 3;
/// Approximate number of rows that the terms are fitted to, and fewest rows of each profile. A dozen coefficients need
/// no more.
const MOST_FITTED: usize = 6000;
const FEWEST_OF_PROFILE: usize = 2;
/// Most timings on several threads that the parameters of helpers are fitted to.
const MOST_CALLED: usize = 1000;

/// A model of the rows that were fitted, if they are enough.
type Fit = Result<Option<MethodModel>>;

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
    /// The rows on several threads, with the thread figures of their machines and the time on one thread.
    called: Vec<(Row, ThreadFigures, Option<f64>)>,
    /// The groups of the rows on one thread, for residuals.
    groups: Groups,
    /// Whether the method was never timed on one thread, so that its time on several counts as its work.
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
        features: &Features,
        notes: &mut Vec<String>,
    ) -> Self {
        let (mut kept, mut values) = (Vec::new(), Vec::new());
        let mut positions = Vec::new();
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
            let ns = nanoseconds(&components, profile, &row);
            match ns.and_then(|ns| Ok((ns, at()?))) {
                Ok((ns, at)) => {
                    values.extend(ns);
                    positions.push(at);
                    kept.push(row);
                }
                Err(why) => note(&row, why),
            }
        }
        let mut with_figures = Vec::new();
        for row in called.into_iter().filter(|r| !r.floor) {
            let profile = &profiles[row.profile];
            let threads = profile.id(row.algorithm).threads();
            match ThreadFigures::of(&profile.hardware, threads) {
                Ok(figures) => {
                    let alone = AlgorithmId::new(&method, Backend::Cpu(1)).ok().and_then(|one| profile.position(&one));
                    let alone_ns = alone.and_then(|one| profile.points[row.spot as usize].of_position(one));
                    with_figures.push((row, figures, alone_ns));
                }
                Err(why) => note(&row, why),
            }
        }
        let values = Array2::from_shape_vec((kept.len(), components.len()), values).unwrap_or_default();
        let rows: Vec<(&Row, Vec<f64>)> = kept.iter().zip(positions).collect();
        let groups = Groups::new(&rows, machines, features, is_incremental(&method));
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
    pub(super) fn fit(&self, rows: &[usize], all: &Designs<'_>, other: Option<&MethodModel>) -> Fit {
        let profiles = all.profiles;
        let measured: Vec<usize> = rows.iter().copied().filter(|&k| !self.rows[k].floor).collect();
        let Some(&first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let of_profiles = rows.chunk_by(|a, b| self.rows[*a].profile == self.rows[*b].profile);
        let most = (MOST_FITTED / of_profiles.clone().count()).max(FEWEST_OF_PROFILE);
        let some = |own: &[usize]| thinned(own.to_vec(), most, self.rows[own[0]].profile);
        let fitted: Vec<usize> = of_profiles.flat_map(some).collect();
        let problem = |rows: &[usize]| {
            let own: Vec<&Row> = rows.iter().map(|&k| &self.rows[k]).collect();
            let values = |(k, j): (usize, usize)| self.values[[rows[k], j]];
            Problem {
                terms: Array2::from_shape_fn((rows.len(), self.components.len()).f(), values),
                ns: own.iter().map(|r| r.ns).collect(),
                weights: weights(&own, &all.machines),
                floors: own.iter().map(|r| r.floor).collect(),
            }
        };
        let other_ns = |rows: &[usize]| other.map(|other| self.other_ns(rows, other, all)).transpose();
        let (to_fit, whole) = (problem(&fitted), problem(&measured));
        let min_of_two = other_ns(&fitted)?.map(|other_ns| MinOfTwo::fit(&to_fit, &other_ns));
        let units = Array1::from(min_of_two.as_ref().map_or_else(|| to_fit.units(), |found| found.units.clone()));
        let modelled = match min_of_two.as_ref().zip(other_ns(&measured)?) {
            Some((min_of_two, other_ns)) => min_of_two.modelled(&whole, &other_ns),
            None => whole.terms.dot(&units),
        };
        if modelled.iter().any(|ns| *ns <= 0.0) {
            return Ok(None);
        }
        let gpu_kinds: BTreeSet<GpuKind> = rows.iter().flat_map(|&k| self.gpu_kinds(k, profiles)).collect();
        let gpu_kinds = Vec::from_iter(gpu_kinds);
        // The error on a software adapter is that of its CPU, twice as large on one machine as on another: no
        // function of the load.
        let ln: Vec<f64> = whole.ns.iter().zip(&modelled).map(|(ns, modelled)| (ns / modelled).ln()).collect();
        let (residual, left) = match gpu_kinds[..] {
            [GpuKind::Software] => (Vec::new(), ln),
            _ => self.groups.residual(&all.basis, |k| measured.binary_search(&k).is_ok(), &ln)?,
        };
        let spread_ln = robust_deviation(&left).unwrap_or(0.0);
        let used = self.components.iter().zip(&units).filter(|(_, u)| **u > 0.0);
        let width = |&k: &usize| self.id(k, profiles).backend().width();
        let revision = profiles[self.rows[first].profile].algorithms[usize::from(self.rows[first].algorithm)].revision;
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
        (model.residual, model.residual_by_motion, model.spread_ln) =
            (residual, is_incremental(&self.method), spread_ln);
        Ok(Some(model))
    }

    /// Fits the effect of helpers to the rows on several threads. The work of one thread is measured if it was timed
    /// at the same point, else modelled.
    ///
    /// # Errors
    /// When the model can't predict a profile that it was fitted to.
    pub(super) fn call_helpers(
        &self,
        model: &mut MethodModel,
        other: Option<&MethodModel>,
        chosen: &[bool],
        all: &Designs<'_>,
    ) -> Result<()> {
        if self.never_alone {
            model.helpers = (self.class == BackendClass::Cpu).then_some(HelpersModel::new(0.0, 0.0, 1.0, 0));
            return Ok(());
        }
        let held: Vec<_> = self.called.iter().filter(|(row, ..)| chosen[row.profile]).collect();
        let weights = weights(&held.iter().map(|(row, ..)| row).collect::<Vec<_>>(), &all.machines);
        let mut works: BTreeMap<usize, Work> = BTreeMap::new();
        let mut called = Vec::new();
        for ((row, figures, alone_ns), weight) in held.into_iter().zip(weights) {
            let (profile, places) = (&all.profiles[row.profile], &all.basis.places);
            if let Entry::Vacant(place) = works.entry(row.profile) {
                let one = &Backend::Cpu(1);
                let fallback = match (&model.fallback, other) {
                    (Some(f), Some(other)) => {
                        let work = Arc::new(other.work(&profile.hardware, one, places, None)?);
                        Some(Fallback { work, factor: f.factor })
                    }
                    _ => None,
                };
                place.insert(model.work(&profile.hardware, one, places, fallback)?);
            }
            let threads = profile.id(row.algorithm).threads();
            model.max_threads = model.max_threads.max(threads);
            called.push(Called {
                objects: row.load.objects,
                threads,
                work_ns: alone_ns.unwrap_or_else(|| works[&row.profile].ns(&row.load)),
                ns: row.ns,
                weight,
                figures: *figures,
            });
        }
        // At random: even steps would take the same few sizes from every scenario.
        let some = Random::named(1, &["helpers"]).shuffled(called.len());
        model.helpers = late_helpers::fit(&some.iter().take(MOST_CALLED).map(|&k| called[k]).collect::<Vec<_>>());
        Ok(())
    }

    /// Returns the modelled cost of the method that this one falls back to, in each row.
    ///
    /// # Errors
    /// When a machine lacks a parameter for it.
    fn other_ns(&self, rows: &[usize], other: &MethodModel, all: &Designs<'_>) -> Result<Vec<f64>, PredictError> {
        // Each GPU of a profile has its own.
        let mut works: BTreeMap<(usize, &Backend), Work> = BTreeMap::new();
        let ns = |row: &Row| {
            let profile = &all.profiles[row.profile];
            let backend = profile.id(row.algorithm).backend();
            let work = match works.entry((row.profile, backend)) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => {
                    place.insert(other.work(&profile.hardware, backend, &all.basis.places, None)?)
                }
            };
            Ok(work.ns(&row.load))
        };
        rows.iter().map(|&k| &self.rows[k]).map(ns).collect()
    }
}

/// Returns the nanoseconds for one unit of each component in a row.
fn nanoseconds(components: &[Component], profile: &Profile, row: &Row) -> Result<Vec<f64>, PredictError> {
    let (hardware, backend) = (&profile.hardware, profile.id(row.algorithm).backend());
    let cache = hardware.value(ParameterId::CacheLlcBytes).filter(|c| *c > 0.0);
    let cache = match backend.class() {
        BackendClass::Cpu => {
            cache.ok_or_else(|| PredictError::NotListed { parameter: ParameterId::CacheLlcBytes.to_string() })?
        }
        BackendClass::Gpu => 0.0,
    };
    let sum = |component: &Component| -> Result<f64, PredictError> {
        let ns = |&(times, term, scale): &(f64, Term, Scale)| {
            Ok(times * term.count(&row.load, cache) * scale.nanoseconds(hardware, backend)?)
        };
        component.0.iter().map(ns).sum()
    };
    components.iter().map(sum).collect()
}
