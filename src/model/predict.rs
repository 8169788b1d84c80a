//! Cost curves of a machine from its hardware parameters.

use super::gpu_set::GpuSet;
use super::scale::need;
use super::{GPU_PREFIX, MethodModel, Model, ModelTerm, Range};
use crate::hardware::{GpuKind, Hardware, parameter};
use crate::{AlgorithmCost, AlgorithmId, Backend, BackendClass, CostCurve, CostTerm, Knot, Load};

/// Cost curves for one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// One curve for each algorithm that could be predicted.
    pub costs: Vec<AlgorithmCost>,
    /// Whether the machine or an algorithm lies outside what the model was trained on.
    pub extrapolated: bool,
    /// What was outside, what was missing, what was left out.
    pub warnings: Vec<String>,
}

/// Objects at which the correction of a predicted curve is tabulated: 2^3 to 2^24, every octave.
const CORRECTION_OCTAVES: std::ops::RangeInclusive<u32> = 3..=24;

impl Model {
    /// Predicts the cost curves of `algorithms`, given with the revisions that will run, on a machine.
    ///
    /// What can't be predicted is left out with a warning: a method that the model has not seen on that processor, another
    /// revision, a GPU that the hardware does not hold, a parameter that is missing.
    ///
    /// # Errors
    /// A sentence, when no algorithm can be predicted.
    pub fn predict(&self, hardware: &Hardware, algorithms: &[(AlgorithmId, u32)]) -> Result<Prediction, String> {
        let mut p = Prediction { costs: Vec::new(), extrapolated: false, warnings: Vec::new() };
        if self.is_simulated() {
            p.warnings.push(format!(
                "the model {} was trained on simulated machines: what it predicts is no evidence; train on real reports",
                self.name
            ));
        }
        p.outside(self.ranges.iter().filter_map(|r| r.excess(&r.parameter, "", hardware.value(&r.parameter))));
        if self.ranges.is_empty() {
            p.outside([format!("the model {} does not say what it was trained on", self.name)]);
        }
        let mut unknown: Vec<String> = Vec::new();
        let mut gpus: Vec<u32> = Vec::new();
        for (id, revision) in algorithms {
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
            let sound = |curve: CostCurve| curve.defect().map_or(Ok(curve), Err);
            let curve = match method.curve(hardware, backend).and_then(sound) {
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
            p.outside(self.ranges.iter().filter_map(|r| {
                let name = r.parameter.strip_prefix(GPU_PREFIX)?;
                r.excess(name, &of, gpu.value(name))
            }));
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
            return Err(format!("the model {} predicts none of these algorithms: {}", self.name, p.warnings.join("; ")));
        }
        Ok(p)
    }

    /// The cost model of an algorithm's method on its class of processor.
    #[must_use]
    pub fn method(&self, id: &AlgorithmId) -> Option<&MethodModel> {
        self.methods.iter().find(|m| m.method == id.method() && m.backend == id.backend().class())
    }
}

impl Prediction {
    /// Each of these warnings makes the prediction an extrapolation.
    fn outside(&mut self, warnings: impl IntoIterator<Item = String>) {
        let before = self.warnings.len();
        self.warnings.extend(warnings);
        self.extrapolated |= self.warnings.len() > before;
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
    /// A warning when a value lies outside by more than a tenth.
    fn excess(&self, name: &str, of: &str, value: Option<f64>) -> Option<String> {
        let value = value?;
        (value < self.min / 1.1 || value > self.max * 1.1)
            .then(|| format!("{name}{of} is {value:.4}, outside the {:.4} to {:.4} of training", self.min, self.max))
    }
}

/// The terms with what a unit of each takes, those of the same count together.
fn in_nanoseconds(terms: &[ModelTerm], hardware: &Hardware, backend: &Backend) -> Result<Vec<CostTerm>, String> {
    let mut sum: Vec<CostTerm> = Vec::new();
    for t in terms.iter().filter(|t| t.unit > 0.0) {
        let unit_ns = t.unit * t.scale.nanoseconds(hardware, backend)?;
        match sum.iter_mut().find(|c| c.term == t.term) {
            Some(same) => same.unit_ns += unit_ns,
            None => sum.push(CostTerm { term: t.term, unit_ns }),
        }
    }
    Ok(sum)
}

impl MethodModel {
    /// The cost curve of this method on a backend of a machine.
    ///
    /// # Errors
    /// Names the hardware parameter or the GPU that is missing.
    pub fn curve(&self, hardware: &Hardware, backend: &Backend) -> Result<CostCurve, String> {
        let [terms, otherwise] = [&self.terms, &self.otherwise].map(|terms| in_nanoseconds(terms, hardware, backend));
        let (terms, otherwise) = (terms?, otherwise?);
        let mut correction = Vec::new();
        if !self.residual.is_empty() || self.residual_intercept != 0.0 {
            for octave in CORRECTION_OCTAVES {
                let objects = (1 << octave).min(self.max_objects).max(self.min_objects);
                let load = Load { objects, ..Load::default() };
                let ln_factor = self.ln_residual(hardware, backend, &load)?;
                correction.push(Knot { log2_objects: f64::from(octave), ln_factor });
            }
        }
        let cache_bytes = match self.backend {
            BackendClass::Cpu => need(hardware, parameter::CACHE_LLC_BYTES)?,
            // No term of a GPU depends on the caches of the CPU.
            BackendClass::Gpu => 0.0,
        };
        Ok(CostCurve { terms, otherwise, cache_bytes, correction })
    }

    fn ln_residual(&self, hardware: &Hardware, backend: &Backend, load: &Load) -> Result<f64, String> {
        let mut sum = self.residual_intercept;
        for r in &self.residual {
            sum += r.slope * (r.feature.value(hardware, backend, load)? - r.centre);
        }
        Ok(sum)
    }

    /// A warning when an algorithm's GPUs are of a kind that the model has not seen.
    fn unseen_kinds(&self, id: &AlgorithmId, hardware: &Hardware, indices: &[u32]) -> Option<String> {
        let mut kinds = indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind);
        let unseen = kinds.find(|kind| !self.gpu_kinds.contains(kind))?;
        let seen: Vec<String> = self.gpu_kinds.iter().map(ToString::to_string).collect();
        Some(match &self.gpu_kinds[..] {
            [] => format!("{id}: the model does not say which kinds of GPU it was trained on"),
            [GpuKind::Software] => {
                format!("{id}: the model was trained on programs that act as GPUs only, and on no real GPU")
            }
            _ => format!("{id}: the model was trained on {} GPUs only, this one is {unseen}", seen.join(" and ")),
        })
    }
}
