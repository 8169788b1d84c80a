//! Figures 10 and 11 of the paper: hardware parameters beside speed, and their influence on the crossovers.

use super::machines::PAPER;
use super::{Material, Page, title};
use crate::data::{COMPARED, Profile, is_real};
use crate::evaluate::{Influence, influences};
use crate::figures::Ratios;
use crate::report::Label;
use crate::text::count;
use anyhow::Result;
use sapwise::AlgorithmId;
use sapwise_tune::GpuHardware;
use sapwise_tune::stats::mean;
use std::collections::BTreeMap;

/// Points that two hosts must share for a speed-up.
const FEWEST_POINTS: usize = 5;
/// Objects from which on a frame counts for a speed-up.
const LARGE: u32 = 1000;

pub(super) fn section(material: &Material, page: &mut Page) -> Result<()> {
    page.section("What parameters go with");
    let hosts = material.whole_hosts();
    match &hosts[..] {
        [reference, others @ ..] if !others.is_empty() => {
            let caption = format!(
                "Figures 10 and 11 for CPUs: parameters over those of the reference, and how many times as fast each \
                 method is on one thread, geometric mean over shared frames of 1000 objects or more. {} show what goes \
                 together, not what causes what.",
                count(hosts.len(), "host")
            );
            page.figure("figure-10-cpus.svg", cpus(reference, others).svg()?, &caption);
        }
        _ => page.lacks("Figures 10 and 11 for CPUs: it takes two hosts."),
    }
    let published = material.reports.iter().filter(|(_, r)| r.label == Label::Published);
    let measured = material.reports.iter().filter(|(_, r)| r.label != Label::Published);
    let all: Vec<&GpuHardware> =
        published.chain(measured).flat_map(|(_, r)| &r.hardware.gpus).filter(|g| is_real(g)).collect();
    match &all[..] {
        [reference, others @ ..] if !others.is_empty() => {
            let caption = "Figures 10 and 11 for GPUs: the paper's parameters over those of the reference.";
            page.figure("figure-10-gpus.svg", gpus(reference, others).svg()?, caption);
        }
        _ => page.lacks("Figures 10 and 11 for GPUs: it takes two GPUs; datasets/published holds those of the paper."),
    }
    influence(material, page)
}

/// The table of influences.
fn influence(material: &Material, page: &mut Page) -> Result<()> {
    let found = material.trained.as_ref().map(|t| influences(&material.profiles, &t.model)).unwrap_or_default();
    if found.is_empty() {
        page.lacks("Influence on crossovers: none was measured in three reports and moves with a parameter.");
        return Ok(());
    }
    let octaves = |value: f64| format!("{value:+.2}");
    let row = |i: &Influence| {
        let (all, ends) = i.by_data.map_or((String::new(), None), |s| (octaves(s.all), s.without_one));
        let ends = ends.map_or([String::new(), String::new()], |(low, high)| [octaves(low), octaves(high)]);
        let decided = i.undecided.as_ref().map_or("yes".to_owned(), |why| format!("no: {why}"));
        let [reports, hosts] = [i.reports, i.hosts].map(|n| n.to_string());
        let head = [i.crossover.clone(), reports, hosts, i.parameter.clone(), octaves(i.by_model), all];
        [&head[..], &ends, &[decided]].concat()
    };
    let columns = "crossover reports hosts parameter model_octaves data_octaves data_least data_most decided";
    let rows: Vec<Vec<String>> = found.iter().map(row).collect();
    page.files.push(("influence.csv", super::csv::table(columns, rows.iter().cloned())?));
    let head = columns.split(' ').map(|c| c.replace('_', " ")).collect();
    let hosts = crate::data::machines(&material.profiles).len();
    let caption = format!(
        "Figure 11: octaves that a crossover moves up when a parameter doubles. Model: halved and doubled, median over \
         reports and scenarios. Data: least squares on the logarithm, each scenario with its own constant; least and \
         most with one host left out. Decided: whether these hosts can tell the parameter from others. Parameters that \
         the model moves it by under 0.1 octaves are left out. Reports of one host are no independent machines: a \
         slope rests on {} at most.",
        count(hosts, "host")
    );
    page.table(&caption, &[vec![head], rows].concat());
    Ok(())
}

