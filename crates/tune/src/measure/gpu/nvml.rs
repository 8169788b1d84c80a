//! Parameters from NVIDIA's management library, which comes with the driver and is loaded at run time.

use nvml_wrapper::Nvml;
use nvml_wrapper::enum_wrappers::device::Clock;

use crate::hardware::{GpuParameterId, Parameter};

/// Asks about the GPU at a PCI address such as `0000:01:00.0`, which must be at work.
///
/// # Errors
/// Says why the library can't be asked.
pub(super) fn query(pci: &str) -> Result<Vec<Parameter>, String> {
    let library = Nvml::init().map_err(|e| format!("NVML, NVIDIA's management library, can't be used: {e}"))?;
    let device = library.device_by_pci_bus_id(pci).map_err(|e| format!("NVML does not know the GPU: {e}"))?;
    let cores = device.num_cores().ok();
    let capability = device.cuda_compute_capability().ok();
    let processors = cores.zip(capability).and_then(|(cores, of)| processors(cores, of.major, of.minor));
    // The highest of a few: the clock rises while the work runs.
    let mhz = (0..8).filter_map(|_| device.clock_info(Clock::SM).ok()).max().filter(|&mhz| mhz > 0);
    let ghz = mhz.map(|mhz| f64::from(mhz) / 1000.0);
    let found = [
        (GpuParameterId::MemoryBytes, device.memory_info().ok().map(|memory| memory.total as f64), "NVML"),
        (GpuParameterId::ClockGhz, ghz, "NVML, clock of the multiprocessors under load"),
        (GpuParameterId::Processors, processors.map(f64::from), "NVML, CUDA cores over the cores of a multiprocessor"),
        (GpuParameterId::Lanes, cores.map(f64::from), "NVML, CUDA cores"),
    ];
    Ok(found.into_iter().filter_map(|(id, value, source)| Some(Parameter::reported(id, value?, source))).collect())
}

/// Multiprocessors behind a number of CUDA cores, by the table of the CUDA programming guide. `None` for what it does
/// not list.
fn processors(cores: u32, major: i32, minor: i32) -> Option<u32> {
    let each = match (major, minor) {
        (3, _) => 192,
        (6, 0) | (7, _) | (8, 0) => 64,
        (5 | 6 | 8..=12, _) => 128,
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
}
