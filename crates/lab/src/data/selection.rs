//! Which reports are trained on, and which of their timings.

use super::profile::{FEWEST_SAMPLES, Profile};
use crate::report::{Label, Report};
use rayon::prelude::*;
use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;
use std::collections::{BTreeMap, HashMap};

/// A method on one class of processor, which has one revision.
pub(crate) type MethodKey = (BackendClass, String);

/// The reports that can be trained on, added one by one so that none has to stay in memory.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    profiles: Vec<Profile>,
    /// File of each fingerprint.
    known: HashMap<u64, String>,
    notes: Vec<String>,
}

impl Selection {
    /// Selects from these reports.
    pub fn of(reports: &[(String, Report)]) -> Self {
        let mut selection = Self::default();
        let reduced: Vec<_> = reports.par_iter().map(|(file, report)| Self::reduce(file, report)).collect();
        reduced.into_iter().for_each(|reduced| selection.add(reduced));
        selection
    }

    /// Reduces a report to the timings that are trained on.
    ///
    /// # Errors
    /// Why the report is left out.
    pub(crate) fn reduce(file: &str, report: &Report) -> Result<Profile, String> {
        if let Some(why) = refusal(report) {
            return Err(format!("{file} is left out: it {why}"));
        }
        let mut profile = Profile::of(file, report);
        // A software adapter takes caches and cores between two frames on the CPU, which happens in no program.
        if report.label == Label::RealSoftwareGpu {
            profile.retain(|t| t.id.backend().class() == BackendClass::Gpu);
        }
        Ok(profile)
    }

    /// Adds a reduced report. One that holds the same measurement as an earlier one is left out.
    pub(crate) fn add(&mut self, reduced: Result<Profile, String>) {
        let profile = match reduced {
            Ok(profile) => profile,
            Err(left_out) => return self.notes.push(left_out),
        };
        let fingerprint = profile.fingerprint();
        if let Some(twin) = self.known.get(&fingerprint) {
            self.notes.push(format!("{} is left out: it holds the same measurement as {twin}", profile.file));
        } else {
            self.known.insert(fingerprint, profile.file.clone());
            self.profiles.push(profile);
        }
    }

    /// Returns the profiles with the newest revision of each method only, and a sentence for each omission.
    pub fn finish(mut self) -> (Vec<Profile>, Vec<String>) {
        self.keep_apart();
        let mut newest: BTreeMap<MethodKey, u32> = BTreeMap::new();
        for timed in self.profiles.iter().flat_map(|p| &p.algorithms) {
            let known = newest.entry(method_key(&timed.id)).or_default();
            *known = timed.revision.max(*known);
        }
        let newest_of = |id: &AlgorithmId| newest.get(&method_key(id)).copied().unwrap_or(0);
        for profile in &mut self.profiles {
            let stale = profile.algorithms.iter().filter(|t| t.revision < newest_of(&t.id));
            let file = &profile.file;
            self.notes.extend(stale.map(|t| {
                format!("{file}: {} is left out, its revision {} is older than {}", t.id, t.revision, newest_of(&t.id))
            }));
            profile.retain(|t| t.revision == newest_of(&t.id));
        }
        // The fit depends on the order a little: the same reports must give the same model however they are named.
        self.profiles.sort_by(|a, b| a.file.cmp(&b.file));
        let (kept, empty): (Vec<_>, Vec<_>) = self.profiles.into_iter().partition(|p| !p.points.is_empty());
        let why = format!("no point has {FEWEST_SAMPLES} samples of a current algorithm");
        self.notes.extend(empty.iter().map(|p| format!("{} is left out: {why}", p.file)));
        (kept, self.notes)
    }

    /// Leaves out the reports of browsers if there are others. WebAssembly makes each method slower by another factor,
    /// which no hardware parameter shows.
    fn keep_apart(&mut self) {
        let is_of_browser = |profile: &Profile| profile.label == Label::RealBrowser;
        if !self.profiles.iter().all(is_of_browser) {
            let why =
                "it was measured in a browser, which is no evidence about native builds; train on such reports alone";
            let apart = self.profiles.iter().filter(|profile| is_of_browser(profile));
            self.notes.extend(apart.map(|profile| format!("{} is left out: {why}", profile.file)));
            self.profiles.retain(|profile| !is_of_browser(profile));
        }
    }
}

