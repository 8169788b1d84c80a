//! The cost of a method on a machine.

use super::needed::needed;
use super::{GroupResidual, MethodModel, PredictError};
use crate::hardware::{Hardware, ParameterId};
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::internals::{Fallback, Places, Residual, Work};
use sapwise::tuning::{CostCurve, CostTerm};
use std::sync::Arc;

impl MethodModel {
    /// Returns the cost of this method on one thread of a machine or on the GPUs of `backend`, with the places of its
    /// model and its fallback there.
    ///
    /// # Errors
    /// Names the missing hardware parameter or GPU, or what is wrong with the cost.
    pub fn work(
        &self,
        hardware: &Hardware,
        backend: &Backend,
        places: &Arc<Places>,
        fallback: Option<Fallback>,
    ) -> Result<Work, PredictError> {
        // Terms of the same count are added.
        let mut terms: Vec<CostTerm> = Vec::new();
        for t in self.terms.iter().filter(|t| t.unit > 0.0) {
            let unit_ns = t.unit * t.scale.nanoseconds(hardware, backend)?;
            match terms.iter_mut().find(|c| c.term == t.term) {
                Some(same) => same.unit_ns += unit_ns,
                None => terms.push(CostTerm::new(t.term, unit_ns)),
            }
        }
        let at = match self.backend {
            BackendClass::Cpu if !self.residual.is_empty() => GroupResidual::of_one_thread(hardware)?,
            _ => Vec::new(),
        };
        let weights = GroupResidual::weights_at(&self.residual, &at);
        let residual = Residual::new(Arc::clone(places), weights, self.residual_by_motion);
        let work = Work {
            terms,
            fallback,
            cache_bytes: match self.backend {
                BackendClass::Cpu => needed(hardware, ParameterId::CacheLlcBytes)?,
                // No term of a GPU depends on the caches of the CPU.
                BackendClass::Gpu => 0.0,
            },
            residual: Some(residual).filter(|r| !r.weights.is_empty()),
        };
        work.defect().map_or(Ok(work), |e| Err(PredictError::Curve(e)))
    }

    /// Returns the cost curve of this method on a backend of a machine, with its cost on one thread or on GPUs.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing, or what is wrong with the curve.
    pub fn curve(&self, work: Arc<Work>, hardware: &Hardware, backend: &Backend) -> Result<CostCurve, PredictError> {
        let mut curve = CostCurve::of(work);
        if let Backend::Cpu(threads @ 2..) = *backend {
            curve.helpers = self.helpers.unwrap_or(UNSEEN).on(hardware, threads)?;
        }
        curve.defect().map_or(Ok(curve), |e| Err(PredictError::Curve(e)))
    }
}

/// Helpers of a method that was never timed on several threads: one cold fork and join, and the full scaling.
const UNSEEN: super::HelpersModel = super::HelpersModel::new(0.0, 1.0, 0.0, 0);
