//! Tidy tables as CSV: a row for each value, with the report and the host that it is from.

use super::Material;
use crate::data::is_sound;
use crate::evaluate::UnitRegrets;
use anyhow::Result;
use sapwise::algorithm::{Backend, BackendClass};
use sapwise_tune::stats::{mean, quantile};

/// Writes a table with these columns.
pub(super) fn table(columns: &str, mut rows: impl Iterator<Item = Vec<String>>) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.split(' '))?;
    rows.try_for_each(|row| writer.write_record(row))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Every studied timing: number of samples, quartiles and mean.
pub(super) fn timings(material: &Material) -> Result<String> {
    let columns = "report host scenario algorithm method processor threads gpus objects pairs moved moved_share \
                   samples quartile_1_ns quartile_3_ns median_ns mean_ns";
    let mut rows = Vec::new();
    for (profile, report) in material.studied() {
        for (point, timing) in report.points.iter().flat_map(|p| p.timings.iter().map(move |t| (p, t))) {
            let id = &timing.algorithm;
            if !is_sound(timing) || profile.position(id).is_none() || point.load.objects == 0 {
                continue;
            }
            let ns: Vec<f64> = timing.samples_ns.iter().map(|&ns| ns as f64).collect();
            let [low, high, middle] = [0.25, 0.75, 0.5].map(|share| quantile(&ns, share));
            let on_gpus = id.backend().class() == BackendClass::Gpu;
            let (threads, gpus) = if on_gpus { (0, id.backend().width()) } else { (id.threads(), 0) };
            let words = [&profile.file, profile.machine(), &point.scenario, &id.to_string(), id.method()];
            let processor = if on_gpus { "gpu" } else { "cpu" };
            let counts = [threads, gpus, point.load.objects].map(|n| n.to_string());
            let of_load = [point.load.pairs, point.load.moved, point.load.moved_share].map(|n| n.to_string());
            let times = [low, high, middle, Some(mean(&ns))].map(|n| n.map_or(String::new(), |n| n.to_string()));
            let words = words.map(str::to_owned).into_iter().chain([processor.to_owned()]);
            let samples = [ns.len().to_string()];
            rows.push(words.chain(counts).chain(of_load).chain(samples).chain(times).collect());
        }
    }
    table(columns, rows.into_iter())
}

/// Every measured crossover between neighbouring fields, beside the predicted one when the report was held out.
pub(super) fn crossovers(material: &Material) -> Result<String> {
    let columns = "report host scenario below above objects predicted_objects predicted_to_cross";
    let held_out = material.trained.as_ref().map(|t| &t.held_out.crossovers[..]).unwrap_or_default();
    let mut rows = Vec::new();
    for (profile, tuning) in material.profiles.iter().zip(&material.tunings) {
        for crossover in tuning.iter().flat_map(|t| &t.crossovers) {
            let alike = |c: &&crate::evaluate::ComparedCrossover| {
                (&c.below, &c.above) == (&crossover.below, &crossover.above) && c.measured == crossover.objects
            };
            let usual = |h: &&crate::evaluate::HeldOutCrossover| {
                h.file == profile.file && h.scenario == profile.usual_scenario()
            };
            let own = held_out.iter().filter(usual).map(|h| &h.compared);
            let predicted = own.clone().find(alike);
            rows.push(vec![
                profile.file.clone(),
                profile.machine().to_owned(),
                profile.usual_scenario().to_owned(),
                crossover.below.to_string(),
                crossover.above.to_string(),
                crossover.objects.to_string(),
                predicted.map_or(String::new(), |c| c.predicted.to_string()),
                predicted.map_or(String::new(), |c| c.crosses.to_string()),
            ]);
        }
    }
    table(columns, rows.into_iter())
}

/// The mean regrets of each strategy on each host, or report of the only host, that was held out.
pub(super) fn regrets(material: &Material) -> Result<String> {
    let columns = "strategy held_out folder seen_share seen_in_games_share unseen_share unseen_in_games_share";
    let held_out = material.trained.iter().flat_map(|t| &t.held_out.regrets);
    let row = |of: &UnitRegrets| {
        let folder = material.profiles.iter().filter(|p| p.machine() == of.unit).find_map(|p| p.file.split_once('/'));
        let words = [of.strategy, &of.unit, folder.map_or("", |(folder, _)| folder)].map(str::to_owned);
        let regrets = [Some(of.seen), of.unseen].into_iter().flat_map(|r| [r.map(|r| r.all), r.map(|r| r.in_games)]);
        words.into_iter().chain(regrets.map(|r| r.map_or(String::new(), |r| r.to_string()))).collect()
    };
    table(columns, held_out.map(row))
}

/// Every hardware parameter of every report.
pub(super) fn parameters(material: &Material) -> Result<String> {
    let mut rows = Vec::new();
    for (file, report) in &material.reports {
        let host = crate::data::host(&report.hardware);
        let gpus = report.hardware.gpus.iter().map(|g| (Backend::Gpu(vec![g.gpu.index]).to_string(), &g.parameters));
        for (of, parameters) in [("machine".to_owned(), &report.hardware.parameters)].into_iter().chain(gpus) {
            for p in parameters {
                let value = p.value.map_or(String::new(), |v| v.to_string());
                let words = [file.clone(), host.clone(), of.clone(), p.name.to_string(), value];
                rows.push([&words[..], &[p.how.to_string(), p.source.clone()]].concat());
            }
        }
    }
    table("report host processor parameter value how source", rows.into_iter())
}
