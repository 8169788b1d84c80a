//! One report of a study: what the page tells of it, and its medians.

use crate::train::Profile;
use sapwise::hardware::parameter;
use sapwise::report::{Label, Provenance, Report};
use sapwise::{AlgorithmId, BackendClass, GpuHardware, GpuKind, Hardware};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A report without its samples.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Where it was read from.
    pub(crate) path: PathBuf,
    /// The same without the folders that all reports share: unlike in all of them, and nothing of the machine that reads it.
    pub(crate) file: String,
    /// What figures call it: the name of the file without its ending, and without folders where no other is called so.
    pub(crate) name: String,
    /// What kind of evidence it is.
    pub(crate) kind: Label,
    pub(crate) provenance: Provenance,
    /// Without the raw samples of its parameters.
    pub(crate) hardware: Hardware,
    /// The medians.
    pub(crate) profile: Profile,
    /// Whether its timings are studied, or why not.
    pub(crate) studied: Result<(), String>,
}

/// A place at which algorithms were timed: the scenario and the number of objects.
pub(super) type Place<'a> = (&'a str, u32);

impl Entry {
    pub(crate) fn new(path: &Path, file: &str, report: Report, studied: Result<(), String>) -> Self {
        let profile = Profile::without_crossings(file, &report);
        let measured = profile.measured.clone();
        Self {
            path: path.to_owned(),
            file: file.to_owned(),
            name: file.strip_suffix(".json").unwrap_or(file).to_owned(),
            kind: report.label,
            provenance: report.provenance,
            // As it was measured: the profile has moved the cores to where they were at the points.
            hardware: measured.unwrap_or_else(|| profile.hardware.clone()),
            profile,
            studied,
        }
    }

    /// The physical machine.
    pub(super) fn machine(&self) -> &str {
        &self.hardware.machine.physical_id
    }

    /// Whether it has all of its machine.
    pub(crate) fn is_whole(&self) -> bool {
        self.wholeness().0
    }

    pub(super) fn is_published(&self) -> bool {
        self.kind == Label::Published
    }

    /// Of two reports of one machine the greater one had more of it: it was whole, had more cores and longer vectors.
    pub(super) fn wholeness(&self) -> (bool, u64, u64) {
        let whole = matches!(self.kind, Label::RealFull | Label::Simulated);
        let count = |name: &str| self.hardware.value(name).map_or(0, |v| v as u64);
        (whole, count(parameter::USABLE_CORES), count(parameter::SIMD_LANES))
    }

    /// The first GPU that is no program on the CPU.
    pub(super) fn gpu(&self) -> Option<&GpuHardware> {
        self.hardware.gpus.iter().find(|g| g.gpu.kind != GpuKind::Software)
    }

    /// A parameter of the machine, or with `gpu/` before its name one of its first GPU that is no program.
    pub(super) fn value(&self, name: &str) -> Option<f64> {
        match name.strip_prefix(sapwise::model::GPU_PREFIX) {
            Some(name) => self.gpu()?.value(name),
            None => self.hardware.value(name),
        }
    }

    /// The most threads that an algorithm was timed on.
    pub(super) fn threads(&self) -> u32 {
        let on_cpu = self.profile.algorithms.iter().filter(|t| t.id.backend().class() == BackendClass::Cpu);
        on_cpu.map(|t| t.id.threads()).max().unwrap_or(1)
    }

    /// The median in ns of every algorithm at every place, the last where a place stands twice, by what the algorithm is
    /// called on every machine.
    pub(super) fn times(&self) -> BTreeMap<String, BTreeMap<Place<'_>, f64>> {
        let threads = self.threads();
        let mut times: BTreeMap<String, BTreeMap<Place<'_>, f64>> = BTreeMap::new();
        for spot in &self.profile.points {
            for &(k, ns) in &spot.medians {
                for name in everywhere(self.profile.id(k), threads) {
                    times.entry(name).or_default().insert((spot.scenario.as_str(), spot.load.objects), ns);
                }
            }
        }
        times
    }
}

