//! The parameters of a machine.

pub mod gpu;

pub use gpu::{GpuGroup, GpuHardware, GpuIdentity, GpuKind};

/// What is known about a machine: who made it, and a list of parameters, each with where it came from.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Hardware {
    /// Which machine it is.
    pub machine: Machine,
    /// The parameters, in the order of [`parameter`]'s constants; a name stands at most once.
    pub parameters: Vec<Parameter>,
    /// Its GPUs, by their number. Empty where there is none or none was looked at.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub gpus: Vec<GpuHardware>,
    /// GPUs that work together.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub gpu_groups: Vec<GpuGroup>,
}

/// What a machine says of itself. Holds nothing that names a host, a user or a single piece of hardware.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Machine {
    /// Which physical machine this is: a hash of CPU vendor, family, model, stepping and last-level cache, as 16 hex digits.
    ///
    /// All profiles of one machine share it, so that validation can leave them out together. Two machines with the same
    /// CPU model share it too: for a model of hardware they are the same machine.
    pub physical_id: String,
    /// Brand text of the CPU.
    pub cpu: String,
    /// Vendor text of the CPU.
    pub vendor: String,
    /// Architecture, as in `std::env::consts::ARCH`.
    pub arch: String,
    /// Operating system, as in `std::env::consts::OS`.
    pub os: String,
    /// SIMD level in use: `portable`, `avx2`, `avx512`.
    pub simd: String,
    /// `none`, or the name of the hypervisor where the CPU reports one.
    pub hypervisor: String,
}

/// One figure of a machine.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Parameter {
    /// Name with its unit as the last words, one of [`parameter`]'s constants.
    pub name: String,
    /// The figure: the median of the samples when it was measured. `None` when it is missing.
    pub value: Option<f64>,
    /// Interquartile range over median of the samples. `None` when there are fewer than four.
    pub dispersion: Option<f64>,
    /// How many samples stand behind the value.
    pub samples: u32,
    /// Samples that were thrown away because foreign load spoiled them.
    pub spoiled: u32,
    /// Highest share of the CPU, 0 to 1, that other programs took during the samples kept. `None` when it can't be told.
    pub foreign_load: Option<f64>,
    /// Whether the figure was measured, reported by the system, printed somewhere, or is missing.
    pub how: How,
    /// The method of a measurement, the interface of a report, or why the figure is missing.
    pub source: String,
}

/// Where a figure came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum How {
    /// Timed on this machine.
    Measured,
    /// Told by the operating system, the CPU or a driver.
    Reported,
    /// Printed in a paper or by a vendor; the source says where, and in which units.
    Published,
    /// Not known; the source says why.
    Missing,
}

/// Names of the parameters. The last words are the unit.
pub mod parameter {
    /// Threads that may run at once: affinity and cgroup quota respected.
    pub const USABLE_CORES: &str = "usable_cores";
    /// Physical cores of the machine, hyper-threads not counted.
    pub const PHYSICAL_CORES: &str = "physical_cores";
    /// Clock that the system reports.
    pub const CLOCK_REPORTED_GHZ: &str = "clock_reported_ghz";
    /// Clock under load, from a chain of dependent additions.
    pub const CLOCK_MEASURED_GHZ: &str = "clock_measured_ghz";
    /// 32-bit floats that one instruction of the SIMD level in use works on.
    pub const SIMD_LANES: &str = "simd_lanes";
    /// First-level data cache of one core.
    pub const CACHE_L1D_BYTES: &str = "cache_l1d_bytes";
    /// Second-level cache of one core.
    pub const CACHE_L2_BYTES: &str = "cache_l2_bytes";
    /// Last-level cache.
    pub const CACHE_LLC_BYTES: &str = "cache_llc_bytes";
    /// Working sets, in KiB, over which load latency is measured.
    pub const LATENCY_WORKING_SETS_KIB: [u32; 7] = [16, 256, 1024, 4096, 16_384, 65_536, 262_144];
    /// Memory of the machine, or the cgroup limit where that is lower.
    pub const MEMORY_BYTES: &str = "memory_bytes";
    /// STREAM triad on one thread, 24 bytes an element.
    pub const BANDWIDTH_ONE_THREAD_GB_PER_S: &str = "bandwidth_one_thread_gb_per_s";
    /// STREAM triad on all usable cores, 24 bytes an element.
    pub const BANDWIDTH_ALL_THREADS_GB_PER_S: &str = "bandwidth_all_threads_gb_per_s";
    /// Cost of one fork and join over all usable cores while the workers are awake.
    pub const FORK_JOIN_WARM_NS: &str = "fork_join_warm_ns";
    /// The same from outside the pool after the workers have slept for 2 ms.
    pub const FORK_JOIN_COLD_NS: &str = "fork_join_cold_ns";
    /// Work done by two threads over work done by one in the same time.
    pub const SCALING_TWO_THREADS_RATIO: &str = "scaling_two_threads_ratio";
    /// Work done by all usable cores over work done by one in the same time.
    pub const SCALING_ALL_THREADS_RATIO: &str = "scaling_all_threads_ratio";

