//! From reports to cost curves, tuning and models.

mod baselines;
mod clouds;
mod columns;
mod crossing;
mod curve;
#[cfg(test)]
mod density;
mod direct;
mod fit;
mod folds;
mod forest;
mod held;
mod importance;
mod learning;
#[cfg(test)]
mod misspecified;
mod model;
mod nnls;
mod notes;
mod partition;
mod prior;
mod profile;
#[cfg(test)]
mod reference;
mod residual;
mod robust;
mod rows;
mod sampled;
mod scores;
mod selection;
#[cfg(test)]
pub(crate) mod synthetic;
mod terms;
mod triangle;
mod two_ways;
mod validate;
mod yardstick;

use crate::progress::Progress;
use anyhow::{Result, bail};
use fit::Designs;
use partition::Partition;
use sapwise::hardware::{GpuParameterId, ParameterId};
use sapwise::model::{GPU_PREFIX, Validation};
use sapwise::{GpuKind, Hardware, Model};

pub(crate) use baselines::{available, by_costs, slice_scenario};
pub(crate) use curve::{measured_costs, measured_tuning};
pub(crate) use held::{Held, HeldBorder, Time};
pub(crate) use importance::{Effect, Importance, Interval, Verdict, importance, measured_borders};
pub(crate) use profile::{Profile, as_at_the_points};
pub(crate) use selection::{Selection, usable};
pub(crate) use validate::OURS;
pub(crate) use yardstick::{Chooser, Yardstick, average};

/// Parameters by which the CPU of a machine is compared with those of the training.
const PARAMETERS: [&str; 8] = [
    ParameterId::ClockMeasuredGhz,
    ParameterId::SimdLanes,
    ParameterId::CacheLlcBytes,
    ParameterId::BandwidthOneThreadGbPerS,
    ParameterId::BandwidthAllThreadsGbPerS,
    ParameterId::ForkJoinColdNs,
    ParameterId::ScalingAllThreadsRatio,
    ParameterId::UsableCores,
];

/// The same of a GPU.
const GPU_PARAMETERS: [&str; 10] = [
    GpuParameterId::RoundTripNs,
    GpuParameterId::ReadBackNs,
    GpuParameterId::DispatchNs,
    GpuParameterId::UploadGbPerS,
    GpuParameterId::UploadRateGbPerS,
    GpuParameterId::DownloadGbPerS,
    GpuParameterId::DownloadRateGbPerS,
    GpuParameterId::ReadGbPerS,
    GpuParameterId::CopyGbPerS,
    GpuParameterId::ArithmeticGflopPerS,
];

/// A parameter of a machine by the name that it has in a model's ranges. That of a GPU is the one of the first GPU, which is a
/// discrete one where there is any; programs that act as GPUs don't count.
pub(crate) fn figure(hardware: &Hardware, name: &str) -> Option<f64> {
    match name.strip_prefix(GPU_PREFIX) {
        Some(name) => hardware.gpus.iter().find(|g| g.gpu.kind != GpuKind::Software)?.value(name),
        None => hardware.value(name),
    }
}

/// Which reports are trained on. The two kinds are never mixed: a simulated machine shows what the cost model that made it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Evidence {
    /// Those of real machines.
    Real,
    /// Those of simulated ones.
    Simulated,
}

/// A model and what has to be said about it.
#[derive(Debug, Clone)]
pub(crate) struct Trained {
    /// The model with its validation.
    pub(crate) model: Model,
    /// In sentences, what was left out and why, and what the validation does not say.
    pub(crate) notes: Vec<String>,
    /// What a picture shows of the validation.
    pub(crate) held: Held,
}

/// The model fitted to all profiles but those that are held out together with that of `file`, and what these are, in words.
///
/// # Errors
/// When no model can be fitted to the others, or there are none.
pub(crate) fn without(profiles: &[Profile], file: &str) -> Result<(Model, String)> {
    let partition = Partition::new(profiles);
    let mut chosen = vec![true; profiles.len()];
    // Of one machine alone a profile is in a fold of its vectors and in one of its threads; both would tell of it.
    let own = |fold: &&Vec<usize>| fold.iter().any(|&k| profiles[k].file == file);
    partition.folds.iter().filter(own).flatten().for_each(|&k| chosen[k] = false);
    if !chosen.contains(&true) {
        bail!("there is no other report to predict {file} from");
    }
    let model = model::model(profiles, &Designs::new(profiles), &chosen, "without")?.0;
    Ok((model, partition.held_out))
}

