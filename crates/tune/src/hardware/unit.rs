//! Units of hardware parameters, which end their names.

/// How names end, and the unit that this stands for.
const UNITS: [(&str, &str); 8] = [
    ("_gb_per_s", "GB/s"),
    ("_gflop_per_s", "GFLOP/s"),
    ("_bytes", "bytes"),
    ("_ghz", "GHz"),
    ("_ns", "ns"),
    ("_ratio", "ratio"),
    ("cores", "cores"),
    ("lanes", "lanes"),
];

/// Returns the unit of a parameter's values; empty if its name does not end with one.
pub(super) fn unit(name: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// Returns a parameter's value as people read it: rounded, with its unit.
pub fn with_unit(name: &str, value: f64) -> String {
    match unit(name) {
        unit @ "GB/s" => format!("{value:.1} {unit}"),
        unit @ "GFLOP/s" => format!("{value:.0} {unit}"),
        unit @ "GHz" => format!("{value:.2} {unit}"),
        "bytes" => bytes(value),
        "ns" => nanoseconds(value),
        "ratio" => format!("{value:.2} ×"),
        _ => format!("{value}"),
    }
}

fn nanoseconds(ns: f64) -> String {
    match ns {
        _ if ns < 1e3 => format!("{ns:.1} ns"),
        _ if ns < 1e6 => format!("{:.2} µs", ns / 1e3),
        _ if ns < 1e9 => format!("{:.2} ms", ns / 1e6),
        _ => format!("{:.2} s", ns / 1e9),
    }
}

fn bytes(count: f64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = count;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    let decimals = usize::from(value < 100.0 && unit > 0 && value.fract() != 0.0);
    format!("{value:.decimals$} {}", units[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_unit_of_their_name() {
        assert_eq!(with_unit("cache_l2_bytes", 2_097_152.0), "2 MiB");
        assert_eq!(with_unit("cache_l1d_bytes", 49152.0), "48 KiB");
        assert_eq!(with_unit("cache_llc_bytes", 1.5 * 1024.0 * 1024.0), "1.5 MiB");
        assert_eq!(with_unit("cache_llc_bytes", 12.0), "12 B");
        assert_eq!(with_unit("bandwidth_one_thread_gb_per_s", 12.345), "12.3 GB/s");
        assert_eq!(with_unit("latency_16_kib_ns", 1.26), "1.3 ns");
        assert_eq!(with_unit("fork_join_cold_ns", 12_500.0), "12.50 µs");
        assert_eq!(with_unit("fork_join_cold_ns", 1_234_567.0), "1.23 ms");
        assert_eq!(with_unit("scaling_two_threads_ratio", 1.9), "1.90 ×");
        assert_eq!(with_unit("usable_cores", 2.0), "2");
        assert_eq!(with_unit("arithmetic_gflop_per_s", 51_234.5), "51234 GFLOP/s");
    }
}
