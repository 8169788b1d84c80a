//! The identity of the machine.

use super::cache_sizes;
use crate::hardware::Machine;
use sapwise::algorithm::SimdLevel;

/// Text that the CPU or the operating system reports; empty if it reports none.
#[derive(Debug, Clone, Default)]
struct Cpu {
    brand: String,
    vendor: String,
    /// Family, model and stepping.
    version: String,
    hypervisor: Option<String>,
}

/// Returns the identity of this machine, with a hash of CPU vendor, family, model, stepping and last-level cache as
/// its id.
pub fn machine() -> Machine {
    let cpu = Cpu::of_this_machine();
    let llc = cache_sizes::reported().last().map_or(0, |cache| cache.bytes);
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

/// Core count and memory are not part of the id: a restricted profile of a machine must keep it.
fn physical_id(cpu: &Cpu, llc_bytes: u64) -> String {
    // Architectures without a version, such as ARM, differ by the brand alone.
    let version = if cpu.version.is_empty() { &cpu.brand } else { &cpu.version };
    format!("{:016x}", fnv1a(&format!("{}\n{version}\n{llc_bytes}", cpu.vendor)))
}

/// FNV-1a, 64 bits. Ids must stay the same in every release, which `std`'s hasher does not promise.
pub(crate) fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Cpu {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    fn of_this_machine() -> Self {
        let cpuid = raw_cpuid::CpuId::new();
        let features = cpuid.get_feature_info();
        let hypervisor = || match cpuid.get_hypervisor_info().map(|info| info.identify()) {
            None => "unnamed".to_owned(),
            Some(raw_cpuid::Hypervisor::Unknown(..)) => "unknown".to_owned(),
            Some(known) => format!("{known:?}").to_lowercase(),
        };
        let version = features.as_ref().map(|f| format!("{} {} {}", f.family_id(), f.model_id(), f.stepping_id()));
        Self {
            brand: cpuid.get_processor_brand_string().map_or_else(String::new, |b| b.as_str().trim().to_owned()),
            vendor: cpuid.get_vendor_info().map_or_else(String::new, |v| v.as_str().to_owned()),
            version: version.unwrap_or_default(),
            hypervisor: features.filter(|f| f.has_hypervisor()).map(|_| hypervisor()),
        }
    }

    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    fn of_this_machine() -> Self {
        let Ok(mut system) = sysinfo::System::new() else { return Self::default() };
        system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
        system.cpus().first().map_or_else(Self::default, |cpu| Self {
            brand: cpu.brand().trim().to_owned(),
            vendor: cpu.vendor_id().trim().to_owned(),
            ..Self::default()
        })
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
}
