//! The table of hardware parameters: what each is called, its unit, where its figures may lie and how they are measured.
//!
//! A new parameter is one entry here and its probe in `measure`.

use crate::named::named;

/// What is to be known about a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Quantity {
    /// The unit of its figures, for readers; the name holds it too.
    pub unit: &'static str,
    /// Where no machine lies outside; `None` where nobody has said.
    pub bounds: Option<Bounds>,
    /// How it is measured, or who reports it.
    pub how: &'static str,
    /// Whether a cost model may read it.
    pub read_by_model: bool,
}

/// The lowest and the highest plausible figure. Wide on purpose: a machine that is merely unlike those of the training is told by the
/// model's ranges. A unit that is off by a thousand lies outside for most machines.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Bounds {
    /// Lowest figure.
    pub least: f64,
    /// Highest figure.
    pub most: f64,
    /// Why nothing lies beyond.
    pub why: &'static str,
}

/// No bounds, and read by no model.
const fn told(unit: &'static str, how: &'static str) -> Quantity {
    Quantity { unit, bounds: None, how, read_by_model: false }
}

/// Read by cost models, within bounds.
const fn read(unit: &'static str, least: f64, most: f64, why: &'static str, how: &'static str) -> Quantity {
    Quantity { unit, bounds: Some(Bounds { least, most, why }), how, read_by_model: true }
}

