//! Figures that no machine has: in another unit, or nonsense.

use super::{Bounds, GpuHardware, GpuParameterId, Hardware, HardwareError, ParameterId};

impl Bounds {
    /// The error that a value outside is. A NaN is in no range.
    fn check(self, name: &str, of: &str, value: Option<f64>) -> Option<HardwareError> {
        let value = value.filter(|v| !(self.least..=self.most).contains(v))?;
        Some(HardwareError::Implausible { parameter: format!("{name}{of}"), value, bounds: self })
    }
}

impl Hardware {
    /// The first parameter of the machine, GPUs aside, that no machine has; most often it is in another unit.
    #[must_use]
    pub fn implausible(&self) -> Option<HardwareError> {
        ParameterId::ALL.into_iter().find_map(|id| self.implausible_value(id))
    }

    fn implausible_value(&self, id: ParameterId) -> Option<HardwareError> {
        id.quantity().bounds?.check(id.as_str(), "", self.value(id))
    }

    /// Takes out every figure of the machine, GPUs aside, that no machine has: too few samples on a machine that was busy. What is wrong
    /// with each, which stands in its place too.
    #[cfg(feature = "this-machine")]
    pub(crate) fn drop_implausible(&mut self) -> Vec<HardwareError> {
        let mut dropped = Vec::new();
        for id in ParameterId::ALL {
            if let Some(why) = self.implausible_value(id) {
                let figures = self.parameters.iter_mut().filter(|p| p.name == id);
                figures.for_each(|p| *p = super::Parameter::missing(id, &why.to_string()));
                dropped.push(why);
            }
        }
        dropped
    }
}

impl GpuHardware {
    /// The first parameter that no GPU has; most often it is in another unit.
    #[must_use]
    pub fn implausible(&self) -> Option<HardwareError> {
        let of = format!(" of gpu{}", self.gpu.index);
        GpuParameterId::ALL.into_iter().find_map(|id| id.quantity().bounds?.check(id.as_str(), &of, self.value(id)))
    }
}
