//! What a machine really is: figures that follow from its specification through stated efficiencies.
//!
//! The report holds them with the noise of a measurement. The efficiencies are rules of thumb, the same for every part of a kind but for a
//! log-normal factor of its own; none was fitted to anything.

use super::factors::{factor, share};
use super::pairing::Build;
use super::specification::{Card, Cpu, Gpu};

/// A CPU as it is.
#[derive(Debug, Clone)]
pub(super) struct TrueCpu {
    pub(super) name: String,
    pub(super) year: f64,
    pub(super) cores: f64,
    pub(super) threads: f64,
    /// Clock of one busy core.
    pub(super) ghz: f64,
    /// Clock when all cores are busy.
    pub(super) all_cores_ghz: f64,
    pub(super) lanes: f64,
    /// First, second and last level.
    pub(super) cache_bytes: [f64; 3],
    /// Of these levels and of the memory.
    pub(super) latency_ns: [f64; 4],
    pub(super) one_thread_gb_per_s: f64,
    pub(super) all_threads_gb_per_s: f64,
    pub(super) fork_join_warm_ns: f64,
    pub(super) fork_join_cold_ns: f64,
    /// What the second thread of a core adds to arithmetic.
    pub(super) second_thread: f64,
}

/// A GPU as it is. Transfers are between CPU and GPU.
#[derive(Debug, Clone)]
pub(super) struct TrueGpu {
    pub(super) name: String,
    pub(super) upload_gb_per_s: f64,
    pub(super) download_gb_per_s: f64,
    pub(super) transfer_latency_ns: f64,
    pub(super) memory_bytes: f64,
    pub(super) read_gb_per_s: f64,
    pub(super) copy_gb_per_s: f64,
    pub(super) submit_ns: f64,
    pub(super) round_trip_ns: f64,
    pub(super) dispatch_ns: f64,
    pub(super) read_back_ns: f64,
    pub(super) gflop_per_s: f64,
}

/// Two GPUs at work at the same time, over one.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrueGroup {
    pub(super) upload: f64,
    pub(super) round_trip: f64,
    pub(super) arithmetic: f64,
}

/// A machine as it is.
#[derive(Debug, Clone)]
pub(super) struct TrueMachine {
    pub(super) seed: u64,
    pub(super) cpu: TrueCpu,
    pub(super) gpus: Vec<TrueGpu>,
    /// Of all GPUs; `None` for fewer than two.
    pub(super) group: Option<TrueGroup>,
}

/// Bytes of memory for each core where the specification says nothing: what is usual.
const MEMORY_BYTES_A_CORE: f64 = 4.0 * 1_073_741_824.0;

impl TrueMachine {
    pub(super) fn new(build: &Build<'_>, seed: u64) -> Self {
        let cpu = TrueCpu::new(build.cpu, seed);
        let gpus: Vec<TrueGpu> = build.gpus.iter().map(|g| TrueGpu::new(g, &cpu, seed)).collect();
        let group = (gpus.len() > 1).then(|| {
            let best = |figure: fn(&TrueGpu) -> f64| gpus.iter().map(figure).fold(0.0, f64::max);
            let sum = |figure: fn(&TrueGpu) -> f64| gpus.iter().map(figure).sum::<f64>();
            let over_best = |figure: fn(&TrueGpu) -> f64| sum(figure) / best(figure);
            let name = &cpu.name;
            TrueGroup {
                // Each card has its own lanes, but the CPU's memory feeds all of them.
                upload: (over_best(|g| g.upload_gb_per_s) * share(seed, name, "upload of several", 0.6, 0.95)).max(1.0),
                round_trip: 1.0 + share(seed, name, "round trips of several", 0.1, 0.5),
                arithmetic: over_best(|g| g.gflop_per_s) * share(seed, name, "arithmetic of several", 0.9, 1.0),
            }
        });
        Self { seed, cpu, gpus, group }
    }

    /// Memory, of which no cost depends.
    pub(super) fn memory_bytes(&self) -> f64 {
        self.cpu.cores * MEMORY_BYTES_A_CORE
    }
}

