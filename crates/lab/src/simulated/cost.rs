//! The cost model of simulated machines: THE TRUTH that their timings are made of.
//!
//! It was written by hand after the timings of the first machine in `datasets/`, for whole machines like it; it is no model of any
//! other. Units are cycles, lane operations, bytes and fork-joins; each is multiplied by a hidden factor of the part
//! ([`super::factors`]) that no report holds. What the terms of `train` can't express, on purpose:
//!
//! - **gathering boxes in sorted order**, at the latency of the cache or memory that holds them: the predictor has no term that
//!   scales with a latency. This is the term that its list lacks.
//! - the fall-off of the last-level cache is smooth here and a kink there;
//! - the hyper-threads of an algorithm gain something else than those of the arithmetic that is measured;
//! - GPUs of one frame get equal shares, so that the slower one is waited for; the predictor adds their rates up;
//! - `pair-cache` is the cheaper of keeping pairs and finding them by a tree, which no sum of terms is.
//!
//! | method on the CPU | serial cycles | divided cycles | lane operations | cold bytes a box |
//! |---|---|---|---|---|
//! | `brute` | 330 + 20 n | 0.35 all pairs + 19 pairs | 6 all pairs | |
//! | `sap` | 1400 + 12 n | 8 n + 6 n log2 n + 0.3 axis candidates + 22 pairs | 4 axis candidates | 100, gathers |
//! | `grid-sap` | 2500 + 10 n | 8 n + 7 n log2 n + 0.45 strip candidates + 16 pairs | 12 strip candidates | 120, gathers |
//! | `bvh` | 1500 + 4 n | 170 n + 5 n log2 n + 25 pairs | | 100, gathers |
//! | `pair-cache`, keeping | 365 + 14 n | 14 n + 34 pairs + 130 moved boxes | | 56 |
//! | `pair-cache`, finding | `bvh` + 1500 | | | |
//!
//! Every method with several threads pays a quarter of a cold fork and join, which grows with the logarithm of the threads.
//!
//! | method on GPUs | dependent dispatches | operations | bytes in the GPU's memory |
//! |---|---|---|---|
//! | `brute` | 5 | 20 all pairs | 60 n |
//! | `sap` | as counted | 25 axis candidates | 48 n, and as counted |
//! | `grid-sap` | as counted | 300 strip candidates | 48 n, and as counted |
//! | `bvh` | as counted | 1500 n | 48 n, and as counted |
//!
//! What is counted is `fit::gpu_counts`, and two dispatches more. Every method on GPUs pays a round trip and a read-back, 24 bytes up a box, 8 bytes down a pair, and 6 cycles a box and 4 a pair of
//! the CPU. With several GPUs each takes an equal share of the boxes and a tenth more that lie on a border.

use super::factors::{CpuFactors, GpuFactors, of_method};
use super::machine::{TrueGpu, TrueMachine};
use crate::fit::gpu_counts;
use sapwise::{AlgorithmId, Backend, Load};

/// Bytes that a frame keeps in flight for each box.
const WORKING_SET_BYTES: f64 = 64.0;
/// Loads of one thread that are on their way at a time.
const LOADS_AT_A_TIME: f64 = 8.0;
/// What a box on the border between two GPUs costs more.
const ON_A_BORDER: f64 = 0.1;

/// A machine with its hidden factors.
#[derive(Debug)]
pub(super) struct Costs<'a> {
    machine: &'a TrueMachine,
    cpu: CpuFactors,
    gpus: Vec<GpuFactors>,
}

impl<'a> Costs<'a> {
    pub(super) fn new(machine: &'a TrueMachine) -> Self {
        let seed = machine.seed;
        let cpu = CpuFactors::new(seed, &machine.cpu.name, machine.cpu.year);
        let gpus = machine.gpus.iter().map(|g| GpuFactors::new(seed, &g.name)).collect();
        Self { machine, cpu, gpus }
    }

    /// The factors of the CPU, which the samples need too.
    pub(super) fn cpu(&self) -> &CpuFactors {
        &self.cpu
    }

    /// Nanoseconds of an undisturbed frame. `None` for a method that the model does not know.
    pub(super) fn frame_ns(&self, id: &AlgorithmId, load: &Load) -> Option<f64> {
        match id.backend() {
            Backend::Cpu(threads) => self.on_cpu(id.method(), f64::from(*threads), load),
            Backend::Gpu(gpus) => self.on_gpus(id.method(), gpus, load),
            _ => None,
        }
    }

