//! Which profiles a folder holds already, so that a measurement resumes where it was stopped.

use super::profile::{Profile, is_named};
use crate::args::{Arguments, Probe, Verb};
use crate::flaw::flaw;
use crate::{output, provenance};
use clap::Parser;
use sapwise::{GpuIdentity, Registry};
use sapwise_lab::data::Document;
use sapwise_lab::data::read_document;
use sapwise_lab::report::Report;
use std::path::{Path, PathBuf};

/// A folder, and what its reports are compared with.
pub(super) struct Existing<'a> {
    pub(super) folder: &'a Path,
    /// The beginning of all file names.
    pub(super) stem: &'a str,
    pub(super) physical_id: &'a str,
    pub(super) registry: &'a Registry,
    /// The command that the profiles are made from.
    pub(super) family: &'a Probe,
}

impl Existing<'_> {
    /// Where a report that is measured today goes.
    pub(super) fn path(&self, profile: &Profile) -> PathBuf {
        self.folder.join(format!("{}-{}--{}.json", self.stem, profile.name, crate::date::today()))
    }

    /// The newest report of a profile that need not be measured again, of whatever day.
    pub(super) fn find(&self, profile: &Profile) -> Option<PathBuf> {
        let stem = format!("{}-{}", self.stem, profile.name);
        let files = std::fs::read_dir(self.folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
        let mut found: Vec<PathBuf> = files.filter(|path| is_named(path, &stem)).collect();
        found.sort_unstable();
        found.into_iter().rev().find(|path| {
            let Ok(Document::Report(report)) = read_document(path, &|_| ()) else { return false };
            self.lack(&report, profile).is_none()
        })
    }

    /// Why a file must not be replaced by this profile's report, if so.
    pub(super) fn obstacle(&self, path: &Path, profile: &Profile) -> Option<String> {
        if !path.exists() {
            return None;
        }
        match read_document(path, &output::warn) {
            Ok(Document::Report(report)) if report.hardware.machine.physical_id == self.physical_id => self
                .keeps(&report, profile)
                .map(|why| format!("{}: {why}; name another folder with --out", path.display())),
            _ => Some(format!(
                "{} is no report of this machine; move it, or name another folder with --out",
                path.display()
            )),
        }
    }

    /// Why a report of this machine stays where this profile's would go, if so: what the same command would measure again is
    /// lost to nobody, a good report of another command is.
    fn keeps(&self, report: &Report, profile: &Profile) -> Option<String> {
        if flaw(report, self.registry).is_some() { None } else { self.foreign(report, profile) }
    }

    /// What a report lacks to be that of a profile, complete and current, if anything.
    pub(super) fn lack(&self, report: &Report, profile: &Profile) -> Option<String> {
        if report.hardware.machine.physical_id != self.physical_id {
            return Some("it is of another machine".to_owned());
        }
        if let Some(why) = flaw(report, self.registry).or_else(|| self.foreign(report, profile)) {
            return Some(why);
        }
        let restriction = report.provenance.restriction.as_ref();
        let proven = |kind| restriction.is_some_and(|r| r.proof.iter().any(|p| p.kind == kind));
        let unproven = profile.kinds().into_iter().find(|&kind| !proven(kind));
        unproven.map(|kind| format!("nothing was there to prove the restriction {kind} by"))
    }

    /// Why a report is not one that this profile's command measures, if so.
    fn foreign(&self, report: &Report, profile: &Profile) -> Option<String> {
        let provenance = &report.provenance;
        let gpus: Vec<&GpuIdentity> = report.hardware.gpus.iter().map(|g| &g.gpu).collect();
        let alike = gpus.len() == profile.gpus.len() && gpus.iter().zip(&profile.gpus).all(|(a, b)| same(a, b));
        if !alike {
            return Some("it was measured by another command, with other GPUs".to_owned());
        }
        let numbers: Vec<u32> = gpus.iter().map(|g| g.index).collect();
        if self.command(profile, &numbers).as_ref() != Some(&provenance.command)
            || provenance.simd != profile.simd.map(|level| level.to_string())
            || provenance.gpu_threads != profile.gpu_threads
        {
            return Some("it was measured by another command".to_owned());
        }
        None
    }

    /// The command that stands in the report of a profile.
    fn command(&self, profile: &Profile, numbers: &[u32]) -> Option<String> {
        let words = std::iter::once("sapwise".to_owned()).chain(profile.arguments(self.family, numbers));
        match Arguments::try_parse_from(words).ok()?.verb {
            Verb::Probe(probe) => Some(provenance::command(&probe)),
            _ => None,
        }
    }
}

/// Whether two identities are of one GPU, whatever its number.
fn same(a: &GpuIdentity, b: &GpuIdentity) -> bool {
    let named = |g: &GpuIdentity| (g.name.clone(), g.device.clone(), g.driver.clone(), g.api.clone(), g.kind);
    named(a) == named(b)
}

