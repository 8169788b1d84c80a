//! What ours know of this machine.

use crate::settings::Settings;
use sapwise::tuning::Source;
use sapwise::{Registry, Tuning};
use sapwise_tune::Model;
use sapwise_tune::measure::{self, Options};

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
