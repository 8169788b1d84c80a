//! The parameters of a machine.

pub mod gpu;
mod placement;
mod plausible;
mod raw;

pub use gpu::{GpuGroup, GpuHardware, GpuIdentity, GpuKind};
pub use raw::Statistic;

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
    /// The figure: when it was measured, what [`Parameter::statistic`] makes of the samples. `None` when it is missing.
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
    /// How the value follows from the samples.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Statistic::is_median"))]
    pub statistic: Statistic,
    /// The samples kept, in the unit of the name, in the order of measurement, to six significant digits. Value, dispersion and
    /// number of samples follow from them. Empty where nothing was measured, where the value is that of a fit, and in reports
    /// made before they were kept.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub raw: Vec<f64>,
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
    /// Time until one core sees what another one wrote.
    pub const CORE_TO_CORE_NS: &str = "core_to_core_ns";
    /// Cost of spreading work over all usable cores and waiting for it, while the helpers are awake.
    pub const FORK_JOIN_WARM_NS: &str = "fork_join_warm_ns";
    /// The same after the helpers have been idle for 2 ms.
    pub const FORK_JOIN_COLD_NS: &str = "fork_join_cold_ns";
    /// Work done by two threads over work done by one in the same time.
    pub const SCALING_TWO_THREADS_RATIO: &str = "scaling_two_threads_ratio";
    /// Work done by all usable cores over work done by one in the same time.
    pub const SCALING_ALL_THREADS_RATIO: &str = "scaling_all_threads_ratio";
    /// 32-bit multiply-adds in registers on one thread, each counted as two operations.
    pub const ARITHMETIC_ONE_THREAD_GFLOP_PER_S: &str = "arithmetic_one_thread_gflop_per_s";
    /// The same on all usable cores.
    pub const ARITHMETIC_ALL_THREADS_GFLOP_PER_S: &str = "arithmetic_all_threads_gflop_per_s";

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
            CORE_TO_CORE_NS,
            FORK_JOIN_WARM_NS,
            FORK_JOIN_COLD_NS,
            SCALING_TWO_THREADS_RATIO,
            SCALING_ALL_THREADS_RATIO,
            ARITHMETIC_ONE_THREAD_GFLOP_PER_S,
            ARITHMETIC_ALL_THREADS_GFLOP_PER_S,
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

    /// What a reader must know of the conditions under which this was measured: foreign load, and cores that came to lie elsewhere.
    #[must_use]
    pub fn disturbed(&self) -> Vec<String> {
        self.lists().filter_map(|(of, list)| loaded(&of, list)).chain(moved(&self.parameters)).collect()
    }

    /// Every list of parameters, with whose it is.
    fn lists(&self) -> impl Iterator<Item = (String, &[Parameter])> {
        let cpu = std::iter::once((String::new(), &self.parameters[..]));
        let gpus = self.gpus.iter().map(|g| (format!(" of gpu{}", g.gpu.index), &g.parameters[..]));
        let groups = self.gpu_groups.iter().map(|g| (format!(" of the GPUs {:?}", g.gpus), &g.parameters[..]));
        cpu.chain(gpus).chain(groups)
    }

    /// What makes this unusable, if anything: a figure that can't be, or something that stands there twice.
    #[must_use]
    pub fn defect(&self) -> Option<String> {
        if let Some(defect) = self.lists().find_map(|(of, list)| defect(&of, list)) {
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

/// Foreign load that is told. In a single window rounding alone may show [`Parameter::SPOILING`].
const TOLD: f64 = 2.0 * Parameter::SPOILING;

/// Which parameters of a list were measured while other programs took too much of the CPU, if any.
fn loaded(of: &str, parameters: &[Parameter]) -> Option<String> {
    let loads = parameters.iter().filter_map(|p| Some((p.name.as_str(), p.foreign_load?)));
    let spoiled: Vec<(&str, f64)> = loads.filter(|(_, load)| *load > TOLD).collect();
    let (name, load) = spoiled.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(format!(
        "other programs or the host took more than {:.0} % of the CPU while {} of the parameters{of} were measured, {:.0} % with \
         {name}; where that is not meant, probe again when the machine is idle",
        TOLD * 100.0,
        spoiled.len(),
        load * 100.0
    ))
}

/// Whether two cores lay near each other for some samples and far apart for others.
fn moved(parameters: &[Parameter]) -> Option<String> {
    let distance = parameters.iter().find(|p| p.name == parameter::CORE_TO_CORE_NS)?;
    // A machine of several groups of cores differs by a factor of four; noise of the clock does not reach two.
    let [low, high] = [0.1, 0.9].map(|q| crate::stats::quantile(&distance.raw, q));
    let (low, high) = low.zip(high).filter(|(low, high)| *high > 2.0 * low)?;
    Some(format!(
        "a cache line took {low:.0} ns from core to core in some samples and {high:.0} ns in others: the program or the virtual CPUs were \
         moved to other cores meanwhile, and what is measured on several cores may be of either place; probe again"
    ))
}

/// What is wrong with a list of parameters, if anything.
fn defect(of: &str, parameters: &[Parameter]) -> Option<String> {
    for (k, p) in parameters.iter().enumerate() {
        if let Some(value) = p.value.filter(|v| !v.is_finite() || *v < 0.0) {
            return Some(format!("the parameter {}{of} is {value:e}", p.name));
        }
        if let Some(why) = p.disagreement() {
            return Some(format!("the parameter {}{of}: {why}", p.name));
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
            statistic: Statistic::Median,
            raw: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hardware(parameters: Vec<Parameter>) -> Hardware {
        Hardware { machine: Machine::default(), parameters, gpus: Vec::new(), gpu_groups: Vec::new() }
    }

    #[test]
    fn a_figure_that_its_samples_contradict_is_a_defect() {
        let p = Parameter { raw: vec![1.0], ..Parameter::reported("a_ns", 1.0, "test") };
        assert_eq!(hardware(vec![p.clone()]).defect(), None);
        let defect = hardware(vec![Parameter { value: Some(1.5), ..p }]).defect();
        assert!(defect.is_some_and(|d| d.contains("a_ns") && d.contains("1.5")));
    }

    #[test]
    fn disturbances_are_told() {
        let loaded = |name: &str, load| Parameter { foreign_load: Some(load), ..Parameter::reported(name, 1.0, "test") };
        let told = |parameters| hardware(parameters).disturbed();
        assert!(told(vec![loaded("a", 0.1), Parameter::reported("b", 1.0, "test")]).is_empty());
        let one = told(vec![loaded("a", 0.25), loaded("b", 0.16), loaded("c", 0.01)]);
        assert!(one.len() == 1 && one[0].contains("while 2 of") && one[0].contains("25 % with a;"), "{one:?}");
        let distance =
            |raw: &[f64]| Parameter { raw: raw.to_vec(), ..Parameter::reported(parameter::CORE_TO_CORE_NS, 1.0, "test") };
        assert!(told(vec![distance(&[38.0, 37.0, 41.0, 60.0])]).is_empty());
        // One sample of many that an interruption spoiled is no other place.
        assert!(told(vec![distance(&[&[38.0; 30][..], &[900.0]].concat())]).is_empty());
        let moved = told(vec![distance(&[&[38.0; 30][..], &[165.0; 10]].concat())]);
        assert!(moved.len() == 1 && moved[0].contains("38 ns") && moved[0].contains("165 ns"), "{moved:?}");
    }
}
