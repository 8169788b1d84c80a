//! The cost model of a method on one class of processor, shared by all machines, thread counts and GPUs.

use super::residual::{Residuals, Ridge};
use super::robust::{Problem, spread};
use super::rows::{Profile, Row, rows};
use super::terms::terms;
use anyhow::Result;
use ndarray::{Array1, Array2};
use sapwise::hardware::parameter;
use sapwise::model::{Feature, MethodModel, ModelTerm, Scale};
use sapwise::report::Label;
use sapwise::{Backend, BackendClass, GpuKind, Hardware, Term};
use std::collections::BTreeMap;

/// Points that a method needs on all machines together.
const FEWEST_POINTS: usize = 8;

/// A cost model for each method and class of processor that the profiles hold enough timings of, and what was left out and
/// why.
///
/// # Errors
/// When the regression of a residual fails.
pub(crate) fn methods(profiles: &[&Profile]) -> Result<(Vec<MethodModel>, Vec<String>)> {
    let mut notes = Vec::new();
    let mut by_method: BTreeMap<(BackendClass, String), Vec<Row>> = BTreeMap::new();
    for (k, profile) in profiles.iter().enumerate() {
        for row in rows(&profile.report, k) {
            let class = row.algorithm.backend().class();
            by_method.entry((class, row.algorithm.method().to_owned())).or_default().push(row);
        }
    }
    let mut methods = Vec::new();
    for ((class, method), mut rows) in by_method {
        let name = if class == BackendClass::Cpu { method.clone() } else { format!("{method} on GPUs") };
        if class == BackendClass::Gpu && leave_out_software(&mut rows, profiles) {
            notes.push(format!(
                "{name}: timings on programs that act as GPUs are left out, there being timings on real ones"
            ));
        }
        match Shared::new(&method, class, rows, profiles, &mut notes).model()? {
            Some(model) => methods.push(model),
            None => {
                notes.push(format!("{name} is left out: fewer than {FEWEST_POINTS} points, or no term explains its time"));
            }
        }
    }
    Ok((methods, notes))
}

/// Leaves out the rows on programs that act as GPUs, where others are left. They are bound by the CPU, so that what they
/// share with a GPU is the interface only. Whether any was left out.
fn leave_out_software(rows: &mut Vec<Row>, profiles: &[&Profile]) -> bool {
    let software = |r: &Row| gpu_kinds(&profiles[r.profile].report.hardware, r).contains(&GpuKind::Software);
    let (programs, real): (Vec<Row>, Vec<Row>) = rows.drain(..).partition(software);
    let some_left_out = real.iter().any(|r| !r.floor) && !programs.is_empty();
    *rows = if real.iter().any(|r| !r.floor) { real } else { programs };
    some_left_out
}

/// The kinds of the GPUs that a row was timed on; none on the CPU.
fn gpu_kinds(hardware: &Hardware, row: &Row) -> Vec<GpuKind> {
    match row.algorithm.backend() {
        Backend::Gpu(indices) => indices.iter().filter_map(|&k| hardware.gpu(k)).map(|g| g.gpu.kind).collect(),
        _ => Vec::new(),
    }
}

/// The rows of one method with their terms in nanoseconds for one unit.
struct Shared<'a> {
    method: &'a str,
    class: BackendClass,
    rows: Vec<Row>,
    profiles: &'a [&'a Profile],
    terms: Vec<(Term, Scale)>,
    design: Array2<f64>,
}

