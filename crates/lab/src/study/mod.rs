//! The study of Avril, Gouranton and Arnaldi (ISVRI 2011) from any set of reports: one page with figures, and tables
//! as CSV.

mod causes;
mod csv;
mod curves;
mod machines;
mod map;
mod page;

use crate::data::{self, Profile, Selection, read_reports};
use crate::fit::{measured_costs, measured_slice, slice_tuning};
use crate::progress::Progress;
use crate::report::Label;
use crate::text::count;
use crate::train::{Trained, train};
use crate::write::{is_temporary, write_text};
use crate::{Report, model_card};
use anyhow::{Context, Result, bail};
use page::Page;
use rayon::prelude::*;
use sapwise::Tuning;
use sapwise::algorithm::BackendClass;
use sapwise_tune::hardware::ParameterId;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The page of a study.
pub const PAGE: &str = "index.html";

/// The result of a study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Summary {
    /// Reports that were read.
    pub reports: usize,
    /// Reports whose timings were studied.
    pub studied: usize,
    /// Hosts that these are of.
    pub hosts: usize,
    /// The files in the folder, the page first.
    pub files: Vec<String>,
    /// Sentences about figures that could not be shown.
    pub missing: Vec<String>,
    /// Sentences about reports that were left out of the training, and about the limits of its validation.
    pub notes: Vec<String>,
}

/// The reports of a study, with the results that its sections show.
struct Material {
    reports: Vec<(String, Report)>,
    /// The studied ones, without samples.
    profiles: Vec<Profile>,
    /// The measured tuning of each of them in its usual scenario, if it has enough sizes.
    tunings: Vec<Option<Tuning>>,
    /// `None` when no model could be fitted.
    trained: Option<Trained>,
    notes: Vec<String>,
}

/// Reads reports, trains and validates a model on them, and writes the page, its figures and the tables into a
/// folder, which is made when it is missing. Files of an earlier study are replaced. The page says how and when it was
/// `made`.
///
/// # Errors
/// When a report can't be read, the folder holds something else or takes no file, and when the user asked to stop.
pub fn study(reports: &[PathBuf], out: &Path, made: &str, progress: &dyn Progress) -> Result<Summary> {
    let reports = read_reports(reports, progress)?;
    // Only now: reports that can't be read leave no empty folder.
    prepare(out)?;
    let material = Material::new(reports, progress)?;
    progress.message("drawing");
    let mut page = Page::default();
    page.files = vec![
        ("timings.csv", csv::timings(&material)?),
        ("crossovers.csv", csv::crossovers(&material)?),
        ("regrets.csv", csv::regrets(&material)?),
        ("parameters.csv", csv::parameters(&material)?),
    ];
    page.text(&material.lead());
    page.text(made);
    curves::section(&material, &mut page)?;
    map::section(&material, &mut page)?;
    regrets(&material, &mut page);
    machines::section(&material, &mut page);
    causes::section(&material, &mut page)?;
    material.notes.iter().for_each(|note| page.text(&format!("Note: {note}.")));
    page.files.insert(0, (PAGE, page.text_of()));
    progress.check()?;
    let Page { files, missing, .. } = page;
    for (name, text) in &files {
        write_text(&out.join(name), text)?;
    }
    Ok(Summary {
        reports: material.reports.len(),
        studied: material.profiles.len(),
        hosts: data::machines(&material.profiles).len(),
        files: files.into_iter().map(|(name, _)| name.to_owned()).collect(),
        missing,
        notes: material.notes,
    })
}

/// Checks before the work that the folder takes a study: it is new, empty, or holds an earlier one.
fn prepare(out: &Path) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("the folder {} can't be made", out.display()))?;
    tempfile::tempfile_in(out).with_context(|| format!("no file can be made in {}", out.display()))?;
    let earlier = fs::read_to_string(out.join(PAGE)).is_ok_and(|text| text.starts_with(page::HEAD));
    // Temporary files of a study that was killed do not count.
    let occupied = fs::read_dir(out)?.flatten().any(|entry| !is_temporary(&entry.file_name()));
    if occupied && !earlier {
        bail!("{} is not empty and holds no earlier study; name a new folder with --out", out.display());
    }
    Ok(())
}

