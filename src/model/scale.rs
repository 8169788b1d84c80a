//! What one unit of work takes on a machine.

use super::PredictError;
use super::gpu_set::GpuSet;
use super::needed::needed;
use crate::hardware::{GpuParameterId, Hardware, ParameterId};
use crate::named::named;
use crate::{Backend, BackendClass};

named! {
    /// Nanoseconds that one unit of work takes on one thread of a machine, or on some of its GPUs.
    ///
    /// Of several GPUs latencies are those of the slowest, because a frame is done when the last of them is. Rates are the sum of
    /// all, but no more than the rate of the fastest times the ratio that the group was measured to have; where it was not
    /// measured, the plain sum.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Scale("scale") {
        /// One cycle of one core: 1 / clock. Of a GPU what the CPU does for it.
        Cycle = "cycle",
        /// One lane of one cycle of one core: 1 / (clock * lanes).
        Lane = "lane",
        /// One byte at the memory bandwidth of one thread.
        Byte = "byte",
        /// One submission that is waited for, and reading back a few bytes of its result: `round_trip_ns` + `read_back_ns`, times
        /// `group_round_trip_ratio` of several GPUs.
        GpuRoundTrip = "gpu_round_trip",
        /// One dispatch that depends on the one before it, in the same submission: `dispatch_ns`.
        GpuDispatch = "gpu_dispatch",
        /// One byte from the CPU to the GPU: 1 / `upload_rate_gb_per_s`, the slope over sizes. Where that is missing
        /// 1 / `upload_gb_per_s`, which has the latency of 32 MiB in it. Several GPUs are limited by `group_upload_ratio`.
        GpuUploadByte = "gpu_upload_byte",
        /// One byte back: 1 / `download_rate_gb_per_s`, else 1 / `download_gb_per_s`. Several GPUs are limited by
        /// `group_upload_ratio`: both ways go over the same bus.
        GpuDownloadByte = "gpu_download_byte",
        /// One byte that a kernel moves in the GPU's memory: 1 / `read_gb_per_s`, where that is missing 1 / `copy_gb_per_s`, whose
        /// copy command is many times faster than any kernel on software adapters. Several GPUs are limited by
        /// `group_arithmetic_ratio`, which tells how far they work at the same time.
        GpuMemoryByte = "gpu_memory_byte",
        /// One 32-bit floating-point operation of all lanes at work: 1 / `arithmetic_gflop_per_s`. Several GPUs are limited by
        /// `group_arithmetic_ratio`.
        GpuOperation = "gpu_operation",
    }
}

impl Scale {
    /// Whether a method on that class of processor may have it.
    #[must_use]
    pub fn is_of(self, class: BackendClass) -> bool {
        match self {
            // The CPU works for a GPU too: it copies boxes and pairs.
            Self::Cycle => true,
            Self::Lane | Self::Byte => class == BackendClass::Cpu,
            _ => class == BackendClass::Gpu,
        }
    }

    /// The hardware parameters of the machine that [`nanoseconds`](Self::nanoseconds) looks at; none of a scale of GPUs, whose
    /// parameters are those of the GPU.
    #[must_use]
    pub fn parameters(self) -> &'static [ParameterId] {
        match self {
            Self::Cycle => &[ParameterId::ClockMeasuredGhz, ParameterId::ClockReportedGhz],
            Self::Lane => &[ParameterId::ClockMeasuredGhz, ParameterId::ClockReportedGhz, ParameterId::SimdLanes],
            Self::Byte => &[ParameterId::BandwidthOneThreadGbPerS],
            Self::GpuRoundTrip
            | Self::GpuDispatch
            | Self::GpuUploadByte
            | Self::GpuDownloadByte
            | Self::GpuMemoryByte
            | Self::GpuOperation => &[],
        }
    }

    /// Nanoseconds that one unit takes on a backend of a machine.
    ///
    /// # Errors
    /// Names the hardware parameter or the GPU that is missing, or says that the scale is not one of that processor.
    pub fn nanoseconds(self, hardware: &Hardware, backend: &Backend) -> Result<f64, PredictError> {
        match backend {
            _ if !self.is_of(backend.class()) => {
                Err(PredictError::NotOfProcessor { backend: backend.to_string(), what: format!("scale {self}") })
            }
            Backend::Cpu(_) => self.on_cpu(hardware),
            Backend::Gpu(gpus) => self.on_gpus(hardware, gpus),
        }
    }

    fn on_cpu(self, hardware: &Hardware) -> Result<f64, PredictError> {
        Ok(match self {
            Self::Lane => cycle(hardware)? / needed(hardware, ParameterId::SimdLanes)?,
            Self::Byte => 1.0 / needed(hardware, ParameterId::BandwidthOneThreadGbPerS)?,
            _ => cycle(hardware)?,
        })
    }

    fn on_gpus(self, hardware: &Hardware, indices: &[u32]) -> Result<f64, PredictError> {
        let set = GpuSet::new(hardware, indices)?;
        Ok(match self {
            Self::GpuRoundTrip => {
                let together = set.ratio(GpuParameterId::GroupRoundTripRatio).unwrap_or(1.0);
                set.latency(&[GpuParameterId::RoundTripNs, GpuParameterId::ReadBackNs])? * together
            }
            Self::GpuDispatch => set.latency(&[GpuParameterId::DispatchNs])?,
            Self::GpuUploadByte => {
                1.0 / set.rate(
                    &[GpuParameterId::UploadRateGbPerS, GpuParameterId::UploadGbPerS],
                    GpuParameterId::GroupUploadRatio,
                )?
            }
            Self::GpuDownloadByte => {
                1.0 / set.rate(
                    &[GpuParameterId::DownloadRateGbPerS, GpuParameterId::DownloadGbPerS],
                    GpuParameterId::GroupUploadRatio,
                )?
            }
            Self::GpuMemoryByte => {
                1.0 / set.rate(
                    &[GpuParameterId::ReadGbPerS, GpuParameterId::CopyGbPerS],
                    GpuParameterId::GroupArithmeticRatio,
                )?
            }
            Self::GpuOperation => {
                1.0 / set.rate(&[GpuParameterId::ArithmeticGflopPerS], GpuParameterId::GroupArithmeticRatio)?
            }
            _ => cycle(hardware)?,
        })
    }
}

/// One cycle in ns, of the measured clock where there is one.
pub(super) fn cycle(hardware: &Hardware) -> Result<f64, PredictError> {
    let measured = needed(hardware, ParameterId::ClockMeasuredGhz);
    measured.or_else(|e| needed(hardware, ParameterId::ClockReportedGhz).map_err(|_| e)).map(|ghz| 1.0 / ghz)
}