impl<'a> Shared<'a> {
    /// Leaves out, with a note, the profiles that lack a hardware parameter.
    fn new(
        method: &'a str,
        class: BackendClass,
        rows: Vec<Row>,
        profiles: &'a [&'a Profile],
        notes: &mut Vec<String>,
    ) -> Self {
        let terms = terms(method, class);
        let (mut kept, mut values) = (Vec::new(), Vec::new());
        let mut told: Vec<(usize, String)> = Vec::new();
        for row in rows {
            let profile = profiles[row.profile];
            match nanoseconds(&terms, &profile.report.hardware, &row) {
                Ok(ns) => {
                    values.extend(ns);
                    kept.push(row);
                }
                // A profile may hold several GPUs, of which one lacks a parameter.
                Err(why) if told.contains(&(row.profile, why.clone())) => {}
                Err(why) => {
                    let what = if class == BackendClass::Cpu { method } else { &row.algorithm.to_string() };
                    notes.push(format!("{} is left out for {what}: {why}", profile.file));
                    told.push((row.profile, why));
                }
            }
        }
        let design = Array2::from_shape_vec((kept.len(), terms.len()), values).unwrap_or_default();
        Self { method, class, rows: kept, profiles, terms, design }
    }

    fn model(&self) -> Result<Option<MethodModel>> {
        let measured: Vec<usize> = (0..self.rows.len()).filter(|&k| !self.rows[k].floor).collect();
        let Some(first) = measured.first().filter(|_| measured.len() >= FEWEST_POINTS) else { return Ok(None) };
        let weights = self.weights();
        let problem = Problem {
            terms: self.design.clone(),
            ns: self.rows.iter().map(|r| r.ns).collect(),
            weights: weights.clone(),
            floors: self.rows.iter().map(|r| r.floor).collect(),
            groups: self.rows.iter().map(|r| r.profile).collect(),
        };
        let units = Array1::from(problem.units());
        let modelled = self.design.dot(&units);
        if measured.iter().any(|&k| modelled[k] <= 0.0) {
            return Ok(None);
        }
        let residuals = self.residuals(&measured, &modelled, &weights)?;
        let ridge = residuals.ridge()?;
        let left = (0..measured.len()).map(|k| residuals.ln_ratios[k] - residuals.at(&ridge, k));
        let spread_ln = spread(left.collect());
        let used = self.terms.iter().zip(&units).filter(|(_, u)| **u > 0.0);
        let objects = || measured.iter().map(|&k| self.rows[k].load.objects);
        let first = &self.rows[*first];
        let revision = self.profiles[first.profile].report.algorithms.iter().find(|t| t.id == first.algorithm);
        let mut gpu_kinds: Vec<GpuKind> =
            self.rows.iter().flat_map(|r| gpu_kinds(&self.profiles[r.profile].report.hardware, r)).collect();
        gpu_kinds.sort_unstable();
        gpu_kinds.dedup();
        let Ridge { intercept, terms } = ridge;
        Ok(Some(MethodModel {
            method: self.method.to_owned(),
            backend: self.class,
            revision: revision.map_or(0, |t| t.revision),
            max_threads: measured.iter().map(|&k| self.rows[k].algorithm.backend().width()).max().unwrap_or(1),
            gpu_kinds,
            min_objects: objects().min().unwrap_or(1),
            max_objects: objects().max().unwrap_or(1),
            terms: used.map(|(&(term, scale), &unit)| ModelTerm { term, scale, unit }).collect(),
            residual_intercept: intercept,
            residual: terms,
            spread_ln,
        }))
    }

    /// Every profile counts the same, and within it every octave of the number of objects. A contended one counts a quarter:
    /// what other programs take changes from one second to the next, so that its parameters say little about its timings. On
    /// the first one a cold fork and join was measured 800 times as long as a parallel frame took.
    fn weights(&self) -> Vec<f64> {
        let octave = |r: &Row| (r.profile, r.load.objects.ilog2());
        let mut rows: BTreeMap<(usize, u32), f64> = BTreeMap::new();
        for row in &self.rows {
            *rows.entry(octave(row)).or_default() += 1.0;
        }
        let mut octaves: BTreeMap<usize, f64> = BTreeMap::new();
        for (profile, _) in rows.keys() {
            *octaves.entry(*profile).or_default() += 1.0;
        }
        let trust = |r: &Row| if self.profiles[r.profile].report.label == Label::RealContended { 0.25 } else { 1.0 };
        self.rows.iter().map(|r| trust(r) / (rows[&octave(r)] * octaves[&r.profile])).collect()
    }

    fn residuals(&self, measured: &[usize], modelled: &Array1<f64>, weights: &[f64]) -> Result<Residuals> {
        let names = Feature::of(self.class);
        let mut features = Vec::new();
        let mut machines: Vec<&str> = Vec::new();
        let mut groups = Vec::new();
        for &k in measured {
            let row = &self.rows[k];
            let hardware = &self.profiles[row.profile].report.hardware;
            for feature in names {
                features.push(feature.value(hardware, row.algorithm.backend(), &row.load).map_err(anyhow::Error::msg)?);
            }
            let machine = hardware.machine.physical_id.as_str();
            groups.push(machines.iter().position(|m| *m == machine).unwrap_or_else(|| {
                machines.push(machine);
                machines.len() - 1
            }));
        }
        let all: Vec<f64> = measured.iter().map(|&k| (self.rows[k].ns / modelled[k]).ln()).collect();
        // A point that the terms miss by far is a term that is missing, or a disturbed measurement: either way no slope.
        let reach = 3.0 * spread(all.clone()).max(0.01);
        Ok(Residuals {
            names,
            features: Array2::from_shape_vec((measured.len(), names.len()), features)?,
            ln_ratios: all.into_iter().map(|r| r.clamp(-reach, reach)).collect(),
            weights: measured.iter().map(|&k| weights[k]).collect(),
            groups,
        })
    }
}

