//! The parameters of a machine that its predicted costs depend on, and what it would be with another value of one.

use crate::data::{Profile, first_real_gpu};
use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::model::GPU_PREFIX;
use sapwise::{Hardware, Parameter};

/// A parameter that a term or a residual reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Figure {
    /// Its name, and that of what stands for it where it is missing.
    names: &'static [&'static str],
    /// Of the GPUs; else of the machine.
    of_gpus: bool,
}

const fn of_machine(names: &'static [&'static str]) -> Figure {
    Figure { names, of_gpus: false }
}

const fn of_gpus(names: &'static [&'static str]) -> Figure {
    Figure { names, of_gpus: true }
}

impl Figure {
    /// Every one that a prediction reads, and at the end of those of the machine one that none reads, the size of the memory:
    /// whatever is found of that is an error of the method. How several GPUs work together is not among them: few machines have
    /// several.
    pub(super) const ALL: [Self; 18] = [
        of_machine(&[ParameterId::ClockMeasuredGhz.as_str(), ParameterId::ClockReportedGhz.as_str()]),
        of_machine(&[ParameterId::SimdLanes.as_str()]),
        of_machine(&[ParameterId::CacheLlcBytes.as_str()]),
        of_machine(&[ParameterId::BandwidthOneThreadGbPerS.as_str()]),
        of_machine(&[ParameterId::BandwidthAllThreadsGbPerS.as_str()]),
        of_machine(&[ParameterId::ForkJoinColdNs.as_str()]),
        of_machine(&[ParameterId::CoreToCoreNs.as_str(), ParameterId::ForkJoinWarmNs.as_str()]),
        of_machine(&[ParameterId::ScalingTwoThreadsRatio.as_str()]),
        of_machine(&[ParameterId::ScalingAllThreadsRatio.as_str()]),
        of_machine(&[ParameterId::UsableCores.as_str()]),
        of_machine(&[ParameterId::MemoryBytes.as_str()]),
        of_gpus(&[GpuParameterId::RoundTripNs.as_str()]),
        of_gpus(&[GpuParameterId::ReadBackNs.as_str()]),
        of_gpus(&[GpuParameterId::DispatchNs.as_str()]),
        of_gpus(&[GpuParameterId::UploadRateGbPerS.as_str(), GpuParameterId::UploadGbPerS.as_str()]),
        of_gpus(&[GpuParameterId::DownloadRateGbPerS.as_str(), GpuParameterId::DownloadGbPerS.as_str()]),
        of_gpus(&[GpuParameterId::ReadGbPerS.as_str(), GpuParameterId::CopyGbPerS.as_str()]),
        of_gpus(&[GpuParameterId::ArithmeticGflopPerS.as_str()]),
    ];

    /// The name of the parameter, as it stands in the ranges of a model.
    pub(super) fn name(self) -> String {
        if self.of_gpus { format!("{GPU_PREFIX}{}", self.names[0]) } else { self.names[0].to_owned() }
    }

    /// Its value, above zero: of the machine, or of the first GPU that is no software adapter.
    pub(super) fn value(self, hardware: &Hardware) -> Option<f64> {
        let of = |name: &&str| match self.of_gpus {
            false => hardware.value_named(name),
            true => first_real_gpu(hardware)?.value_named(name),
        };
        self.names.iter().find_map(of).filter(|v| *v > 0.0)
    }

    /// The profile as if this had been found to be `value`, where it was found at all. All GPUs change alike, and so does what may stand for
    /// the parameter.
    pub(super) fn replaced(self, profile: &Profile, value: f64) -> Profile {
        let mut other = profile.clone();
        let Some(own) = self.value(&profile.hardware) else { return other };
        let change = |p: &mut Parameter| {
            if self.names.contains(&p.name.as_str()) {
                p.value = p.value.map(|v| v * value / own);
            }
        };
        match self.of_gpus {
            false => other.hardware.parameters.iter_mut().for_each(change),
            true => other.hardware.gpus.iter_mut().flat_map(|g| &mut g.parameters).for_each(change),
        }
        other
    }
}
