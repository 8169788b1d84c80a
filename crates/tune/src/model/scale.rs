//! The time of one unit of work on a machine.

use super::PredictError;
use super::gpu_set::GpuSet;
use super::needed::needed;
use crate::hardware::{GpuParameterId, Hardware, ParameterId};
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::named;

named! {
    /// Nanoseconds of one unit of work on one thread of a machine or on some of its GPUs.
    ///
    /// Latencies of several GPUs are those of the slowest, because a frame ends with the last of them. Rates are the
    /// sum of all, but at most the rate of the fastest times the measured ratio of the group; without one, the plain
    /// sum.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Scale("scale") {
        /// One cycle of one core: 1 / clock. For a GPU, the work of the CPU.
        Cycle = "cycle",
        /// One lane of one cycle of one core: 1 / (clock * lanes).
        Lane = "lane",
        /// One byte at the memory bandwidth of one thread.
        Byte = "byte",
        /// One submission and the wait for it, and reading a few bytes of its result: `round_trip_ns` +
        /// `read_back_ns`, times `group_round_trip_ratio` for several GPUs.
        GpuRoundTrip = "gpu_round_trip",
        /// One dispatch that depends on the previous one in the same submission: `dispatch_ns`.
        GpuDispatch = "gpu_dispatch",
        /// One byte from the CPU to the GPU: 1 / `upload_rate_gb_per_s`, the slope over sizes. If that is missing,
        /// 1 / `upload_gb_per_s`, which includes the latency of 32 MiB. `group_upload_ratio` limits several GPUs.
        GpuUploadByte = "gpu_upload_byte",
        /// One byte back: 1 / `download_rate_gb_per_s`, else 1 / `download_gb_per_s`. `group_upload_ratio` limits
        /// several GPUs: both directions share the bus.
        GpuDownloadByte = "gpu_download_byte",
        /// One byte that a kernel moves in the GPU's memory: 1 / `read_gb_per_s`. If that is missing, 1 /
        /// `copy_gb_per_s`, although the copy command of software adapters is many times faster than any kernel.
        /// `group_arithmetic_ratio` limits several GPUs.
        GpuMemoryByte = "gpu_memory_byte",
        /// One 32-bit floating-point operation with all lanes at work: 1 / `arithmetic_gflop_per_s`.
        /// `group_arithmetic_ratio` limits several GPUs.
        GpuOperation = "gpu_operation",
    }
}

impl Scale {
    /// Returns whether a method on that class of processor may have it.
    pub fn is_of(self, class: BackendClass) -> bool {
        match self {
            // The CPU works for a GPU too: it copies boxes and pairs.
            Self::Cycle => true,
            Self::Lane | Self::Byte => class == BackendClass::Cpu,
            _ => class == BackendClass::Gpu,
        }
    }

    /// Returns the hardware parameters of the machine that [`nanoseconds`](Self::nanoseconds) reads; none for a scale
    /// of GPUs.
    pub fn parameters(self) -> &'static [ParameterId] {
        match self {
            Self::Cycle => &[ParameterId::ClockMeasuredGhz, ParameterId::ClockReportedGhz],
            Self::Lane => &[ParameterId::ClockMeasuredGhz, ParameterId::ClockReportedGhz, ParameterId::SimdLanes],
            Self::Byte => &[ParameterId::BandwidthOneThreadGbPerS],
            _ => &[],
        }
    }

    /// Returns the nanoseconds of one unit on a backend of a machine.
    ///
    /// # Errors
    /// Names the missing hardware parameter or GPU, or the scale if it is of another processor.
    pub fn nanoseconds(self, hardware: &Hardware, backend: &Backend) -> Result<f64, PredictError> {
        use GpuParameterId as G;
        if !self.is_of(backend.class()) {
            return Err(PredictError::NotOfProcessor { backend: backend.to_string(), what: format!("scale {self}") });
        }
        let gpus: &[u32] = if let Backend::Gpu(gpus) = backend { gpus } else { &[] };
        let set = GpuSet::new(hardware, gpus)?;
        let byte = |ids, ratio| set.rate(ids, ratio).map(|rate| 1.0 / rate);
        match self {
            Self::Cycle => cycle(hardware),
            Self::Lane => Ok(cycle(hardware)? / needed(hardware, ParameterId::SimdLanes)?),
            Self::Byte => Ok(1.0 / needed(hardware, ParameterId::BandwidthOneThreadGbPerS)?),
            Self::GpuRoundTrip => {
                let together = set.ratio(G::GroupRoundTripRatio).unwrap_or(1.0);
                Ok(set.latency(&[G::RoundTripNs, G::ReadBackNs])? * together)
            }
            Self::GpuDispatch => set.latency(&[G::DispatchNs]),
            Self::GpuUploadByte => byte([G::UploadRateGbPerS, G::UploadGbPerS], G::GroupUploadRatio),
            Self::GpuDownloadByte => byte([G::DownloadRateGbPerS, G::DownloadGbPerS], G::GroupUploadRatio),
            Self::GpuMemoryByte => byte([G::ReadGbPerS, G::CopyGbPerS], G::GroupArithmeticRatio),
            Self::GpuOperation => byte([G::ArithmeticGflopPerS; 2], G::GroupArithmeticRatio),
        }
    }
}

/// Returns one cycle in ns, by the measured clock, else by the reported one.
pub(super) fn cycle(hardware: &Hardware) -> Result<f64, PredictError> {
    let measured = needed(hardware, ParameterId::ClockMeasuredGhz);
    measured.or_else(|e| needed(hardware, ParameterId::ClockReportedGhz).map_err(|_| e)).map(|ghz| 1.0 / ghz)
}
