//! The tuning that our algorithms use on this machine.

use crate::settings::Settings;
use sapwise::tuning::Source;
use sapwise::{Registry, Tuning};
use sapwise_tune::Model;
use sapwise_tune::measure::{self, Options};

/// Measures the hardware and returns the tuning that the built-in model predicts from it for a number of threads. If
/// nothing is timed, returns the usual tuning instead.
///
/// # Errors
/// If nothing can be predicted.
pub(crate) fn tuning(registry: &Registry, threads: u32, settings: &Settings) -> Result<Tuning, String> {
    if !settings.full {
        return Ok(Tuning::usual(registry));
    }
    let hardware = measure::hardware(&Options::default().with_threads(Some(threads)));
    let model = Model::built_in().map_err(|e| e.to_string())?;
    let prediction = model.predict(&hardware, &registry.available()).map_err(|e| e.to_string())?;
    // The costs decide; the slice through loads is only shown to people.
    Ok(Tuning::from_costs(Source::Predicted, "uniform", prediction.costs, &[]))
}
