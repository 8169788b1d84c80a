//! The cost of a method on a machine.

use super::needed::needed;
use super::{MethodModel, PredictError};
use crate::cost::{Places, Residual};
use crate::hardware::{Hardware, ParameterId};
use crate::{Backend, BackendClass, CostCurve, CostTerm, Fallback, Work};
use std::sync::Arc;

impl MethodModel {
    /// What this method takes on one thread of a machine, or on the GPUs of `backend`. `places` are those of its model, `fallback` what it
    /// falls back to there.
    ///
    /// # Errors
    /// Names the hardware parameter or the GPU that is missing, or what is wrong with the cost.
    pub fn work(
        &self,
        hardware: &Hardware,
        backend: &Backend,
        places: &Arc<Places>,
        fallback: Option<Fallback>,
    ) -> Result<Work, PredictError> {
        // Those of the same count together.
        let mut terms: Vec<CostTerm> = Vec::new();
        for t in self.terms.iter().filter(|t| t.unit > 0.0) {
            let unit_ns = t.unit * t.scale.nanoseconds(hardware, backend)?;
            match terms.iter_mut().find(|c| c.term == t.term) {
                Some(same) => same.unit_ns += unit_ns,
                None => terms.push(CostTerm { term: t.term, unit_ns }),
            }
        }
        let residual = (!self.residual.is_empty())
            .then(|| Residual::new(Arc::clone(places), self.residual.clone(), self.residual_by_motion));
        let work = Work {
            terms,
            fallback,
            cache_bytes: match self.backend {
                BackendClass::Cpu => needed(hardware, ParameterId::CacheLlcBytes)?,
                // No term of a GPU depends on the caches of the CPU.
                BackendClass::Gpu => 0.0,
            },
            residual,
        };
        work.defect().map_or(Ok(work), |e| Err(PredictError::Curve(e)))
    }

    /// The cost curve of this method on a backend of a machine where its work takes so long.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing, or what is wrong with the curve.
    pub fn curve(&self, work: Arc<Work>, hardware: &Hardware, backend: &Backend) -> Result<CostCurve, PredictError> {
        let mut curve = CostCurve::of(work);
        if let Backend::Cpu(threads) = backend {
            curve.helpers = self.helpers.unwrap_or(UNSEEN).on(hardware, *threads)?;
        }
        curve.defect().map_or(Ok(curve), |e| Err(PredictError::Curve(e)))
    }
}

/// Helpers of a method that was never timed on several threads: one cold fork and join, and all that threads add.
const UNSEEN: super::HelpersModel = super::HelpersModel::new(0.0, 1.0, 0.0, 0);
