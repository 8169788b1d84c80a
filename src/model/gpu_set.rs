//! What GPUs that work on one frame together are worth.

use super::PredictError;
use super::needed::needed_of_gpu;
use crate::hardware::GpuParameterId;
use crate::{GpuGroup, GpuHardware, Hardware};

/// The GPUs of an algorithm, as the hardware describes them.
pub(super) struct GpuSet<'a> {
    gpus: Vec<&'a GpuHardware>,
    /// How they work together, where that was measured.
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
        let ratio = |id: GpuParameterId| self.ratio(id).is_none();
        self.gpus.len() > 1 && GpuParameterId::GROUP.into_iter().all(ratio)
    }

    /// The sum of some latencies in ns, of the slowest GPU; the others wait for it.
    ///
    /// # Errors
    /// Names the parameter that is missing.
    pub(super) fn latency(&self, ids: &[GpuParameterId]) -> Result<f64, PredictError> {
        let mut slowest = 0.0_f64;
        for gpu in &self.gpus {
            let mut sum = 0.0;
            for &id in ids {
                sum += needed_of_gpu(gpu, id)?;
            }
            slowest = slowest.max(sum);
        }
        Ok(slowest)
    }

    /// The rates of all GPUs together: their sum, but no more than the group was seen to gain over its fastest GPU. Of
    /// several names for the same rate the first that a GPU has is taken.
    ///
    /// # Errors
    /// Names the last parameter, when a GPU has none of them.
    pub(super) fn rate(&self, ids: &[GpuParameterId], ratio: GpuParameterId) -> Result<f64, PredictError> {
        let (mut sum, mut fastest) = (0.0, 0.0_f64);
        for gpu in &self.gpus {
            let found = ids.iter().find_map(|&id| needed_of_gpu(gpu, id).ok());
            // Of those that are missing the last one is told.
            let rate = found.map_or_else(|| ids.last().map_or(Ok(0.0), |&last| needed_of_gpu(gpu, last)), Ok)?;
            sum += rate;
            fastest = fastest.max(rate);
        }
        Ok(self.ratio(ratio).map_or(sum, |ratio| sum.min(fastest * ratio)))
    }

    /// A ratio of the group; `None` for one GPU, and where it was not measured.
    pub(super) fn ratio(&self, id: GpuParameterId) -> Option<f64> {
        let ratio = self.group.filter(|_| self.gpus.len() > 1)?.value(id)?;
        (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
    }
}
