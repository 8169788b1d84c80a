//! Cost curves of a machine from its hardware parameters.

use super::curve::Figures;
use super::gpu_set::GpuSet;
use super::interval::Doubt;
use super::{GPU_PREFIX, MethodModel, Model, Place, Range};
use crate::hardware::{GpuKind, Hardware};
use crate::{AlgorithmCost, AlgorithmId, Backend, BackendClass, GpuHardware};

/// Cost curves for one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// One curve for each algorithm that could be predicted.
    pub costs: Vec<AlgorithmCost>,
    /// Whether the machine or an algorithm lies outside what the model was trained on.
    pub extrapolated: bool,
    /// What was outside, what was missing, what was left out.
    pub warnings: Vec<String>,
    /// How sure it is, for [`Prediction::tuning`].
    pub(super) doubt: Doubt,
}

/// What to do where a machine is unlike those of training.
pub const ASK: &str = "this machine is unlike those of training: measure a few timings with `sapwise predict --samples 8`, or all with \
                   `sapwise probe`";

impl Model {
    /// Predicts the cost curves of `algorithms`, given with the revisions that will run, on a machine.
    ///
    /// What can't be predicted is left out with a warning: a method that the model has not seen on that processor, another
    /// revision, a GPU that the hardware does not hold, a parameter that is missing or that no GPU has.
    ///
    /// A machine is extrapolated when a parameter lies outside its [range](Range), or all together farther from the
    /// [cloud](super::Cloud) of the training than any machine of it. The errors of training are then taken larger by the ratio of
    /// the two distances. A model of fewer machines than parameters and two has no cloud, and only the ranges tell.
    ///
    /// # Errors
    /// A sentence, when no algorithm can be predicted, or a parameter of the machine has a value that no machine has.
    pub fn predict(&self, hardware: &Hardware, algorithms: &[(AlgorithmId, u32)]) -> Result<Prediction, String> {
        if let Some(why) = hardware.implausible() {
            return Err(why);
        }
        let mut p = Prediction {
            costs: Vec::new(),
            extrapolated: false,
            warnings: Vec::new(),
            doubt: Doubt::new(self, self.untested(algorithms)),
        };
        if self.is_simulated() {
            p.warnings.push(format!(
                "the model {} was trained on simulated machines: what it predicts is no evidence; train on real reports",
                self.name
            ));
        }
        let mut unlike =
            p.outside(self.ranges.iter().filter_map(|r| r.excess(&r.parameter, "", hardware.value(&r.parameter))));
        let place = self.cloud(BackendClass::Cpu).map(|cloud| cloud.place(|name| hardware.value(name)));
        unlike |= p.outside(place.as_ref().and_then(|place| place.warning("")));
        let wider_on_cpu = place.map_or(1.0, |place| place.ratio.max(1.0));
        if self.ranges.is_empty() {
            p.outside([format!("the model {} does not say what it was trained on", self.name)]);
        }
        let places: Vec<(u32, Place<'_>)> = self
            .cloud(BackendClass::Gpu)
            .map(|cloud| hardware.gpus.iter().map(|g| (g.gpu.index, cloud.place(|name| g.value(name)))).collect())
            .unwrap_or_default();
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
            let mut wider = wider_on_cpu;
            if let Backend::Gpu(indices) = backend {
                p.outside(method.unseen_kinds(id, hardware, indices));
                gpus.extend(indices);
                // The CPU works for a GPU too.
                wider =
                    places.iter().filter(|(k, _)| indices.contains(k)).map(|(_, place)| place.ratio).fold(wider, f64::max);
            }
            p.doubt.add(id, &self.folds, &mut figures, wider);
            let spread_ln = method.spread_ln;
            p.costs.push(AlgorithmCost { algorithm: id.clone(), revision: *revision, curve, spread_ln });
        }
        gpus.sort_unstable();
        gpus.dedup();
        for gpu in gpus.into_iter().filter_map(|k| hardware.gpu(k)) {
            let of = format!(" of gpu{}", gpu.gpu.index);
            unlike |= p.outside(self.ranges.iter().filter_map(|r| {
                let name = r.parameter.strip_prefix(GPU_PREFIX)?;
                r.excess(name, &of, gpu.value(name))
            }));
            let place = places.iter().find(|(k, _)| *k == gpu.gpu.index);
            unlike |= p.outside(place.and_then(|(_, place)| place.warning(&of)));
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
            return Err(format!("the model {} predicts none of these algorithms: {}", self.name, p.warnings.join("; ")));
        }
        Ok(p)
    }

    /// The cost model of an algorithm's method on its class of processor.
    #[must_use]
    pub fn method(&self, id: &AlgorithmId) -> Option<&MethodModel> {
        self.methods.iter().find(|m| m.method == id.method() && m.backend == id.backend().class())
    }

    fn cloud(&self, processor: BackendClass) -> Option<&super::Cloud> {
        self.clouds.iter().find(|c| c.processor == processor)
    }

    /// Which of the processors in use can't be compared with those of training in all parameters together, if any.
    fn untested(&self, algorithms: &[(AlgorithmId, u32)]) -> Option<String> {
        let lacks = |class| algorithms.iter().any(|a| a.0.backend().class() == class) && self.cloud(class).is_none();
        let what = match (lacks(BackendClass::Cpu), lacks(BackendClass::Gpu)) {
            (true, true) => "machine and its GPUs are like those of training is told by each parameter",
            (true, false) => "machine is like those of training is told by each parameter",
            (false, true) => "machine's GPUs are like those of training is told by each parameter",
            (false, false) => return None,
        };
        Some(format!("whether this {what} alone and not by all together, for which the training holds too few"))
    }
}

/// # Errors
/// The parameter of one of the GPUs that no GPU has.
fn gpus_that_are(hardware: &Hardware, backend: &Backend) -> Result<(), String> {
    let Backend::Gpu(indices) = backend else { return Ok(()) };
    indices.iter().filter_map(|&k| hardware.gpu(k)).find_map(GpuHardware::implausible).map_or(Ok(()), Err)
}

impl Place<'_> {
    /// A warning when all parameters together lie farther from those of training than any machine of it.
    fn warning(&self, of: &str) -> Option<String> {
        (self.ratio > 1.0).then(|| {
            format!(
                "all parameters{of} together lie {:.1} times as far from those of training as any machine of it did, most by {}",
                self.ratio,
                self.most.join(" and ")
            )
        })
    }
}

impl Prediction {
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
                format!("{id}: the model was trained on programs that act as GPUs only, and on no real GPU")
            }
            _ => format!("{id}: the model was trained on {} GPUs only, this one is {unseen}", seen.join(" and ")),
        })
    }
}