    /// Name of the load latency over a working set, one of [`LATENCY_WORKING_SETS_KIB`].
    #[must_use]
    pub fn latency_name(kib: u32) -> String {
        format!("latency_{kib}_kib_ns")
    }

    /// Every parameter name, in the order of a report.
    #[must_use]
    pub fn all_names() -> Vec<String> {
        let before = [
            USABLE_CORES,
            PHYSICAL_CORES,
            CLOCK_REPORTED_GHZ,
            CLOCK_MEASURED_GHZ,
            SIMD_LANES,
            CACHE_L1D_BYTES,
            CACHE_L2_BYTES,
            CACHE_LLC_BYTES,
        ];
        let after = [
            MEMORY_BYTES,
            BANDWIDTH_ONE_THREAD_GB_PER_S,
            BANDWIDTH_ALL_THREADS_GB_PER_S,
            FORK_JOIN_WARM_NS,
            FORK_JOIN_COLD_NS,
            SCALING_TWO_THREADS_RATIO,
            SCALING_ALL_THREADS_RATIO,
        ];
        let latencies = LATENCY_WORKING_SETS_KIB.map(latency_name);
        before.iter().map(|s| (*s).to_owned()).chain(latencies).chain(after.iter().map(|s| (*s).to_owned())).collect()
    }
}

impl Hardware {
    /// The value of a parameter, when it is there and not missing.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.name == name).and_then(|p| p.value)
    }

    /// The GPU of a number, where it was looked at.
    #[must_use]
    pub fn gpu(&self, index: u32) -> Option<&GpuHardware> {
        self.gpus.iter().find(|g| g.gpu.index == index)
    }

    /// How the GPUs of these numbers, ascending, work together, where that was looked at.
    #[must_use]
    pub fn gpu_group(&self, indices: &[u32]) -> Option<&GpuGroup> {
        self.gpu_groups.iter().find(|g| g.gpus == indices)
    }

    /// What makes this unusable, if anything: a figure that can't be, or something that stands there twice.
    #[must_use]
    pub fn defect(&self) -> Option<String> {
        let cpu = std::iter::once((String::new(), &self.parameters));
        let gpus = self.gpus.iter().map(|g| (format!(" of gpu{}", g.gpu.index), &g.parameters));
        let groups = self.gpu_groups.iter().map(|g| (format!(" of the GPUs {:?}", g.gpus), &g.parameters));
        if let Some(defect) = cpu.chain(gpus).chain(groups).find_map(|(of, list)| defect(&of, list)) {
            return Some(defect);
        }
        for (k, g) in self.gpus.iter().enumerate() {
            if self.gpus[..k].iter().any(|h| h.gpu.index == g.gpu.index) {
                return Some(format!("gpu{} stands there twice", g.gpu.index));
            }
        }
        for (k, g) in self.gpu_groups.iter().enumerate() {
            let known = g.gpus.iter().all(|&k| self.gpu(k).is_some());
            if g.gpus.len() < 2 || !g.gpus.is_sorted_by(|a, b| a < b) || !known {
                return Some(format!("the GPUs {:?} are no group of two or more of the GPUs that stand there", g.gpus));
            }
            if self.gpu_groups[..k].iter().any(|h| h.gpus == g.gpus) {
                return Some(format!("the group of the GPUs {:?} stands there twice", g.gpus));
            }
        }
        None
    }
}

/// What is wrong with a list of parameters, if anything.
fn defect(of: &str, parameters: &[Parameter]) -> Option<String> {
    for (k, p) in parameters.iter().enumerate() {
        if p.value.is_some_and(|v| !v.is_finite() || v < 0.0) {
            return Some(format!("the parameter {}{of} is {:?}", p.name, p.value));
        }
        if parameters[..k].iter().any(|q| q.name == p.name) {
            return Some(format!("the parameter {}{of} stands there twice", p.name));
        }
    }
    None
}

impl Parameter {
    /// A figure told by the system.
    #[must_use]
    pub fn reported(name: &str, value: f64, source: &str) -> Self {
        Self { how: How::Reported, value: Some(value), samples: 1, ..Self::missing(name, source) }
    }

    /// A figure that is not known, and why.
    #[must_use]
    pub fn missing(name: &str, why: &str) -> Self {
        Self {
            name: name.to_owned(),
            value: None,
            dispersion: None,
            samples: 0,
            spoiled: 0,
            foreign_load: None,
            how: How::Missing,
            source: why.to_owned(),
        }
    }
}
