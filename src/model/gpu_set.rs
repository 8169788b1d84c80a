//! What GPUs that work on one frame together are worth.

use crate::hardware::gpu::parameter;
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
    pub(super) fn new(hardware: &'a Hardware, indices: &[u32]) -> Result<Self, String> {
        let one = |&k: &u32| {
            hardware.gpu(k).ok_or_else(|| format!("the hardware holds no gpu{k}; see `sapwise devices`, then measure again"))
        };
        let gpus: Vec<&GpuHardware> = indices.iter().map(one).collect::<Result<_, _>>()?;
        Ok(Self { gpus, group: hardware.gpu_group(indices) })
    }

    /// Whether there are several and nobody measured how they work together.
    pub(super) fn is_unmeasured_group(&self) -> bool {
        let ratio = |name: &&str| self.ratio(name).is_none();
        self.gpus.len() > 1 && parameter::GROUP.iter().all(ratio)
    }

    /// The sum of some latencies in ns, of the slowest GPU; the others wait for it.
    ///
    /// # Errors
    /// Names the parameter that is missing.
    pub(super) fn latency(&self, names: &[&str]) -> Result<f64, String> {
        let mut slowest = 0.0_f64;
        for gpu in &self.gpus {
            let mut sum = 0.0;
            for name in names {
                sum += need(gpu, name)?;
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
    pub(super) fn rate(&self, names: &[&str], ratio: &str) -> Result<f64, String> {
        let (mut sum, mut fastest) = (0.0, 0.0_f64);
        for gpu in &self.gpus {
            let found = names.iter().find_map(|name| need(gpu, name).ok());
            // Of those that are missing the last one is told.
            let rate = found.map_or_else(|| names.last().map_or(Ok(0.0), |last| need(gpu, last)), Ok)?;
            sum += rate;
            fastest = fastest.max(rate);
        }
        Ok(self.ratio(ratio).map_or(sum, |ratio| sum.min(fastest * ratio)))
    }

    /// A ratio of the group; `None` for one GPU, and where it was not measured.
    pub(super) fn ratio(&self, name: &str) -> Option<f64> {
        let ratio = self.group.filter(|_| self.gpus.len() > 1)?.value(name)?;
        (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
    }
}

/// A parameter that must be there and above zero.
fn need(gpu: &GpuHardware, name: &str) -> Result<f64, String> {
    let k = gpu.gpu.index;
    match gpu.parameters.iter().find(|p| p.name == name) {
        Some(p) => match p.value {
            Some(value) if value > 0.0 && value.is_finite() => Ok(value),
            Some(value) => Err(format!("the parameter {name} of gpu{k} is {value}")),
            None => Err(format!("the parameter {name} of gpu{k} is missing: {}", p.source)),
        },
        None => Err(format!("the parameter {name} of gpu{k} is missing; measure it with `sapwise probe --hardware-only`")),
    }
}
