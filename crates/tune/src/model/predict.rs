//! Predicts the cost curves of a machine from its hardware parameters.

use super::gpu_set::GpuSet;
use super::{GPU_PREFIX, MethodModel, Model, PredictError};
use crate::GpuHardware;
use crate::hardware::Hardware;
use crate::stats::NORMAL_90;
use sapwise::algorithm::{Backend, BackendClass, Entry, Load};
use sapwise::internals::{Fallback, GpuKind, Work};
use sapwise::tuning::{AlgorithmCost, Source};
use sapwise::{AlgorithmId, Tuning};
use std::sync::Arc;

/// Cost curves for one machine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// One curve for each algorithm that could be predicted.
    pub costs: Vec<AlgorithmCost>,
    /// Whether the machine lies outside the training. Then no crossover has an interval.
    pub extrapolated: bool,
    /// Algorithms on more threads or GPUs than the model has seen. Their crossovers have no interval.
    pub wider: Vec<AlgorithmId>,
    /// What was outside, missing or left out, in sentences.
    pub warnings: Vec<String>,
    /// Name of the model.
    pub model: String,
    /// [`Model::ratios_90_ln`].
    pub ratios_90_ln: Option<f64>,
}

/// Why a predicted crossover has no interval.
const NO_INTERVALS: &str =
    "no interval: too few machines like this one were measured to know the error of a prediction on it";

/// What to do if a machine is unlike those of the training.
const ASK: &str = "this machine is unlike those of the training: measure it with `sapwise probe --out report.json`, \
                   then `sapwise predict --report report.json --measured`";

/// Costs that are known already, by method and backend.
type Works<'a> = Vec<(&'a str, Backend, Arc<Work>)>;

impl Model {
    /// Predicts the cost curves of `algorithms`, in the revisions that will run, on a machine.
    ///
    /// Leaves out with a warning what it can't predict: a method that the model has not seen on that processor,
    /// another revision, a GPU that the hardware does not hold, a missing or implausible parameter. A machine is
    /// extrapolated if a parameter lies outside its [range](super::Range).
    ///
    /// # Errors
    /// If no algorithm can be predicted, or a parameter of the machine has a value that no machine has.
    pub fn predict(&self, hardware: &Hardware, algorithms: &[Entry]) -> Result<Prediction, PredictError> {
        if let Some(why) = hardware.implausible() {
            return Err(PredictError::Hardware(why));
        }
        let mut p = Prediction {
            costs: Vec::new(),
            extrapolated: false,
            wider: Vec::new(),
            warnings: Vec::new(),
            model: self.name.clone(),
            ratios_90_ln: self.ratios_90_ln,
        };
        let mut unlike = p
            .outside(self.ranges.iter().filter_map(|r| r.excess(&r.parameter, "", hardware.value_named(&r.parameter))));
        if self.ranges.is_empty() {
            p.outside([format!("the model {} does not record what it was trained on", self.name)]);
        }
        // Why, and which.
        let mut left_out: Vec<(String, Vec<String>)> = Vec::new();
        let mut leave_out = |id: &AlgorithmId, why: String| match left_out.iter_mut().find(|(known, _)| *known == why) {
            Some((_, ids)) => ids.push(id.to_string()),
            None => left_out.push((why, vec![id.to_string()])),
        };
        let mut gpus = Vec::new();
        let mut works: Works<'_> = Vec::new();
        for Entry { id, revision, .. } in algorithms {
            let backend = id.backend();
            let Some(method) = self.method(id) else {
                leave_out(id, format!("the model {} was not trained on it", self.name));
                continue;
            };
            if method.revision != *revision {
                let known = method.revision;
                let why = format!("the model knows revision {known}, this build has {revision}; train on new reports");
                leave_out(id, why);
                continue;
            }
            let work = check_gpus(hardware, backend).and_then(|()| self.work(method, hardware, backend, &mut works));
            let curve = match work.and_then(|work| method.curve(work, hardware, backend)) {
                Ok(curve) => curve,
                Err(missing) => {
                    leave_out(id, missing.to_string());
                    continue;
                }
            };
            if backend.width() > method.max_threads {
                let what = if backend.class() == BackendClass::Cpu { "threads" } else { "GPUs" };
                p.warnings.push(format!("{id}: the model has seen {} {what} at most", method.max_threads));
                p.wider.push(id.clone());
            }
            if let Backend::Gpu(indices) = backend {
                p.outside(method.unseen_kinds(id, hardware, indices));
                gpus.extend(indices);
            }
            let spread_ln = method.spread_ln;
            p.costs.push(AlgorithmCost::new(id.clone(), *revision, curve, spread_ln));
        }
        gpus.sort_unstable();
        gpus.dedup();
        for gpu in gpus.into_iter().filter_map(|&k| hardware.gpu(k)) {
            let of = format!(" of gpu{}", gpu.gpu.index);
            unlike |= p.outside(self.ranges.iter().filter_map(|r| {
                let name = r.parameter.strip_prefix(GPU_PREFIX)?;
                r.excess(name, &of, gpu.value_named(name))
            }));
        }
        if unlike {
            p.warnings.push(ASK.to_owned());
        }
        p.warn_of_unmeasured_groups(hardware);
        p.warnings.extend(left_out.into_iter().map(|(why, ids)| format!("{}: left out, since {why}", ids.join(", "))));
        if p.costs.is_empty() {
            return Err(PredictError::Nothing { model: p.model, warnings: p.warnings.join("; ") });
        }
        Ok(p)
    }

