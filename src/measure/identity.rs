//! What the machine says of itself.

use super::cache_sizes;
use crate::SimdLevel;
use crate::hardware::Machine;

/// Text that the operating system or the CPU reports; empty where it reports none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Cpu {
    brand: String,
    vendor: String,
    /// Family, model and stepping, or what the architecture has in their place.
    version: String,
    hypervisor: Option<String>,
}

pub(super) fn machine() -> Machine {
    let cpu = Cpu::of_this_machine();
    let llc = cache_sizes::reported().last_level.map_or(0, |level| level.bytes);
    Machine {
        physical_id: physical_id(&cpu, llc),
        cpu: cpu.brand,
        vendor: cpu.vendor,
        arch: std::env::consts::ARCH.to_owned(),
        os: std::env::consts::OS.to_owned(),
        simd: SimdLevel::in_use().to_string(),
        hypervisor: cpu.hypervisor.unwrap_or_else(|| "none".to_owned()),
    }
}

/// Neither core count nor memory goes in: a restricted profile of a machine must keep the machine's id.
fn physical_id(cpu: &Cpu, llc_bytes: u64) -> String {
    // Architectures without a version in the CPU, such as Apple's, are told apart by the brand alone.
    let version = if cpu.version.is_empty() { &cpu.brand } else { &cpu.version };
    format!("{:016x}", fnv1a(&format!("{}\n{version}\n{llc_bytes}", cpu.vendor)))
}

/// FNV-1a, 64 bits. Written out because ids must stay the same in every release, and `std`'s hasher promises nothing.
pub(crate) fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Cpu {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    fn of_this_machine() -> Self {
        let cpuid = raw_cpuid::CpuId::new();
        let features = cpuid.get_feature_info();
        let hypervisor = features.as_ref().filter(|f| f.has_hypervisor()).map(|_| {
            cpuid.get_hypervisor_info().map_or_else(
                || "unnamed".to_owned(),
                |info| match info.identify() {
                    raw_cpuid::Hypervisor::Unknown(..) => "unknown".to_owned(),
                    known => format!("{known:?}").to_lowercase(),
                },
            )
        });
        Self {
            brand: cpuid.get_processor_brand_string().map_or_else(String::new, |b| b.as_str().trim().to_owned()),
            vendor: cpuid.get_vendor_info().map_or_else(String::new, |v| v.as_str().to_owned()),
            version: features
                .map_or_else(String::new, |f| format!("{} {} {}", f.family_id(), f.model_id(), f.stepping_id())),
            hypervisor,
        }
    }

    /// `/proc/cpuinfo` on Linux, else what sysinfo finds.
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    fn of_this_machine() -> Self {
        let mut cpu =
            std::fs::read_to_string("/proc/cpuinfo").map_or_else(|_| Self::default(), |text| parse_cpuinfo(&text));
        if let Ok(mut system) = sysinfo::System::new() {
            system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
            if let Some(first) = system.cpus().first() {
                if cpu.brand.is_empty() {
                    cpu.brand = first.brand().trim().to_owned();
                }
                if cpu.vendor.is_empty() {
                    cpu.vendor = first.vendor_id().trim().to_owned();
                }
            }
        }
        cpu
    }
}

/// The first CPU of an ARM `/proc/cpuinfo`. Such machines have numbers where x86 has texts.
#[cfg(any(test, not(any(target_arch = "x86", target_arch = "x86_64"))))]
fn parse_cpuinfo(text: &str) -> Cpu {
    let field = |name: &str| {
        let line = text.lines().find(|line| line.split(':').next().is_some_and(|key| key.trim() == name))?;
        line.split_once(':').map(|(_, value)| value.trim().to_owned())
    };
    let version: Vec<String> =
        ["CPU architecture", "CPU variant", "CPU part", "CPU revision"].into_iter().filter_map(field).collect();
    Cpu {
        brand: field("model name").unwrap_or_default(),
        vendor: field("CPU implementer").unwrap_or_default(),
        version: version.join(" "),
        hypervisor: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv1a_of_published_texts() {
        // From the test vectors of the FNV reference code.
        assert_eq!(fnv1a(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a("a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a("foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn id_depends_on_version_and_cache_but_not_on_the_brand() {
        let cpu = Cpu { brand: "x".into(), vendor: "v".into(), version: "6 1 2".into(), hypervisor: None };
        let id = physical_id(&cpu, 1 << 25);
        assert_eq!(id.len(), 16);
        assert_eq!(id, physical_id(&Cpu { brand: "y".into(), hypervisor: Some("kvm".into()), ..cpu.clone() }, 1 << 25));
        assert_ne!(id, physical_id(&cpu, 1 << 24));
        assert_ne!(id, physical_id(&Cpu { version: "6 1 3".into(), ..cpu }, 1 << 25));
    }

    #[test]
    fn arm_cpuinfo() {
        let text = "processor\t: 0\nBogoMIPS\t: 243.75\nCPU implementer\t: 0x41\nCPU architecture: 8\n\
                    CPU variant\t: 0x3\nCPU part\t: 0xd0c\nCPU revision\t: 1\n";
        let cpu = parse_cpuinfo(text);
        assert_eq!((cpu.vendor.as_str(), cpu.version.as_str()), ("0x41", "8 0x3 0xd0c 1"));
        assert_eq!(parse_cpuinfo(""), Cpu::default());
    }
}
