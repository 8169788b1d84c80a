//! What a folder holds already.

use super::profile::{Profile, is_named};
use crate::args::{Arguments, Probe, Verb};
use crate::document::read_document;
use crate::{provenance, restriction, revisions};
use clap::Parser;
use sapwise::json::Document;
use sapwise::{GpuIdentity, Registry, Report};
use std::path::{Path, PathBuf};

/// What reports are held against.
pub(super) struct There<'a> {
    pub(super) folder: &'a Path,
    /// The beginning of all file names.
    pub(super) stem: &'a str,
    pub(super) physical_id: &'a str,
    pub(super) registry: &'a Registry,
    /// The command that the profiles are made from.
    pub(super) family: &'a Probe,
}

impl There<'_> {
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
            let Ok(Document::Report(report)) = read_document(path) else { return false };
            self.lack(&report, profile).is_none()
        })
    }

    /// Why a file must not be replaced by this profile's report, if so.
    pub(super) fn obstacle(&self, path: &Path) -> Option<String> {
        if !path.exists() {
            return None;
        }
        match read_document(path) {
            Ok(Document::Report(report)) if report.hardware.machine.physical_id == self.physical_id => None,
            _ => {
                Some(format!("{} is no report of this machine; move it, or name another folder with --out", path.display()))
            }
        }
    }

    /// What a report lacks to be that of a profile, complete and current, if anything.
    pub(super) fn lack(&self, report: &Report, profile: &Profile) -> Option<String> {
        let provenance = &report.provenance;
        if report.hardware.machine.physical_id != self.physical_id {
            return Some("it is of another machine".to_owned());
        }
        if !provenance.optimised && !cfg!(debug_assertions) {
            return Some("it was measured by a build without optimisation".to_owned());
        }
        if let Some(stale) = revisions::stale_in_report(report, self.registry).first() {
            return Some(format!("it is stale: {stale}"));
        }
        let gpus: Vec<&GpuIdentity> = report.hardware.gpus.iter().map(|g| &g.gpu).collect();
        let alike = gpus.len() == profile.gpus.len() && gpus.iter().zip(&profile.gpus).all(|(a, b)| same(a, b));
        if !alike {
            return Some("its GPUs are others".to_owned());
        }
        let numbers: Vec<u32> = gpus.iter().map(|g| g.index).collect();
        if self.command(profile, &numbers).as_ref() != Some(&provenance.command)
            || provenance.simd != profile.simd.map(|level| level.to_string())
            || provenance.gpu_threads != profile.gpu_threads
        {
            return Some("it was measured by another command".to_owned());
        }
        if report.points.is_empty()
            || report.remarks.iter().any(|r| r.starts_with("unfinished") || r.starts_with("interrupted"))
        {
            return Some("it is incomplete".to_owned());
        }
        let restriction = provenance.restriction.as_ref();
        if let Some(told) = restriction.and_then(|r| restriction::not_shown(r).into_iter().next()) {
            return Some(told);
        }
        let proven = |kind| restriction.is_some_and(|r| r.proof.iter().any(|p| p.kind == kind));
        let unproven = profile.kinds().into_iter().find(|&kind| !proven(kind));
        unproven.map(|kind| format!("nothing was there to prove the restriction {kind} by"))
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
    GpuIdentity { index: 0, ..a.clone() } == GpuIdentity { index: 0, ..b.clone() }
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
    use sapwise::GpuKind;

    fn gpu(index: u32, name: &str) -> GpuIdentity {
        let text = String::new;
        GpuIdentity { index, name: name.to_owned(), device: text(), driver: text(), api: text(), kind: GpuKind::Discrete }
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
