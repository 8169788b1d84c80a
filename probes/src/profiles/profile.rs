//! One machine with fewer threads, a lower SIMD level or other GPUs than it has.

use super::slug;
use crate::args::Probe;
use crate::gpus::GpuChoice;
use crate::provenance;
use sapwise::algorithm::SimdLevel;
use sapwise_lab::sweep::Plan;
use sapwise_tune::{GpuIdentity, GpuKind};
use std::time::Duration;

/// Time for the hardware parameters of the CPU and for starting processes.
const HARDWARE: Duration = Duration::from_secs(8);

/// Time for the parameters of a GPU. A software adapter is the slowest.
const GPU: Duration = Duration::from_secs(25);

/// One report of a machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// Name of its file without the ending, such as `avx2-1t`.
    pub(super) name: String,
    /// The command that measures it, without the name of the program, and as the report repeats it.
    pub(super) command: String,
    /// SIMD level to force; `None` for the highest.
    pub(super) simd: Option<SimdLevel>,
    pub(super) gpus: Vec<GpuIdentity>,
    /// The longest time that it should take.
    pub(super) time: Duration,
}

impl Profile {
    pub(super) fn simd_text(&self) -> Option<String> {
        self.simd.map(|level| level.to_string())
    }
}

/// Threads and SIMD level; `None` for all that the machine has.
type Limits = (Option<u32>, Option<SimdLevel>);

/// Returns the profiles of a machine: the whole of it, each lower SIMD level, fewer threads, and both on one thread;
/// the same with each real GPU; all real GPUs together; two software adapters together. The first and the one-thread
/// profile come a second time at the end, for the noise floor.
///
/// Profiles with GPUs are quick, and with `--quick` all are.
pub(super) fn profiles(probe: &Probe, cores: u32, level: SimdLevel, gpus: &[GpuIdentity]) -> Vec<Profile> {
    let lower: Vec<SimdLevel> = SimdLevel::ALL.into_iter().rev().filter(|&l| l < level).collect();
    let fewer = std::iter::successors(Some(1_u32), |k| k.checked_mul(2)).take_while(|&k| k < cores);
    let mut limits: Vec<Limits> = vec![(None, None)];
    limits.extend(lower.iter().map(|&level| (None, Some(level))));
    limits.extend(fewer.map(|k| (Some(k), None)));
    if cores > 1 {
        limits.extend(lower.iter().map(|&level| (Some(1), Some(level))));
    }
    let of_limits = |prefix: &str, gpus: &[GpuIdentity]| -> Vec<Profile> {
        limits.iter().map(|&limits| profile(probe, prefix, limits, gpus)).collect()
    };
    let mut all = of_limits("", &[]);
    let (software, real): (Vec<_>, Vec<_>) = gpus.iter().cloned().partition(|g| g.kind == GpuKind::Software);
    for (gpu, name) in real.iter().zip(slug::gpus(&real)) {
        all.extend(of_limits(&name, std::slice::from_ref(gpu)));
    }
    if real.len() > 1 {
        all.push(profile(probe, "all-gpus", (None, None), &real));
    }
    match &software[..] {
        [] => {}
        [one] => all.push(profile(probe, "software-gpu", (None, None), std::slice::from_ref(one))),
        [first, second, ..] => {
            all.push(profile(probe, "two-gpus", (None, None), &[first.clone(), second.clone()]));
        }
    }
    let repeated: Vec<Profile> = all.iter().filter(|p| ["full", "1t"].contains(&p.name.as_str())).cloned().collect();
    all.extend(repeated.into_iter().map(|p| Profile { name: format!("{}-again", p.name), ..p }));
    all
}

fn profile(probe: &Probe, prefix: &str, (threads, simd): Limits, gpus: &[GpuIdentity]) -> Profile {
    let mut words: Vec<String> = Vec::new();
    words.extend((!prefix.is_empty()).then(|| prefix.to_owned()));
    words.extend(simd.map(|level| level.to_string()));
    words.extend(threads.map(|k| format!("{k}t")));
    let quick = probe.quick || !gpus.is_empty();
    let only: Vec<u32> = gpus.iter().map(|g| g.index).collect();
    let own = Probe {
        quick,
        threads,
        gpus: GpuChoice { no_gpus: only.is_empty(), only, software_gpus: false },
        ..probe.clone()
    };
    let plan = Plan::new(quick, &probe.scenarios(), probe.max_objects);
    Profile {
        name: if words.is_empty() { "full".to_owned() } else { words.join("-") },
        command: provenance::command(&own),
        simd,
        gpus: gpus.to_vec(),
        time: plan.total + HARDWARE + GPU * gpus.len() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(cores: u32, level: SimdLevel, gpus: &[GpuIdentity]) -> Vec<Profile> {
        profiles(&Probe::of("--profiles --seed=3"), cores, level, gpus)
    }

    fn gpu(index: u32, name: &str, kind: GpuKind) -> GpuIdentity {
        GpuIdentity::new(index, name, kind)
    }

    #[test]
    fn threads_halve_and_simd_levels_come_on_all_threads_and_on_one() {
        let names = |cores, level| all(cores, level, &[]).into_iter().map(|p| p.name).collect::<Vec<_>>();
        assert_eq!(names(1, SimdLevel::Portable), ["full", "full-again"]);
        let six = ["full", "portable", "1t", "2t", "4t", "portable-1t", "full-again", "1t-again"];
        assert_eq!(names(6, SimdLevel::Avx2), six);
    }

    #[test]
    fn each_real_gpu_has_all_limits_and_software_adapters_one_report() {
        let cards = [gpu(0, "NVIDIA H200", GpuKind::Discrete), gpu(1, "NVIDIA H200", GpuKind::Discrete)];
        let programs = [gpu(2, "llvmpipe (LLVM 15)", GpuKind::Software), gpu(3, "SwiftShader", GpuKind::Software)];
        let all = all(2, SimdLevel::Portable, &[&cards[..], &programs].concat());
        let names: Vec<&str> = all.iter().map(|p| p.name.as_str()).collect();
        let own = ["full", "1t", "nvidia-h200", "nvidia-h200-1t", "nvidia-h200-2", "nvidia-h200-2-1t"];
        assert_eq!(names[..6], own);
        assert_eq!(names[6..], ["all-gpus", "two-gpus", "full-again", "1t-again"]);
        assert_eq!(all[1].command, "probe --no-gpus --threads 1 --seed 3");
        assert_eq!(all[7].command, "probe --quick --gpu 2 --gpu 3 --seed 3");
        assert_eq!(all[9].command, all[1].command);
        Probe::of(all[7].command.strip_prefix("probe").unwrap());
    }
}
