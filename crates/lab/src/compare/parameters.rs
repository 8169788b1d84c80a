//! How far a measured parameter differs from report to report.

use crate::Report;
use sapwise::stats::{quantile, relative_iqr};
use sapwise::{How, Parameter};
use serde::Serialize;

/// A parameter over several reports.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ParameterSpread {
    /// Its name; that of a GPU's begins with `gpu0/`.
    pub name: String,
    /// Median over the reports, in the unit that the name ends with.
    pub median: f64,
    /// Interquartile range over median; `None` below four reports.
    pub dispersion: Option<f64>,
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
}

/// The measured parameters that every report has, in the order of the first.
pub(super) fn spreads(reports: &[&Report]) -> Vec<ParameterSpread> {
    let lists: Vec<Vec<(String, &Parameter)>> = reports.iter().map(|r| parameters(r)).collect();
    let Some(first) = lists.first() else { return Vec::new() };
    let value = |list: &[(String, &Parameter)], name: &str| list.iter().find(|(n, _)| n == name)?.1.value;
    let mut spreads = Vec::new();
    for (name, _) in first.iter().filter(|(_, p)| p.how == How::Measured) {
        let Some(values) = lists.iter().map(|list| value(list, name)).collect::<Option<Vec<f64>>>() else { continue };
        let at = |q: f64| quantile(&values, q).unwrap_or_default();
        let (low, median, high) = (at(0.0), at(0.5), at(1.0));
        spreads.push(ParameterSpread { name: name.clone(), median, dispersion: relative_iqr(&values), low, high });
    }
    spreads
}

fn parameters(report: &Report) -> Vec<(String, &Parameter)> {
    let hardware = &report.hardware;
    let cpu = hardware.parameters.iter().map(|p| (p.name.clone(), p));
    let gpus =
        hardware.gpus.iter().flat_map(|g| g.parameters.iter().map(|p| (format!("gpu{}/{}", g.gpu.index, p.name), p)));
    cpu.chain(gpus).collect()
}
