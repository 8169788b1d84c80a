//! The form of a tuning in a file.
//!
//! Algorithms of a method share their [`Work`], and all residuals share their [`Places`]. A file holds each once.

use super::{AlgorithmCost, Crossover, Source, Step, Tuning, TuningError};
use crate::cost::{CostTerm, Fallback, Helpers, Places, Residual, Work};
use crate::tuning::CostCurve;
use crate::{AlgorithmId, Load};
use std::sync::Arc;

/// Which algorithm to run under which load.
#[derive(serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Tuning", deny_unknown_fields))]
pub(super) struct TuningFile {
    /// Where the tuning came from.
    source: Source,
    /// Name of the model that predicted the costs; null without a prediction.
    model: Option<String>,
    /// Whether the machine lies outside what the model was trained on.
    extrapolated: bool,
    /// In words, what was outside and what that means.
    warnings: Vec<String>,
    /// Scenario of `steps` and `crossovers`.
    scenario: String,
    /// The cheapest algorithm over the number of objects in that scenario, ascending.
    steps: Vec<Step>,
    /// Where one step gives way to the next.
    crossovers: Vec<Crossover>,
    /// What `low` and `high` of the crossovers are made of, and why some have none.
    interval_basis: String,
    /// Loads at which residuals are known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    places: Vec<Load>,
    /// Costs of methods on one thread, or on GPUs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    works: Vec<WorkFile>,
    /// The cost of each algorithm. Empty: `steps` decide.
    costs: Vec<CostFile>,
}

/// The cost of a method on one thread, or on some GPUs.
#[derive(serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Work", deny_unknown_fields))]
struct WorkFile {
    /// Terms of the sum; none is negative.
    terms: Vec<CostTerm>,
    /// What is done instead if that is cheaper; null if nothing is.
    fallback: Option<FallbackFile>,
    /// Last-level cache of the machine.
    cache_bytes: f64,
    /// What the terms leave unexplained: the weight of each of `places`, as the logarithm of a factor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    residual: Vec<f64>,
    /// Whether the residual depends on how far boxes move.
    #[serde(default)]
    residual_by_motion: bool,
}

/// The work of another method, done instead.
#[derive(serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Fallback", deny_unknown_fields))]
struct FallbackFile {
    /// That work: a position in `works` before this one, from 0.
    work: usize,
    /// Its cost here over its cost there.
    factor: f64,
}

/// The cost of one algorithm.
#[derive(serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "AlgorithmCost", deny_unknown_fields))]
struct CostFile {
    /// The algorithm.
    algorithm: AlgorithmId,
    /// Revision of the algorithm that was measured or predicted.
    revision: u32,
    /// Its cost on one thread: a position in `works`, from 0.
    work: usize,
    /// The effect of several threads; null for one thread and for GPUs.
    helpers: Option<Helpers>,
    /// Correction of the whole: on several threads by what the model leaves unexplained, later by frames that ran.
    residual: Option<Residual>,
    /// Standard deviation of the natural logarithm of measured over modelled time.
    spread_ln: f64,
}

/// The works of a tuning, each once. A fallback stands before the work that has it.
#[derive(Default)]
struct Works {
    known: Vec<Arc<Work>>,
    files: Vec<WorkFile>,
}

impl Works {
    /// Returns the position of a work, and adds it if it is new.
    fn position(&mut self, work: &Arc<Work>) -> usize {
        if let Some(known) = self.known.iter().position(|w| Arc::ptr_eq(w, work)) {
            return known;
        }
        let fallback = work.fallback.as_ref();
        let fallback = fallback.map(|f| FallbackFile { work: self.position(&f.work), factor: f.factor });
        let residual = work.residual.as_ref();
        self.files.push(WorkFile {
            terms: work.terms.clone(),
            fallback,
            cache_bytes: work.cache_bytes,
            residual: residual.map_or_else(Vec::new, |r| r.weights.clone()),
            residual_by_motion: residual.is_some_and(|r| r.by_motion),
        });
        self.known.push(Arc::clone(work));
        self.known.len() - 1
    }
}

impl From<Tuning> for TuningFile {
    fn from(tuning: Tuning) -> Self {
        let places = tuning.places().map_or_else(Vec::new, |places| places.loads().to_vec());
        let mut works = Works::default();
        let cost = |AlgorithmCost { algorithm, revision, curve, spread_ln }| CostFile {
            algorithm,
            revision,
            work: works.position(&curve.work),
            helpers: curve.helpers,
            residual: curve.residual,
            spread_ln,
        };
        let costs = tuning.costs.into_iter().map(cost).collect();
        Self {
            source: tuning.source,
            model: tuning.model,
            extrapolated: tuning.extrapolated,
            warnings: tuning.warnings,
            scenario: tuning.scenario,
            steps: tuning.steps,
            crossovers: tuning.crossovers,
            interval_basis: tuning.interval_basis,
            places,
            works: works.files,
            costs,
        }
    }
}

impl TryFrom<TuningFile> for Tuning {
    type Error = TuningError;

    fn try_from(file: TuningFile) -> Result<Self, TuningError> {
        let TuningFile { source, model, extrapolated, warnings, scenario, steps, crossovers, interval_basis, .. } =
            file;
        let places = Arc::new(Places::new(file.places));
        let mut works: Vec<Arc<Work>> = Vec::new();
        for WorkFile { terms, fallback, cache_bytes, residual, residual_by_motion } in file.works {
            let fallback = fallback.map(|FallbackFile { work, factor }| match works.get(work) {
                Some(other) => Ok(Fallback { work: Arc::clone(other), factor }),
                None => Err(TuningError::NoFallback { work }),
            });
            let residual = Residual::new(Arc::clone(&places), residual, residual_by_motion);
            works.push(Arc::new(Work {
                fallback: fallback.transpose()?,
                terms,
                cache_bytes,
                residual: Some(residual).filter(|r| !r.weights.is_empty()),
            }));
        }
        let cost = |CostFile { algorithm, revision, work, helpers, residual, spread_ln }| {
            let Some(known) = works.get(work) else { return Err(TuningError::NoWork { algorithm, work }) };
            let residual = residual.map(|own| Residual { places: Arc::clone(&places), ..own });
            let curve = CostCurve { work: Arc::clone(known), helpers, residual };
            Ok(AlgorithmCost { algorithm, revision, curve, spread_ln })
        };
        let costs = file.costs.into_iter().map(cost).collect::<Result<_, _>>()?;
        let tuning = Self { source, model, extrapolated, warnings, scenario, steps, crossovers, interval_basis, costs };
        tuning.defect().map_or(Ok(tuning), Err)
    }
}
