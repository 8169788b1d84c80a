//! Cost curves of a machine from its hardware parameters.

use super::curve::Figures;
use super::gpu_set::GpuSet;
use super::{GPU_PREFIX, MethodModel, Model, PredictError, Range};
use crate::hardware::{GpuKind, Hardware};
use crate::{AlgorithmCost, AlgorithmId, Backend, BackendClass, Entry, GpuHardware, Load, Source, Tuning};

/// Cost curves for one machine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// One curve for each algorithm that could be predicted.
    pub costs: Vec<AlgorithmCost>,
    /// Whether the machine or an algorithm lies outside what the model was trained on.
    pub extrapolated: bool,
    /// What was outside, what was missing, what was left out.
    pub warnings: Vec<String>,
    /// Name of the model.
    pub model: String,
}

/// Why a predicted crossover has no interval.
const NO_INTERVALS: &str =
    "no interval is claimed: too few machines were measured to say how far a prediction lies from the truth on a new one";

/// What to do where a machine is unlike those of training.
pub const ASK: &str = "this machine is unlike those of training: measure a few timings with `sapwise predict --samples 8`, or all with \
                   `sapwise probe`";

impl Model {
    /// Predicts the cost curves of `algorithms` in the revisions that will run, on a machine.
    ///
    /// What can't be predicted is left out with a warning: a method that the model has not seen on that processor, another
    /// revision, a GPU that the hardware does not hold, a parameter that is missing or that no GPU has.
    ///
    /// A machine is extrapolated when a parameter lies outside its [range](Range).
    ///
    /// # Errors
    /// When no algorithm can be predicted, or a parameter of the machine has a value that no machine has.
    pub fn predict(&self, hardware: &Hardware, algorithms: &[Entry]) -> Result<Prediction, PredictError> {
        if let Some(why) = hardware.implausible() {
            return Err(PredictError::Hardware(why));
        }
        let mut p = Prediction { costs: Vec::new(), extrapolated: false, warnings: Vec::new(), model: self.name.clone() };
        if self.simulated {
            p.warnings.push(format!(
                "the model {} was trained on simulated machines: what it predicts is no evidence; train on real reports",
                self.name
            ));
        }
        let mut unlike =
            p.outside(self.ranges.iter().filter_map(|r| r.excess(&r.parameter, "", hardware.value_named(&r.parameter))));
        if self.ranges.is_empty() {
            p.outside([format!("the model {} does not say what it was trained on", self.name)]);
        }
        let mut unknown: Vec<String> = Vec::new();
        let mut gpus: Vec<u32> = Vec::new();
        for Entry { id, revision, .. } in algorithms {
            let backend = id.backend();
            let Some(method) = self.method(id) else {
                unknown.push(id.to_string());
                continue;
            };
            if method.revision != *revision {
                p.warnings.push(format!(
                    "{id} is left out: the model knows its revision {}, this build has {revision}; train on new reports",
                    method.revision
                ));
                continue;
            }
            let mut figures = Figures::new(hardware, backend);
            let curve = match gpus_that_are(hardware, backend).and_then(|()| method.formula().curve(&mut figures)) {
                Ok(curve) => curve,
                Err(missing) => {
                    p.warnings.push(format!("{id} is left out: {missing}"));
                    continue;
                }
            };
            if backend.width() > method.max_threads {
                let what = if backend.class() == BackendClass::Cpu { "threads" } else { "GPUs" };
                p.outside([format!("{id}: the model has seen {} {what} at most", method.max_threads)]);
            }
            if let Backend::Gpu(indices) = backend {
                p.outside(method.unseen_kinds(id, hardware, indices));
                gpus.extend(indices);
            }
            let spread_ln = method.spread_ln;
            p.costs.push(AlgorithmCost { algorithm: id.clone(), revision: *revision, curve, spread_ln });
        }
        gpus.sort_unstable();
        gpus.dedup();
        for gpu in gpus.into_iter().filter_map(|k| hardware.gpu(k)) {
            let of = format!(" of gpu{}", gpu.gpu.index);
            unlike |= p.outside(self.ranges.iter().filter_map(|r| {
                let name = r.parameter.strip_prefix(GPU_PREFIX)?;
                r.excess(name, &of, gpu.value_named(name))
            }));
        }
        if unlike {
            p.warnings.push(ASK.to_owned());
        }
        p.tell_unmeasured_groups(hardware);
        if !unknown.is_empty() {
            p.warnings.push(format!(
                "left out, since the model {} was not trained on it: {}",
                self.name,
                unknown.join(", ")
            ));
        }
        if p.costs.is_empty() {
            return Err(PredictError::Nothing { model: p.model, warnings: p.warnings });
        }
        Ok(p)
    }

