//! GPUs that work on one frame together.

use super::PredictError;
use super::needed::needed_of_gpu;
use crate::hardware::GpuParameterId;
use crate::{GpuGroup, GpuHardware, Hardware};

/// The GPUs of an algorithm, as the hardware describes them.
pub(super) struct GpuSet<'a> {
    gpus: Vec<&'a GpuHardware>,
    /// How they work together, if measured.
    group: Option<&'a GpuGroup>,
}

impl<'a> GpuSet<'a> {
    /// # Errors
    /// Names the GPU that the hardware does not hold.
    pub(super) fn new(hardware: &'a Hardware, indices: &[u32]) -> Result<Self, PredictError> {
        let one = |&k: &u32| hardware.gpu(k).ok_or(PredictError::NoGpu { index: k });
        let gpus: Vec<&GpuHardware> = indices.iter().map(one).collect::<Result<_, _>>()?;
        Ok(Self { gpus, group: hardware.gpu_group(indices) })
    }

    /// Whether there are several and nobody measured how they work together.
    pub(super) fn is_unmeasured_group(&self) -> bool {
        self.gpus.len() > 1 && GpuParameterId::GROUP.into_iter().all(|id| self.ratio(id).is_none())
    }

    /// Returns the sum of some latencies of the slowest GPU, in ns; the others wait for it.
    ///
    /// # Errors
    /// Names the parameter that is missing.
    pub(super) fn latency(&self, ids: &[GpuParameterId]) -> Result<f64, PredictError> {
        let of_one = |gpu: &&GpuHardware| ids.iter().map(|&id| needed_of_gpu(gpu, id)).sum::<Result<f64, _>>();
        self.gpus.iter().map(of_one).try_fold(0.0, |slowest, sum| Ok(f64::max(slowest, sum?)))
    }

    /// Returns the rates of all GPUs together: their sum, but at most the fastest times the ratio of the group. Of
    /// several ids a GPU uses the first that it has.
    ///
    /// # Errors
    /// Names the last parameter if a GPU has none of them.
    pub(super) fn rate(&self, ids: [GpuParameterId; 2], ratio: GpuParameterId) -> Result<f64, PredictError> {
        let (mut sum, mut fastest) = (0.0, 0.0_f64);
        for gpu in &self.gpus {
            let rate = needed_of_gpu(gpu, ids[0]).or_else(|_| needed_of_gpu(gpu, ids[1]))?;
            sum += rate;
            fastest = fastest.max(rate);
        }
        Ok(self.ratio(ratio).map_or(sum, |ratio| sum.min(fastest * ratio)))
    }

    /// Returns a ratio of the group; `None` for one GPU and if it was not measured.
    pub(super) fn ratio(&self, id: GpuParameterId) -> Option<f64> {
        let ratio = self.group.filter(|_| self.gpus.len() > 1)?.value(id)?;
        (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
    }
}