/// Fits the model called `name` to what was selected of reports, and validates it.
///
/// Reports of the other evidence, those without timings, of unoptimised builds and repeated ones are left out by the selection, and so are
/// timings of revisions that are not the newest of their method. The file names stand in the model; the order of the reports matters for one
/// baseline only, which takes the first one left in training for the default machine.
///
/// # Errors
/// When no report can be used, with the reason for each and what to do; when no method can be fitted.
pub(crate) fn train(selection: Selection, name: &str) -> Result<Trained> {
    let evidence = selection.evidence();
    let (profiles, mut notes) = selection.finish();
    if profiles.is_empty() {
        let why = if notes.is_empty() { "none was given".to_owned() } else { notes.join("; ") };
        let next = match evidence {
            Evidence::Real => "measure one with `sapwise probe --out R.json` of a release build",
            Evidence::Simulated => "make some with `sapwise simulate`",
        };
        bail!("no report can be trained on: {why}; {next}");
    }
    let designs = Designs::new(&profiles);
    let (mut model, left_out) = model::model(&profiles, &designs, &vec![true; profiles.len()], name)?;
    model.clouds = clouds::clouds(profiles.iter().map(|p| (&p.hardware, model::timed_gpus(p).collect())));
    model.folds = folds::folds(&profiles, &designs)?;
    notes.extend(designs.notes.iter().cloned());
    notes.extend(left_out);
    let partition = Partition::new(&profiles);
    let trainings = learning::trainings(&profiles);
    let progress = Progress::new((partition.folds.len() + trainings.len()) as u64);
    progress.message("validating");
    let validated = validate::validate(&profiles, &designs, &partition, &progress)?;
    notes.extend(validated.notes);
    progress.message("validating trainings of fewer machines");
    let learning = learning::learning(&profiles, &trainings, &progress)?;
    model.prior = validated.prior;
    if let Some(defect) = model.defect() {
        bail!("the model that was fitted can't be used: {defect}; the machines of the reports may all be alike");
    }
    model.validation = Validation { learning, ..validated.validation };
    Ok(Trained { model, notes: notes::folded(notes), held: validated.held })
}

#[cfg(test)]
mod tests {
    use super::synthetic::Machine;
    use super::*;
    use sapwise::report::Label;
    use sapwise::{Report, json};

    fn reports() -> Vec<(String, Report)> {
        Machine::family().iter().map(|m| (format!("{}.json", m.name), m.report())).collect()
    }

    fn of(reports: &[(String, Report)]) -> Selection {
        Selection::of(reports, Evidence::Real)
    }

    #[test]
    fn a_model_is_the_same_after_json_and_knows_its_ranges() {
        let trained = train(of(&reports()), "test").unwrap();
        let text = json::write(&trained.model).unwrap();
        assert_eq!(json::model(&text).unwrap(), trained.model);
        assert_eq!(trained.model.ranges.len(), PARAMETERS.len());
        let cores = trained.model.ranges.iter().find(|r| r.parameter == ParameterId::UsableCores).unwrap();
        assert_eq!((cores.min, cores.max), (2.0, 16.0));
    }

    #[test]
    fn a_model_of_gpus_knows_their_ranges_and_predicts_them() {
        let machines = Machine::family_with_gpus();
        let reports: Vec<(String, Report)> =
            machines[..3].iter().map(|m| (format!("{}.json", m.name), m.report())).collect();
        let model = train(of(&reports), "test").unwrap().model;
        assert_eq!(json::model(&json::write(&model).unwrap()).unwrap(), model);
        let range = model.ranges.iter().find(|r| r.parameter == "gpu/upload_rate_gb_per_s").unwrap();
        assert_eq!((range.min, range.max), (5.0, 24.0));
        let all = |ids: &[&str]| ids.iter().map(|id| (id.parse().unwrap(), 1)).collect::<Vec<_>>();
        let within = model.predict(&machines[1].hardware(), &all(&["grid-sap@cpu1", "grid-sap@gpu0", "grid-sap@gpu0+1"])).unwrap();
        assert!(within.costs.len() == 3 && !within.extrapolated, "{:?}", within.warnings);
        let outside = model.predict(&machines[4].hardware(), &all(&["grid-sap@gpu0"])).unwrap();
        let told = |text: &str| outside.warnings.iter().any(|w| w.contains(text));
        assert!(outside.extrapolated && told("upload_rate_gb_per_s of gpu0 is 50.0000"), "{:?}", outside.warnings);
    }

    #[test]
    fn one_report_gives_a_model_without_scores() {
        let trained = train(of(&reports()[..1]), "test").unwrap();
        assert_eq!(trained.model.methods.len(), 4);
        assert!(trained.model.validation.methods.is_empty() && trained.model.validation.learning.is_empty());
    }

    #[test]
    fn of_too_many_reports_the_counts_are_kept() {
        let one = reports().remove(0);
        let profile = Profile::of("a.json", &one.1);
        let mut profiles = vec![profile; model::MOST_LISTED + 1];
        profiles.iter_mut().enumerate().for_each(|(k, p)| {
            p.file = format!("{k}.json");
            p.hardware.machine.physical_id = format!("{:016x}", k / 2);
        });
        profiles[1].label = Label::RealRestricted;
        let designs = Designs::new(&profiles);
        let fitted = |chosen: &[bool]| model::model(&profiles, &designs, chosen, "many").unwrap().0;
        let mut chosen = vec![true; profiles.len()];
        let many = fitted(&chosen);
        let counts: Vec<_> = many.trained_on_counts.iter().map(|c| (c.label, c.reports, c.physical_machines)).collect();
        let all = model::MOST_LISTED;
        assert_eq!(counts, [(Label::RealFull, all, all / 2 + 1), (Label::RealRestricted, 1, 1)]);
        assert!(many.trained_on.is_empty() && !many.is_simulated());
        assert_eq!(json::model(&json::write(&many).unwrap()).unwrap(), many);
        chosen[0] = false;
        let few = fitted(&chosen);
        assert!(few.trained_on.len() == all && few.trained_on_counts.is_empty());
    }

    #[test]
    fn nothing_usable_says_what_to_do() {
        let mut report = reports().remove(0);
        report.1.provenance.optimised = false;
        for reports in [vec![], vec![report]] {
            let error = train(of(&reports), "test").unwrap_err().to_string();
            assert!(error.contains("sapwise probe --out"), "{error}");
        }
    }
}
