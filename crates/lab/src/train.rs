//! A model trained on reports and validated on held-out machines.

use crate::data::{Profile, Selection};
use crate::evaluate::{HeldOut, Partition, validate};
use crate::fit::{Designs, model};
use crate::progress::Progress;
use crate::training::{Training, TrainingReport};
use anyhow::{Result, bail};
use sapwise_tune::Model;

/// A model and how well it did.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The model, fitted to all reports.
    pub model: Model,
    /// Its training reports, and how well models of its kind did on held-out machines.
    pub training: Training,
    /// Sentences about reports and methods that were left out, and about the limits of the validation.
    pub notes: Vec<String>,
    /// Regrets on held-out machines, and their crossovers.
    pub held_out: HeldOut,
}

/// Fits a model to all profiles except those that are held out together with that of `file`. Returns it with a name
/// for the held-out part, such as `physical machine`.
///
/// # Errors
/// When there are no others, or no model can be fitted to them.
pub fn without(profiles: &[Profile], file: &str) -> Result<(Model, String)> {
    let partition = Partition::new(profiles);
    let mut chosen = vec![true; profiles.len()];
    // A profile of the only machine is in two folds: that of its SIMD level and that of its threads.
    let own = |fold: &&Vec<usize>| fold.iter().any(|&k| profiles[k].file == file);
    partition.folds.iter().filter(own).flatten().for_each(|&k| chosen[k] = false);
    if !chosen.contains(&true) {
        bail!("there is no other report to predict {file} from");
    }
    let model = model(&Designs::new(profiles), &chosen, "without")?.0;
    Ok((model, partition.held_out))
}

/// Fits the model called `name` to the selected reports, and validates it.
///
/// # Errors
/// When no report can be used, with the reasons and what to do; when no method can be fitted; when the user asked to
/// stop.
pub fn train(selection: Selection, name: &str, progress: &dyn Progress) -> Result<Trained> {
    let (profiles, mut notes) = selection.finish();
    if profiles.is_empty() {
        let why = if notes.is_empty() { "none was given".to_owned() } else { notes.join("; ") };
        bail!("no report can be trained on: {why}; measure one with `sapwise probe --out R.json` of a release build");
    }
    let designs = Designs::new(&profiles);
    let (mut model, left_out) = model(&designs, &vec![true; profiles.len()], name)?;
    notes.extend(designs.notes.iter().cloned());
    notes.extend(left_out);
    let validated = validate(&profiles, &designs, &Partition::new(&profiles), progress)?;
    notes.extend(validated.notes.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
    model.ratios_90_ln = validated.validation.coverage.map(|c| c.ratios_90_ln);
    let report = |p: &Profile| TrainingReport { file: p.file.clone(), host: p.machine().to_owned(), label: p.label };
    let training = Training {
        trained_on: profiles.iter().map(report).collect(),
        validation: validated.validation,
        published: None,
    };
    Ok(Trained { model, training, notes, held_out: validated.held_out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::COMPARED;
    use crate::progress::Silent;
    use crate::report::Report;
    use crate::synthetic::Machine;
    use crate::training::{read_model, write_model};
    use sapwise_tune::hardware::ParameterId;

    fn reports() -> Vec<(String, Report)> {
        Machine::family().iter().map(|m| (format!("{}.json", m.name), m.report())).collect()
    }

    #[test]
    fn a_model_is_the_same_after_json_and_knows_its_ranges() {
        let trained = train(Selection::of(&reports()), "test", &Silent).unwrap();
        let text = write_model(&trained.model, &trained.training).unwrap();
        let read = read_model(&text).unwrap();
        assert_eq!((read.model, read.training), (trained.model.clone(), trained.training));
        assert_eq!(trained.model.ranges.len(), COMPARED.len());
        let cores = trained.model.ranges.iter().find(|r| r.parameter == ParameterId::UsableCores).unwrap();
        assert_eq!((cores.min, cores.max), (2.0, 16.0));
    }

    #[test]
    fn a_users_tree_is_fitted_with_the_terms_that_its_reports_name() {
        use crate::report::{Timed, TimedTerm, Timing};
        use sapwise::AlgorithmId;
        use sapwise::algorithm::Load;
        use sapwise::tuning::Term;
        use sapwise_tune::model::Scale;
        let id: AlgorithmId = "my-tree@cpu1".parse().unwrap();
        // A sort of all boxes and nothing else: the usual terms of an unknown method hold it too, beside ten others.
        let named = TimedTerm { term: Term::Sort, scale: Scale::Cycle };
        let ns = |machine: &Machine, load: &Load| 9.0 / machine.ghz * named.term.count(load, machine.cache_bytes);
        let reports: Vec<(String, Report)> = Machine::family()
            .iter()
            .map(|machine| {
                let mut report = machine.report();
                report.algorithms.push(Timed { terms: vec![named], ..Timed::new(id.clone(), 1) });
                for point in &mut report.points {
                    let samples_ns = vec![ns(machine, &point.load).round() as u64; 5];
                    point.timings.push(Timing { algorithm: id.clone(), samples_ns, error: None });
                }
                (format!("{}.json", machine.name), report)
            })
            .collect();
        let trained = train(Selection::of(&reports), "test", &Silent).unwrap();
        let tree = trained.model.methods.iter().find(|m| m.method == "my-tree").unwrap();
        assert_eq!(tree.terms.iter().map(|t| (t.term, t.scale)).collect::<Vec<_>>(), [(named.term, named.scale)]);
        assert!((tree.terms[0].unit / 9.0 - 1.0).abs() < 0.01, "{tree:?}");
        let costs = crate::fit::measured_costs(&Profile::of("", &reports[0].1)).0;
        let own = costs.iter().find(|c| c.algorithm == id).unwrap();
        assert_eq!(own.curve.work.terms.iter().map(|t| t.term).collect::<Vec<_>>(), [named.term]);
    }

    #[test]
    fn nothing_usable_says_what_to_do() {
        let mut report = reports().remove(0);
        report.1.provenance.optimised = false;
        for reports in [vec![], vec![report]] {
            let error = train(Selection::of(&reports), "test", &Silent).unwrap_err().to_string();
            assert!(error.contains("sapwise probe --out"), "{error}");
        }
    }
}
