//! The family: every profile of a machine.

use super::profile::Profile;
use super::slug;
use crate::contention::Contended;
use crate::restriction::is_lavapipe;
use sapwise::{GpuIdentity, GpuKind, SimdLevel};

/// What there is to take from.
#[derive(Debug, Clone)]
pub(super) struct Whole {
    pub(super) cores: u32,
    pub(super) level: SimdLevel,
    /// The GPUs that are taken.
    pub(super) gpus: Vec<GpuIdentity>,
}

/// Every profile, each behind those from which one thing less is taken.
///
/// Undisturbed on every number of threads at every SIMD level; with contended memory and cache, on all threads and on one, at
/// every level; each GPU alone on every number of threads, lavapipe also on fewer of its own; all GPUs of one class together.
/// Disturbed ones and those with GPUs are quick, and with `quick` all are.
pub(super) fn family(whole: &Whole, quick: bool) -> Vec<Profile> {
    // From all of them down.
    let fewer: Vec<u32> =
        std::iter::successors(Some(1_u32), |k| k.checked_mul(2)).take_while(|&k| k < whole.cores).collect();
    let threads: Vec<Option<u32>> = std::iter::once(None).chain(fewer.iter().rev().copied().map(Some)).collect();
    let ends: Vec<Option<u32>> = threads.iter().copied().filter(|t| t.is_none_or(|k| k == 1)).collect();
    let lower = SimdLevel::ALL.into_iter().rev().filter(|&level| level < whole.level).map(Some);
    let levels: Vec<Option<SimdLevel>> = std::iter::once(None).chain(lower).collect();
    let mut list = List(Vec::new());
    for &threads in &threads {
        for &simd in &levels {
            list.push("", Profile { threads, simd, quick, ..plain() });
        }
    }
    for kind in [Contended::Memory, Contended::Cache] {
        for &threads in &ends {
            for &simd in &levels {
                list.push("", Profile { threads, simd, contended: Some(kind), ..plain() });
            }
        }
    }
    for (gpu, name) in whole.gpus.iter().zip(slug::gpus(&whole.gpus)) {
        let alone = |threads, gpu_threads| Profile { threads, gpu_threads, gpus: vec![gpu.clone()], ..plain() };
        for &threads in &threads {
            list.push(&name, alone(threads, None));
        }
        for &own in fewer.iter().rev().filter(|_| is_lavapipe(gpu)) {
            for &threads in &ends {
                list.push(&name, alone(threads, Some(own)));
            }
        }
    }
    // Software adapters and cards don't work together.
    let (programs, cards): (Vec<_>, Vec<_>) = whole.gpus.iter().cloned().partition(|g| g.kind == GpuKind::Software);
    let both = programs.len() > 1 && cards.len() > 1;
    for (gpus, of) in [(cards, ""), (programs, if both { "software-" } else { "" })] {
        if gpus.len() < 2 {
            continue;
        }
        let name = format!("{}-{of}gpus", number(gpus.len()));
        for &threads in &ends {
            list.push(&name, Profile { threads, gpus: gpus.clone(), ..plain() });
        }
    }
    list.0
}

/// Nothing taken, no GPU, quick.
fn plain() -> Profile {
    let (name, gpus) = (String::new(), Vec::new());
    Profile { name, threads: None, simd: None, contended: None, gpus, gpu_threads: None, quick: true }
}

struct List(Vec<Profile>);

impl List {
    /// Adds a profile under a name that no other has. `gpus` names its GPUs.
    fn push(&mut self, gpus: &str, profile: Profile) {
        let mut words: Vec<String> = Vec::new();
        words.extend((!gpus.is_empty()).then(|| gpus.to_owned()));
        words.extend(profile.gpu_threads.map(|k| format!("{k}lp")));
        words.extend(profile.contended.map(|kind| kind.to_string()));
        words.extend(profile.simd.map(|level| level.to_string()));
        words.extend(profile.threads.map(|k| format!("{k}t")));
        let name = if words.is_empty() { "full".to_owned() } else { words.join("-") };
        let used: Vec<String> = self.0.iter().map(|p| p.name.clone()).collect();
        self.0.push(Profile { name: slug::unused(name, &used), ..profile });
    }
}

