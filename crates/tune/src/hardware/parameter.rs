//! The table of hardware parameters. A new parameter is one entry here and its probe in `measure`.

use super::unit::unit;
use sapwise::named;

/// What is known about a parameter beside its name.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Quantity {
    /// Unit of its values, as the name ends.
    pub unit: &'static str,
    /// Lowest and highest plausible value; `None` if any value is taken.
    pub bounds: Option<Bounds>,
    /// Whether a cost model may read it.
    pub read_by_model: bool,
}

/// Lowest and highest plausible value. The bounds are wide: they find wrong units, while the ranges of a model find
/// unusual machines.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Bounds {
    /// Lowest value.
    pub least: f64,
    /// Highest value.
    pub most: f64,
}

const ANY: Option<Bounds> = None;

const fn within(least: f64, most: f64) -> Option<Bounds> {
    Some(Bounds { least, most })
}

/// Defines the keys of a table: name, bounds, and whether a model reads it.
macro_rules! parameters {
    ($(#[$meta:meta])* $name:ident($kind:literal) {
        $($(#[$doc:meta])* $variant:ident = $text:literal, $bounds:expr, $read:literal;)+
    }) => {
        named! {
            $(#[$meta])*
            #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
            #[non_exhaustive]
            pub enum $name($kind) {
                $($(#[$doc])* $variant = $text,)+
            }
        }

        impl $name {
            /// Returns what is known about the parameter.
            pub fn quantity(self) -> Quantity {
                let (bounds, read_by_model) = match self {
                    $(Self::$variant => ($bounds, $read),)+
                };
                Quantity { unit: unit(self.as_str()), bounds, read_by_model }
            }
        }

        impl AsRef<str> for $name {
            fn as_ref(&self) -> &str {
                self.as_str()
            }
        }

        impl PartialEq<$name> for String {
            fn eq(&self, other: &$name) -> bool {
                self == other.as_str()
            }
        }

        impl PartialEq<$name> for &str {
            fn eq(&self, other: &$name) -> bool {
                *self == other.as_str()
            }
        }
    };
}

parameters! {
    /// A parameter of a machine without its GPUs.
    ParameterId("hardware parameter") {
        /// Threads that may run at once under the process's affinity and cgroup quota.
        UsableCores = "usable_cores", within(1.0, 4096.0), true;
        /// Physical cores of the machine, without hyper-threads.
        PhysicalCores = "physical_cores", ANY, false;
        /// Clock that the system reports.
        ClockReportedGhz = "clock_reported_ghz", within(0.05, 20.0), true;
        /// Clock under load, from a chain of dependent additions.
        ClockMeasuredGhz = "clock_measured_ghz", within(0.05, 20.0), true;
        /// 32-bit floats in one vector of the SIMD level in use.
        SimdLanes = "simd_lanes", within(1.0, 64.0), true;
        /// First-level data cache of one core.
        CacheL1dBytes = "cache_l1d_bytes", ANY, false;
        /// Second-level cache of one core.
        CacheL2Bytes = "cache_l2_bytes", ANY, false;
        /// Last-level cache.
        CacheLlcBytes = "cache_llc_bytes", within(65_536.0, 17_179_869_184.0), true;
        /// Load latency over 16 KiB.
        Latency16KibNs = "latency_16_kib_ns", ANY, false;
        /// Load latency over 256 KiB.
        Latency256KibNs = "latency_256_kib_ns", ANY, false;
        /// Load latency over 1 MiB.
        Latency1024KibNs = "latency_1024_kib_ns", ANY, false;
        /// Load latency over 4 MiB.
        Latency4096KibNs = "latency_4096_kib_ns", ANY, false;
        /// Load latency over 16 MiB.
        Latency16384KibNs = "latency_16384_kib_ns", ANY, false;
        /// Load latency over 64 MiB.
        Latency65536KibNs = "latency_65536_kib_ns", ANY, false;
        /// Load latency over 256 MiB.
        Latency262144KibNs = "latency_262144_kib_ns", ANY, false;
        /// Memory of the machine, or the cgroup limit if that is lower.
        MemoryBytes = "memory_bytes", ANY, false;
        /// Memory bandwidth of one thread, by the STREAM triad.
        BandwidthOneThreadGbPerS = "bandwidth_one_thread_gb_per_s", within(0.2, 1000.0), true;
        /// Memory bandwidth of all usable cores, by the STREAM triad.
        BandwidthAllThreadsGbPerS = "bandwidth_all_threads_gb_per_s", within(0.2, 5000.0), false;
        /// Time until one core sees what another core wrote.
        CoreToCoreNs = "core_to_core_ns", within(1.0, 1e5), false;
        /// Cost of one parallel call on all usable cores while the helpers are awake.
        ForkJoinWarmNs = "fork_join_warm_ns", ANY, false;
        /// The same after the helpers were idle for 2 ms.
        ForkJoinColdNs = "fork_join_cold_ns", within(50.0, 1e7), true;
        /// Work of two threads over work of one in the same time.
        ScalingTwoThreadsRatio = "scaling_two_threads_ratio", within(0.05, 20.0), true;
        /// Work of all usable cores over work of one in the same time.
        ScalingAllThreadsRatio = "scaling_all_threads_ratio", within(0.05, 8192.0), true;
    }
}

impl ParameterId {
    /// Load latencies by working set in KiB, ascending.
    pub const LATENCIES: [(u32, Self); 7] = [
        (16, Self::Latency16KibNs),
        (256, Self::Latency256KibNs),
        (1024, Self::Latency1024KibNs),
        (4096, Self::Latency4096KibNs),
        (16_384, Self::Latency16384KibNs),
        (65_536, Self::Latency65536KibNs),
        (262_144, Self::Latency262144KibNs),
    ];
}

parameters! {
    /// A parameter of a GPU or of a group of GPUs. An upload goes from the CPU to the GPU, a download back.
    GpuParameterId("parameter of a GPU") {
        /// Upload of 33 554 432 bytes: copy into mapped memory, copy by the GPU, wait. The paper's CPU to GPU
        /// bandwidth.
        UploadGbPerS = "upload_gb_per_s", within(0.01, 2000.0), true;
        /// Slope of a line through uploads from 4 KiB to 64 MiB.
        UploadRateGbPerS = "upload_rate_gb_per_s", within(0.01, 2000.0), true;
        /// Download of 33 554 432 bytes. The paper's GPU to CPU bandwidth.
        DownloadGbPerS = "download_gb_per_s", within(0.01, 2000.0), true;
        /// Slope of a line through downloads from 4 KiB to 64 MiB.
        DownloadRateGbPerS = "download_rate_gb_per_s", within(0.01, 2000.0), true;
        /// Bandwidth of a kernel that reads the GPU's memory, over a working set beyond its caches.
        ReadGbPerS = "read_gb_per_s", within(0.1, 100_000.0), true;
        /// Bandwidth of the copy command within the GPU's memory, reads and writes counted. The paper's internal
        /// bandwidth.
        CopyGbPerS = "copy_gb_per_s", within(0.1, 100_000.0), true;
        /// Memory of the GPU.
        MemoryBytes = "memory_bytes", ANY, false;
        /// Clock of the processors.
        ClockGhz = "clock_ghz", within(0.01, 20.0), false;
        /// Multiprocessors, or compute units.
        Processors = "processors", ANY, false;
        /// 32-bit multiply-adds that can start in one cycle on all processors. The paper's cores.
        Lanes = "lanes", ANY, false;
        /// Submission of an empty dispatch, and the wait for it.
        RoundTripNs = "round_trip_ns", within(100.0, 1e9), true;
        /// One more dispatch in a pass in which each depends on the previous one.
        DispatchNs = "dispatch_ns", within(10.0, 1e9), true;
        /// Copy of 4 bytes to memory that the CPU can read, mapping and reading.
        ReadBackNs = "read_back_ns", within(100.0, 1e9), true;
        /// 32-bit floating-point operations; a multiply-add counts as two.
        ArithmeticGflopPerS = "arithmetic_gflop_per_s", within(0.1, 1e6), true;
        /// 1 if the GPU executes what is submitted, 0 if its driver only reports so; then nothing is timed.
        Executes = "executes", ANY, false;
        /// Of a group: bytes per second of uploads to all GPUs at once over the fastest one alone.
        GroupUploadRatio = "group_upload_ratio", ANY, true;
        /// Of a group: time of round trips of all GPUs at once over the slowest one alone.
        GroupRoundTripRatio = "group_round_trip_ratio", ANY, true;
        /// Of a group: operations per second of all GPUs at once over the fastest one alone.
        GroupArithmeticRatio = "group_arithmetic_ratio", ANY, true;
    }
}

impl GpuParameterId {
    /// The parameters of a group of GPUs, in the order of a report.
    pub const GROUP: [Self; 3] = [Self::GroupUploadRatio, Self::GroupRoundTripRatio, Self::GroupArithmeticRatio];

    /// The parameters of one GPU, in the order of a report.
    pub const OF_ONE: [Self; Self::ALL.len() - Self::GROUP.len()] = *Self::ALL.first_chunk().unwrap();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_end_with_their_unit() {
        for id in ParameterId::ALL {
            assert_eq!(id.as_str().parse(), Ok(id));
        }
        for (kib, id) in ParameterId::LATENCIES {
            assert_eq!((id.as_str(), id.quantity().unit), (&format!("latency_{kib}_kib_ns")[..], "ns"));
        }
        let unknown = "lanes_of_tomorrow".parse::<GpuParameterId>().unwrap_err().to_string();
        assert!(unknown.contains("lanes_of_tomorrow"), "{unknown}");
    }

    #[test]
    fn one_gpu_and_a_group_share_out_all_parameters() {
        let all = [&GpuParameterId::OF_ONE[..], &GpuParameterId::GROUP].concat();
        assert_eq!(all, GpuParameterId::ALL);
    }
}
