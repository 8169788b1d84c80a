//! Finds values that no machine has: another unit, or nonsense.

use super::{Bounds, GpuHardware, GpuParameterId, Hardware, HardwareError, ParameterId};

impl Bounds {
    /// Returns the error of a value outside; NaN is outside.
    fn check(self, name: &str, of: &str, value: Option<f64>) -> Option<HardwareError> {
        let Self { least, most } = self;
        let value = value.filter(|v| !(least..=most).contains(v))?;
        Some(HardwareError(format!(
            "the parameter {name}{of} is {value}, and no machine lies outside {least} to {most}; check its unit, or \
             measure it with `sapwise probe --hardware-only`"
        )))
    }
}

impl Hardware {
    /// Returns the first parameter of the machine, without its GPUs, whose value no machine has.
    pub fn implausible(&self) -> Option<HardwareError> {
        ParameterId::ALL.into_iter().find_map(|id| self.implausible_value(id))
    }

    fn implausible_value(&self, id: ParameterId) -> Option<HardwareError> {
        id.quantity().bounds?.check(id.as_str(), "", self.value(id))
    }

    /// Makes each implausible parameter of the machine missing, without its GPUs, and returns why. A busy machine
    /// yields such values.
    #[cfg(feature = "measure")]
    pub(crate) fn drop_implausible(&mut self) -> Vec<HardwareError> {
        let mut dropped = Vec::new();
        for id in ParameterId::ALL {
            if let Some(why) = self.implausible_value(id) {
                let values = self.parameters.iter_mut().filter(|p| p.name == id);
                values.for_each(|p| *p = super::Parameter::missing(id, &why.to_string()));
                dropped.push(why);
            }
        }
        dropped
    }
}

impl GpuHardware {
    /// Returns the first parameter whose value no GPU has.
    pub fn implausible(&self) -> Option<HardwareError> {
        let of = format!(" of gpu{}", self.gpu.index);
        GpuParameterId::ALL.into_iter().find_map(|id| id.quantity().bounds?.check(id.as_str(), &of, self.value(id)))
    }
}
