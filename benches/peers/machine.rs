//! What ours know of this machine, and what the document says of it.

use crate::settings::Settings;
use sapwise::tuning::Source;
use sapwise::{Registry, Tuning};
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::measure::{self, Options};
use sapwise_tune::{Hardware, Model};
use std::process::Command;

/// The tuning for a number of threads that the built-in model predicts from hardware parameters, which are measured
/// now; written down by hand where nothing is timed.
///
/// # Errors
/// When nothing can be predicted.
pub(crate) fn tuning(registry: &Registry, threads: u32, settings: &Settings) -> Result<Tuning, String> {
    if !settings.full {
        return Ok(Tuning::usual(registry));
    }
    let hardware = measure::hardware(&Options::default().with_threads(Some(threads)));
    let model = Model::built_in().map_err(|e| e.to_string())?;
    let prediction = model.predict(&hardware, &registry.available()).map_err(|e| e.to_string())?;
    // Where there are costs, they decide; the slice through loads is for people.
    Ok(Tuning::from_costs(Source::Predicted, "uniform", prediction.costs, &[]))
}

/// The machine and the build in one line of Markdown.
pub(crate) fn describe() -> String {
    let machine = measure::machine();
    let topology = measure::family(measure::Family::Topology, &Options::default());
    let hardware = Hardware::new(machine, topology);
    let m = &hardware.machine;
    let cores = hardware.value(ParameterId::UsableCores).unwrap_or(f64::NAN);
    let compiler = Command::new("rustc").arg("--version").output().ok();
    let compiler =
        compiler.and_then(|o| String::from_utf8(o.stdout).ok()).unwrap_or_else(|| "rustc unknown".to_owned());
    format!(
        "{}, {cores} usable cores, {} {}, hypervisor {}, SIMD level {}; {}; {}.",
        m.cpu,
        m.os,
        m.arch,
        m.hypervisor,
        m.simd,
        compiler.trim(),
        crate::date::today()
    )
}