impl Material {
    /// # Errors
    /// When the user asked to stop.
    fn new(reports: Vec<(String, Report)>, progress: &dyn Progress) -> Result<Self> {
        // Published parameters have no timings, so leaving them out needs no note.
        let timed = reports.iter().filter(|(_, report)| report.label != Label::Published);
        let mut selection = Selection::default();
        timed.for_each(|(file, report)| selection.add(Selection::reduce(file, report)));
        let (profiles, mut notes) = selection.clone().finish();
        let trained = match train(selection, "study", progress) {
            Ok(trained) => {
                notes.clone_from(&trained.notes);
                Some(trained)
            }
            Err(why) => {
                progress.check()?;
                notes.push(format!("{why:#}"));
                None
            }
        };
        let tuning = |profile: &Profile| {
            let scenario = profile.usual_scenario();
            let loads = measured_slice(profile, scenario).ok()?;
            slice_tuning(measured_costs(profile).0, scenario, &loads).ok()
        };
        let tunings = profiles.par_iter().map(tuning).collect();
        Ok(Self { reports, profiles, tunings, trained, notes })
    }

    fn lead(&self) -> String {
        format!(
            "From {}: the timings of {} on {}. Sapwise {}. All tables are beside this page as CSV: timings.csv, \
             crossovers.csv, regrets.csv, parameters.csv and influence.csv.",
            count(self.reports.len(), "report"),
            count(self.profiles.len(), "report"),
            count(data::machines(&self.profiles).len(), "host"),
            env!("CARGO_PKG_VERSION")
        )
    }

    /// The studied profiles, each with its report.
    fn studied(&self) -> impl Iterator<Item = (&Profile, &Report)> {
        // Two reports may have the same name, not the same values of all parameters.
        let alike = |p: &Profile, r: &Report| {
            p.hardware.parameters.iter().map(|p| p.value).eq(r.hardware.parameters.iter().map(|p| p.value))
        };
        self.profiles.iter().filter_map(move |profile| {
            let own = self.reports.iter().find(|(file, report)| *file == profile.file && alike(profile, report));
            own.map(|(_, report)| (profile, report))
        })
    }

    /// For each host its best profile by a rank, in the order of the reports.
    fn best_of_hosts<R: Ord>(&self, rank: impl Fn(&Profile) -> R) -> Vec<&Profile> {
        let mut best: BTreeMap<&str, &Profile> = BTreeMap::new();
        for profile in &self.profiles {
            let known = best.entry(profile.machine()).or_insert(profile);
            if rank(profile) > rank(known) {
                *known = profile;
            }
        }
        self.profiles.iter().filter(|p| best.values().any(|b| std::ptr::eq(*b, *p))).collect()
    }

    /// For each host the profile that has most of it: whole before restricted, then by cores and vector lanes.
    fn whole_hosts(&self) -> Vec<&Profile> {
        let count = |p: &Profile, id| p.hardware.value(id).map_or(0, |v| v as u64);
        self.best_of_hosts(|p| {
            (p.label == Label::RealFull, count(p, ParameterId::UsableCores), count(p, ParameterId::SimdLanes))
        })
    }
}

/// Returns the name of a report on the page.
fn title(profile: &Profile) -> &str {
    profile.file.strip_suffix(".json").unwrap_or(&profile.file)
}

/// The table of strategies.
fn regrets(material: &Material, page: &mut Page) {
    page.section("Regret of what is chosen on held-out hosts");
    let validation = material.trained.as_ref().map(|t| &t.training.validation).filter(|v| !v.methods.is_empty());
    let Some(validation) = validation else {
        return page.lacks("Nothing was held out: it takes two reports with timings.");
    };
    let mut rows = Vec::new();
    let what = model_card::scores(validation, |table| {
        rows = table.to_vec();
        String::new()
    });
    page.text(
        "Regret is the time of what is chosen over that of the best choice, less one. In parentheses it is weighted by \
         the numbers of objects that games are assumed to have, log-normal around 800.",
    );
    page.table(what.trim(), &rows);
    let on_gpu = |p: &Profile| p.algorithms.iter().any(|t| t.id.backend().class() == BackendClass::Gpu);
    let with_gpu = |p: &&Profile| on_gpu(p) && p.hardware.gpus.iter().any(data::is_real);
    let hosts: BTreeSet<&str> = material.profiles.iter().filter(with_gpu).map(Profile::machine).collect();
    match hosts.len() {
        0 => {}
        1 => page.lacks("The GPU of a host held out: one host has a real GPU, and it takes two."),
        n => page.text(&format!("{n} hosts have timings on a real GPU.")),
    }
}

#[cfg(test)]
mod tests;
