//! One report of a study: what the page tells of it, and its medians.

use crate::data::{Profile, figure, first_real_gpu, is_real};
use crate::report::{Label, Provenance, Report};
use sapwise::hardware::ParameterId;
use sapwise::{AlgorithmId, Backend, BackendClass, GpuHardware, Hardware};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A report without its samples.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Where it was read from.
    pub(crate) path: PathBuf,
    /// The name of the file, with its folder or a number where another is called so. No path: it is of the machine that reads it.
    pub(crate) file: String,
    /// The same without its ending.
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

/// What is said of algorithms on all cores, and of GPUs that are software adapters.
pub(super) const ON_ALL_CORES: &str = " on all cores";
pub(super) const SOFTWARE: &str = " (software)";

/// A place at which algorithms were timed: the scenario and the number of objects.
pub(super) type PointKey<'a> = (&'a str, u32);

impl Entry {
    pub(crate) fn new(path: &Path, file: &str, mut report: Report, studied: Result<(), String>) -> Self {
        let machine = &mut report.hardware.machine;
        let of_gpus = report.hardware.gpus.iter_mut().map(|g| &mut g.gpu.name);
        let told =
            [&mut machine.cpu, &mut machine.simd, &mut report.provenance.command, &mut report.provenance.version];
        told.into_iter().chain(of_gpus).for_each(|text| *text = legible(text));
        let profile = Profile::of(file, &report);
        Self {
            path: path.to_owned(),
            file: file.to_owned(),
            name: file.strip_suffix(".json").unwrap_or(file).to_owned(),
            kind: report.label,
            provenance: report.provenance,
            hardware: profile.hardware.clone(),
            profile,
            studied,
        }
    }

    /// The physical machine.
    pub(super) fn machine(&self) -> &str {
        self.profile.machine()
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
        let whole = self.kind == Label::RealFull;
        let count = |id| self.hardware.value(id).map_or(0, |v| v as u64);
        (whole, count(ParameterId::UsableCores), count(ParameterId::SimdLanes))
    }

    /// The first GPU that is no software adapter.
    pub(super) fn gpu(&self) -> Option<&GpuHardware> {
        first_real_gpu(&self.hardware)
    }

    /// A parameter of the machine, or with `gpu/` before its name one of its first GPU that is no software adapter.
    pub(super) fn value(&self, name: &str) -> Option<f64> {
        figure(&self.hardware, name)
    }

    /// Numbers of the GPUs that are software adapters.
    pub(super) fn software_gpus(&self) -> Vec<u32> {
        let software_gpus = self.hardware.gpus.iter().filter(|g| !is_real(g));
        software_gpus.map(|g| g.gpu.index).collect()
    }

    /// The most threads that an algorithm was timed on.
    pub(super) fn threads(&self) -> u32 {
        let on_cpu = self.profile.algorithms.iter().filter(|t| t.id.backend().class() == BackendClass::Cpu);
        on_cpu.map(|t| t.id.threads()).max().unwrap_or(1)
    }

    /// The median in ns of every algorithm at every place, the last where a place stands twice, by what the algorithm is
    /// called on every machine.
    pub(super) fn times(&self) -> BTreeMap<String, BTreeMap<PointKey<'_>, f64>> {
        let threads = self.threads();
        let software_gpus = self.software_gpus();
        let mut times: BTreeMap<String, BTreeMap<PointKey<'_>, f64>> = BTreeMap::new();
        for spot in &self.profile.points {
            for &(k, ns) in &spot.medians {
                for name in everywhere(self.profile.id(k), threads, &software_gpus) {
                    times.entry(name).or_default().insert((spot.scenario.as_str(), spot.load.objects), ns);
                }
            }
        }
        times
    }
}

/// What an algorithm is called on every machine: on one core, on all cores, which may be one, on each number of GPUs; those that are `software_gpus`
/// are told apart, since they are the CPU again. Nothing of some but not all cores.
fn everywhere(id: &AlgorithmId, threads: u32, software_gpus: &[u32]) -> Vec<String> {
    let mut names = Vec::new();
    match id.backend() {
        Backend::Gpu(gpus) => {
            let software = if gpus.iter().any(|g| software_gpus.contains(g)) { SOFTWARE } else { "" };
            match gpus[..] {
                // The first alone, or so many together.
                [0] => names.push(format!("{id}{software}")),
                [_] => {}
                _ => names.push(format!("{} on {} GPUs{software}", id.method(), gpus.len())),
            }
        }
        other => {
            names.extend((other.width() == 1).then(|| id.to_string()));
            names.extend((other.width() == threads).then(|| format!("{}{ON_ALL_CORES}", id.method())));
        }
    }
    names
}

