//! Which reports are trained on, and which of their timings.

use super::profile::{FEWEST_SAMPLES, Profile};
use crate::report::{Label, Report};
use sapwise::{AlgorithmId, BackendClass};
use std::collections::{BTreeMap, HashMap};

/// Which reports are trained on. The two kinds are never mixed: a simulated machine shows what the cost model that made it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// Those of real machines.
    Real,
    /// Those of simulated ones.
    Simulated,
}

/// What shares a revision: a method on one class of processor.
type Key = (BackendClass, String);

/// Why a report is not trained on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file} is left out: it {why}")]
pub struct LeftOut {
    file: String,
    why: String,
}

/// The reports that can be trained on, gathered one by one so that none has to stay in memory.
#[derive(Debug, Clone)]
pub struct Selection {
    evidence: Evidence,
    profiles: Vec<Profile>,
    /// File of each fingerprint.
    known: HashMap<u64, String>,
    notes: Vec<String>,
}

impl Selection {
    /// None so far.
    pub fn new(evidence: Evidence) -> Self {
        Self { evidence, profiles: Vec::new(), known: HashMap::new(), notes: Vec::new() }
    }

    /// All of these reports.
    pub fn of(reports: &[(String, Report)], evidence: Evidence) -> Self {
        let mut selection = Self::new(evidence);
        for (file, report) in reports {
            selection.add(selection.reduce(file, report));
        }
        selection
    }

    /// Which kind it takes.
    pub fn evidence(&self) -> Evidence {
        self.evidence
    }

    /// What of a report can be trained on, or why nothing can. Apart from [`Selection::add`] because it is work that threads can share.
    ///
    /// # Errors
    /// Why the report is left out.
    pub fn reduce(&self, file: &str, report: &Report) -> Result<Profile, LeftOut> {
        match refusal(report, self.evidence) {
            Some(why) => Err(LeftOut { file: file.to_owned(), why }),
            None => {
                let mut profile = Profile::of(file, report);
                // Between two frames on the CPU a software adapter takes its caches, and its threads the cores: no other frame of a program has it so.
                if report.label == Label::RealSoftwareGpu {
                    profile.retain(|t| t.id.backend().class() == BackendClass::Gpu);
                }
                Ok(profile)
            }
        }
    }

    /// Adds a report that was reduced; one that holds the same measurement as an earlier one is left out.
    pub fn add(&mut self, reduced: Result<Profile, LeftOut>) {
        let profile = match reduced {
            Ok(profile) => profile,
            Err(left_out) => return self.notes.push(left_out.to_string()),
        };
        match self.known.get(&profile.fingerprint()) {
            Some(twin) => {
                self.notes.push(format!("{} is left out: it holds the same measurement as {twin}", profile.file))
            }
            None => {
                self.known.insert(profile.fingerprint(), profile.file.clone());
                self.profiles.push(profile);
            }
        }
    }

    /// The profiles with the newest revision of each method only, and what was left out and why.
    pub fn finish(mut self) -> (Vec<Profile>, Vec<String>) {
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
                self.notes
                    .push(format!("{file} is left out: no point has {FEWEST_SAMPLES} samples of a current algorithm"));
            }
            !p.points.is_empty()
        });
        (self.profiles, self.notes)
    }
}

/// The reports that can be trained on, and what was left out and why.
pub fn usable(reports: &[(String, Report)], evidence: Evidence) -> (Vec<Profile>, Vec<String>) {
    Selection::of(reports, evidence).finish()
}

fn refusal(report: &Report, evidence: Evidence) -> Option<String> {
    match (report.label, evidence) {
        (Label::Published, _) => return Some("holds published parameters, without timings".to_owned()),
        (Label::Simulated, Evidence::Real) => {
            let why = "is simulated, which is no evidence of how fast a machine is; with `--simulated` such reports are taken alone";
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
    use crate::synthetic::Machine;

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
        let (profiles, notes) =
            usable(&[simulated, published, debug, empty, good.clone(), good].map(named), Evidence::Real);
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
