//! Figures 4, 6 and 7 of the paper: time over objects on the CPU and GPUs, on several GPUs, and on several threads.

use super::{Material, Page, title};
use crate::data::{Profile, is_real};
use crate::figures::{Curve, CurvePanel, Curves, Field};
use crate::fit::slice_tuning;
use anyhow::Result;
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::{AlgorithmId, Tuning};
use sapwise_tune::stats::{mean, median};
use std::collections::{BTreeMap, BTreeSet};

/// Hosts in one figure at most.
const MOST_PANELS: usize = 6;
/// Objects from which on a frame is large: below it fork and join make up most of it.
const LARGE: u32 = 1000;

/// A part of a machine that algorithms run on: some threads, or some GPUs by their numbers.
type Side = (BackendClass, Vec<u32>);

/// Which sides a figure compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Compared {
    CpuAndGpu,
    Gpus,
    Threads,
}

impl Compared {
    fn takes(self, backend: &Backend) -> bool {
        let on_gpus = backend.class() == BackendClass::Gpu;
        self == Self::CpuAndGpu || on_gpus == (self == Self::Gpus)
    }

    fn sides(self, profile: &Profile) -> BTreeSet<Side> {
        let available = profile.available();
        available.iter().map(AlgorithmId::backend).filter(|b| self.takes(b)).map(side).collect()
    }

    /// Whether a profile has sides to compare.
    fn is_in(self, profile: &Profile) -> bool {
        let sides = self.sides(profile);
        match self {
            Self::CpuAndGpu => sides.iter().map(|s| s.0).collect::<BTreeSet<_>>().len() > 1,
            Self::Gpus => sides.iter().any(|s| s.1.len() > 1),
            Self::Threads => sides.len() > 1,
        }
    }
}

pub(super) fn section(material: &Material, page: &mut Page) -> Result<()> {
    page.section("Time over objects");
    page.text(
        "Each curve is the fastest algorithm on that many threads or GPUs, medians over the frames of one scenario. \
         Shades are the fields of optimal performance between the crossovers of curves that were fitted to the same \
         timings. GPU times include the transfers.",
    );
    let figures = [
        (Compared::CpuAndGpu, "figure-4-cpu-gpu.svg", "Figure 4: CPU and GPU", "no report has timings of both"),
        (Compared::Gpus, "figure-6-gpus.svg", "Figure 6: one and several GPUs", "no report has several GPUs"),
        (
            Compared::Threads,
            "figure-7-threads.svg",
            "Figure 7: one and several threads",
            "no report has several threads",
        ),
    ];
    for (compared, file, what, lack) in figures {
        let mut hosts = material.best_of_hosts(|p| (compared.is_in(p), compared.sides(p).len(), p.points.len()));
        hosts.retain(|p| compared.is_in(p));
        hosts.truncate(MOST_PANELS);
        if hosts.is_empty() {
            page.lacks(&format!("{what}: {lack}."));
            continue;
        }
        let panels = hosts.iter().map(|p| panel(material, p, compared)).collect();
        let time = Curves { title: what.to_owned(), x_name: "objects", y_name: "time of a frame (µs)", panels };
        page.figure(file, time.svg()?, &format!("{what}."));
        if compared == Compared::Threads {
            let panels = hosts.iter().map(|p| CurvePanel { curves: speed_ups(p), ..titled(p) }).collect();
            let title = "Speed-up over the number of threads".to_owned();
            let curves = Curves { title, x_name: "threads", y_name: "speed-up", panels };
            let caption =
                "Speed-up of each method over one thread, geometric mean over frames of 1000 objects or more.";
            page.figure("speed-up.svg", curves.svg()?, caption);
        }
    }
    page.text(
        "Figure 8, the choice frame by frame beside every fixed algorithm, is drawn by `sapwise run SCENARIO --plot \
         P.svg` on the machine itself.",
    );
    Ok(())
}

fn side(backend: &Backend) -> Side {
    match backend {
        Backend::Gpu(gpus) => (BackendClass::Gpu, gpus.clone()),
        other => (other.class(), vec![other.width()]),
    }
}

fn name(profile: &Profile, (class, numbers): &Side) -> String {
    match (class, &numbers[..]) {
        (BackendClass::Cpu, [1]) => "1 thread".to_owned(),
        (BackendClass::Cpu, threads) => format!("{} threads", threads[0]),
        (BackendClass::Gpu, gpus) => {
            let own = profile.hardware.gpus.iter().filter(|g| gpus.contains(&g.gpu.index));
            let software = if own.clone().all(is_real) { "" } else { " (software)" };
            format!("{}{software}", Backend::Gpu(gpus.to_vec()))
        }
    }
}

fn titled(profile: &Profile) -> CurvePanel {
    CurvePanel { title: format!("{} ({})", title(profile), profile.usual_scenario()), ..CurvePanel::default() }
}

