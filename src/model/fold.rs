//! What a model is without some of its machines, and how far off it is on them.

use super::{Feature, Formula, ModelTerm, ResidualTerm, Scale};
use crate::{AlgorithmId, BackendClass, Term};

/// Shares of a distribution at which held-out errors are kept, ascending. The errors between two of them count as large as those
/// at the upper one, so that what is kept is never less than what was seen.
pub const QUANTILES: [f64; 8] = [0.25, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0];

/// Absolute errors of natural logarithms at [`QUANTILES`].
pub type LnErrors = [f64; QUANTILES.len()];

/// The fit without some physical machines, and its errors on them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Fold {
    /// Physical machines that were left out of the fit.
    pub machines: u32,
    /// The cost models that were fitted to the other machines.
    pub methods: Vec<FoldMethod>,
    /// Their errors on the machines that were left out.
    pub errors: Vec<RoleErrors>,
}

/// A [`MethodModel`](super::MethodModel) of a fold: only what its curve is made of, each figure to six digits.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FoldMethod {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// The processor that it holds for.
    pub backend: BackendClass,
    /// Fewest and most objects that were timed.
    pub objects: (u32, u32),
    /// What is counted, what of the hardware one count costs, and how much of that.
    pub terms: Vec<(Term, Scale, f64)>,
    /// The same of the other way, where there is one: [`CostCurve::otherwise`](crate::CostCurve::otherwise).
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub otherwise: Vec<(Term, Scale, f64)>,
    /// Constant of the residual.
    pub intercept: f64,
    /// Slopes of the residual on features that nothing was taken off: the intercept has it.
    pub slopes: Vec<(Feature, f64)>,
}

/// What algorithms of different machines have in common: the method, the class of processor, and whether one thread or GPU works
/// or several do.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Role {
    /// The part of the algorithm's id before the `@`.
    pub method: String,
    /// The class of processor.
    pub backend: BackendClass,
    /// Several threads or GPUs.
    pub several: bool,
}

/// The errors of one role on the machines that were left out, each machine weighing the same.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RoleErrors {
    /// The role.
    pub role: Role,
    /// How many of the machines timed it.
    pub machines: u32,
    /// Of the logarithm of measured over predicted time.
    pub ln_errors: LnErrors,
    /// For roles that were timed on the same frames, itself or one further down in the list: its position there, how many of the
    /// machines timed both, and the errors of the logarithm of the ratio of their times. Two algorithms are wrong on one machine
    /// together, so that this is less than the errors of both, and where they cross depends on it alone.
    pub against: Vec<(u32, u32, LnErrors)>,
}

impl Role {
    /// The role of an algorithm.
    #[must_use]
    pub fn of(id: &AlgorithmId) -> Self {
        let backend = id.backend();
        Self { method: id.method().to_owned(), backend: backend.class(), several: backend.width() > 1 }
    }

    /// Whether an algorithm has this role.
    #[must_use]
    pub fn is_of(&self, id: &AlgorithmId) -> bool {
        let backend = id.backend();
        self.method == id.method() && self.backend == backend.class() && self.several == (backend.width() > 1)
    }
}

impl FoldMethod {
    pub(super) fn formula(&self) -> Formula<impl Iterator<Item = ModelTerm>, impl Iterator<Item = ResidualTerm>> {
        let term = |&(term, scale, unit): &(Term, Scale, f64)| ModelTerm { term, scale, unit };
        Formula {
            class: self.backend,
            terms: self.terms.iter().map(term),
            otherwise: self.otherwise.iter().map(term),
            intercept: self.intercept,
            residual: self.slopes.iter().map(|&(feature, slope)| ResidualTerm { feature, centre: 0.0, slope }),
            objects: self.objects,
        }
    }
}

impl Fold {
    /// What makes this fold unusable, if anything.
    pub(super) fn defect(&self) -> Option<String> {
        for m in &self.methods {
            let sound = m.terms.iter().chain(&m.otherwise).all(|t| t.2.is_finite() && t.2 >= 0.0 && t.1.is_of(m.backend))
                && m.slopes.iter().all(|s| s.1.is_finite() && s.0.is_of(m.backend))
                && m.intercept.is_finite();
            if !sound {
                return Some(format!("a fold: {} on the {} has a term or slope that can't be", m.method, m.backend));
            }
        }
        for (k, e) in self.errors.iter().enumerate() {
            let ascend = |q: &LnErrors| q[0] >= 0.0 && q.is_sorted() && q[QUANTILES.len() - 1].is_finite();
            let further = |&(other, machines, ref q): &(u32, u32, LnErrors)| {
                (k..self.errors.len()).contains(&(other as usize)) && machines <= e.machines && ascend(q)
            };
            if !ascend(&e.ln_errors) || e.machines > self.machines || !e.against.iter().all(further) {
                return Some(format!("a fold: errors of {} on the {} that can't be", e.role.method, e.role.backend));
            }
        }
        None
    }

    /// The method of an algorithm, where this fold has it.
    pub(super) fn method(&self, id: &AlgorithmId) -> Option<&FoldMethod> {
        self.methods.iter().find(|m| m.method == id.method() && m.backend == id.backend().class())
    }

    /// The errors of an algorithm's role, and how many machines they are of.
    pub(super) fn errors_of(&self, id: &AlgorithmId) -> Option<(u32, &LnErrors)> {
        self.errors.iter().find(|e| e.role.is_of(id)).map(|e| (e.machines, &e.ln_errors))
    }

    /// The errors of the ratio of two algorithms, and how many machines they are of.
    pub(super) fn errors_between(&self, a: &AlgorithmId, b: &AlgorithmId) -> Option<(u32, &LnErrors)> {
        let of = |id| self.errors.iter().position(|e| e.role.is_of(id));
        let (a, b) = (of(a)?, of(b)?);
        let other = a.max(b) as u32;
        self.errors[a.min(b)].against.iter().find(|t| t.0 == other).map(|(_, machines, q)| (*machines, q))
    }
}