/// Returns why a report is not trained on, if it is not.
fn refusal(report: &Report) -> Option<String> {
    let why = if report.label == Label::Published {
        "holds published parameters, without timings"
    } else if !report.provenance.optimised {
        "was timed by an unoptimised build; measure again with one built by `cargo build --release`"
    } else if let Some(why) = report.hardware.implausible() {
        return Some(format!("can't be: {why}"));
    } else if report.points.is_empty() {
        "holds no timings; measure again without `--hardware-only`"
    } else if report.label == Label::RealContended {
        // One of two threads waits 4 ms for its turn on a core; on an idle machine both take 50 µs. No hardware
        // parameter shows that.
        "was measured while other programs ran on the same cores; measure again when the machine is idle"
    } else {
        return None;
    };
    Some(why.to_owned())
}

pub(crate) fn method_key(id: &AlgorithmId) -> MethodKey {
    (id.backend().class(), id.method().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn selected(reports: impl IntoIterator<Item = Report>) -> (Vec<Profile>, Vec<String>) {
        Selection::of(&reports.into_iter().map(|r| ("a.json".to_owned(), r)).collect::<Vec<_>>()).finish()
    }

    #[test]
    fn unusable_reports_are_left_out_with_a_reason() {
        let good = Machine::family()[0].report();
        let [mut published, mut debug, mut empty, mut contended, mut megahertz] = [(); 5].map(|()| good.clone());
        published.label = Label::Published;
        debug.provenance.optimised = false;
        empty.points.clear();
        contended.label = Label::RealContended;
        let clock = megahertz.hardware.parameters.iter_mut().find(|p| p.name == "clock_measured_ghz").unwrap();
        clock.value = clock.value.map(|ghz| ghz * 1000.0);
        let (profiles, notes) = selected([published, debug, empty, contended, megahertz, good.clone(), good]);
        assert_eq!(profiles.len(), 1);
        let said = [
            "published",
            "unoptimised",
            "--hardware-only",
            "on the same cores",
            "clock_measured_ghz",
            "the same measurement",
        ];
        assert!(said.iter().all(|t| notes.iter().any(|n| n.contains(t))) && notes.len() == 6, "{notes:?}");
    }

    #[test]
    fn reports_of_browsers_are_kept_apart() {
        let [one, mut browser] = [0, 1].map(|k| Machine::family()[k].report());
        browser.label = Label::RealBrowser;
        let (profiles, notes) = selected([one, browser.clone()]);
        assert_eq!((profiles.len(), profiles[0].label), (1, Label::RealFull));
        assert!(notes.len() == 1 && notes[0].contains("in a browser"), "{notes:?}");
        assert_eq!(selected([browser]).0.len(), 1);
    }

    #[test]
    fn old_revisions_errors_and_few_samples_are_dropped() {
        let [mut old, new] = [0, 1].map(|k| Machine::family()[k].report());
        let mut newer = new.clone();
        newer.algorithms.iter_mut().filter(|t| t.id.method() == "grid-sap").for_each(|t| t.revision += 1);
        old.points[0].timings[0].error = Some("out of memory".to_owned());
        old.points[0].timings[1].samples_ns.truncate(2);
        let before = old.points[0].timings.len();
        let strips = old.points[0].timings.iter().filter(|t| t.algorithm.method() == "grid-sap").count();
        let (profiles, notes) = selected([old, newer]);
        assert!(profiles[0].algorithms.iter().all(|t| t.id.method() != "grid-sap"));
        let stale = profiles[1].algorithms.iter().filter(|t| t.id.method() == "grid-sap").count();
        assert!(stale > 0 && notes.iter().all(|n| n.contains("revision")), "{notes:?}");
        assert_eq!(profiles[0].points[0].medians.len(), before - 2 - strips);
    }
}