fn panel(material: &Material, profile: &Profile, compared: Compared) -> CurvePanel {
    let curve = |side_: &Side| Curve { name: name(profile, side_), points: fastest(profile, side_) };
    let curves = compared.sides(profile).iter().map(curve).collect();
    let at = material.profiles.iter().position(|p| std::ptr::eq(p, profile));
    let tuning = at.and_then(|k| material.tunings[k].as_ref());
    let fields = tuning.map(|tuning| fields(profile, tuning, compared)).unwrap_or_default();
    CurvePanel { curves, fields, ..titled(profile) }
}

/// At each size the median time in µs of the fastest algorithm of a side.
fn fastest(profile: &Profile, of: &Side) -> Vec<(f64, f64)> {
    let mut sizes: BTreeMap<u32, BTreeMap<u16, Vec<f64>>> = BTreeMap::new();
    for spot in profile.points.iter().filter(|s| s.scenario == profile.usual_scenario()) {
        for &(k, ns) in spot.medians.iter().filter(|m| side(profile.id(m.0).backend()) == *of) {
            sizes.entry(spot.load.objects).or_default().entry(k).or_default().push(ns / 1e3);
        }
    }
    let least = |rounds: BTreeMap<u16, Vec<f64>>| rounds.values().filter_map(|us| median(us)).min_by(f64::total_cmp);
    sizes.into_iter().filter_map(|(objects, rounds)| Some((f64::from(objects), least(rounds)?))).collect()
}

/// The fields between the sides that are compared, by the measured costs of their algorithms.
fn fields(profile: &Profile, tuning: &Tuning, compared: Compared) -> Vec<Field> {
    let mut fields: Vec<Field> = Vec::new();
    let own = tuning.costs.iter().filter(|c| compared.takes(c.algorithm.backend())).cloned().collect();
    let scenario = profile.usual_scenario();
    let Ok(tuning) = slice_tuning(own, scenario, &profile.slice(scenario)) else { return fields };
    for step in &tuning.steps {
        let name = name(profile, &side(step.algorithm.backend()));
        let from = f64::from(step.from_objects);
        match fields.last_mut() {
            Some(last) if last.name == name => {}
            last => {
                last.into_iter().for_each(|last| last.to = from);
                fields.push(Field { name, from, to: f64::INFINITY });
            }
        }
    }
    fields
}

/// For each method the speed-up on each number of threads over one thread, at large frames at which both were timed.
fn speed_ups(profile: &Profile) -> Vec<Curve> {
    let mut ratios: BTreeMap<&str, BTreeMap<u32, Vec<f64>>> = BTreeMap::new();
    for spot in profile.points.iter().filter(|s| s.load.objects >= LARGE) {
        for &(k, ns) in &spot.medians {
            let id = profile.id(k);
            let is_single = |m: &&(u16, f64)| {
                profile.id(m.0).method() == id.method() && *profile.id(m.0).backend() == Backend::Cpu(1)
            };
            let single = spot.medians.iter().find(is_single);
            if let (Backend::Cpu(threads), Some((_, one))) = (id.backend(), single) {
                ratios.entry(id.method()).or_default().entry(*threads).or_default().push((one / ns).ln());
            }
        }
    }
    let curve = |(method, threads): (&str, BTreeMap<u32, Vec<f64>>)| Curve {
        name: method.to_owned(),
        points: threads.into_iter().map(|(threads, ln)| (f64::from(threads), mean(&ln).exp())).collect(),
    };
    ratios.into_iter().map(curve).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    #[test]
    fn curves_are_the_fastest_of_each_side_and_fields_follow_each_other() {
        let reports = vec![("a.json".to_owned(), Machine::family()[2].report())];
        let material = Material::new(reports, &crate::progress::Silent).unwrap();
        let profile = &material.profiles[0];
        let is_in = [Compared::Threads, Compared::Gpus, Compared::CpuAndGpu].map(|compared| compared.is_in(profile));
        assert_eq!(is_in, [true, false, false]);
        let panel = panel(&material, profile, Compared::Threads);
        assert!(panel.curves.len() > 1 && panel.curves[0].name == "1 thread", "{panel:?}");
        let spot = profile.points.iter().find(|s| s.scenario == profile.usual_scenario()).unwrap();
        let single = spot.medians.iter().filter(|m| profile.id(m.0).threads() == 1).map(|m| m.1 / 1e3);
        let least = single.min_by(f64::total_cmp).unwrap();
        assert!(panel.curves[0].points.contains(&(f64::from(spot.load.objects), least)), "{panel:?}");
        let joined = |w: &[Field]| w[0].to == w[1].from && w[0].name != w[1].name;
        assert!(panel.fields.len() > 1 && panel.fields.windows(2).all(joined), "{panel:?}");
    }

    #[test]
    fn one_thread_has_no_speed_up() {
        let profile = Profile::of("a.json", &Machine::family()[2].report());
        for curve in speed_ups(&profile) {
            assert!((curve.points[0].1 - 1.0).abs() < 1e-12, "{curve:?}");
            assert!(curve.points.iter().all(|p| p.1 > 0.5 && p.1 < p.0 + 0.5), "{curve:?}");
        }
    }
}
