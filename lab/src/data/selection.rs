//! Which reports are trained on, and which of their timings.

use super::Evidence;
use super::profile::{FEWEST_SAMPLES, Profile};
use sapwise::report::{Label, Report};
use sapwise::{AlgorithmId, BackendClass};
use std::collections::{BTreeMap, HashMap};

/// What shares a revision: a method on one class of processor.
type Key = (BackendClass, String);

/// Reports that crossings are looked for in, about: a regression on a handful of parameters needs no more.
const MOST_CROSSED: usize = 600;

/// The reports that can be trained on, gathered one by one so that none has to stay in memory.
#[derive(Debug, Clone)]
pub(crate) struct Selection {
    evidence: Evidence,
    /// Crossings are looked for in each report whose place is a multiple of this.
    crossed: usize,
    profiles: Vec<Profile>,
    /// File of each fingerprint.
    known: HashMap<u64, String>,
    notes: Vec<String>,
}

impl Selection {
    /// For about so many reports.
    pub(crate) fn new(evidence: Evidence, reports: usize) -> Self {
        Self {
            evidence,
            crossed: reports.div_ceil(MOST_CROSSED).max(1),
            profiles: Vec::new(),
            known: HashMap::new(),
            notes: Vec::new(),
        }
    }

    /// All of these reports.
    pub(crate) fn of(reports: &[(String, Report)], evidence: Evidence) -> Self {
        let mut selection = Self::new(evidence, reports.len());
        for (place, (file, report)) in reports.iter().enumerate() {
            let reduced = selection.reduce(place, file, report);
            selection.add(reduced);
        }
        selection
    }

    /// Which kind it takes.
    pub(crate) fn evidence(&self) -> Evidence {
        self.evidence
    }

    /// What of the report at a place among all can be trained on, or why nothing can. Apart from [`Selection::add`] because it is work that threads can share.
    pub(crate) fn reduce(&self, place: usize, file: &str, report: &Report) -> Result<Profile, String> {
        match refusal(report, self.evidence) {
            Some(why) => Err(format!("{file} is left out: it {why}")),
            None if place.is_multiple_of(self.crossed) => Ok(Profile::of(file, report)),
            None => Ok(Profile::without_crossings(file, report)),
        }
    }

    /// Adds a report that was reduced; one that holds the same measurement as an earlier one is left out.
    pub(crate) fn add(&mut self, reduced: Result<Profile, String>) {
        let profile = match reduced {
            Ok(profile) => profile,
            Err(why) => return self.notes.push(why),
        };
        match self.known.get(&profile.fingerprint()) {
            Some(twin) => self.notes.push(format!("{} is left out: it holds the same measurement as {twin}", profile.file)),
            None => {
                self.known.insert(profile.fingerprint(), profile.file.clone());
                self.profiles.push(profile);
            }
        }
    }

    /// The profiles with the newest revision of each method only, and what was left out and why.
    pub(crate) fn finish(mut self) -> (Vec<Profile>, Vec<String>) {
        let newest = newest_revisions(&self.profiles);
        let newest_of = |id: &AlgorithmId| newest.get(&key(id)).copied().unwrap_or(0);
        for profile in &mut self.profiles {
            let stale = profile.algorithms.iter().filter(|t| t.revision < newest_of(&t.id));
            let file = &profile.file;
            self.notes.extend(stale.map(|t| {
                format!("{file}: {} is left out, its revision {} is older than {}", t.id, t.revision, newest_of(&t.id))
            }));
            profile.retain(|t| t.revision == newest_of(&t.id));
        }
        self.profiles.retain(|p| {
            if p.points.is_empty() {
                let file = &p.file;
                self.notes.push(format!("{file} is left out: no point has {FEWEST_SAMPLES} samples of a current algorithm"));
            }
            !p.points.is_empty()
        });
        (self.profiles, self.notes)
    }
}

/// The reports that can be trained on, and what was left out and why.
pub(crate) fn usable(reports: &[(String, Report)], evidence: Evidence) -> (Vec<Profile>, Vec<String>) {
    Selection::of(reports, evidence).finish()
}