    fn on_cpu(&self, method: &str, threads: f64, load: &Load) -> Option<f64> {
        if method == "pair-cache" {
            let finding = self.on_cpu("bvh", threads, load)? + self.cycles(1500.0);
            return Some(self.keeping(threads, load).min(finding));
        }
        let n = f64::from(load.objects);
        let sort = n * n.max(1.0).log2();
        let all = n * (n - 1.0).max(0.0) / 2.0;
        let (axis, strip, pairs) = (load.axis_candidates, load.strip_candidates, load.pairs);
        // Serial and divided cycles, cycles for pairs, lane operations, and cold bytes of a sorting method.
        let (serial, divided, written, lanes, cold) = match method {
            "brute" => (330.0 + 20.0 * n, 0.35 * all, 19.0, 6.0 * all, None),
            "sap" => (1400.0 + 12.0 * n, 8.0 * n + 6.0 * sort + 0.3 * axis, 22.0, 4.0 * axis, Some(100.0)),
            "grid-sap" => (2500.0 + 10.0 * n, 8.0 * n + 7.0 * sort + 0.45 * strip, 16.0, 12.0 * strip, Some(120.0)),
            "bvh" => (1500.0 + 4.0 * n, 170.0 * n + 5.0 * sort, 25.0, 0.0, Some(100.0)),
            _ => return None,
        };
        let fast = self.speed_up(threads);
        let divided = self.cycles(divided + written * pairs * self.cpu.pairs) / fast;
        let lanes = lanes * self.cpu.lanes / (self.machine.cpu.ghz * self.machine.cpu.lanes * fast);
        let memory = cold.map_or(0.0, |bytes| self.moving(n, bytes, threads) + self.gathering(n, fast));
        let sum = self.cycles(serial) + divided + lanes + memory;
        Some(sum * self.of_method(method) + self.forking(threads))
    }

    /// Pairs that are kept from frame to frame.
    fn keeping(&self, threads: f64, load: &Load) -> f64 {
        let n = f64::from(load.objects);
        let divided = 14.0 * n + 34.0 * load.pairs * self.cpu.pairs + 130.0 * n * load.moved;
        let sum = self.cycles(365.0 + 14.0 * n)
            + self.cycles(divided) / self.speed_up(threads)
            + self.moving(n, 56.0, threads);
        sum * self.of_method("pair-cache") + self.forking(threads)
    }

    fn cycles(&self, cycles: f64) -> f64 {
        cycles * self.cpu.cycles / self.machine.cpu.ghz
    }

    fn speed_up(&self, threads: f64) -> f64 {
        self.machine.cpu.speed_up(threads, self.cpu.second_thread)
    }

    fn forking(&self, threads: f64) -> f64 {
        let cpu = &self.machine.cpu;
        let grown = |threads: f64| 1.0 + 0.2 * threads.log2();
        if threads <= 1.0 {
            0.0
        } else {
            0.25 * cpu.fork_join_cold_ns * self.cpu.fork_join * grown(threads) / grown(cpu.threads)
        }
    }

    /// `bytes` of each box whose working set the last-level cache does not hold.
    fn moving(&self, n: f64, bytes: f64, threads: f64) -> f64 {
        let cpu = &self.machine.cpu;
        let held = cpu.cache_bytes[2] * self.cpu.cache_share / (WORKING_SET_BYTES * n).max(1.0);
        let outside = 1.0 / (1.0 + held.powf(self.cpu.cache_sharpness));
        let gb_per_s = (cpu.one_thread_gb_per_s * threads).min(cpu.all_threads_gb_per_s);
        n * outside * bytes * self.cpu.bytes / gb_per_s
    }

    /// One load of each box out of order: the term that the predictor lacks.
    fn gathering(&self, n: f64, fast: f64) -> f64 {
        let cpu = &self.machine.cpu;
        let beyond_first = cpu.latency_of(WORKING_SET_BYTES * n) - cpu.latency_ns[0];
        n * beyond_first.max(0.0) * self.cpu.gather / (LOADS_AT_A_TIME * fast)
    }

    fn of_method(&self, method: &str) -> f64 {
        of_method(self.machine.seed, &self.machine.cpu.name, method)
    }

    fn on_gpus(&self, method: &str, indices: &[u32], load: &Load) -> Option<f64> {
        let share = 1.0 / indices.len() as f64;
        let more = if indices.len() > 1 { 1.0 + ON_A_BORDER } else { 1.0 };
        let n = f64::from(load.objects);
        let all = n * (n - 1.0).max(0.0) / 2.0;
        // The methods that sort are counted; boxes come up and are copied once more.
        let counted =
            gpu_counts(method).map(|(dispatches, of_box, of_pair)| (dispatches, of_box * n + of_pair * load.pairs));
        let (dispatches, bytes) = counted.unwrap_or((3.0, 12.0 * n));
        let (dispatches, bytes) = (dispatches + 2.0, bytes + 48.0 * n);
        let operations = match method {
            "brute" => 20.0 * all,
            "sap" => 25.0 * load.axis_candidates,
            "grid-sap" => 300.0 * load.strip_candidates,
            "bvh" => 1500.0 * n,
            _ => return None,
        };
        let group = self.machine.group.filter(|_| indices.len() > 1);
        let mut slowest = 0.0_f64;
        for &k in indices {
            let gpu: &TrueGpu = self.machine.gpus.get(k as usize)?;
            let hidden = self.gpus.get(k as usize)?;
            let waiting = (gpu.round_trip_ns + gpu.read_back_ns) * group.map_or(1.0, |g| g.round_trip);
            let latency = (waiting + dispatches * gpu.dispatch_ns) * hidden.driver;
            let working = operations * hidden.operations / gpu.gflop_per_s + bytes * hidden.memory / gpu.read_gb_per_s;
            // The bus is shared: of what several would take alone they get what the group gains.
            let bus = group.map_or(1.0, |g| indices.len() as f64 / g.upload.min(indices.len() as f64));
            let transfers = (24.0 * n / gpu.upload_gb_per_s + 8.0 * load.pairs / gpu.download_gb_per_s) * bus;
            let own = of_method(self.machine.seed, &gpu.name, method);
            slowest = slowest.max(latency + (working * own + transfers) * share * more);
        }
        Some(slowest + self.cycles(6.0 * n + 4.0 * load.pairs))
    }
}

