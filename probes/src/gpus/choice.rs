//! Which GPUs a verb takes.

use sapwise::report::Report;
use sapwise::{AlgorithmId, Backend, GpuIdentity, GpuKind};

/// The options of verbs that take GPUs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::Args)]
pub(crate) struct GpuChoice {
    /// Leave out every GPU, and load no driver.
    #[arg(long, conflicts_with = "software_gpus")]
    pub(crate) no_gpus: bool,
    /// Take programs that act as GPUs too, such as llvmpipe and SwiftShader. They run on the CPU and can't beat it.
    #[arg(long)]
    pub(crate) software_gpus: bool,
}

impl GpuChoice {
    /// Whether a GPU is taken.
    pub(crate) fn takes(self, gpu: &GpuIdentity) -> bool {
        !self.no_gpus && (self.software_gpus || gpu.kind != GpuKind::Software)
    }

    /// Takes what is not wanted out of the timings of a report; its hardware stays as it is.
    pub(crate) fn restrict(self, report: &mut Report) {
        let wanted: Vec<u32> = report.hardware.gpus.iter().filter(|g| self.takes(&g.gpu)).map(|g| g.gpu.index).collect();
        let stays = |id: &AlgorithmId| uses(id).iter().all(|k| wanted.contains(k));
        report.algorithms.retain(|t| stays(&t.id));
        report.points.iter_mut().for_each(|p| p.timings.retain(|t| stays(&t.algorithm)));
    }

    /// What the user should know about GPUs that were not taken, if anything.
    pub(crate) fn tell(self, left_out: &[GpuIdentity]) -> Option<String> {
        if self.no_gpus || left_out.is_empty() {
            return None;
        }
        let names: Vec<String> = left_out.iter().map(|g| format!("gpu{} ({})", g.index, g.name)).collect();
        let (verb, what, them) = match names.len() {
            1 => ("is", "a program", "it"),
            _ => ("are", "programs", "them"),
        };
        let names = names.join(", ");
        Some(format!("{names} {verb} {what} on the CPU that can't beat it; --software-gpus takes {them} in all the same."))
    }
}

/// The numbers of the GPUs that an algorithm runs on; none on the CPU.
pub(crate) fn uses(id: &AlgorithmId) -> &[u32] {
    match id.backend() {
        Backend::Gpu(list) => list,
        _ => &[],
    }
}

/// How the GPU of a number differs between two machines, if it does.
pub(crate) fn difference(there: Option<&GpuIdentity>, here: Option<&GpuIdentity>) -> Option<String> {
    match (there, here) {
        (Some(a), Some(b)) if (&a.name, &a.device, &a.api) != (&b.name, &b.device, &b.api) => {
            Some(format!("gpu{} was {} there and is {} here", a.index, a.name, b.name))
        }
        (Some(a), Some(b)) if a.driver != b.driver => {
            Some(format!("gpu{} had the driver {} there and has {} here", a.index, a.driver, b.driver))
        }
        (Some(a), None) => Some(format!("gpu{} was {} there, and there is no gpu{} here", a.index, a.name, a.index)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gpu(index: u32, kind: GpuKind) -> GpuIdentity {
        let text = |t: &str| t.to_owned();
        GpuIdentity { index, name: text("X"), device: text("1:2"), driver: text("d 1"), api: text("vulkan"), kind }
    }

    #[test]
    fn programs_are_taken_only_when_asked_for() {
        let (real, program) = (gpu(0, GpuKind::Integrated), gpu(1, GpuKind::Software));
        let takes = |c: GpuChoice| (c.takes(&real), c.takes(&program));
        assert_eq!(takes(GpuChoice::default()), (true, false));
        assert_eq!(takes(GpuChoice { software_gpus: true, ..GpuChoice::default() }), (true, true));
        assert_eq!(takes(GpuChoice { no_gpus: true, ..GpuChoice::default() }), (false, false));
        assert!(GpuChoice::default().tell(&[program]).unwrap().contains("gpu1 (X) is a program"));
        assert_eq!(GpuChoice::default().tell(&[]), None);
    }

    #[test]
    fn other_gpus_and_other_drivers_are_told() {
        let (a, mut b) = (gpu(0, GpuKind::Discrete), gpu(0, GpuKind::Discrete));
        assert_eq!(difference(Some(&a), Some(&b)), None);
        b.driver = "d 2".to_owned();
        assert!(difference(Some(&a), Some(&b)).unwrap().contains("driver d 1"));
        b.name = "Y".to_owned();
        assert!(difference(Some(&a), Some(&b)).unwrap().contains("is Y here"));
        assert!(difference(Some(&a), None).unwrap().contains("no gpu0 here"));
    }
}
