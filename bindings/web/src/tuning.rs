//! What each algorithm costs, by the built-in model.

use sapwise::algorithm::Load;
use sapwise::{Adaptive, Registry, Tuning};
use sapwise_tune::{Hardware, Machine, Model, Parameter, ParameterId, json};
use std::cell::RefCell;
use wasm_bindgen::prelude::*;

thread_local! {
    /// By which new searches choose; `None` until the first.
    static TUNING: RefCell<Option<Tuning>> = const { RefCell::new(None) };
}

/// Typical hardware for one thread of a browser. Only the ratios of costs matter for a choice.
const TYPICAL: [(ParameterId, f64); 5] = [
    (ParameterId::UsableCores, 1.0),
    (ParameterId::ClockMeasuredGhz, 3.0),
    (ParameterId::SimdLanes, 4.0),
    (ParameterId::CacheLlcBytes, 16_777_216.0),
    (ParameterId::BandwidthOneThreadGbPerS, 10.0),
];

/// Predicts what the algorithms cost on a machine.
pub(crate) fn predicted(hardware: &Hardware) -> Result<Tuning, JsError> {
    let loads: Vec<Load> = (2..=20).map(|k| Load::of_objects(1 << k).with_pairs(f64::from(1 << k) / 2.0)).collect();
    Ok(Model::built_in()?.predict(hardware, &Registry::new().available())?.tuning("uniform", &loads))
}

/// Makes a search that chooses by the tuning in use.
pub(crate) fn adaptive() -> Result<Adaptive, JsError> {
    let known = TUNING.with_borrow(Clone::clone);
    let tuning = match known {
        Some(tuning) => tuning,
        None => {
            let typical = TYPICAL.map(|(id, value)| Parameter::reported(id, value, "typical"));
            predicted(&Hardware::new(Machine::of("typical"), typical.into()))?
        }
    };
    TUNING.set(Some(tuning.clone()));
    Ok(Adaptive::new(tuning, &Registry::new())?)
}

/// Makes every `BroadPhase` and `Space` that is made from now on choose by this tuning: the text of a file of
/// `sapwise predict`, or of `Probe.tuning()`. By default they choose by the built-in model for typical hardware. Both
/// learn from the times of frames.
#[wasm_bindgen(js_name = useTuning)]
pub fn use_tuning(json: &str) -> Result<(), JsError> {
    crate::fault::call(|| {
        let tuning = json::tuning(json)?;
        // Refuses a tuning without an algorithm that can run here.
        Adaptive::new(tuning.clone(), &Registry::new())?;
        TUNING.set(Some(tuning));
        Ok(())
    })
}