/// Nanoseconds for one unit of each term in a row.
fn nanoseconds(terms: &[(Term, Scale)], hardware: &Hardware, row: &Row) -> Result<Vec<f64>, String> {
    let backend = row.algorithm.backend();
    let cache = hardware.value(parameter::CACHE_LLC_BYTES).filter(|c| *c > 0.0);
    let cache = match backend.class() {
        BackendClass::Cpu => {
            cache.ok_or_else(|| format!("the hardware parameter {} is missing", parameter::CACHE_LLC_BYTES))?
        }
        BackendClass::Gpu => 0.0,
    };
    // The residual needs its parameters even where no term does.
    Feature::of(backend.class()).iter().try_for_each(|f| f.value(hardware, backend, &row.load).map(|_| ()))?;
    let one = |&(term, scale): &(Term, Scale)| Ok(term.count(&row.load, cache) * scale.nanoseconds(hardware, backend)?);
    terms.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Machine, gpu_truth, truth};
    use super::*;

    fn profiles(machines: impl IntoIterator<Item = Machine>) -> Vec<Profile> {
        machines.into_iter().map(|m| Profile { file: format!("{}.json", m.name), report: m.report() }).collect()
    }

    #[test]
    fn coefficients_are_recovered_from_six_machines_and_predict_the_seventh() {
        let all = profiles(Machine::family().into_iter().map(Machine::exact));
        let training: Vec<&Profile> = all[..6].iter().collect();
        let (fitted, notes) = methods(&training).unwrap();
        assert!(notes.is_empty() && fitted.len() == 4, "{notes:?}");
        for truth in truth() {
            let found = fitted.iter().find(|m| m.method == truth.method).unwrap();
            for t in &truth.terms {
                let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
                assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
            }
            assert!(found.spread_ln < 0.005, "{found:?}");
            for row in rows(&all[6].report, 0).iter().filter(|r| r.algorithm.method() == truth.method && !r.floor) {
                let curve = found.curve(&all[6].report.hardware, row.algorithm.backend()).unwrap();
                assert!((curve.cost_ns(&row.load) / row.ns - 1.0).abs() < 0.02, "{row:?}");
            }
        }
    }

    #[test]
    fn coefficients_on_gpus_are_recovered_and_predict_the_machine_left_out() {
        let all = profiles(Machine::family_with_gpus().into_iter().map(Machine::exact));
        let training: Vec<&Profile> = all[..7].iter().collect();
        let (fitted, notes) = methods(&training).unwrap();
        assert!(notes.is_empty() && fitted.len() == 7, "{notes:?}");
        for truth in gpu_truth() {
            let alike = |m: &&MethodModel| m.method == truth.method && m.backend == BackendClass::Gpu;
            let found = fitted.iter().find(alike).unwrap();
            assert_eq!((found.max_threads, &found.gpu_kinds[..]), (2, &[GpuKind::Discrete, GpuKind::Integrated][..]));
            for t in &truth.terms {
                let unit = found.terms.iter().find(|f| (f.term, f.scale) == (t.term, t.scale)).map_or(0.0, |f| f.unit);
                assert!((unit / t.unit - 1.0).abs() < 0.05, "{}: {t:?} became {unit}; {:?}", truth.method, found.terms);
            }
            assert!(found.spread_ln < 0.005, "{found:?}");
            let of_held = rows(&all[7].report, 0);
            let own =
                |r: &&Row| r.algorithm.method() == truth.method && r.algorithm.to_string().contains("@gpu") && !r.floor;
            assert!(of_held.iter().filter(own).count() > 10);
            for row in of_held.iter().filter(own) {
                let curve = found.curve(&all[7].report.hardware, row.algorithm.backend()).unwrap();
                assert!((curve.cost_ns(&row.load) / row.ns - 1.0).abs() < 0.02, "{row:?}");
            }
        }
    }

    #[test]
    fn one_machine_with_a_gpu_has_a_model_of_full_rank() {
        let all = profiles(Machine::family_with_gpus().into_iter().take(1));
        let (fitted, notes) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        assert!(notes.is_empty() && fitted.len() == 7, "{notes:?}");
        for method in fitted {
            let own = |r: &&Row| r.algorithm.method() == method.method && r.algorithm.backend().class() == method.backend;
            for row in rows(&all[0].report, 0).iter().filter(own).filter(|r| !r.floor) {
                let curve = method.curve(&all[0].report.hardware, row.algorithm.backend()).unwrap();
                assert!((curve.cost_ns(&row.load) / row.ns).ln().abs() < 0.5, "{row:?}");
            }
        }
    }

    #[test]
    fn programs_that_act_as_gpus_serve_only_where_there_is_no_real_one() {
        let mut all = profiles(Machine::family_with_gpus().into_iter().take(3));
        let software = |p: &mut Profile| p.report.hardware.gpus.iter_mut().for_each(|g| g.gpu.kind = GpuKind::Software);
        software(&mut all[0]);
        let kinds = |all: &[Profile]| {
            let (fitted, notes) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
            let told = notes.iter().any(|n| n.contains("programs that act as GPUs are left out"));
            (fitted.into_iter().find(|m| m.backend == BackendClass::Gpu).unwrap().gpu_kinds, told)
        };
        let (found, told) = kinds(&all);
        assert!(told && !found.contains(&GpuKind::Software), "{found:?}");
        all.iter_mut().for_each(software);
        assert_eq!(kinds(&all), (vec![GpuKind::Software], false));
    }

    #[test]
    fn a_gpu_that_lacks_a_parameter_costs_its_own_rows_only() {
        let mut all = profiles(Machine::family_with_gpus().into_iter().take(3));
        let gpu = &mut all[1].report.hardware.gpus[1];
        gpu.parameters.retain(|p| p.name != sapwise::hardware::gpu::parameter::DISPATCH_NS);
        let (fitted, notes) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(fitted.len(), 7);
        assert!(notes.iter().all(|n| n.contains("dispatch_ns") && n.contains("gpu1")) && notes.len() == 3, "{notes:?}");
    }

    #[test]
    fn the_residual_repairs_a_term_that_is_missing() {
        let mut all = profiles(Machine::family());
        for point in all.iter_mut().flat_map(|p| &mut p.report.points) {
            let factor = (-0.02 * (f64::from(point.load.objects).log2() - 11.0).powi(2)).exp();
            let samples = point.timings.iter_mut().flat_map(|t| &mut t.samples_ns);
            samples.for_each(|ns| *ns = (*ns as f64 * factor) as u64);
        }
        let (fitted, _) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        let mut errors = (0.0, 0.0);
        for method in fitted {
            let bare = MethodModel { residual: Vec::new(), residual_intercept: 0.0, ..method.clone() };
            let error = |m: &MethodModel| {
                let rows: Vec<Row> =
                    rows(&all[3].report, 3).into_iter().filter(|r| r.algorithm.method() == m.method && !r.floor).collect();
                let curve = |r: &Row| m.curve(&all[3].report.hardware, r.algorithm.backend()).unwrap();
                rows.iter().map(|r| (curve(r).cost_ns(&r.load) / r.ns).ln().powi(2)).sum::<f64>()
            };
            errors = (errors.0 + error(&method), errors.1 + error(&bare));
        }
        assert!(errors.0 < 0.8 * errors.1, "{errors:?}");
    }

    #[test]
    fn machines_that_lack_a_parameter_are_told() {
        let mut all = profiles(Machine::family().into_iter().take(2));
        all[0].report.hardware.parameters.retain(|p| p.name != parameter::FORK_JOIN_COLD_NS);
        let (fitted, notes) = methods(&all.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(fitted.len(), 4);
        assert!(notes.iter().any(|n| n.contains(parameter::FORK_JOIN_COLD_NS)), "{notes:?}");
    }
}
