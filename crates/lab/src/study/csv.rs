//! Tidy tables as CSV: a row for each value, with the report and the host that it is from.

use super::Material;
use anyhow::Result;
use sapwise::algorithm::{Backend, BackendClass};

/// Writes a table with these columns.
pub(super) fn table(columns: &str, mut rows: impl Iterator<Item = Vec<String>>) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.split(' '))?;
    rows.try_for_each(|row| writer.write_record(row))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Every median and mean time of the studied reports.
pub(super) fn timings(material: &Material) -> Result<String> {
    let columns = "report host scenario algorithm method processor threads gpus objects pairs moved moved_share \
                   median_ns mean_ns";
    let mut rows = Vec::new();
    for profile in &material.profiles {
        for spot in &profile.points {
            for (&(k, median_ns), mean_ns) in spot.medians.iter().zip(&spot.means) {
                let id = profile.id(k);
                let on_gpus = id.backend().class() == BackendClass::Gpu;
                let (threads, gpus) = if on_gpus { (0, id.backend().width()) } else { (id.threads(), 0) };
                let words = [&profile.file, profile.machine(), &spot.scenario, &id.to_string(), id.method()];
                let processor = if on_gpus { "gpu" } else { "cpu" };
                let counts = [threads, gpus, spot.load.objects].map(|n| n.to_string());
                let numbers = [spot.load.pairs, spot.load.moved, spot.load.moved_share, median_ns, *mean_ns];
                let words = words.map(str::to_owned).into_iter().chain([processor.to_owned()]);
                rows.push(words.chain(counts).chain(numbers.map(|n| n.to_string())).collect());
            }
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

/// The mean regret of each strategy on each host, or report of the only host, that was held out.
pub(super) fn regrets(material: &Material) -> Result<String> {
    let mut rows = Vec::new();
    for held_out in material.trained.iter().map(|t| &t.held_out) {
        for (strategy, regrets) in &held_out.regrets {
            // A strategy that was judged on fewer units does not say on which.
            let named = regrets.len() == held_out.units.len();
            for (k, regret) in regrets.iter().enumerate() {
                let unit = if named { held_out.units[k].clone() } else { String::new() };
                rows.push(vec![(*strategy).to_owned(), unit, regret.to_string()]);
            }
        }
    }
    table("strategy held_out mean_regret_share", rows.into_iter())
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