/// Of each physical machine that is studied the report that has most of it; of one machine alone all reports.
pub(crate) fn representatives(entries: &[Entry]) -> Vec<usize> {
    let studied = || (0..entries.len()).filter(|&k| entries[k].studied.is_ok());
    let best = best_of_machines(entries, studied(), Entry::wholeness);
    if best.len() > 1 { best } else { studied().collect() }
}

/// Of each physical machine the first of the entries with the highest rank, by position, ascending.
pub(super) fn best_of_machines<R: Ord>(
    entries: &[Entry],
    among: impl Iterator<Item = usize>,
    rank: impl Fn(&Entry) -> R,
) -> Vec<usize> {
    let mut machines: BTreeMap<&str, usize> = BTreeMap::new();
    for k in among {
        let best = machines.entry(entries[k].machine()).or_insert(k);
        if rank(&entries[k]) > rank(&entries[*best]) {
            *best = k;
        }
    }
    let mut found: Vec<usize> = machines.into_values().collect();
    found.sort_unstable();
    found
}

/// Letters of a name, at most: one of a megabyte fills a page.
const MOST_LETTERS: usize = 100;

/// A name without what would turn the direction of the text after it, ring a bell or fill screens.
fn legible(text: &str) -> String {
    let turns = |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let sound = |c: char| if c.is_control() || turns(c) { char::REPLACEMENT_CHARACTER } else { c };
    let mut short: String = text.chars().take(MOST_LETTERS).map(sound).collect();
    if text.chars().nth(MOST_LETTERS).is_some() {
        short.push_str("...");
    }
    short
}

/// Names of files, each unlike all others: those that several share have their folder before them, and a number where that does not help.
pub(crate) fn names(files: &[PathBuf]) -> Vec<String> {
    let last =
        |path: Option<&Path>| path.and_then(Path::file_name).map(|n| legible(&n.to_string_lossy())).unwrap_or_default();
    let short: Vec<String> = files.iter().map(|f| last(Some(f))).collect();
    let with_folder = |k: usize| match last(files[k].parent()) {
        folder if folder.is_empty() => short[k].clone(),
        folder => format!("{folder}/{}", short[k]),
    };
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    short.iter().for_each(|name| *count.entry(name).or_default() += 1);
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let unlike = |k: usize| {
        let name = if count[short[k].as_str()] > 1 { with_folder(k) } else { short[k].clone() };
        let times = seen.entry(name.clone()).or_default();
        *times += 1;
        if *times > 1 { format!("{name} ({times})") } else { name }
    };
    (0..files.len()).map(unlike).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unlike_and_no_paths() {
        let named = |paths: &[&str]| names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(named(&["/home/me/r.json", "s.json"]), ["r.json", "s.json"]);
        assert_eq!(
            named(&["/home/me/a/r.json", "b/r.json", "/home/a/r.json", "s.json"]),
            ["a/r.json", "b/r.json", "a/r.json (2)", "s.json"]
        );
        assert_eq!(named(&["r.json", "../r.json", "/r.json"]), ["r.json", "r.json (2)", "r.json (3)"]);
        assert!(named(&[]).is_empty());
        let long = "x".repeat(200);
        let odd = named(&["a\u{202e}b\u{7}.json", &long]);
        assert_eq!((odd[0].as_str(), odd[1].chars().count()), ("a\u{fffd}b\u{fffd}.json", MOST_LETTERS + 3));
    }

    #[test]
    fn algorithms_have_the_same_name_on_every_machine() {
        let named = |id: &str, threads| everywhere(&id.parse().unwrap(), threads, &[2]);
        assert_eq!(named("grid-sap@cpu1", 8), ["grid-sap@cpu1"]);
        assert_eq!(named("grid-sap@cpu8", 8), ["grid-sap on all cores"]);
        assert_eq!(named("grid-sap@cpu1", 1), ["grid-sap@cpu1", "grid-sap on all cores"]);
        assert!(named("grid-sap@cpu4", 8).is_empty() && named("grid-sap@gpu1", 8).is_empty());
        assert_eq!(named("grid-sap@gpu0", 8), ["grid-sap@gpu0"]);
        assert_eq!(named("grid-sap@gpu0+1", 8), ["grid-sap on 2 GPUs"]);
        assert_eq!(named("grid-sap@gpu0+2", 8), ["grid-sap on 2 GPUs (software)"]);
    }
}
