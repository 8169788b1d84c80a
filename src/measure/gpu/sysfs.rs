//! What Linux tells of AMD and Intel GPUs, in files below `/sys`.

use std::fs;
use std::path::{Path, PathBuf};

/// The files of one GPU.
#[derive(Debug, Clone)]
pub(super) struct Sysfs {
    /// `/sys/bus/pci/devices/0000:01:00.0`.
    device: PathBuf,
}

impl Sysfs {
    /// The GPU at a PCI address such as `0000:01:00.0`; where there is none, the only one of that vendor and device number.
    pub(super) fn find(pci: &str, vendor: u32, device: u32) -> Option<Self> {
        let all = Path::new("/sys/bus/pci/devices");
        if !pci.is_empty() {
            return Some(Self { device: all.join(pci) }).filter(|s| s.device.is_dir());
        }
        let id = |path: &Path, name: &str| parse_hex(&fs::read_to_string(path.join(name)).ok()?);
        let is_it = |path: &PathBuf| id(path, "vendor") == Some(vendor) && id(path, "device") == Some(device);
        let mut found = fs::read_dir(all).ok()?.filter_map(Result::ok).map(|entry| entry.path()).filter(is_it);
        let first = found.next()?;
        // Two of the same kind can't be told apart without an address.
        found.next().is_none().then_some(Self { device: first })
    }

    /// Memory of an AMD card.
    pub(super) fn memory_bytes(&self) -> Option<u64> {
        self.number("mem_info_vram_total").filter(|&bytes| bytes > 0)
    }

    /// The present clock, and the file that tells. The GPU must be at work.
    pub(super) fn clock_ghz(&self) -> Option<(f64, &'static str)> {
        let amd = || Some((parse_dpm(&self.text("pp_dpm_sclk")?)?, "amdgpu, pp_dpm_sclk"));
        let i915 = |name, source| Some((self.card_number(name)?, source));
        let mhz = amd()
            .or_else(|| i915("gt/gt0/rps_act_freq_mhz", "i915, rps_act_freq_mhz"))
            .or_else(|| i915("gt_act_freq_mhz", "i915, gt_act_freq_mhz"))
            .or_else(|| Some((self.number("tile0/gt0/freq0/act_freq")?, "xe, act_freq")))?;
        // Intel reports zero while it sleeps.
        (mhz.0 > 0).then_some((mhz.0 as f64 / 1000.0, mhz.1))
    }

    /// Compute units and lanes of an AMD GPU, from the kernel's list of compute nodes.
    pub(super) fn compute(&self) -> Option<Compute> {
        let address = parse_address(self.device.file_name()?.to_str()?)?;
        let nodes = fs::read_dir("/sys/class/kfd/kfd/topology/nodes").ok()?;
        nodes
            .filter_map(Result::ok)
            .filter_map(|node| fs::read_to_string(node.path().join("properties")).ok())
            .find_map(|text| parse_node(&text, address))
    }

    fn text(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.device.join(name)).ok()
    }

    fn number(&self, name: &str) -> Option<u64> {
        self.text(name)?.trim().parse().ok()
    }

    /// A number in the folder of the GPU's card, `drm/card0` or another.
    fn card_number(&self, name: &str) -> Option<u64> {
        let cards = fs::read_dir(self.device.join("drm")).ok()?;
        let is_card = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(|n| n.starts_with("card"));
        cards
            .filter_map(Result::ok)
            .filter(is_card)
            .find_map(|card| fs::read_to_string(card.path().join(name)).ok()?.trim().parse().ok())
    }
}

/// Processors of an AMD GPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Compute {
    pub(super) units: u32,
    pub(super) lanes: u32,
}

/// A number such as `0x1002`.
fn parse_hex(text: &str) -> Option<u32> {
    u32::from_str_radix(text.trim().strip_prefix("0x")?, 16).ok()
}

/// The clock in MHz from lines such as `1: 1200Mhz *`: the one with the star is in use.
fn parse_dpm(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.trim_end().strip_suffix('*'))?;
    let (_, clock) = line.split_once(':')?;
    let clock = clock.trim().to_ascii_lowercase();
    clock.strip_suffix("mhz")?.trim().parse().ok()
}

/// Domain and location, as the list of compute nodes has them, of a PCI address.
fn parse_address(text: &str) -> Option<(u64, u64)> {
    let (rest, function) = text.rsplit_once('.')?;
    let mut numbers = rest.split(':').map(|field| u64::from_str_radix(field, 16).ok());
    let (domain, bus, device) = (numbers.next()??, numbers.next()??, numbers.next()??);
    let function = u64::from_str_radix(function, 16).ok()?;
    (numbers.next().is_none() && bus < 256 && device < 32 && function < 8)
        .then_some((domain, bus << 8 | device << 3 | function))
}

/// Compute units and lanes from the text of a node's properties, if it is the node at this address.
fn parse_node(text: &str, (domain, location): (u64, u64)) -> Option<Compute> {
    let value = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
        line.trim().parse::<u64>().ok()
    };
    if value("location_id")? != location || value("domain").unwrap_or(0) != domain {
        return None;
    }
    let (simds, each) = (value("simd_count")?, value("simd_per_cu")?);
    let units = u32::try_from(simds.checked_div(each)?).ok().filter(|&units| units > 0)?;
    // Four units of 16 lanes, or two of 32: 64 either way.
    Some(Compute { units, lanes: units.checked_mul(64)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: &str = "cpu_cores_count 0\nsimd_count 160\nmem_banks_count 1\nsimd_per_cu 4\nwave_front_size 64\n\
                        vendor_id 4098\ndevice_id 26273\nlocation_id 768\ndomain 0\n";

    #[test]
    fn the_clock_in_use() {
        assert_eq!(parse_dpm("0: 500Mhz\n1: 1200Mhz *\n2: 2000Mhz\n"), Some(1200));
        assert_eq!(parse_dpm("0: 500MHz *"), Some(500));
        assert_eq!(parse_dpm("0: 500Mhz\n"), None);
        assert_eq!(parse_dpm("*"), None);
        assert_eq!(parse_dpm(""), None);
    }

    #[test]
    fn addresses() {
        assert_eq!(parse_address("0000:03:00.0"), Some((0, 768)));
        assert_eq!(parse_address("0001:c1:1f.7"), Some((1, 0xc1ff)));
        for text in ["", "0000:03:00", "03:00.0", "0000:03:00:00.0", "0000:100:00.0", "x:03:00.0"] {
            assert_eq!(parse_address(text), None, "{text}");
        }
    }

    #[test]
    fn nodes() {
        assert_eq!(parse_node(NODE, (0, 768)), Some(Compute { units: 40, lanes: 2560 }));
        assert_eq!(parse_node(NODE, (0, 769)), None);
        assert_eq!(parse_node(NODE, (1, 768)), None);
        // The node of a CPU.
        assert_eq!(parse_node("simd_count 0\nsimd_per_cu 0\nlocation_id 0\n", (0, 0)), None);
        assert_eq!(parse_node("", (0, 0)), None);
    }

    #[test]
    fn identities() {
        assert_eq!(parse_hex("0x1002\n"), Some(0x1002));
        assert_eq!(parse_hex("1002"), None);
        assert!(Sysfs::find("", u32::MAX, u32::MAX).is_none());
        assert!(Sysfs::find("ffff:ff:1f.7", 0, 0).is_none());
    }
}