    /// Returns the cost model of an algorithm's method on its class of processor.
    pub fn method(&self, id: &AlgorithmId) -> Option<&MethodModel> {
        self.of_method(id.method(), id.backend().class())
    }

    pub(super) fn of_method(&self, method: &str, class: BackendClass) -> Option<&MethodModel> {
        self.methods.iter().find(|m| m.method == method && m.backend == class)
    }

    /// The cost of a method on one thread of a machine or on GPUs, computed once for all numbers of threads.
    fn work<'a>(
        &'a self,
        method: &'a MethodModel,
        hardware: &Hardware,
        backend: &Backend,
        known: &mut Works<'a>,
    ) -> Result<Arc<Work>, PredictError> {
        let on = if let Backend::Gpu(_) = backend { backend.clone() } else { Backend::Cpu(1) };
        if let Some((.., work)) = known.iter().find(|w| w.0 == method.method && w.1 == on) {
            return Ok(Arc::clone(work));
        }
        let fallback = match &method.fallback {
            None => None,
            Some(f) => {
                let other = self.of_method(&f.method, method.backend).filter(|o| o.fallback.is_none());
                let other = other.ok_or_else(|| PredictError::NoMethod { method: f.method.clone() })?;
                Some(Fallback { work: self.work(other, hardware, backend, known)?, factor: f.factor })
            }
        };
        let work = Arc::new(method.work(hardware, backend, &self.places, fallback)?);
        known.push((&method.method, on, Arc::clone(&work)));
        Ok(work)
    }
}

/// # Errors
/// Names a parameter of one of the GPUs whose value no GPU has.
fn check_gpus(hardware: &Hardware, backend: &Backend) -> Result<(), PredictError> {
    let Backend::Gpu(indices) = backend else { return Ok(()) };
    let implausible = indices.iter().filter_map(|&k| hardware.gpu(k)).find_map(GpuHardware::implausible);
    implausible.map_or(Ok(()), |e| Err(PredictError::Hardware(e)))
}

impl Prediction {
    /// Returns the tuning, with `steps` and `crossovers` for the slice through `loads`, ascending by objects.
    ///
    /// The interval of a crossover is the range in which the ratio of the two costs is nearer to one than nine of ten
    /// such ratios were to their prediction on held-out machines. There is none if fewer than two were held out, if
    /// the machine is extrapolated, or beside an algorithm in `wider`.
    pub fn tuning(self, scenario: &str, loads: &[Load]) -> Tuning {
        let within = self.ratios_90_ln.filter(|_| !self.extrapolated);
        let spread = |_: usize, _: usize, _: &Load| within.unwrap_or(0.0) / NORMAL_90;
        let mut tuning = Tuning::from_costs_with(Source::Predicted, scenario, self.costs, loads, spread);
        tuning.interval_basis = match within {
            Some(ln) => format!(
                "within a factor of {:.2} of equal cost: on held-out machines nine of ten ratios of two times were \
                 that near their prediction",
                ln.exp()
            ),
            None => NO_INTERVALS.to_owned(),
        };
        let unknown = |id: &AlgorithmId| within.is_none() || self.wider.contains(id);
        for c in tuning.crossovers.iter_mut().filter(|c| unknown(&c.below) || unknown(&c.above)) {
            (c.low, c.high) = (None, None);
        }
        tuning.model = Some(self.model);
        (tuning.extrapolated, tuning.warnings) = (self.extrapolated, self.warnings);
        tuning
    }

    /// Adds warnings of which each makes the prediction an extrapolation. Returns whether there was any.
    fn outside(&mut self, warnings: impl IntoIterator<Item = String>) -> bool {
        let before = self.warnings.len();
        self.warnings.extend(warnings);
        let any = self.warnings.len() > before;
        self.extrapolated |= any;
        any
    }

    fn warn_of_unmeasured_groups(&mut self, hardware: &Hardware) {
        let mut named: Vec<String> = Vec::new();
        for backend in self.costs.iter().map(|c| c.algorithm.backend()) {
            let Backend::Gpu(indices) = backend else { continue };
            let name = backend.to_string();
            if !named.contains(&name) && GpuSet::new(hardware, indices).is_ok_and(|set| set.is_unmeasured_group()) {
                let what = "how these GPUs work together was not measured; their rates are added up";
                self.warnings.push(format!("{name}: {what}"));
                named.push(name);
            }
        }
    }
}

impl MethodModel {
    /// Returns a warning if a GPU of an algorithm is of a kind that the model has not seen.
    fn unseen_kinds(&self, id: &AlgorithmId, hardware: &Hardware, indices: &[u32]) -> Option<String> {
        let mut kinds = indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind);
        let unseen = kinds.find(|kind| !self.gpu_kinds.contains(kind))?;
        let seen: Vec<&str> = self.gpu_kinds.iter().map(|kind| kind.as_str()).collect();
        Some(match &self.gpu_kinds[..] {
            [] => format!("{id}: the model does not record which kinds of GPU it was trained on"),
            [GpuKind::Software] => format!("{id}: the model was trained on software adapters and no real GPU"),
            _ => format!("{id}: the model was trained on {} GPUs only, this one is {unseen}", seen.join(" and ")),
        })
    }
}