impl TrueCpu {
    fn new(cpu: &Cpu, seed: u64) -> Self {
        let name = &cpu.name;
        let between = |what: &str, low: f64, high: f64| share(seed, name, what, low, high);
        let [cores, threads] = [cpu.cores, cpu.threads].map(f64::from);
        let year = f64::from(cpu.year);
        let ghz = cpu.boost_ghz * between("one core's clock", 0.96, 1.0);
        // Cycles to the first two levels; to the last one more the more cores share it; the memory in ns, farther in large chips.
        let to_memory = (65.0 + 6.0 * cores.log2()) * factor(seed, name, "latency of the memory", 0.12);
        let latency_ns = [4.0 / ghz, 13.0 / ghz, 36.0 / ghz + 0.2 * cores, to_memory];
        let all_threads_gb_per_s = cpu.memory_gb_per_s * between("share of the memory's bandwidth", 0.7, 0.9);
        // Lines of 64 bytes that one core has on their way at a time; prefetchers have got better over the years.
        let lines = 10.0 + 1.0 * (year - 2008.0).clamp(0.0, 20.0);
        let joining = |ns: f64, what| ns * (1.0 + 0.2 * threads.log2()) * factor(seed, name, what, 0.35);
        Self {
            name: name.clone(),
            year,
            cores,
            threads,
            ghz,
            all_cores_ghz: (cpu.base_ghz + (cpu.boost_ghz - cpu.base_ghz) * between("all cores' clock", 0.3, 0.8))
                .min(ghz),
            lanes: f64::from(cpu.simd.level().1),
            cache_bytes: [cpu.l1d_bytes, cpu.l2_bytes, cpu.llc_bytes],
            latency_ns,
            one_thread_gb_per_s: (lines * 64.0 / to_memory).min(all_threads_gb_per_s),
            all_threads_gb_per_s,
            fork_join_warm_ns: joining(700.0, "warm fork and join"),
            fork_join_cold_ns: joining(12_000.0, "cold fork and join"),
            second_thread: between("second thread in arithmetic", 0.0, 0.3),
        }
    }

    /// Work of `threads` threads over that of one, where the second thread of a core adds `second` of the first.
    pub(super) fn speed_up(&self, threads: f64, second: f64) -> f64 {
        let busy = threads.min(self.cores);
        // The clock falls evenly from one busy core to all.
        let fallen = if self.cores > 1.0 { (busy - 1.0) / (self.cores - 1.0) } else { 0.0 };
        let clock = 1.0 - fallen * (1.0 - self.all_cores_ghz / self.ghz);
        (busy + second * (threads - busy)) * clock
    }

    /// Mean latency of a load from a working set, where the levels hold shares of it.
    pub(super) fn latency_of(&self, bytes: f64) -> f64 {
        let mut held = 0.0;
        let mut sum = 0.0;
        for (level, latency) in self.latency_ns.iter().enumerate() {
            let within = self.cache_bytes.get(level).map_or(1.0, |c| (c / bytes.max(1.0)).min(1.0)).max(held);
            sum += (within - held) * latency;
            held = within;
        }
        sum
    }
}

impl TrueGpu {
    fn new(gpu: &Gpu, cpu: &TrueCpu, seed: u64) -> Self {
        let name = &gpu.name;
        let between = |what: &str, low: f64, high: f64| share(seed, name, what, low, high);
        let latency = |ns: f64, what: &str| ns * factor(seed, name, what, 0.3);
        // One inside a CPU shares its memory, which it reads as fast as all cores do.
        let memory_gb_per_s = gpu.card.as_ref().map_or(cpu.all_threads_gb_per_s, |c| c.memory_gb_per_s);
        // The boxes are copied twice: by the CPU into memory that the GPU sees, then over the bus.
        let bus =
            gpu.card.as_ref().map_or(memory_gb_per_s / 2.0, pcie_gb_per_s) * between("share of the bus", 0.75, 0.9);
        let twice = |bus: f64| 1.0 / (1.0 / bus + 1.0 / cpu.one_thread_gb_per_s);
        // Drivers of earlier years take longer.
        let age = 1.0 + (2020.0 - f64::from(gpu.year)).max(0.0) / 12.0;
        Self {
            name: name.clone(),
            upload_gb_per_s: twice(bus),
            download_gb_per_s: twice(bus * between("download over upload", 0.8, 1.0)),
            transfer_latency_ns: latency(12_000.0 * age, "latency of a transfer"),
            memory_bytes: gpu.card.as_ref().map_or(cpu.cores * MEMORY_BYTES_A_CORE / 2.0, |c| c.memory_bytes),
            read_gb_per_s: memory_gb_per_s * between("share of reading", 0.75, 0.92),
            copy_gb_per_s: memory_gb_per_s * between("share of copying", 0.7, 0.88),
            submit_ns: latency(8_000.0 * age, "submission"),
            round_trip_ns: latency(22_000.0 * age, "round trip"),
            dispatch_ns: latency(2_500.0 * age, "dispatch"),
            read_back_ns: latency(16_000.0 * age, "reading back"),
            gflop_per_s: 2.0 * f64::from(gpu.lanes) * gpu.clock_ghz * between("share of the arithmetic", 0.8, 0.97),
        }
    }
}

