//! What the Linux driver of AMD GPUs reports in files below `/sys`.

use std::fs;
use std::time::{Duration, Instant};

use super::reported::LOAD;
use crate::hardware::{GpuParameterId, Parameter};

/// Reads about the GPU at a PCI address such as `0000:01:00.0`, which must be at work.
pub(super) fn query(pci: &str) -> Vec<Parameter> {
    let sclk = || parse_sclk_mhz(&fs::read_to_string(format!("/sys/bus/pci/devices/{pci}/pp_dpm_sclk")).ok()?);
    // The highest of a few: the clock rises while the work runs.
    let (start, mut mhz) = (Instant::now(), sclk());
    while mhz.is_some() && start.elapsed() < LOAD {
        std::thread::sleep(Duration::from_millis(2));
        mhz = mhz.max(sclk());
    }
    let clock = mhz.map(|mhz| Parameter::reported(GpuParameterId::ClockGhz, mhz as f64 / 1e3, "amdgpu, pp_dpm_sclk"));
    let units = compute_units(pci).into_iter().flat_map(|units| {
        // Four units of 16 lanes, or two of 32.
        let lanes = (GpuParameterId::Lanes, 64 * units, "KFD, 64 lanes for each compute unit");
        [(GpuParameterId::Processors, units, "KFD, simd_count over simd_per_cu"), lanes]
            .map(|(id, count, source)| Parameter::reported(id, count as f64, source))
    });
    clock.into_iter().chain(units).collect()
}

/// The clock in use, from lines such as `1: 1200Mhz *`: the one with the star.
fn parse_sclk_mhz(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.trim_end().strip_suffix('*'))?;
    let clock = line.split_once(':')?.1.trim().to_ascii_lowercase();
    clock.strip_suffix("mhz")?.parse().ok()
}

/// Compute units, from the kernel's list of compute nodes.
fn compute_units(pci: &str) -> Option<u64> {
    let location = parse_location(pci)?;
    let nodes = fs::read_dir("/sys/class/kfd/kfd/topology/nodes").ok()?;
    let texts = nodes.flatten().filter_map(|node| fs::read_to_string(node.path().join("properties")).ok());
    texts.into_iter().find_map(|text| parse_units(&text, location))
}

/// Domain and location of a PCI address, as the list of compute nodes has them.
fn parse_location(pci: &str) -> Option<(u64, u64)> {
    let hex = |text| u64::from_str_radix(text, 16).ok();
    let (address, function) = pci.rsplit_once('.')?;
    let fields: Vec<u64> = address.split(':').map(hex).collect::<Option<_>>()?;
    let &[domain, bus, device] = &fields[..] else { return None };
    Some((domain, bus << 8 | device << 3 | hex(function)?))
}

/// Compute units from the text of a node's properties, if it is the node at this location.
fn parse_units(text: &str, (domain, location): (u64, u64)) -> Option<u64> {
    let value = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
        line.trim().parse::<u64>().ok()
    };
    let is_it = value("location_id")? == location && value("domain").unwrap_or(0) == domain;
    value("simd_count")?.checked_div(value("simd_per_cu")?).filter(|&units| is_it && units > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_in_use() {
        assert_eq!(parse_sclk_mhz("0: 500Mhz\n1: 1200Mhz *\n2: 2000Mhz\n"), Some(1200));
        for wrong in ["0: 500Mhz\n", "*", ""] {
            assert_eq!(parse_sclk_mhz(wrong), None);
        }
    }

    #[test]
    fn compute_units_of_the_node_at_an_address() {
        assert_eq!(parse_location("0001:c1:1f.7"), Some((1, 0xc1ff)));
        for wrong in ["", "0000:03:00", "03:00.0", "x:03:00.0"] {
            assert_eq!(parse_location(wrong), None, "{wrong}");
        }
        let node = "cpu_cores_count 0\nsimd_count 160\nmem_banks_count 1\nsimd_per_cu 4\nlocation_id 768\ndomain 0\n";
        let at = |pci| parse_units(node, parse_location(pci).unwrap());
        assert_eq!((at("0000:03:00.0"), at("0000:03:00.1"), at("0001:03:00.0")), (Some(40), None, None));
        // The node of a CPU.
        assert_eq!(parse_units("simd_count 0\nsimd_per_cu 0\nlocation_id 0\n", (0, 0)), None);
    }
}