/// What an algorithm is called on every machine: on one core, on all cores, which may be one, on each number of GPUs. Nothing of some
/// but not all cores.
fn everywhere(id: &AlgorithmId, threads: u32) -> Vec<String> {
    let mut names = Vec::new();
    match (id.backend().class(), id.backend().width()) {
        (BackendClass::Cpu, width) => {
            names.extend((width == 1).then(|| id.to_string()));
            names.extend((width == threads).then(|| format!("{} on all cores", id.method())));
        }
        // The first alone, or so many together.
        (BackendClass::Gpu, 1) => names.extend((id.backend().to_string() == "gpu0").then(|| id.to_string())),
        (BackendClass::Gpu, width) => names.push(format!("{} on {width} GPUs", id.method())),
    }
    names
}

/// Calls entries without folders where no two of them are called the same then.
pub(crate) fn shorten(entries: &mut [Entry]) {
    let short = |e: &Entry| e.name.rsplit('/').next().unwrap_or_default().to_owned();
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    entries.iter().for_each(|e| *count.entry(short(e)).or_default() += 1);
    for entry in entries {
        let name = short(entry);
        if count[&name] == 1 {
            entry.name = name;
        }
    }
}

/// Of each physical machine that is studied the report that has most of it; of one machine alone all reports.
pub(crate) fn representatives(entries: &[Entry]) -> Vec<usize> {
    let mut machines: BTreeMap<&str, usize> = BTreeMap::new();
    let studied = || (0..entries.len()).filter(|&k| entries[k].studied.is_ok());
    for k in studied() {
        let best = machines.entry(entries[k].machine()).or_insert(k);
        if entries[k].wholeness() > entries[*best].wholeness() {
            *best = k;
        }
    }
    let mut found: Vec<usize> = if machines.len() > 1 { machines.into_values().collect() } else { studied().collect() };
    found.sort_unstable();
    found
}

/// The names of files without the folders that all of them share.
pub(crate) fn names(files: &[PathBuf]) -> Vec<String> {
    let parts = |path: &Path| -> Vec<String> { path.iter().map(|p| p.to_string_lossy().into_owned()).collect() };
    let all: Vec<Vec<String>> = files.iter().map(|f| parts(&f.canonicalize().unwrap_or_else(|_| f.clone()))).collect();
    let Some(first) = all.first() else { return Vec::new() };
    let shared = (0..first.len()).take_while(|&k| all.iter().all(|p| p.len() > k + 1 && p[k] == first[k])).count();
    all.iter().map(|p| p[shared..].join("/")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_without_shared_folders_and_unlike() {
        let named = |paths: &[&str]| names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(named(&["/none/a/r.json"]), ["r.json"]);
        assert_eq!(named(&["/none/a/r.json", "/none/b/r.json", "/none/b/c/r.json"]), ["a/r.json", "b/r.json", "b/c/r.json"]);
        assert_eq!(named(&["/none/a/r.json", "/none/a/s.json"]), ["r.json", "s.json"]);
        assert!(named(&[]).is_empty());
    }

    #[test]
    fn algorithms_have_the_same_name_on_every_machine() {
        let named = |id: &str, threads| everywhere(&id.parse().unwrap(), threads);
        assert_eq!(named("strips@cpu1", 8), ["strips@cpu1"]);
        assert_eq!(named("strips@cpu8", 8), ["strips on all cores"]);
        assert_eq!(named("strips@cpu1", 1), ["strips@cpu1", "strips on all cores"]);
        assert!(named("strips@cpu4", 8).is_empty() && named("strips@gpu1", 8).is_empty());
        assert_eq!(named("strips@gpu0", 8), ["strips@gpu0"]);
        assert_eq!(named("strips@gpu0+1", 8), ["strips on 2 GPUs"]);
    }
}
