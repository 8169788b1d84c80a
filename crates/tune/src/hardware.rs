//! What is known about a machine: its identity and its parameters.

mod error;
mod figure;
mod gpu;
mod parameter;
mod plausible;
mod statistic;
mod unit;

pub use error::HardwareError;
pub use figure::{How, Parameter};
pub use gpu::{GpuGroup, GpuHardware};
pub use parameter::{Bounds, GpuParameterId, ParameterId, Quantity};
pub use sapwise::internals::{GpuIdentity, GpuKind};
pub use statistic::Statistic;
pub use unit::with_unit;

/// What is known about a machine: its identity and a list of parameters, each with its origin.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Hardware {
    /// Which machine it is.
    pub machine: Machine,
    /// The parameters; a name appears at most once. A file may hold names that this version does not know; they are
    /// kept.
    pub parameters: Vec<Parameter>,
    /// Its GPUs by number. Empty if there are none or none was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gpus: Vec<GpuHardware>,
    /// GPUs that work together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gpu_groups: Vec<GpuGroup>,
}

/// The identity of a machine. Names no host, no user and no single piece of hardware.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Machine {
    /// Hash of CPU vendor, family, model, stepping and last-level cache, as 16 hex digits.
    ///
    /// All profiles of one machine share it, so that validation holds them out together. Two machines with the same
    /// CPU model share it too: to a model of hardware they are the same machine.
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
    /// Name of the hypervisor that the CPU reports, or `none`.
    pub hypervisor: String,
}

impl Machine {
    /// Creates a machine of which only the [`physical_id`](Self::physical_id) is known.
    pub fn of(physical_id: impl Into<String>) -> Self {
        Self { physical_id: physical_id.into(), ..Self::default() }
    }

    /// Returns the name of the tuning file for machines of this kind, which `sapwise predict --report FOLDER` writes:
    /// physical id, SIMD level, usable cores and the device numbers of its GPUs, as in
    /// `478e43ba2e7824ab-avx512-16-10de2335.json`. Software adapters are left out.
    pub fn tuning_file(&self, cores: u32, gpus: &[GpuIdentity]) -> String {
        // A driver's text and a report of a stranger may hold any character.
        let plain = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>();
        let mut name = format!("{}-{}-{cores}", plain(&self.physical_id), plain(&self.simd));
        for gpu in gpus.iter().filter(|gpu| gpu.kind != GpuKind::Software) {
            name = name + "-" + &plain(&gpu.device);
        }
        name + ".json"
    }
}

impl Hardware {
    /// Creates a machine with these parameters and without GPUs.
    pub fn new(machine: Machine, parameters: Vec<Parameter>) -> Self {
        Self { machine, parameters, gpus: Vec::new(), gpu_groups: Vec::new() }
    }

    /// Replaces the GPUs.
    #[must_use]
    pub fn with_gpus(self, gpus: Vec<GpuHardware>) -> Self {
        Self { gpus, ..self }
    }

    /// Returns the value of a parameter unless it is missing.
    pub fn value(&self, id: ParameterId) -> Option<f64> {
        self.value_named(id.as_str())
    }

    /// Returns the value of a parameter by its name, which this version need not know.
    pub fn value_named(&self, name: &str) -> Option<f64> {
        Parameter::find(&self.parameters, name)?.value
    }

    /// Returns the GPU of a number if it was measured.
    pub fn gpu(&self, index: u32) -> Option<&GpuHardware> {
        self.gpus.iter().find(|g| g.gpu.index == index)
    }

    /// Returns the group of the GPUs of these numbers, ascending, if it was measured.
    pub fn gpu_group(&self, indices: &[u32]) -> Option<&GpuGroup> {
        self.gpu_groups.iter().find(|g| g.gpus == indices)
    }

    /// Returns what disturbed the measurement, in sentences: foreign load, and cores that moved.
    pub fn disturbed(&self) -> Vec<String> {
        self.lists().filter_map(|(of, list)| loaded(&of, list)).chain(moved(&self.parameters)).collect()
    }

    /// Every list of parameters, with its owner in words.
    fn lists(&self) -> impl Iterator<Item = (String, &[Parameter])> {
        let cpu = std::iter::once((String::new(), &self.parameters[..]));
        let gpus = self.gpus.iter().map(|g| (format!(" of gpu{}", g.gpu.index), &g.parameters[..]));
        let groups = self.gpu_groups.iter().map(|g| (format!(" of the GPUs {:?}", g.gpus), &g.parameters[..]));
        cpu.chain(gpus).chain(groups)
    }

    /// Returns what makes the description unusable, if anything: an impossible value, or something listed twice.
    pub fn defect(&self) -> Option<HardwareError> {
        if let Some(defect) = self.lists().find_map(|(of, list)| Parameter::defect(&of, list)) {
            return Some(defect);
        }
        for (k, g) in self.gpus.iter().enumerate() {
            if self.gpus[..k].iter().any(|h| h.gpu.index == g.gpu.index) {
                return Some(HardwareError(format!("gpu{} is listed twice", g.gpu.index)));
            }
        }
        for (k, g) in self.gpu_groups.iter().enumerate() {
            let known = g.gpus.iter().all(|&k| self.gpu(k).is_some());
            if g.gpus.len() < 2 || !g.gpus.is_sorted_by(|a, b| a < b) || !known {
                let of = &g.gpus;
                return Some(HardwareError(format!(
                    "{of:?} is not a group: name two or more of the listed GPUs, ascending"
                )));
            }
            if self.gpu_groups[..k].iter().any(|h| h.gpus == g.gpus) {
                return Some(HardwareError(format!("the group of the GPUs {:?} is listed twice", g.gpus)));
            }
        }
        None
    }
}

