//! The clock that the system reports, and the clock that a chain of dependent additions shows.
//!
//! They differ: one virtual machine reported 2.0 GHz and ran at 2.4 GHz.

use std::hint::black_box;
use std::time::Instant;

use super::Options;
use super::samples::Plan;
use crate::hardware::{Parameter, ParameterId, Statistic};

/// Links of one timed chain: 1.4 ms at 4 GHz, short enough to fit between two interruptions, and long enough that a
/// report holds a few hundred samples at most.
const LINKS: u64 = 5_600_000;

/// Additions that the assembly repeats before it returns to the loop, whose own counter runs beside the chain.
const UNROLLED: u64 = 64;

pub(super) fn measure(options: &Options) -> Result<Vec<Parameter>, String> {
    let method = format!(
        "chain of {LINKS} dependent register additions on one thread; value is the median of the fastest quarter of \
         the chains, dispersion is of all"
    );
    // An interruption can only make a chain slower, so the fast ones show the clock. The best of hundreds would be a
    // short boost.
    let plan = Plan { statistic: Statistic::FastestQuarterMedian, ..options.plan(100, 450) };
    let measured = plan.measure([(ParameterId::ClockMeasuredGhz, method)], || Ok([chain_ghz()]));
    measured.map(|measured| std::iter::once(reported()).chain(measured).collect())
}

/// Clock from one addition a cycle.
///
/// The addend is a register: cores such as Golden Cove eliminate the addition of an immediate at rename, which would
/// show five times the clock. In assembly, because the compiler would replace the chain by a multiplication.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
fn chain_ghz() -> f64 {
    use std::arch::asm;
    let mut sum = black_box(1_u64);
    let addend = black_box(3_u64);
    let start = Instant::now();
    for _ in 0..LINKS / UNROLLED {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: adds one register to another, 64 times; touches neither memory nor the stack, and the flags are not
        // preserved.
        unsafe {
            asm!(
                ".rept 64", "add {sum}, {addend}", ".endr",
                sum = inout(reg) sum, addend = in(reg) addend, options(nomem, nostack)
            );
        }
        #[cfg(target_arch = "aarch64")]
        // SAFETY: adds one register to another, 64 times; touches neither memory, the stack nor the flags.
        unsafe {
            asm!(
                ".rept 64",
                "add {sum}, {sum}, {addend}",
                ".endr",
                sum = inout(reg) sum,
                addend = in(reg) addend,
                options(nomem, nostack, preserves_flags)
            );
        }
    }
    black_box(sum);
    // Infinite if the system's clock did not move.
    (LINKS / UNROLLED * UNROLLED) as f64 / start.elapsed().as_nanos() as f64
}

/// NaN: nobody wrote a chain for this architecture.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn chain_ghz() -> f64 {
    f64::NAN
}

fn reported() -> Parameter {
    let name = ParameterId::ClockReportedGhz;
    // The highest clock first: it does not change from one second to the next.
    let path = "/sys/devices/system/cpu/cpu0/cpufreq/cpuinfo_max_freq";
    if let Some(khz) = std::fs::read_to_string(path).ok().and_then(|text| positive(&text)) {
        return Parameter::reported(name, khz / 1e6, path);
    }
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(mhz) = raw_cpuid::CpuId::new().get_processor_frequency_info().map(|i| i.processor_max_frequency())
        && mhz > 0
    {
        return Parameter::reported(name, f64::from(mhz) / 1e3, "CPUID leaf 0x16, maximum");
    }
    // sysinfo rounds it to MHz, which would make another host of the same one.
    match std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| parse_cpu_mhz(&text)) {
        Some(mhz) => Parameter::reported(name, mhz / 1e3, "/proc/cpuinfo, cpu MHz of the first CPU"),
        None => Parameter::missing(name, "neither cpufreq, CPUID leaf 0x16 nor /proc/cpuinfo reports it"),
    }
}

fn positive(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0)
}

/// MHz of the first CPU in the text of `/proc/cpuinfo`.
fn parse_cpu_mhz(text: &str) -> Option<f64> {
    let line = text.lines().find(|line| line.starts_with("cpu MHz"))?;
    positive(line.split_once(':')?.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cpu_mhz_and_never_bogomips() {
        assert_eq!(parse_cpu_mhz("processor\t: 0\ncpu MHz\t\t: 2599.998\nbogomips\t: 5199.99\n"), Some(2599.998));
        assert_eq!(parse_cpu_mhz("BogoMIPS\t: 243.75\n"), None);
        assert_eq!(parse_cpu_mhz("cpu MHz\t\t: 0.000\n"), None);
        assert_eq!(parse_cpu_mhz("cpu MHz"), None);
    }
}