/// Defines the keys of a table, and what stands behind each.
macro_rules! parameters {
    ($(#[$meta:meta])* $name:ident($kind:literal) { $($(#[$doc:meta])* $variant:ident = $text:literal => $quantity:expr;)+ }) => {
        named! {
            $(#[$meta])*
            #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
            #[non_exhaustive]
            pub enum $name($kind) {
                $($(#[$doc])* $variant = $text,)+
            }
        }

        impl $name {
            /// What is to be known about it.
            #[must_use]
            pub const fn quantity(self) -> Quantity {
                match self {
                    $(Self::$variant => $quantity,)+
                }
            }
        }

        impl AsRef<str> for $name {
            fn as_ref(&self) -> &str {
                self.as_str()
            }
        }

        impl From<$name> for String {
            fn from(id: $name) -> Self {
                id.as_str().to_owned()
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

        impl PartialEq<$name> for str {
            fn eq(&self, other: &$name) -> bool {
                self == other.as_str()
            }
        }
    };
}

const PROCESSOR_CLOCK: &str = "from microcontrollers to twice what any processor has been cooled for";
const WORKING_SET: &str = "a chain of dependent loads over a working set of that size";
const TRIAD: &str = "STREAM triad, 24 bytes an element";
const LINK: &str = "a tenth of the first bus for graphics, and more than any link of today";
const GPU_MEMORY: &str = "software adapters, and ten times the fastest memory of today";
const ONE_MESSAGE: &str = "one message over a bus takes that long, and nobody waits for a second";
const ALL_OF_A_TRANSFER: &str = "33 554 432 bytes through a staging buffer, by the wall clock";
const LINE_OF_SIZES: &str = "a line through transfers from 4 KiB to 64 MiB";
const READING: &str = "a kernel that reads a working set again and again";

parameters! {
    /// A parameter of a machine, its GPUs aside.
    ParameterId("hardware parameter") {
        /// Threads that may run at once: affinity and cgroup quota respected.
        UsableCores = "usable_cores" => read("cores", 1.0, 4096.0, "no system runs more processors", "affinity and control group");
        /// Physical cores of the machine, hyper-threads not counted.
        PhysicalCores = "physical_cores" => told("cores", "the operating system");
        /// Clock that the system reports.
        ClockReportedGhz = "clock_reported_ghz" => read("GHz", 0.05, 20.0, PROCESSOR_CLOCK, "the operating system");
        /// Clock under load.
        ClockMeasuredGhz = "clock_measured_ghz" => read("GHz", 0.05, 20.0, PROCESSOR_CLOCK, "a chain of dependent additions");
        /// 32-bit floats that one instruction of the SIMD level in use works on.
        SimdLanes = "simd_lanes" =>
            read("lanes", 1.0, 64.0, "from none to the 2048 bits of the widest vector instructions", "the CPU's feature flags");
        /// First-level data cache of one core.
        CacheL1dBytes = "cache_l1d_bytes" => told("bytes", "CPUID, sysfs or sysctl");
        /// Second-level cache of one core.
        CacheL2Bytes = "cache_l2_bytes" => told("bytes", "CPUID, sysfs or sysctl");
        /// Last-level cache.
        CacheLlcBytes = "cache_llc_bytes" => read(
            "bytes",
            65_536.0,
            17_179_869_184.0,
            "from boards for hobbyists to ten times the largest server's",
            "CPUID, sysfs or sysctl",
        );
        /// Load latency over 16 KiB.
        Latency16KibNs = "latency_16_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 256 KiB.
        Latency256KibNs = "latency_256_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 1 MiB.
        Latency1024KibNs = "latency_1024_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 4 MiB.
        Latency4096KibNs = "latency_4096_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 16 MiB.
        Latency16384KibNs = "latency_16384_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 64 MiB.
        Latency65536KibNs = "latency_65536_kib_ns" => told("ns", WORKING_SET);
        /// Load latency over 256 MiB.
        Latency262144KibNs = "latency_262144_kib_ns" => told("ns", WORKING_SET);
        /// Memory of the machine, or the cgroup limit where that is lower.
        MemoryBytes = "memory_bytes" => told("bytes", "the operating system and the control group");
        /// Memory bandwidth of one thread.
        BandwidthOneThreadGbPerS = "bandwidth_one_thread_gb_per_s" =>
            read("GB/s", 0.2, 1000.0, "one channel of memory of 1998, and more than any one core takes", TRIAD);
        /// Memory bandwidth of all usable cores.
        BandwidthAllThreadsGbPerS = "bandwidth_all_threads_gb_per_s" => Quantity {
            read_by_model: false,
            ..read("GB/s", 0.2, 5000.0, "one channel of memory of 1998, and two sockets of stacked memory", TRIAD)
        };
        /// Time until one core sees what another one wrote.
        CoreToCoreNs = "core_to_core_ns" => Quantity {
            read_by_model: false,
            ..read(
                "ns",
                1.0,
                1e5,
                "light goes a foot in a nanosecond; between sockets it is under a microsecond",
                "a cache line that two cores write in turn",
            )
        };
        /// Cost of spreading work over all usable cores and waiting for it, while the helpers are awake.
        ForkJoinWarmNs = "fork_join_warm_ns" => told("ns", "an empty parallel call, one after the other");
        /// The same after the helpers have been idle for 2 ms.
        ForkJoinColdNs = "fork_join_cold_ns" => read(
            "ns",
            50.0,
            1e7,
            "one message between cores takes that long; over several turns of a scheduler it is other programs that are measured",
            "an empty parallel call after a pause of 2 ms",
        );
        /// Work done by two threads over work done by one in the same time.
        ScalingTwoThreadsRatio = "scaling_two_threads_ratio" => read(
            "ratio",
            0.05,
            20.0,
            "a disturbed thread makes two look better, but not in percent",
            "integer arithmetic on one and on two threads",
        );
        /// Work done by all usable cores over work done by one in the same time.
        ScalingAllThreadsRatio = "scaling_all_threads_ratio" =>
            read("ratio", 0.05, 8192.0, "twice the most processors", "integer arithmetic on one and on all threads");
        /// 32-bit multiply-adds in registers on one thread, each counted as two operations.
        ArithmeticOneThreadGflopPerS = "arithmetic_one_thread_gflop_per_s" => told("Gflop/s", "multiply-adds in registers");
        /// The same on all usable cores.
        ArithmeticAllThreadsGflopPerS = "arithmetic_all_threads_gflop_per_s" => told("Gflop/s", "multiply-adds in registers");
    }
}

impl ParameterId {
    /// Load latencies, by their working set in KiB, ascending.
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
    /// A parameter of a GPU, or of GPUs that work together. "Upload" is from the CPU to the GPU, "download" back.
    GpuParameterId("parameter of a GPU") {
        /// Upload of 33 554 432 bytes, all of it: copy into mapped memory, copy by the GPU, wait. The paper's first transfer.
        UploadGbPerS = "upload_gb_per_s" => read("GB/s", 0.01, 2000.0, LINK, ALL_OF_A_TRANSFER);
        /// The part of that upload that the CPU does.
        UploadHostCopyGbPerS = "upload_host_copy_gb_per_s" => told("GB/s", ALL_OF_A_TRANSFER);
        /// The part of that upload that the GPU does.
        UploadDeviceCopyGbPerS = "upload_device_copy_gb_per_s" => told("GB/s", ALL_OF_A_TRANSFER);
        /// Time of an upload of no bytes.
        UploadLatencyNs = "upload_latency_ns" => told("ns", LINE_OF_SIZES);
        /// Slope of that line.
        UploadRateGbPerS = "upload_rate_gb_per_s" => read("GB/s", 0.01, 2000.0, LINK, LINE_OF_SIZES);
        /// Download of 33 554 432 bytes, all of it. The paper's second transfer.
        DownloadGbPerS = "download_gb_per_s" => read("GB/s", 0.01, 2000.0, LINK, ALL_OF_A_TRANSFER);
        /// The part of that download that the CPU does.
        DownloadHostCopyGbPerS = "download_host_copy_gb_per_s" => told("GB/s", ALL_OF_A_TRANSFER);
        /// The part of that download that the GPU does.
        DownloadDeviceCopyGbPerS = "download_device_copy_gb_per_s" => told("GB/s", ALL_OF_A_TRANSFER);
        /// Time of a download of no bytes.
        DownloadLatencyNs = "download_latency_ns" => told("ns", LINE_OF_SIZES);
        /// Slope of that line.
        DownloadRateGbPerS = "download_rate_gb_per_s" => read("GB/s", 0.01, 2000.0, LINK, LINE_OF_SIZES);
        /// Reading within the GPU's memory, over a working set beyond its caches.
        ReadGbPerS = "read_gb_per_s" => read("GB/s", 0.1, 100_000.0, GPU_MEMORY, READING);
        /// Writing within the GPU's memory, over a working set beyond its caches.
        WriteGbPerS = "write_gb_per_s" => told("GB/s", "a kernel that writes");
        /// Copying within the GPU's memory by its copy command, bytes read and bytes written both counted. The paper's internal
        /// bandwidth.
        CopyGbPerS = "copy_gb_per_s" => read("GB/s", 0.1, 100_000.0, GPU_MEMORY, "the copy command, from buffer to buffer");
        /// Reading bandwidth over 64 KiB.
        Read64KibGbPerS = "read_64_kib_gb_per_s" => told("GB/s", READING);
        /// Reading bandwidth over 1 MiB.
        Read1024KibGbPerS = "read_1024_kib_gb_per_s" => told("GB/s", READING);
        /// Reading bandwidth over 8 MiB.
        Read8192KibGbPerS = "read_8192_kib_gb_per_s" => told("GB/s", READING);
        /// Reading bandwidth over 32 MiB.
        Read32768KibGbPerS = "read_32768_kib_gb_per_s" => told("GB/s", READING);
        /// Reading bandwidth over 128 MiB.
        Read131072KibGbPerS = "read_131072_kib_gb_per_s" => told("GB/s", READING);
        /// Memory of the GPU.
        MemoryBytes = "memory_bytes" => told("bytes", "the driver");
        /// Clock of the processors.
        ClockGhz = "clock_ghz" => Quantity {
            read_by_model: false,
            ..read("GHz", 0.01, 20.0, "from the first cards to twice what any processor has been cooled for", "the driver")
        };
        /// Multiprocessors, compute units, shader cores.
        Processors = "processors" => told("processors", "the driver");
        /// Lanes of all processors: 32-bit multiply-adds that can start in one cycle. "Cores" in the paper.
        Lanes = "lanes" => told("lanes", "the driver");
        /// Time of the CPU in one submission of one dispatch, without waiting for it.
        SubmitNs = "submit_ns" => told("ns", "an empty dispatch");
        /// One submission of an empty dispatch, and waiting for it.
        RoundTripNs = "round_trip_ns" => read("ns", 100.0, 1e9, ONE_MESSAGE, "an empty dispatch, submitted and waited for");
        /// One more dispatch in a pass, where each depends on the one before.
        DispatchNs = "dispatch_ns" =>
            read("ns", 10.0, 1e9, "some dozen cycles, and nobody waits for a second", "dispatches that depend on each other");
        /// Copying 4 bytes to memory that the CPU can read, mapping it and reading them.
        ReadBackNs = "read_back_ns" => read("ns", 100.0, 1e9, ONE_MESSAGE, "4 bytes, copied, mapped and read");
        /// 32-bit floating-point operations, a multiply-add counted as two.
        ArithmeticGflopPerS = "arithmetic_gflop_per_s" => read(
            "Gflop/s",
            0.1,
            1e6,
            "software adapters, and ten times the fastest GPU of today",
            "chains of multiply-adds in registers",
        );
        /// Atomic additions to distinct addresses, in thousands of millions a second.
        AtomicGPerS = "atomic_g_per_s" => told("G/s", "a kernel of atomic additions");
        /// Workgroups of the largest size that run at the same time.
        ParallelUnits = "parallel_units" => told("workgroups", "the staircase of the time over the number of workgroups");
        /// Lanes that run in lockstep.
        SubgroupLanes = "subgroup_lanes" => told("lanes", "the driver");
        /// Most invocations in a workgroup.
        WorkgroupInvocations = "workgroup_invocations" => told("invocations", "the driver");
        /// Most memory that a workgroup shares.
        WorkgroupMemoryBytes = "workgroup_memory_bytes" => told("bytes", "the driver");
        /// Most bytes that a kernel can see of one buffer.
        BindingBytes = "binding_bytes" => told("bytes", "the driver");
        /// Largest buffer.
        BufferBytes = "buffer_bytes" => told("bytes", "the driver");
        /// 1 where CPU and GPU share one memory, else 0.
        UnifiedMemory = "unified_memory" => told("0 or 1", "the driver");
        /// Largest heap of memory of its own.
        DeviceLocalBytes = "device_local_bytes" => told("bytes", "the driver");
        /// Largest heap of memory of its own that the CPU reaches too; 0 where there is none.
        HostVisibleLocalBytes = "host_visible_local_bytes" => told("bytes", "the driver");
        /// 1 where the CPU reaches all memory of a card (resizable BAR), 0 where it reaches a window of it or nothing.
        ResizableBar = "resizable_bar" => told("0 or 1", "the driver");
        /// 1 where it executes what it is given, 0 where it only says so: then nothing of it is timed.
        Executes = "executes" => told("0 or 1", "a kernel whose result is read back");
        /// Of a group: uploads of all GPUs at once over the fastest one alone, in bytes per second.
        GroupUploadRatio = "group_upload_ratio" =>
            Quantity { read_by_model: true, ..told("ratio", "uploads, a thread for each GPU") };
        /// Of a group: round trips of all GPUs at once, over those of the slowest one alone, in time.
        GroupRoundTripRatio = "group_round_trip_ratio" =>
            Quantity { read_by_model: true, ..told("ratio", "round trips, a thread for each GPU") };
        /// Of a group: arithmetic of all GPUs at once over the fastest one alone, in operations per second.
        GroupArithmeticRatio = "group_arithmetic_ratio" =>
            Quantity { read_by_model: true, ..told("ratio", "arithmetic, a thread for each GPU") };
    }
}

impl GpuParameterId {
    /// The parameters of a group of GPUs, in the order of a report.
    pub const GROUP: [Self; 3] = [Self::GroupUploadRatio, Self::GroupRoundTripRatio, Self::GroupArithmeticRatio];

    /// The parameters of one GPU, in the order of a report.
    pub const OF_ONE: [Self; Self::ALL.len() - Self::GROUP.len()] = {
        let mut ids = [Self::UploadGbPerS; Self::ALL.len() - Self::GROUP.len()];
        let mut k = 0;
        while k < ids.len() {
            ids[k] = Self::ALL[k];
            k += 1;
        }
        ids
    };

    /// Reading bandwidths, by their working set in KiB, ascending.
    pub const READS: [(u32, Self); 5] = [
        (64, Self::Read64KibGbPerS),
        (1024, Self::Read1024KibGbPerS),
        (8192, Self::Read8192KibGbPerS),
        (32_768, Self::Read32768KibGbPerS),
        (131_072, Self::Read131072KibGbPerS),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_end_with_their_unit() {
        let names = ParameterId::ALL
            .map(ParameterId::as_str)
            .into_iter()
            .chain(GpuParameterId::ALL.map(GpuParameterId::as_str));
        assert!(
            names.into_iter().all(|n| n.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_'))
        );
        for id in ParameterId::ALL {
            assert_eq!(id.as_str().parse(), Ok(id));
        }
        for (kib, id) in ParameterId::LATENCIES {
            assert_eq!(id.as_str(), format!("latency_{kib}_kib_ns"));
        }
        for (kib, id) in GpuParameterId::READS {
            assert_eq!(id.as_str(), format!("read_{kib}_kib_gb_per_s"));
        }
        assert!("lanes_of_tomorrow".parse::<GpuParameterId>().is_err_and(|e| e.text() == "lanes_of_tomorrow"));
    }

    #[test]
    fn those_of_one_gpu_and_those_of_a_group_are_all() {
        let all = [&GpuParameterId::OF_ONE[..], &GpuParameterId::GROUP].concat();
        assert_eq!(all, GpuParameterId::ALL);
    }
}
