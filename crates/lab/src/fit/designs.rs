//! The cost models of all methods, fitted to parts of the profiles.

use crate::data::Profile;
use crate::fit::design::{Design, FEWEST_POINTS};
use crate::fit::load_residual::{Basis, places};
use crate::fit::method_rows::rows_by_method;
use crate::fit::terms::{Component, components, fallback_method};
use crate::text::once;
use anyhow::Result;
use sapwise::algorithm::BackendClass;
use sapwise::internals::Places;
use sapwise_tune::model::MethodModel;
use std::sync::Arc;

/// The rows of every method with the data of a fit, computed once for all fits to parts of the profiles.
#[derive(Debug)]
pub struct Designs<'a> {
    pub(crate) profiles: &'a [Profile],
    /// The scenario that is left out, if one is.
    pub(super) without: Option<&'a str>,
    /// Position of the physical machine of each profile, counted in the order of their first profiles.
    pub(super) machines: Vec<usize>,
    pub(super) methods: Vec<Design>,
    pub(super) basis: Basis,
    /// Sentences about profiles that were left out because a parameter is missing.
    pub notes: Vec<String>,
}

impl<'a> Designs<'a> {
    /// Collects the rows of all methods, with the terms that reports name for a method, else with the usual ones.
    pub fn new(profiles: &'a [Profile]) -> Self {
        Self::without(profiles, None)
    }

    /// Does the same without a scenario.
    pub fn without(profiles: &'a [Profile], scenario: Option<&'a str>) -> Self {
        Self::at(profiles, scenario, Arc::new(places(profiles, scenario)))
    }

    /// Does the same for residuals at these places.
    pub(super) fn at(profiles: &'a [Profile], without: Option<&'a str>, places: Arc<Places>) -> Self {
        let (mut notes, machines, basis) = (Vec::new(), machines(profiles), Basis::new(places));
        let features = basis.features(profiles);
        let mut by_method: Vec<_> = rows_by_method(profiles, without).into_iter().collect();
        // A method that falls back to another one is fitted after that.
        by_method.sort_by_key(|((_, method), _)| fallback_method(method).is_some());
        let methods = by_method
            .into_iter()
            .map(|((class, method), rows)| {
                let own = reported_terms(profiles, &method, class).unwrap_or_else(|| components(&method, class));
                Design::new(method, class, own, rows, (profiles, &machines), &features, &mut notes)
            })
            .collect();
        Self { profiles, without, machines, methods, basis, notes }
    }

    /// Fits a cost model for each method and class of processor that the chosen profiles hold enough timings of.
    /// Returns them with sentences about the timings and methods that were left out.
    ///
    /// # Errors
    /// When a residual can't be solved for.
    pub fn fit(&self, chosen: &[bool]) -> Result<(Vec<MethodModel>, Vec<String>)> {
        let (mut models, mut notes): (Vec<MethodModel>, _) = (Vec::new(), Vec::new());
        for design in &self.methods {
            let other = fallback_method(&design.method)
                .and_then(|other| models.iter().find(|m| m.method == other && m.backend == design.class))
                .cloned();
            let mut rows: Vec<usize> = (0..design.rows.len()).filter(|&k| chosen[design.rows[k].profile]).collect();
            let note = "on GPUs, timings on software adapters are left out: there are timings on real GPUs".to_owned();
            if design.leave_out_software(&mut rows, self.profiles) && !notes.contains(&note) {
                notes.push(note);
            }
            match design.fit(&rows, self, other.as_ref())? {
                Some(mut model) => {
                    design.call_helpers(&mut model, other.as_ref(), chosen, self)?;
                    models.push(model);
                }
                // None of the chosen profiles knows it.
                None if rows.is_empty() => {}
                None => {
                    let why = format!("fewer than {FEWEST_POINTS} points, or no term explains its time");
                    notes.push(format!("{} is left out: {why}", design.name()));
                }
            }
        }
        Ok((models, notes))
    }
}

/// Returns the terms that the reports name for a method, each once in the order of the first that has it.
fn reported_terms(profiles: &[Profile], method: &str, class: BackendClass) -> Option<Vec<Component>> {
    let timed = profiles.iter().flat_map(|p| &p.algorithms);
    let own = timed.filter(|t| t.id.method() == method && t.id.backend().class() == class).flat_map(|t| &t.terms);
    Some(once(own.map(|t| Component::of(t.term, t.scale)))).filter(|c| !c.is_empty())
}

/// Returns the position of the physical machine of each profile.
fn machines(profiles: &[Profile]) -> Vec<usize> {
    let known = once(profiles.iter().map(Profile::machine));
    profiles.iter().filter_map(|p| known.iter().position(|m| *m == p.machine())).collect()
}

#[cfg(test)]
mod tests;