#[cfg(test)]
mod tests {
    use super::super::pairing::{Build, builds};
    use super::super::specification::built_in;
    use super::*;

    fn load(objects: u32, moved: f64) -> Load {
        let n = f64::from(objects);
        Load::of_objects(objects)
            .with_candidates(0.3 * n.powf(5.0 / 3.0), 4.0 * n)
            .with_pairs(0.5 * n)
            .with_moved(moved)
    }

    fn machines() -> Vec<TrueMachine> {
        let specifications = built_in().unwrap();
        let builds: Vec<Build<'_>> = builds(&specifications, specifications.cpus.len(), 1).unwrap();
        builds.iter().map(|b| TrueMachine::new(b, 1)).collect()
    }

    fn ns(machine: &TrueMachine, id: &str, load: &Load) -> f64 {
        Costs::new(machine).frame_ns(&id.parse().unwrap(), load).unwrap()
    }

    #[test]
    fn every_method_of_this_build_has_a_cost_that_grows_with_the_objects() {
        for machine in machines() {
            let mut ids = sapwise::Registry::with_cores(machine.cpu.threads as u32).available();
            let gpus = super::super::hardware::identities(&machine);
            ids.extend(sapwise::gpu::algorithms(&gpus));
            for id in ids.into_iter().map(|e| e.id) {
                let costs = Costs::new(&machine);
                let course = [10, 1000, 100_000].map(|n| costs.frame_ns(&id, &load(n, 0.04)).unwrap());
                assert!(
                    course[0] > 0.0 && course.is_sorted() && course[2].is_finite(),
                    "{id} on {machine:?}: {course:?}"
                );
            }
        }
    }

    #[test]
    fn pair_cache_is_never_dearer_than_bvh_by_more_than_its_look_and_gains_where_little_moves() {
        for machine in machines() {
            for n in [100, 10_000, 300_000] {
                let (still, fast) = (load(n, 0.0), load(n, 1.0));
                let look = ns(&machine, "bvh@cpu1", &fast) * 0.5 + 10_000.0;
                assert!(ns(&machine, "pair-cache@cpu1", &fast) <= ns(&machine, "bvh@cpu1", &fast) + look);
                assert!(
                    ns(&machine, "pair-cache@cpu1", &still) < ns(&machine, "bvh@cpu1", &still),
                    "{n} on {machine:?}"
                );
            }
        }
    }

    #[test]
    fn two_equal_gpus_halve_the_work_of_one_at_best_and_do_pay_for_large_scenes() {
        let (mut pairs_of_gpus, mut paid) = (0, 0);
        for machine in machines().iter().filter(|m| m.gpus.len() >= 2 && m.gpus[0].name == m.gpus[1].name) {
            pairs_of_gpus += 1;
            for method in ["brute", "sap", "grid-sap", "bvh"] {
                let cost = |gpus: &str| ns(machine, &format!("{method}@{gpus}"), &load(10_000_000, 1.0));
                let (one, two) = (cost("gpu0"), cost("gpu0+1"));
                assert!(two >= 0.5 * one, "{method}: {two} with two GPUs and {one} with one of {machine:?}");
                paid += usize::from(two < one);
            }
        }
        assert!(pairs_of_gpus >= 3 && paid >= pairs_of_gpus, "{paid} of {pairs_of_gpus} machines");
    }

    #[test]
    fn the_best_method_depends_on_the_size_and_on_the_machine() {
        let best = |machine: &TrueMachine, n: u32| {
            let threads = machine.cpu.threads as u32;
            let mut ids = sapwise::Registry::with_cores(threads).available();
            ids.extend(sapwise::gpu::algorithms(&super::super::hardware::identities(machine)));
            let costs = Costs::new(machine);
            let load = load(n, 1.0);
            let ns = |id: &AlgorithmId| costs.frame_ns(id, &load).unwrap();
            ids.into_iter().map(|e| e.id).min_by(|a, b| ns(a).total_cmp(&ns(b))).unwrap()
        };
        let machines = machines();
        assert!(machines.iter().all(|m| best(m, 10).to_string() == "brute@cpu1"));
        let large: Vec<AlgorithmId> = machines.iter().map(|m| best(m, 300_000)).collect();
        let on_gpus = large.iter().filter(|id| matches!(id.backend(), Backend::Gpu(_))).count();
        assert!(on_gpus >= 5 && on_gpus + 5 <= machines.len(), "{on_gpus} of {}", machines.len());
        assert!(large.iter().all(|id| id.method() != "brute"), "{large:?}");
    }
}