fn cpus(reference: &Profile, others: &[&Profile]) -> Ratios {
    let parameter = |id: sapwise_tune::hardware::ParameterId| {
        let ratio = |p: &&Profile| ratio(p.hardware.value(id), reference.hardware.value(id));
        (id.as_str().replace('_', " "), others.iter().map(ratio).collect())
    };
    let mut rows: Vec<(String, Vec<Option<f64>>)> = COMPARED.into_iter().map(parameter).collect();
    let faster: Vec<_> = others.iter().map(|p| speed_ups(reference, p)).collect();
    for id in reference.available().into_iter().filter(|id| id.threads() == 1) {
        let ratios: Vec<Option<f64>> = faster.iter().map(|f| f.get(&id).copied()).collect();
        if ratios.iter().any(Option::is_some) {
            rows.push((format!("speed of {}", id.method()), ratios));
        }
    }
    Ratios {
        title: format!("Parameters and speed over those of {}", title(reference)),
        machines: others.iter().map(|p| title(p).to_owned()).collect(),
        rows,
    }
}

fn gpus(reference: &GpuHardware, others: &[&GpuHardware]) -> Ratios {
    let row = |(name, id): (&str, sapwise_tune::hardware::GpuParameterId)| {
        let ratios = others.iter().map(|g| ratio(g.value(id), reference.value(id)));
        (name.to_owned(), ratios.collect())
    };
    Ratios {
        title: format!("Parameters of GPUs over those of {}", reference.gpu.name),
        machines: others.iter().map(|g| g.gpu.name.clone()).collect(),
        rows: PAPER.into_iter().map(row).collect(),
    }
}

fn ratio(value: Option<f64>, reference: Option<f64>) -> Option<f64> {
    value.zip(reference).map(|(value, reference)| value / reference).filter(|r| r.is_finite() && *r > 0.0)
}

/// How many times as fast each algorithm is on another host.
fn speed_ups(reference: &Profile, other: &Profile) -> BTreeMap<AlgorithmId, f64> {
    let mut ratios: BTreeMap<AlgorithmId, Vec<f64>> = BTreeMap::new();
    for spot in reference.points.iter().filter(|s| s.load.objects >= LARGE) {
        let alike = |o: &&crate::data::Spot| (&o.scenario, o.load.objects) == (&spot.scenario, spot.load.objects);
        let Some(theirs) = other.points.iter().find(alike) else { continue };
        for &(k, ns) in &spot.medians {
            let id = reference.id(k);
            if let Some(other_ns) = other.position(id).and_then(|k| theirs.of_position(k)) {
                ratios.entry(id.clone()).or_default().push((ns / other_ns).ln());
            }
        }
    }
    ratios.retain(|_, ln| ln.len() >= FEWEST_POINTS);
    ratios.into_iter().map(|(id, ln)| (id, mean(&ln).exp())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    #[test]
    fn a_slower_copy_of_a_machine_is_slower_by_its_factor() {
        let fast = Profile::of("a.json", &Machine::family()[2].clone().exact().report());
        let mut slow = fast.clone();
        slow.points.iter_mut().flat_map(|s| &mut s.medians).for_each(|m| m.1 *= 3.0);
        let found = speed_ups(&slow, &fast);
        assert!(!found.is_empty() && found.values().all(|r| (r - 3.0).abs() < 1e-9), "{found:?}");
        let ratios = cpus(&slow, &[&fast]);
        assert!(ratios.rows.iter().all(|(name, r)| {
            let expected = if name.starts_with("speed") { 3.0 } else { 1.0 };
            r[0].is_none_or(|r| (r - expected).abs() < 1e-9)
        }));
    }
}
