//! `sapwise study`: a page with figures and tables of any set of reports.

use crate::args::Study as Arguments;
use sapwise_lab::data::{read_report, report_files};
use crate::exit::{Outcome, WrongUsage};
use crate::output;
use crate::progress::Progress;
use crate::study::{self, Answer, Compared, Entry, PAGE, Study};
use sapwise_lab::text::count;
use crate::terminal::Terminal;
use crate::train::{self, Evidence, Held, Profile, Selection};
use anyhow::bail;
use rayon::prelude::*;
use sapwise::{Border, Report};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Reports that are in memory at the same time: a full one has a megabyte.
const AT_A_TIME: usize = 64;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let files = unlike(report_files(&arguments.reports)?);
    let names = study::names(&files);
    let [reference, machines] = [arguments.reference.as_slice(), &arguments.machines].map(|paths| places(paths, &files));
    let (reference, machines) = (reference?, machines?);
    study::prepare(&arguments.out)?;
    let evidence = if arguments.simulated { Evidence::Simulated } else { Evidence::Real };
    let Read { mut entries, selection, unreadable } = read(&files, &names, evidence)?;
    let (profiles, mut notes) = selection.clone().finish();
    tell_studied(&mut entries, &profiles, &notes);
    let importance = match profiles.is_empty() {
        true => Err("no report can be studied".to_owned()),
        false => train::importance(&profiles).map_err(|why| format!("{why:#}")),
    };
    let trained = train::train(selection, "study").map_err(|why| format!("{why:#}"));
    if let Ok(trained) = &trained {
        notes.clone_from(&trained.notes);
    }
    notes.extend(unreadable.iter().map(|(name, why)| format!("{name} could not be read: {why}")));
    // By the file, since what could not be read is no entry.
    let at = |file: &PathBuf| entries.iter().position(|e| e.path == *file);
    let asked: Vec<usize> = machines.iter().filter_map(at).collect();
    let studied = || (0..entries.len()).filter(|&k| entries[k].studied.is_ok());
    let wanted: Vec<usize> = if asked.is_empty() { studied().collect() } else { asked.clone() };
    let reference = match reference.first() {
        Some(file) => at(file),
        None => wanted.iter().copied().find(|&k| entries[k].is_whole()).or(wanted.first().copied()),
    };
    let compared = if asked.is_empty() { study::representatives(&entries) } else { asked };
    let progress = Progress::new(Compared::ALL.len() as u64 + 2);
    progress.message("reading what is drawn");
    let draw = |compared: Compared| {
        let drawn = compared.drawn(&entries, &wanted);
        let read = |k: usize| Ok((k, read_report(&entries[k].path)?.1));
        let drawn = drawn.into_iter().map(read).collect::<anyhow::Result<Vec<(usize, Report)>>>();
        progress.advance(1);
        Ok((compared, drawn?))
    };
    let drawn = Compared::ALL.into_iter().map(draw).collect::<anyhow::Result<_>>()?;
    progress.message("borders of what was left out");
    let borders = match &trained {
        Ok(trained) => borders(&trained.held, &entries),
        Err(_) => BTreeMap::new(),
    };
    progress.advance(1);
    progress.message("drawing");
    let study = Study {
        entries,
        wanted: compared,
        reference,
        profiles,
        notes,
        trained,
        importance,
        drawn,
        borders,
        command: command(arguments),
    };
    let answer = study.write(&arguments.out)?;
    drop(progress);
    for (name, why) in &unreadable {
        output::complain(&format!("warning: {name} is left out: {why}"));
    }
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        output::print(&summary(&answer, &arguments.out, arguments.simulated))?;
    }
    Ok(Outcome::Done)
}

/// What was read of the reports.
struct Read {
    entries: Vec<Entry>,
    selection: Selection,
    /// Names of the others, and why.
    unreadable: Vec<(String, String)>,
}

/// Reads all reports on all cores, some at a time.
fn read(files: &[PathBuf], names: &[String], evidence: Evidence) -> anyhow::Result<Read> {
    let progress = Progress::new(files.len() as u64);
    progress.message("reading");
    let mut found = Read { entries: Vec::new(), selection: Selection::new(evidence, files.len()), unreadable: Vec::new() };
    let placed: Vec<(usize, &PathBuf)> = files.iter().enumerate().collect();
    for some in placed.chunks(AT_A_TIME) {
        let read = |&(place, file): &(usize, &PathBuf)| match read_report(file) {
            // By the name that the page has, which is no path of this machine.
            Err(why) => (place, Err(why.root_cause().to_string().replace(&file.display().to_string(), &names[place]))),
            Ok((_, report)) => {
                let reduced = found.selection.reduce(place, &names[place], &report);
                let studied = reduced.as_ref().map(|_| ()).map_err(Clone::clone);
                (place, Ok((Entry::new(file, &names[place], report, studied), reduced)))
            }
        };
        let all: Vec<_> = some.par_iter().map(read).collect();
        for (place, read) in all {
            match read {
                Err(why) => found.unreadable.push((names[place].clone(), why)),
                Ok((entry, reduced)) => {
                    found.entries.push(entry);
                    found.selection.add(reduced);
                }
            }
        }
        progress.advance(some.len() as u64);
    }
    if found.entries.is_empty() {
        let (name, why) = &found.unreadable[0];
        bail!("none of {} files is a report that can be read; {name}: {why}", files.len());
    }
    Ok(found)
}