fn refusal(report: &Report, evidence: Evidence) -> Option<String> {
    match (report.label, evidence) {
        (Label::Published, _) => return Some("holds published parameters, without timings".to_owned()),
        (Label::Simulated, Evidence::Real) => {
            let why =
                "is simulated, which is no evidence of how fast a machine is; `train --simulated` takes such reports alone";
            return Some(why.to_owned());
        }
        (Label::Simulated, Evidence::Simulated) => {}
        (_, Evidence::Simulated) => {
            return Some("is of a real machine, and with --simulated only simulated ones are trained on".to_owned());
        }
        (_, Evidence::Real) => {}
    }
    if !report.provenance.optimised {
        return Some(
            "was timed by an unoptimised build; measure again with one built by `cargo build --release`".to_owned(),
        );
    }
    if let Some(why) = report.hardware.implausible() {
        return Some(format!("can't be: {why}"));
    }
    if report.points.is_empty() {
        return Some("holds no timings; measure again without `--hardware-only`".to_owned());
    }
    // Two threads of which one waits for its turn on a core take 4 ms where alone they take 50 us. No parameter of the hardware tells
    // that, and a model that has seen it predicts it of others.
    if report.label == Label::RealContended && report.provenance.threads.is_none() {
        return Some(
            "was measured while other programs ran on the same cores; measure again when the machine is idle, or with \
             --contended and --threads, which leave cores to both"
                .to_owned(),
        );
    }
    None
}

fn key(id: &AlgorithmId) -> Key {
    (id.backend().class(), id.method().to_owned())
}

/// The newest revision of each method on each class of processor.
fn newest_revisions(profiles: &[Profile]) -> BTreeMap<Key, u32> {
    let mut newest = BTreeMap::new();
    for timed in profiles.iter().flat_map(|p| &p.algorithms) {
        let known = newest.entry(key(&timed.id)).or_insert(timed.revision);
        *known = timed.revision.max(*known);
    }
    newest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::synthetic::Machine;

    fn named(report: Report) -> (String, Report) {
        ("a.json".to_owned(), report)
    }

    #[test]
    fn simulated_published_unoptimised_empty_and_repeated_reports_are_told() {
        let good = Machine::family()[0].report();
        let [mut simulated, mut published, mut debug, mut empty] = [(); 4].map(|()| good.clone());
        simulated.label = Label::Simulated;
        published.label = Label::Published;
        debug.provenance.optimised = false;
        empty.points.clear();
        let (profiles, notes) = usable(&[simulated, published, debug, empty, good.clone(), good].map(named), Evidence::Real);
        assert_eq!(profiles.len(), 1);
        let told = ["simulated", "published", "unoptimised", "--hardware-only", "the same measurement"];
        assert!(told.iter().all(|t| notes.iter().any(|n| n.contains(t))) && notes.len() == 5, "{notes:?}");
    }

    #[test]
    fn a_report_of_no_machine_that_can_be_is_left_out() {
        let good = Machine::family()[0].report();
        let mut megahertz = good.clone();
        let clock = megahertz.hardware.parameters.iter_mut().find(|p| p.name == "clock_measured_ghz").unwrap();
        clock.value = clock.value.map(|ghz| ghz * 1000.0);
        let (profiles, notes) = usable(&[megahertz, good].map(named), Evidence::Real);
        assert!(profiles.len() == 1 && notes.len() == 1 && notes[0].contains("clock_measured_ghz"), "{notes:?}");
    }

    #[test]
    fn real_and_simulated_reports_are_never_mixed() {
        let [real, mut simulated] = [0, 1].map(|k| Machine::family()[k].report());
        simulated.label = Label::Simulated;
        let both = [named(real), ("b.json".to_owned(), simulated)];
        for (evidence, kept, told) in [(Evidence::Real, 0, "b.json"), (Evidence::Simulated, 1, "a.json")] {
            let (profiles, notes) = usable(&both, evidence);
            assert!(profiles.len() == 1 && profiles[0].file == both[kept].0, "{evidence:?}");
            assert!(notes.len() == 1 && notes[0].starts_with(told) && notes[0].contains("--simulated"), "{notes:?}");
        }
    }

    #[test]
    fn contended_reports_are_trained_on_where_the_others_had_cores_of_their_own() {
        let mut contended = Machine::family()[0].report();
        contended.label = Label::RealContended;
        let (profiles, notes) = usable(&[named(contended.clone())], Evidence::Real);
        assert!(profiles.is_empty() && notes[0].contains("on the same cores"), "{notes:?}");
        contended.provenance.threads = Some(1);
        assert_eq!(usable(&[named(contended)], Evidence::Real).0.len(), 1);
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
        let (profiles, notes) = usable(&[named(old), named(newer)], Evidence::Real);
        assert!(profiles[0].algorithms.iter().all(|t| t.id.method() != "grid-sap"));
        let stale = profiles[1].algorithms.iter().filter(|t| t.id.method() == "grid-sap").count();
        assert!(stale > 0 && notes.iter().all(|n| n.contains("revision")), "{notes:?}");
        assert_eq!(profiles[0].points[0].medians.len(), before - 2 - strips);
    }
}