fn number(count: usize) -> String {
    let words = ["two", "three", "four", "five", "six", "seven", "eight"];
    words.get(count.wrapping_sub(2)).map_or(count.to_string(), |word| (*word).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gpu(index: u32, name: &str, kind: GpuKind) -> GpuIdentity {
        GpuIdentity::new(index, name, kind)
    }

    fn names(cores: u32, level: SimdLevel, gpus: &[GpuIdentity]) -> Vec<String> {
        let whole = Whole { cores, level, gpus: gpus.to_vec() };
        family(&whole, false).into_iter().map(|p| p.name).collect()
    }

    fn programs() -> [GpuIdentity; 2] {
        [gpu(0, "llvmpipe (LLVM 15)", GpuKind::Software), gpu(1, "SwiftShader Device (Subzero)", GpuKind::Software)]
    }

    #[test]
    fn one_core_without_vectors_has_three_profiles() {
        assert_eq!(names(1, SimdLevel::Portable, &[]), ["full", "memory", "cache"]);
    }

    #[test]
    fn two_cores_with_two_programs_are_as_in_the_datasets() {
        let undisturbed = ["full", "avx2", "portable", "1t", "avx2-1t", "portable-1t"];
        let contended =
            |kind: &str| undisturbed.map(|n| if n == "full" { kind.to_owned() } else { format!("{kind}-{n}") });
        let on_gpus = [
            "lavapipe",
            "lavapipe-1t",
            "lavapipe-1lp",
            "lavapipe-1lp-1t",
            "swiftshader",
            "swiftshader-1t",
            "two-gpus",
            "two-gpus-1t",
        ];
        let mut all = undisturbed.map(str::to_owned).to_vec();
        all.extend(contended("memory").into_iter().chain(contended("cache")));
        assert_eq!(names(2, SimdLevel::Avx512, &[]), all);
        all.extend(on_gpus.map(str::to_owned));
        assert_eq!(names(2, SimdLevel::Avx512, &programs()), all);
    }

    #[test]
    fn threads_go_down_by_halves_and_contention_is_at_both_ends() {
        let six = names(6, SimdLevel::Portable, &[]);
        assert_eq!(six, ["full", "4t", "2t", "1t", "memory", "memory-1t", "cache", "cache-1t"]);
        let cards = [gpu(0, "NVIDIA H200", GpuKind::Discrete), gpu(1, "NVIDIA H200", GpuKind::Discrete)];
        let all = names(64, SimdLevel::Avx512, &[&cards[..], &programs()].concat());
        // 7 numbers of threads at 3 levels; 2 kinds, 2 numbers, 3 levels; 4 GPUs on 7; lavapipe on 6 numbers of its own, 2 ends
        // each; 2 classes of several, 2 ends.
        assert_eq!(all.len(), 21 + 12 + 28 + 12 + 4);
        for name in ["32t", "avx2-16t", "nvidia-h200-2-8t", "lavapipe-32lp-1t", "two-gpus-1t", "two-software-gpus"] {
            assert!(all.iter().any(|n| n == name), "{name} is not in {all:?}");
        }
    }

    #[test]
    fn names_differ_and_whatever_proves_a_restriction_comes_before_it() {
        // A card with the name of a profile.
        let odd = [gpu(0, "avx2 1t", GpuKind::Discrete), gpu(1, "Full", GpuKind::Integrated)];
        for cores in [1, 2, 6, 64] {
            for level in SimdLevel::ALL {
                let whole = Whole { cores, level, gpus: [&odd[..], &programs()].concat() };
                let all = family(&whole, false);
                for (k, profile) in all.iter().enumerate() {
                    let fit = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
                    assert!(profile.name.chars().all(fit) && !profile.name.contains("--"), "{}", profile.name);
                    assert!(all[..k].iter().all(|p| p.name != profile.name), "{}", profile.name);
                    for kind in profile.kinds() {
                        let lifted = profile.lifted(kind);
                        assert!(all[..k].iter().any(|p| p.is_alike(&lifted)), "{} without {kind}", profile.name);
                    }
                }
            }
        }
    }

    #[test]
    fn only_undisturbed_profiles_of_the_cpu_are_measured_in_full() {
        let whole = Whole { cores: 2, level: SimdLevel::Avx2, gpus: programs().to_vec() };
        let full: Vec<String> = family(&whole, false).into_iter().filter(|p| !p.quick).map(|p| p.name).collect();
        assert_eq!(full, ["full", "portable", "1t", "portable-1t"]);
        assert!(family(&whole, true).iter().all(|p| p.quick));
    }
}