    /// The cost model of an algorithm's method on its class of processor.
    #[must_use]
    pub fn method(&self, id: &AlgorithmId) -> Option<&MethodModel> {
        self.methods.iter().find(|m| m.method == id.method() && m.backend == id.backend().class())
    }
}

/// # Errors
/// The parameter of one of the GPUs that no GPU has.
fn gpus_that_are(hardware: &Hardware, backend: &Backend) -> Result<(), PredictError> {
    let Backend::Gpu(indices) = backend else { return Ok(()) };
    indices
        .iter()
        .filter_map(|&k| hardware.gpu(k))
        .find_map(GpuHardware::implausible)
        .map_or(Ok(()), |e| Err(PredictError::Hardware(e)))
}

impl Prediction {
    /// The tuning, with `steps` and `crossovers` for the slice through `loads`, ascending by objects.
    ///
    /// Its crossovers have no intervals: how far a prediction lies from the truth on machines never seen was not measured on enough of
    /// them.
    #[must_use]
    pub fn tuning(self, scenario: &str, loads: &[Load]) -> Tuning {
        let mut tuning = Tuning::from_costs(Source::Predicted, scenario, self.costs, loads);
        for crossover in &mut tuning.crossovers {
            (crossover.low, crossover.high) = (None, None);
        }
        tuning.interval_basis = NO_INTERVALS.to_owned();
        tuning.model = Some(self.model);
        (tuning.extrapolated, tuning.warnings) = (self.extrapolated, self.warnings);
        tuning
    }

    /// Each of these warnings makes the prediction an extrapolation. Whether there was any.
    fn outside(&mut self, warnings: impl IntoIterator<Item = String>) -> bool {
        let before = self.warnings.len();
        self.warnings.extend(warnings);
        let any = self.warnings.len() > before;
        self.extrapolated |= any;
        any
    }

    fn tell_unmeasured_groups(&mut self, hardware: &Hardware) {
        let mut told: Vec<String> = Vec::new();
        for backend in self.costs.iter().map(|c| c.algorithm.backend()) {
            let Backend::Gpu(indices) = backend else { continue };
            let name = backend.to_string();
            if !told.contains(&name) && GpuSet::new(hardware, indices).is_ok_and(|set| set.is_unmeasured_group()) {
                self.warnings
                    .push(format!("{name}: how these GPUs work together was not measured; their rates are added up"));
                told.push(name);
            }
        }
    }
}

impl Range {
    /// A warning when a value lies outside by more than a tenth. Two measurements of one parameter of one machine differ by some
    /// percent, and by up to a tenth where its clock was not fixed; without a tolerance every other machine like those of training
    /// would count as outside.
    fn excess(&self, name: &str, of: &str, value: Option<f64>) -> Option<String> {
        let value = value?;
        (value < self.min / 1.1 || value > self.max * 1.1)
            .then(|| format!("{name}{of} is {value:.4}, outside the {:.4} to {:.4} of training", self.min, self.max))
    }
}

impl MethodModel {
    /// A warning when an algorithm's GPUs are of a kind that the model has not seen.
    fn unseen_kinds(&self, id: &AlgorithmId, hardware: &Hardware, indices: &[u32]) -> Option<String> {
        let mut kinds = indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind);
        let unseen = kinds.find(|kind| !self.gpu_kinds.contains(kind))?;
        let seen: Vec<String> = self.gpu_kinds.iter().map(ToString::to_string).collect();
        Some(match &self.gpu_kinds[..] {
            [] => format!("{id}: the model does not say which kinds of GPU it was trained on"),
            [GpuKind::Software] => {
                format!("{id}: the model was trained on software adapters only, and on no real GPU")
            }
            _ => format!("{id}: the model was trained on {} GPUs only, this one is {unseen}", seen.join(" and ")),
        })
    }
}