/// Lowest foreign load that is reported, a share of the CPU: in one window rounding alone may show
/// [`Parameter::SPOILING`].
const REPORTED_LOAD: f64 = 2.0 * Parameter::SPOILING;

/// Which parameters of a list were measured while other programs took too much of the CPU.
fn loaded(of: &str, parameters: &[Parameter]) -> Option<String> {
    let loads = parameters.iter().filter_map(|p| Some((p.name.as_str(), p.foreign_load?)));
    let spoiled: Vec<(&str, f64)> = loads.filter(|(_, load)| *load > REPORTED_LOAD).collect();
    let (name, load) = spoiled.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(format!(
        "other programs or the host took more than {:.0} % of the CPU while {} of the parameters{of} were measured, \
         {:.0} % with {name}; unless that is intended, probe again when the machine is idle",
        REPORTED_LOAD * 100.0,
        spoiled.len(),
        load * 100.0
    ))
}

/// Whether two cores were near each other in some samples and far apart in others.
fn moved(parameters: &[Parameter]) -> Option<String> {
    let distance = Parameter::find(parameters, ParameterId::CoreToCoreNs)?;
    // Cores of different groups differ by a factor of four; noise of the clock does not reach two.
    let [low, high] = [0.1, 0.9].map(|q| crate::stats::quantile(&distance.raw, q));
    let (low, high) = low.zip(high).filter(|(low, high)| *high > 2.0 * low)?;
    Some(format!(
        "a cache line took {low:.0} ns from core to core in some samples and {high:.0} ns in others: the program or \
         the virtual CPUs \
         moved to other cores meanwhile, so what was measured on several cores mixes both places; probe again"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hardware(parameters: Vec<Parameter>) -> Hardware {
        Hardware::new(Machine::default(), parameters)
    }

    #[test]
    fn a_value_that_its_samples_contradict_is_a_defect() {
        let p = Parameter { raw: vec![1.0], ..Parameter::reported("a_ns", 1.0, "test") };
        assert_eq!(hardware(vec![p.clone()]).defect(), None);
        let defect = hardware(vec![Parameter { value: Some(1.5), ..p }]).defect().map(|d| d.to_string());
        assert!(defect.is_some_and(|d| d.contains("a_ns") && d.contains("1.5")));
    }

    #[test]
    fn disturbances_are_reported() {
        let loaded =
            |name: &str, load| Parameter { foreign_load: Some(load), ..Parameter::reported(name, 1.0, "test") };
        let told = |parameters| hardware(parameters).disturbed();
        assert!(told(vec![loaded("a", 0.1), Parameter::reported("b", 1.0, "test")]).is_empty());
        let one = told(vec![loaded("a", 0.25), loaded("b", 0.16), loaded("c", 0.01)]);
        assert!(one.len() == 1 && one[0].contains("while 2 of") && one[0].contains("25 % with a;"), "{one:?}");
        let distance = |raw: &[f64]| Parameter {
            raw: raw.to_vec(),
            ..Parameter::reported(ParameterId::CoreToCoreNs, 1.0, "test")
        };
        assert!(told(vec![distance(&[38.0, 37.0, 41.0, 60.0])]).is_empty());
        // One interrupted sample is not another place.
        assert!(told(vec![distance(&[&[38.0; 30][..], &[900.0]].concat())]).is_empty());
        let moved = told(vec![distance(&[&[38.0; 30][..], &[165.0; 10]].concat())]);
        assert!(moved.len() == 1 && moved[0].contains("38 ns") && moved[0].contains("165 ns"), "{moved:?}");
    }

    /// Reports of earlier versions hold parameters that this version does not measure.
    #[test]
    fn parameters_without_an_id_are_written_back_as_they_were_read() {
        let text = r#"{"machine":{"physical_id":"0123456789abcdef","cpu":"","vendor":"","arch":"","os":"","simd":"avx2",
            "hypervisor":"none"},"parameters":[{"name":"arithmetic_one_thread_gflop_per_s","value":2.5,"dispersion":0.6,
            "samples":4,"spoiled":1,"foreign_load":0.01,"how":"measured",
            "source":"fused multiply-adds","raw":[4.0,1.0,3.0,2.0]}],
            "gpus":[{"gpu":{"index":0,"name":"a","device":"10de:2335","driver":"b","api":"vulkan","kind":"discrete"},
            "parameters":[{"name":"atomic_g_per_s","value":720.976,"dispersion":null,"samples":1,"spoiled":0,
            "foreign_load":null,"how":"reported","source":"c"},{"name":"parallel_units","value":132.0,"dispersion":0.0,
            "samples":5,"spoiled":0,"foreign_load":null,"how":"measured","source":"d","statistic":"fit"}]}]}"#;
        let hardware: Hardware = serde_json::from_str(text).unwrap();
        assert_eq!(hardware.value_named("arithmetic_one_thread_gflop_per_s"), Some(2.5));
        assert_eq!(hardware.gpu(0).unwrap().value_named("parallel_units"), Some(132.0));
        let written: serde_json::Value = serde_json::to_value(&hardware).unwrap();
        assert_eq!(written, serde_json::from_str::<serde_json::Value>(text).unwrap());
    }
}