/// GB/s of a bus one way, by the specification of PCI Express: 250 MB/s a lane in the first generation; twice that in each
/// further one, of which those from the third on lose 1.5 % to their code.
fn pcie_gb_per_s(card: &Card) -> f64 {
    let generation = card.pcie_generation;
    let lane = 0.25 * f64::from(1_u32 << (generation - 1)) * if generation >= 3 { 0.985 } else { 1.0 };
    lane * f64::from(card.pcie_lanes)
}

#[cfg(test)]
mod tests {
    use super::super::pairing::builds;
    use super::super::specification::built_in;
    use super::*;

    #[test]
    fn a_bus_is_as_fast_as_its_specification() {
        let card =
            |pcie_generation, pcie_lanes| Card { memory_bytes: 1.0, memory_gb_per_s: 1.0, pcie_generation, pcie_lanes };
        assert_eq!(pcie_gb_per_s(&card(2, 16)), 8.0);
        assert!((pcie_gb_per_s(&card(4, 8)) - 15.75).abs() < 0.05);
    }

    #[test]
    fn no_machine_is_better_than_its_specification() {
        let specifications = built_in().unwrap();
        for build in builds(&specifications, 51, 1).unwrap() {
            let machine = TrueMachine::new(&build, 1);
            let (cpu, spec) = (&machine.cpu, build.cpu);
            assert!(cpu.ghz <= spec.boost_ghz && cpu.all_cores_ghz >= spec.base_ghz * 0.96, "{cpu:?}");
            assert!(cpu.one_thread_gb_per_s <= cpu.all_threads_gb_per_s, "{cpu:?}");
            assert!(cpu.all_threads_gb_per_s < spec.memory_gb_per_s, "{cpu:?}");
            let all = cpu.speed_up(cpu.threads, cpu.second_thread);
            assert!(all <= 1.3 * cpu.cores && all >= 0.5 * cpu.cores && cpu.speed_up(1.0, 0.3) == 1.0, "{cpu:?}");
            assert!(cpu.latency_ns.is_sorted(), "{cpu:?}");
            for (gpu, spec) in machine.gpus.iter().zip(&build.gpus) {
                assert!(spec.card.as_ref().is_none_or(|c| gpu.read_gb_per_s < c.memory_gb_per_s), "{gpu:?}");
                assert!(gpu.download_gb_per_s <= gpu.upload_gb_per_s, "{gpu:?}");
            }
            assert_eq!(machine.group.is_some(), machine.gpus.len() == 2);
        }
    }

    #[test]
    fn latency_grows_from_that_of_the_first_cache_to_that_of_the_memory() {
        let specifications = built_in().unwrap();
        let cpu = TrueMachine::new(&builds(&specifications, 1, 1).unwrap()[0], 1).cpu;
        let sets = [1e3, 1e5, 1e6, 1e7, 1e8, 1e10];
        assert!(sets.map(|bytes| cpu.latency_of(bytes)).is_sorted(), "{cpu:?}");
        assert_eq!(cpu.latency_of(1e3), cpu.latency_ns[0]);
        assert!(cpu.latency_of(1e12) > 0.99 * cpu.latency_ns[3]);
    }
}
