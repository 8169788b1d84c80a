//! Machines in files.

use super::wire;
use crate::hardware::{GpuGroup, GpuHardware, GpuIdentity, GpuKind, HardwareError, How, Machine, Parameter, Statistic};

wire! {
    /// What is known about a machine.
    Hardware = crate::Hardware, checked HardwareError {
        /// Which machine it is.
        machine: Machine,
        /// Its parameters; a name stands at most once.
        parameters: Vec<Parameter>,
        /// Its GPUs, by their number.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        gpus: Vec<GpuHardware>,
        /// GPUs that work together.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        gpu_groups: Vec<GpuGroup>,
    }
}

wire! {
    /// What a machine says of itself. Holds nothing that names a host, a user or a single piece of hardware.
    MachineKeys = Machine {
        /// A hash of CPU vendor, family, model, stepping and last-level cache, as 16 hex digits.
        physical_id: String,
        /// Brand text of the CPU.
        cpu: String,
        /// Vendor text of the CPU.
        vendor: String,
        /// Architecture.
        arch: String,
        /// Operating system.
        os: String,
        /// SIMD level in use: `portable`, `avx2`, `avx512`.
        simd: String,
        /// `none`, or the name of the hypervisor where the CPU reports one.
        hypervisor: String,
    }
}

wire! {
    /// One figure of a machine.
    ParameterKeys = Parameter {
        /// Name with its unit as the last words.
        name: String,
        /// The figure; null when it is missing.
        value: Option<f64>,
        /// Interquartile range over median of the samples; null when there are fewer than four.
        dispersion: Option<f64>,
        /// How many samples stand behind the value.
        samples: u32,
        /// Samples that were thrown away because foreign load spoiled them.
        spoiled: u32,
        /// Highest share of the CPU, 0 to 1, that other programs took during the samples kept; null when it can't be told.
        foreign_load: Option<f64>,
        /// Where the figure came from.
        how: How,
        /// The method of a measurement, the interface of a report, or why the figure is missing.
        source: String,
        /// How the value follows from the samples.
        #[serde(default, skip_serializing_if = "Statistic::is_median")]
        statistic: Statistic,
        /// The samples kept, in the unit of the name, in the order of measurement.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        raw: Vec<f64>,
    }
}

wire! {
    /// One GPU.
    GpuHardwareKeys = GpuHardware {
        /// Which GPU it is.
        gpu: GpuIdentity,
        /// Its parameters; a name stands at most once.
        parameters: Vec<Parameter>,
    }
}

wire! {
    /// What a GPU and its driver say of themselves. Holds no serial number and no bus address.
    GpuIdentityKeys = GpuIdentity {
        /// The number in `gpu0`, `gpu1` and so on.
        index: u32,
        /// Name as the driver tells it.
        name: String,
        /// PCI vendor and device number, or the numbers that the driver uses in their place.
        device: String,
        /// Name and version of the driver.
        driver: String,
        /// The interface it is driven through: `vulkan`, `metal` or `dx12`.
        api: String,
        /// What kind of GPU it is.
        kind: GpuKind,
    }
}

wire! {
    /// Several GPUs at work at the same time.
    GpuGroupKeys = GpuGroup {
        /// Numbers of the GPUs, ascending, two or more.
        gpus: Vec<u32>,
        /// Parameters of the group; a name stands at most once.
        parameters: Vec<Parameter>,
    }
}

#[cfg(test)]
mod tests {
    use crate::{Hardware, Machine, Parameter, ParameterId};

    #[test]
    fn parameters_that_this_version_does_not_know_are_kept() {
        let of_tomorrow = Parameter::measured("photons_per_s", 1e9, "a machine of tomorrow");
        let known = Parameter::reported(ParameterId::UsableCores, 2.0, "test");
        let hardware = Hardware::new(Machine::of("0123456789abcdef"), vec![known, of_tomorrow]);
        let text = serde_json::to_string(&hardware).unwrap();
        let read: Hardware = serde_json::from_str(&text).unwrap();
        assert_eq!(read, hardware);
        assert_eq!((read.value(ParameterId::UsableCores), read.value_named("photons_per_s")), (Some(2.0), Some(1e9)));
    }

    #[test]
    fn figures_that_can_not_be_are_refused_where_a_file_is_read() {
        let twice = vec![Parameter::reported("x_ns", 1.0, "test"); 2];
        let text = serde_json::to_string(&Hardware::new(Machine::default(), twice)).unwrap();
        let error = serde_json::from_str::<Hardware>(&text).unwrap_err().to_string();
        assert!(error.contains("the parameter x_ns is listed twice"), "{error}");
    }
}
