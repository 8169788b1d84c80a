//! The options of verbs that take GPUs.

use super::look::Seen;
use crate::exit::WrongUsage;
use sapwise::AlgorithmId;
use sapwise::algorithm::Backend;
use sapwise_lab::report::Report;
use sapwise_tune::{GpuIdentity, GpuKind};

/// The options of verbs that take GPUs.
#[derive(Debug, Clone, Default, PartialEq, Eq, clap::Args)]
pub(crate) struct GpuChoice {
    /// Use no GPU and load no driver.
    #[arg(long, conflicts_with = "software_gpus")]
    pub(crate) no_gpus: bool,
    /// Use software adapters too, such as llvmpipe and SwiftShader. They run on the CPU and are slower than its own
    /// algorithms.
    #[arg(long)]
    pub(crate) software_gpus: bool,
    /// Use this GPU only, as `sapwise devices` numbers it, even if it is a software adapter; may be given several
    /// times.
    #[arg(long = "gpu", value_name = "N", conflicts_with_all = ["no_gpus", "software_gpus"])]
    pub(crate) only: Vec<u32>,
}

impl GpuChoice {
    /// Whether a GPU is taken.
    pub(crate) fn takes(&self, gpu: &GpuIdentity) -> bool {
        if self.only.is_empty() {
            !self.no_gpus && (self.software_gpus || gpu.kind != GpuKind::Software)
        } else {
            self.only.contains(&gpu.index)
        }
    }

    /// Refuses numbers of GPUs that this machine lacks.
    ///
    /// # Errors
    /// Names the GPUs that it has.
    pub(crate) fn check(&self, seen: &Seen) -> Result<(), WrongUsage> {
        match seen.lacks(&self.only) {
            Some(why) => Err(WrongUsage(format!("--gpu: {why}"))),
            None => Ok(()),
        }
    }

    /// Returns the options as they were given, for another command, each after a blank.
    pub(crate) fn words(&self) -> String {
        let flags = [(self.no_gpus, " --no-gpus"), (self.software_gpus, " --software-gpus")];
        let only = self.only.iter().map(|k| format!(" --gpu {k}"));
        flags.into_iter().filter(|(given, _)| *given).map(|(_, word)| word.to_owned()).chain(only).collect()
    }

    /// Removes other GPUs from the timings of a report; its hardware stays.
    pub(crate) fn restrict(&self, report: &mut Report) {
        let wanted: Vec<u32> =
            report.hardware.gpus.iter().filter(|g| self.takes(&g.gpu)).map(|g| g.gpu.index).collect();
        let stays = |id: &AlgorithmId| uses(id).iter().all(|k| wanted.contains(k));
        report.algorithms.retain(|t| stays(&t.id));
        report.points.iter_mut().for_each(|p| p.timings.retain(|t| stays(&t.algorithm)));
    }

    /// Returns what the user should know about GPUs that were not taken, if anything.
    pub(crate) fn tell(&self, left_out: &[GpuIdentity]) -> Option<String> {
        if self.no_gpus || !self.only.is_empty() || left_out.is_empty() {
            return None;
        }
        let names: Vec<String> = left_out.iter().map(|g| format!("gpu{}", g.index)).collect();
        let (what, them) = if names.len() == 1 { ("a software adapter", "it") } else { ("software adapters", "them") };
        let names = names.join(", ");
        Some(format!("Not used: {names}, {what}. Use --software-gpus to measure {them} anyway."))
    }
}

/// Returns the numbers of the GPUs that an algorithm runs on; none on the CPU.
pub(crate) fn uses(id: &AlgorithmId) -> &[u32] {
    match id.backend() {
        Backend::Gpu(list) => list,
        _ => &[],
    }
}

/// Returns how the GPU of a number differs between two machines, if it does.
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
        let [device, driver, api] = ["1:2", "d 1", "vulkan"].map(str::to_owned);
        GpuIdentity { device, driver, api, ..GpuIdentity::new(index, "X", kind) }
    }

    #[test]
    fn software_adapters_are_used_only_when_asked_for() {
        let (real, software) = (gpu(0, GpuKind::Integrated), gpu(1, GpuKind::Software));
        let takes = |c: GpuChoice| (c.takes(&real), c.takes(&software));
        assert_eq!(takes(GpuChoice::default()), (true, false));
        assert_eq!(takes(GpuChoice { software_gpus: true, ..GpuChoice::default() }), (true, true));
        assert_eq!(takes(GpuChoice { no_gpus: true, ..GpuChoice::default() }), (false, false));
        let second = GpuChoice { only: vec![1], ..GpuChoice::default() };
        assert_eq!((second.words(), GpuChoice::default().words()), (" --gpu 1".to_owned(), String::new()));
        assert_eq!((takes(second.clone()), second.tell(std::slice::from_ref(&real))), ((false, true), None));
        let seen = |identities| Seen { identities, remark: None };
        assert!(second.check(&seen(vec![real.clone(), software.clone()])).is_ok());
        let complaint = second.check(&seen(vec![real.clone()])).unwrap_err().to_string();
        assert_eq!(complaint, "--gpu: this machine has no gpu1, only gpu0 (X)");
        assert!(GpuChoice::default().check(&seen(Vec::new())).is_ok());
        assert!(GpuChoice::default().tell(&[software]).unwrap().contains("gpu1, a software adapter"));
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