/// Marks those whose timings are left out, with the reason that the selection gave.
fn tell_studied(entries: &mut [Entry], profiles: &[Profile], notes: &[String]) {
    let kept: BTreeSet<&str> = profiles.iter().map(|p| p.file.as_str()).collect();
    for profile in profiles {
        // Without timings of stale revisions: another algorithm under the same name is no other machine.
        entries.iter_mut().filter(|e| e.file == profile.file).for_each(|e| e.profile = profile.clone());
    }
    for entry in entries.iter_mut().filter(|e| !kept.contains(e.file.as_str())) {
        let beginning = format!("{} is left out: ", entry.file);
        let why = notes.iter().find_map(|n| n.strip_prefix(&beginning));
        entry.studied = Err(why.unwrap_or("none of its timings can be used").to_owned());
    }
}

/// The measured borders, with intervals, of every report that was left out in turn.
fn borders(held: &Held, entries: &[Entry]) -> BTreeMap<String, Vec<Border>> {
    let files: BTreeSet<&str> = held.borders.iter().map(|b| b.file.as_str()).collect();
    let own: Vec<&Entry> = entries.iter().filter(|e| files.contains(e.file.as_str())).collect();
    let borders = |entry: &&Entry| {
        let mut report = read_report(&entry.path).ok()?.1;
        study::keep(&mut report, |id| entry.profile.position(id).is_some());
        let tuning = train::measured_tuning(&report, train::usual_scenario(&report)).ok()?;
        Some((entry.file.clone(), tuning.crossovers))
    };
    own.par_iter().filter_map(borders).collect()
}

/// The files, each once.
fn unlike(files: Vec<PathBuf>) -> Vec<PathBuf> {
    let mut seen = BTreeSet::new();
    files.into_iter().filter(|f| seen.insert(f.canonicalize().unwrap_or_else(|_| f.clone()))).collect()
}

/// Those of the files that are meant by these paths.
fn places(paths: &[PathBuf], files: &[PathBuf]) -> Result<Vec<PathBuf>, WrongUsage> {
    let same = |a: &Path, b: &Path| a == b || a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    let place = |path: &PathBuf| {
        let found = files.iter().find(|f| same(f, path));
        found.cloned().ok_or_else(|| WrongUsage(format!("{} is not among the reports", path.display())))
    };
    paths.iter().map(place).collect()
}

/// Paths in the command at most; more tell nobody anything.
const MOST_PATHS: usize = 6;

/// The command that makes the study again where it was called. What is above the folder it was called in is of this machine alone, and of
/// a path that begins there the last name stands.
fn command(arguments: &Arguments) -> String {
    let mut words = vec!["sapwise study".to_owned()];
    words.extend(arguments.simulated.then(|| "--simulated".to_owned()));
    match &arguments.reports[..] {
        few if few.len() <= MOST_PATHS => words.extend(few.iter().map(|p| shown(p))),
        many => words.push(format!("({} reports or folders)", many.len())),
    }
    words.push(format!("--out {}", shown(&arguments.out)));
    words.extend(arguments.reference.iter().map(|p| format!("--reference {}", shown(p))));
    words.extend(arguments.machines.iter().map(|p| format!("--machine {}", shown(p))));
    words.join(" ")
}

/// A path as a shell takes it, without what is of this machine alone.
fn shown(path: &Path) -> String {
    let last = || path.file_name().map(|n| n.to_string_lossy().into_owned());
    let text = if path.is_relative() { path.display().to_string() } else { last().unwrap_or_else(|| "/".to_owned()) };
    let plain = |c: char| c.is_alphanumeric() || "-_./+=,@%".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

fn summary(answer: &Answer, out: &Path, simulated: bool) -> String {
    let studied = answer.reports.iter().filter(|r| r.left_out.is_none()).count();
    let simulated =
        if simulated { "simulated machines, which are no evidence of how fast any is" } else { "physical machines" };
    let mut text = format!(
        "{} read, the timings of {studied} studied; {simulated}: {}\n\n",
        count(answer.reports.len(), "report"),
        answer.physical_machines
    );
    let mut rows = vec![["the paper says", "by its own table", "by these reports"].map(str::to_owned).to_vec()];
    rows.extend(answer.claims.iter().map(|c| vec![c.claim.clone(), c.by_its_table.clone(), c.by_these_reports.clone()]));
    text.push_str(&Terminal::of_standard_output().table(&rows));
    if let Some(regret) = answer.mean_regret {
        text.push_str(&format!(
            "\nPredicted from hardware parameters, left out in turn by {}: mean regret {:.1} %\n",
            answer.held_out,
            regret * 100.0
        ));
    }
    for missing in &answer.missing {
        text.push_str(&format!("\nmissing: {missing}"));
    }
    text.push_str(&format!(
        "\n\nThe page is {}, with {} files beside it. Next: open it in a browser.",
        out.join(PAGE).display(),
        answer.files.len()
    ));
    text
}