/// The numbers that GPUs have now. Numbers may change with the drivers that are loaded; of several that are alike the one with
/// the same number is taken first.
///
/// # Errors
/// Names the GPU that is gone.
pub(super) fn numbers(wanted: &[GpuIdentity], now: &[GpuIdentity]) -> Result<Vec<u32>, String> {
    let mut numbers: Vec<u32> = Vec::new();
    for gpu in wanted {
        let free = |g: &&GpuIdentity| same(g, gpu) && !numbers.contains(&g.index);
        let found = now.iter().find(|g| **g == *gpu && free(g)).or_else(|| now.iter().find(free));
        let gone = || format!("gpu{} ({}) was there when the profiles were listed and is gone", gpu.index, gpu.name);
        numbers.push(found.ok_or_else(gone)?.index);
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_lab::data::read_report;

    fn stored_report() -> Report {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../datasets/earlier/amd-epyc-2c-full--2026-11-21.json");
        read_report(Path::new(path), &|_| ()).unwrap().1
    }
    use crate::profiles::family::{Whole, family};
    use sapwise::{GpuKind, SimdLevel};
    use sapwise_lab::report::{Label, Proof, Restricted, Restriction, Timed};

    fn gpu(index: u32, name: &str) -> GpuIdentity {
        GpuIdentity::new(index, name, GpuKind::Discrete)
    }

    fn probe(words: &[&str]) -> Probe {
        match Arguments::try_parse_from(["sapwise", "probe", "--profiles"].iter().chain(words)).unwrap().verb {
            Verb::Probe(probe) => probe,
            other => panic!("{other:?}"),
        }
    }

    /// A report of another command in the place of the profile `1t`, and one of the same.
    fn with_one_thread(check: impl Fn(&Existing, &Profile, Report, Report)) {
        let family_of = probe(&["--no-gpus"]);
        let registry = Registry::with_cores(2);
        let mut report = stored_report();
        report.label = Label::RealRestricted;
        // Their revisions would be stale with each that changes.
        report.algorithms.clear();
        report.points.iter_mut().for_each(|p| p.timings.clear());
        report.hardware.gpus.clear();
        report.provenance.optimised = true;
        let proof = |without| Proof {
            kind: Restricted::Threads,
            parameter: "usable_cores".to_owned(),
            gpu: None,
            without: Some(without),
            with: Some(1.0),
            shows: without > 1.0,
        };
        report.provenance.restriction = Some(Restriction { kinds: vec![Restricted::Threads], proof: vec![proof(2.0)] });
        report.provenance.simd = None;
        report.provenance.gpu_threads = None;
        let physical_id = report.hardware.machine.physical_id.clone();
        let folder = Path::new("reports");
        let existing =
            Existing { folder, stem: "x-2c", physical_id: &physical_id, registry: &registry, family: &family_of };
        let whole = Whole { cores: 2, level: SimdLevel::Portable, gpus: Vec::new() };
        let profile = family(&whole, false).into_iter().find(|p| p.name == "1t").unwrap();
        let mut own = report.clone();
        own.provenance.command = existing.command(&profile, &[]).unwrap();
        report.provenance.command = "probe --quick --no-gpus --threads 1 --seed 1".to_owned();
        check(&existing, &profile, report, own);
    }

    #[test]
    fn a_good_report_of_another_command_stays_and_one_with_a_flaw_does_not() {
        with_one_thread(|existing, profile, other, own| {
            let keeps = |change: &dyn Fn(&mut Report)| {
                let mut report = other.clone();
                change(&mut report);
                existing.keeps(&report, profile)
            };
            assert_eq!(keeps(&|_| {}).as_deref(), Some("it was measured by another command"));
            assert_eq!(keeps(&|r| r.remarks.push("unfinished: going on".to_owned())), None);
            assert_eq!(keeps(&|r| r.label = Label::RealContended), None);
            let proof = |r: &mut Report| r.provenance.restriction.as_mut().unwrap().proof[0].shows = false;
            assert_eq!(keeps(&proof), None);
            let stale = Timed::new("brute@cpu1".parse().unwrap(), u32::MAX);
            assert_eq!(keeps(&|r| r.algorithms.push(stale.clone())), None);
            let contended = |r: &mut Report| {
                r.label = Label::RealContended;
                r.provenance.command += " --contended=memory";
            };
            assert!(keeps(&contended).is_some());
            assert_eq!(existing.keeps(&own, profile), None);
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("x-2c-1t--2026-11-21.json");
            assert_eq!(existing.obstacle(&path, profile), None);
            std::fs::write(&path, sapwise_lab::report::write(&other).unwrap()).unwrap();
            let told = existing.obstacle(&path, profile).unwrap();
            assert!(told.contains("another command; name another folder with --out"), "{told}");
            std::fs::write(&path, "{}").unwrap();
            assert!(existing.obstacle(&path, profile).unwrap().contains("is no report of this machine"));
        });
    }

    #[test]
    fn a_report_that_other_programs_disturbed_is_measured_again() {
        with_one_thread(|existing, profile, _, mut own| {
            assert_eq!(existing.lack(&own, profile), None);
            own.label = Label::RealContended;
            assert_eq!(existing.lack(&own, profile).as_deref(), Some("other programs disturbed it"));
        });
    }

    #[test]
    fn gpus_are_found_under_new_numbers() {
        let (x, y) = (gpu(0, "X"), gpu(1, "Y"));
        assert_eq!(numbers(std::slice::from_ref(&y), &[gpu(0, "Y"), gpu(1, "X")]), Ok(vec![0]));
        assert_eq!(numbers(&[gpu(1, "X")], &[x.clone(), gpu(1, "X")]), Ok(vec![1]));
        assert_eq!(numbers(&[x.clone(), gpu(1, "X")], &[gpu(2, "X"), gpu(1, "X")]), Ok(vec![2, 1]));
        assert!(numbers(&[x.clone(), x], &[gpu(0, "X")]).unwrap_err().contains("gpu0 (X) was there"));
        assert!(numbers(&[y], &[]).is_err());
    }
}
