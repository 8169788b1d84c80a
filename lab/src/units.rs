//! Figures of hardware parameters with their units.

use crate::text::{bytes, duration};
use sapwise::hardware::GpuParameterId;

/// A value with the unit that the end of its parameter's name says.
pub fn value(name: &str, value: f64) -> String {
    match name {
        _ if name.ends_with("_gb_per_s") => format!("{value:.1} GB/s"),
        _ if name.ends_with("_gflop_per_s") => format!("{value:.0} GFLOP/s"),
        _ if name.ends_with("_g_per_s") => format!("{value:.2} G/s"),
        _ if name == GpuParameterId::UnifiedMemory.as_str() => if value > 0.0 { "yes" } else { "no" }.to_owned(),
        _ if name.ends_with("_bytes") => bytes(value),
        _ if name.ends_with("_ghz") => format!("{value:.2} GHz"),
        _ if name.ends_with("_ns") && value < 1000.0 => format!("{value:.1} ns"),
        _ if name.ends_with("_ns") => duration(value),
        _ if name.ends_with("_ratio") => format!("{value:.2} x"),
        _ => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_unit_of_their_name() {
        assert_eq!(value("cache_l2_bytes", 2_097_152.0), "2 MiB");
        assert_eq!(value("bandwidth_one_thread_gb_per_s", 12.345), "12.3 GB/s");
        assert_eq!(value("latency_16_kib_ns", 1.26), "1.3 ns");
        assert_eq!(value("fork_join_cold_ns", 12_500.0), "12.50 us");
        assert_eq!(value("scaling_two_threads_ratio", 1.9), "1.90 x");
        assert_eq!(value("usable_cores", 2.0), "2");
        assert_eq!(value("arithmetic_gflop_per_s", 51_234.5), "51234 GFLOP/s");
        assert_eq!(value("atomic_g_per_s", 0.25), "0.25 G/s");
        assert_eq!(value("unified_memory", 1.0), "yes");
    }
}
