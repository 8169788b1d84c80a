//! What NVIDIA's management library tells. It comes with the driver and is loaded at run time; without it nothing is known
//! here.

/// What the library told of one GPU; each `Err` is a reason for the report.
#[derive(Debug, Clone)]
pub(super) struct Nvml {
    /// Clock of the multiprocessors under load.
    pub(super) clock_ghz: Result<f64, String>,
    /// Memory of the card.
    pub(super) memory_bytes: Result<u64, String>,
    /// CUDA cores.
    pub(super) cores: Result<u32, String>,
    /// Multiprocessors: cores over the cores that one has at this compute capability.
    pub(super) processors: Result<u32, String>,
}

impl Nvml {
    /// Nothing, for one reason.
    fn none(why: &str) -> Self {
        let why = || why.to_owned();
        Self { clock_ghz: Err(why()), memory_bytes: Err(why()), cores: Err(why()), processors: Err(why()) }
    }
}

/// Asks about the GPU at a PCI address such as `0000:01:00.0`. `load` is called just before the clock is read, and must
/// give the GPU work and not wait for it: an idle GPU clocks down.
#[cfg(not(target_vendor = "apple"))]
pub(super) fn query(pci: &str, load: impl FnOnce()) -> Nvml {
    use nvml_wrapper::enum_wrappers::device::Clock;

    if pci.is_empty() {
        return Nvml::none("the driver reports no PCI address, so NVML can't be asked about this GPU");
    }
    let library = match nvml_wrapper::Nvml::init() {
        Ok(library) => library,
        Err(error) => return Nvml::none(&format!("NVML, NVIDIA's management library, can't be used: {error}")),
    };
    let device = match library.device_by_pci_bus_id(pci) {
        Ok(device) => device,
        Err(error) => return Nvml::none(&format!("NVML does not know the GPU: {error}")),
    };
    let text = |error: nvml_wrapper::error::NvmlError| format!("NVML does not tell: {error}");
    let cores = device.num_cores().map_err(text);
    let capability = device.cuda_compute_capability().map_err(text);
    let processors = cores.clone().and_then(|cores| {
        let capability = capability?;
        processors(cores, capability.major, capability.minor).ok_or_else(|| {
            let (major, minor) = (capability.major, capability.minor);
            format!("no table says how many cores a multiprocessor of compute capability {major}.{minor} has")
        })
    });
    let memory_bytes = device.memory_info().map(|memory| memory.total).map_err(text);
    load();
    // The highest of a few: the clock rises while the work runs.
    let clocks = (0..8).map(|_| device.clock_info(Clock::SM)).collect::<Result<Vec<_>, _>>().map_err(text);
    let clock_ghz = clocks.and_then(|mhz| match mhz.into_iter().max() {
        Some(mhz) if mhz > 0 => Ok(f64::from(mhz) / 1000.0),
        _ => Err("NVML reports a clock of zero".to_owned()),
    });
    Nvml { clock_ghz, memory_bytes, cores, processors }
}

/// Nothing: the library does not exist here.
#[cfg(target_vendor = "apple")]
pub(super) fn query(_pci: &str, _load: impl FnOnce()) -> Nvml {
    Nvml::none("there is no NVML on this system")
}

/// Multiprocessors behind this many CUDA cores, by the table of the CUDA programming guide. `None` for what it does not list.
#[cfg_attr(target_vendor = "apple", allow(dead_code, reason = "the library that reports cores does not exist there"))]
fn processors(cores: u32, major: i32, minor: i32) -> Option<u32> {
    let each = match (major, minor) {
        (3, _) => 192,
        (6, 0) | (7, _) | (8, 0) => 64,
        (5 | 6 | 8 | 9 | 10 | 11 | 12, _) => 128,
        _ => return None,
    };
    (cores > 0 && cores.is_multiple_of(each)).then_some(cores / each)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiprocessors_of_known_cards() {
        // H200, A100, V100, RTX 4090, RTX 2080 Ti, GTX 1080, P100, GTX 680.
        let cards = [
            (16_896, 9, 0, 132),
            (6912, 8, 0, 108),
            (5120, 7, 0, 80),
            (16_384, 8, 9, 128),
            (4352, 7, 5, 68),
            (2560, 6, 1, 20),
            (3584, 6, 0, 56),
            (1536, 3, 0, 8),
        ];
        for (cores, major, minor, expected) in cards {
            assert_eq!(processors(cores, major, minor), Some(expected));
        }
        assert_eq!(processors(100, 9, 0), None);
        assert_eq!(processors(0, 9, 0), None);
        assert_eq!(processors(1024, 99, 0), None);
    }

    #[test]
    fn an_absent_library_is_a_reason() {
        let nothing = query("", || {});
        assert!(nothing.clock_ghz.is_err() && nothing.cores.is_err());
    }
}
