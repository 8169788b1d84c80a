//! Bounds that no machine lies beyond: a figure outside is in another unit, or nonsense.

#[cfg(feature = "this-machine")]
use super::Parameter;
use super::{GpuHardware, Hardware, gpu, parameter};

/// A parameter's lowest and highest plausible value, and why.
type Bounds = (&'static str, f64, f64, &'static str);

/// Of a machine. Wide on purpose: a machine that is merely unlike those of the training is told by the model's ranges. A unit
/// that is off by a thousand lies outside for most machines, and for the others the ranges are left.
const OF_MACHINE: [Bounds; 11] = [
    (parameter::USABLE_CORES, 1.0, 4096.0, "no system runs more processors"),
    (parameter::CLOCK_REPORTED_GHZ, 0.05, 20.0, "from microcontrollers to twice what any processor has been cooled for"),
    (parameter::CLOCK_MEASURED_GHZ, 0.05, 20.0, "from microcontrollers to twice what any processor has been cooled for"),
    (parameter::SIMD_LANES, 1.0, 64.0, "from none to the 2048 bits of the widest vector instructions"),
    (parameter::CACHE_LLC_BYTES, 65_536.0, 17_179_869_184.0, "from boards for hobbyists to ten times the largest server's"),
    (
        parameter::BANDWIDTH_ONE_THREAD_GB_PER_S,
        0.2,
        1000.0,
        "one channel of memory of 1998, and more than any one core takes",
    ),
    (
        parameter::BANDWIDTH_ALL_THREADS_GB_PER_S,
        0.2,
        5000.0,
        "one channel of memory of 1998, and two sockets of stacked memory",
    ),
    (parameter::CORE_TO_CORE_NS, 1.0, 1e5, "light goes a foot in a nanosecond; between sockets it is under a microsecond"),
    (parameter::FORK_JOIN_COLD_NS, 50.0, 1e9, "one message between cores takes that long, and nobody waits for a second"),
    (parameter::SCALING_TWO_THREADS_RATIO, 0.05, 20.0, "a disturbed thread makes two look better, but not in percent"),
    (parameter::SCALING_ALL_THREADS_RATIO, 0.05, 8192.0, "twice the most processors"),
];

/// Of a GPU.
const OF_GPU: [Bounds; 11] = [
    (gpu::parameter::CLOCK_GHZ, 0.01, 20.0, "from the first cards to twice what any processor has been cooled for"),
    (gpu::parameter::ROUND_TRIP_NS, 100.0, 1e9, "one message over a bus takes that long, and nobody waits for a second"),
    (gpu::parameter::READ_BACK_NS, 100.0, 1e9, "one message over a bus takes that long, and nobody waits for a second"),
    (gpu::parameter::DISPATCH_NS, 10.0, 1e9, "some dozen cycles, and nobody waits for a second"),
    (
        gpu::parameter::UPLOAD_GB_PER_S,
        0.01,
        2000.0,
        "a tenth of the first bus for graphics, and more than any link of today",
    ),
    (
        gpu::parameter::UPLOAD_RATE_GB_PER_S,
        0.01,
        2000.0,
        "a tenth of the first bus for graphics, and more than any link of today",
    ),
    (
        gpu::parameter::DOWNLOAD_GB_PER_S,
        0.01,
        2000.0,
        "a tenth of the first bus for graphics, and more than any link of today",
    ),
    (
        gpu::parameter::DOWNLOAD_RATE_GB_PER_S,
        0.01,
        2000.0,
        "a tenth of the first bus for graphics, and more than any link of today",
    ),
    (gpu::parameter::READ_GB_PER_S, 0.1, 100_000.0, "programs that act as GPUs, and ten times the fastest memory of today"),
    (gpu::parameter::COPY_GB_PER_S, 0.1, 100_000.0, "programs that act as GPUs, and ten times the fastest memory of today"),
    (gpu::parameter::ARITHMETIC_GFLOP_PER_S, 0.1, 1e6, "programs that act as GPUs, and ten times the fastest GPU of today"),
];

impl Hardware {
    /// A sentence on the first parameter of the machine, GPUs aside, that no machine has; most often it is in another unit.
    #[must_use]
    pub fn implausible(&self) -> Option<String> {
        OF_MACHINE.iter().find_map(|bounds| outside(bounds, "", self.value(bounds.0)))
    }

    /// Takes out every figure of the machine, GPUs aside, that no machine has: too few samples on a machine that was busy. A
    /// sentence on each, which stands in its place too.
    #[cfg(feature = "this-machine")]
    pub(crate) fn drop_implausible(&mut self) -> Vec<String> {
        let mut told = Vec::new();
        for bounds in &OF_MACHINE {
            if let Some(why) = outside(bounds, "", self.value(bounds.0)) {
                let figures = self.parameters.iter_mut().filter(|p| p.name == bounds.0);
                figures.for_each(|p| *p = Parameter::missing(bounds.0, &why));
                told.push(why);
            }
        }
        told
    }
}

impl GpuHardware {
    /// A sentence on the first parameter that no GPU has; most often it is in another unit.
    #[must_use]
    pub fn implausible(&self) -> Option<String> {
        let of = format!(" of gpu{}", self.gpu.index);
        OF_GPU.iter().find_map(|bounds| outside(bounds, &of, self.value(bounds.0)))
    }
}

fn outside(&(name, least, most, why): &Bounds, of: &str, value: Option<f64>) -> Option<String> {
    // A NaN is in no range.
    let value = value.filter(|v| !(least..=most).contains(v))?;
    Some(format!(
        "the parameter {name}{of} is {value}, and no machine lies outside {least} to {most} ({why}); check its unit, or measure \
         it with `sapwise probe --hardware-only`"
    ))
}
