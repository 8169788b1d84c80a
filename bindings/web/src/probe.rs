//! Measures the machine of whoever opens the page, and makes a report of it.

mod parameters;
mod sweep;

use crate::arrays::object;
use crate::clock::{milliseconds, tick_ms};
use crate::fault::call;
use crate::tuning::predicted;
use js_sys::{Date, Reflect};
use parameters::Parameters;
use sapwise::Registry;
use sapwise::algorithm::{Entry, Load, SimdLevel};
use sapwise::internals::splitmix::mix;
use sapwise_tune::json::{self, Format};
use sapwise_tune::{Hardware, Machine};
use serde_json::{Value, json};
use std::cell::RefCell;
use sweep::Sweep;
use wasm_bindgen::prelude::*;

/// Whether this module is built with the vectors of WebAssembly.
const SIMD: bool = cfg!(target_feature = "simd128");

const SEED: u64 = 1;

/// A sample takes at least this many ticks of the clock, so that rounding changes it by 5 %, and this many
/// milliseconds.
const TICKS: f64 = 20.0;
const LEAST_MS: f64 = 1.0;

/// A step of the caller lasts about this long, so that a page stays alive.
const STEP_MS: f64 = 30.0;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r"
/** How far a probe is. */
export interface Progress {
  /** Parts that are done, and all of them. */
  done: number;
  of: number;
  /** What was done last, in words. */
  text: string;
}
";

/// Measures this machine as a page can, within a minute: clock, latency and bandwidth of memory, then every algorithm
/// over three scenarios. Call `step` until `done` equals `of`. `report` returns what was measured until then. Works
/// in a worker, too.
#[wasm_bindgen]
pub struct Probe(RefCell<State>);

struct State {
    began_ms: f64,
    tick_ms: f64,
    measured: usize,
    parameters: Parameters,
    sweep: Sweep,
    text: String,
}

impl State {
    const OF: usize = Parameters::STEPS + Sweep::POINTS;

    fn done(&self) -> usize {
        self.measured + self.sweep.done
    }

    fn hardware(&self) -> Hardware {
        self.parameters.hardware(machine())
    }
}

/// Reads a text of an object of the global scope.
fn told(object: &str, name: &str) -> Option<JsValue> {
    let object = Reflect::get(&js_sys::global(), &object.into()).ok().filter(JsValue::is_object)?;
    Reflect::get(&object, &name.into()).ok()
}

/// Returns the machine as far as a browser tells: its name and version, system and processors, as every page sees them.
fn machine() -> Machine {
    let agent = told("navigator", "userAgent").and_then(|agent| agent.as_string()).unwrap_or_default();
    let version = |name: &str| {
        let digits = agent.split_once(name)?.1;
        Some(format!("{} {}", name.trim_end_matches('/'), digits.split(['.', ' ']).next()?))
    };
    let browsers = ["Firefox/", "Edg/", "Chrome/", "Version/", "Node.js/"];
    let browser = browsers.into_iter().find_map(version).unwrap_or_else(|| "an unknown browser".to_owned());
    let systems = ["Android", "iPhone", "iPad", "Windows", "Mac OS", "Linux"];
    let os = systems.into_iter().find(|name| agent.contains(name)).unwrap_or("unknown").to_ascii_lowercase();
    let processors = told("navigator", "hardwareConcurrency").and_then(|count| count.as_f64()).unwrap_or(0.0);
    // Machines that a page can't tell apart count as one, which validation holds out together.
    let hash = format!("{os} {processors}").bytes().fold(mix(0x6272_6f77), |hash, byte| mix(hash ^ u64::from(byte)));
    let mut machine = Machine::of(format!("{hash:016x}"));
    machine.cpu = format!("unknown, with {processors} processors, in {browser}");
    machine.vendor = "unknown".to_owned();
    machine.arch = std::env::consts::ARCH.to_owned();
    machine.os = os;
    machine.simd = if SIMD { SimdLevel::Portable.to_string() } else { "none".to_owned() };
    machine.hypervisor = "unknown".to_owned();
    machine
}

#[wasm_bindgen]
impl Probe {
    /// Begins.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Result<Self, JsError> {
        call(|| {
            let tick_ms = tick_ms();
            let least_ms = (LEAST_MS.max(TICKS * tick_ms) * 10.0).ceil() / 10.0;
            let (parameters, sweep) = (Parameters::new(least_ms), Sweep::new(least_ms, SEED));
            let began_ms = milliseconds();
            Ok(Self(RefCell::new(State { began_ms, tick_ms, measured: 0, parameters, sweep, text: String::new() })))
        })
    }

    /// Measures for some milliseconds, in a slow browser tenths of a second.
    #[wasm_bindgen(unchecked_return_type = "Progress")]
    pub fn step(&self) -> Result<JsValue, JsError> {
        call(|| {
            let state = &mut *self.0.borrow_mut();
            let started = milliseconds();
            while state.done() < State::OF && milliseconds() - started < STEP_MS {
                if state.measured < Parameters::STEPS {
                    state.text = state.parameters.step(state.measured).to_owned();
                    state.measured += 1;
                } else {
                    state.text = state.sweep.step();
                }
            }
            let text = if state.done() < State::OF { format!("{}.", state.text) } else { "Done.".to_owned() };
            Ok(object([("done", state.done().into()), ("of", State::OF.into()), ("text", text.into())]))
        })
    }

    /// Returns the report: the text of a file that `sapwise check` checks and `sapwise study` shows. It names no
    /// person and no machine.
    pub fn report(&self) -> Result<String, JsError> {
        call(|| {
            let state = &*self.0.borrow();
            let isolated = Reflect::get(&js_sys::global(), &"crossOriginIsolated".into());
            let isolated = isolated.is_ok_and(|isolated| isolated.is_truthy());
            let mut remarks = vec![format!(
                "the clock of the browser ticks every {:.4} ms, and the page is {}cross-origin isolated; a sample is \
                 the mean of the frames of at least {} ms",
                state.tick_ms,
                if isolated { "" } else { "not " },
                state.parameters.least_ms
            )];
            remarks.extend(state.sweep.remarks.iter().cloned());
            if state.done() < State::OF {
                remarks.push(format!("unfinished: {} of {} parts are done", state.done(), State::OF));
            }
            let algorithm = |entry: Entry| json!({"id": entry.id, "revision": entry.revision});
            let algorithms: Vec<_> = Registry::new().available().into_iter().map(algorithm).collect();
            let date: String = Date::new_0().to_iso_string().into();
            let seconds = ((milliseconds() - state.began_ms) / 100.0).ceil() / 10.0;
            let report = json!({
                "label": "real_browser",
                "provenance": {
                    "version": env!("CARGO_PKG_VERSION"), "date": date[..10], "command": "probe in a browser",
                    "seed": SEED, "threads": 1, "simd": null, "optimised": !cfg!(debug_assertions), "seconds": seconds,
                },
                "hardware": state.hardware(),
                "algorithms": algorithms,
                "points": state.sweep.points.iter().map(|point| &point.1).collect::<Vec<_>>(),
                "remarks": remarks,
            });
            Ok(Format::new("report", 3).write(&report)?)
        })
    }

    /// Returns what the built-in model predicts for this machine at each point of the report, as JSON: a list of
    /// objects with `scenario`, `objects`, `algorithm` and `ns`.
    pub fn prediction(&self) -> Result<String, JsError> {
        call(|| {
            let state = &*self.0.borrow();
            if state.sweep.points.is_empty() {
                return Ok("[]".to_owned());
            }
            let tuning = predicted(&state.hardware())?;
            let of_point = |(load, point): &(Load, Value)| {
                let scenario = point["scenario"].clone();
                let row = |cost: &sapwise::tuning::AlgorithmCost| {
                    let (id, ns) = (&cost.algorithm, cost.curve.cost_ns(load));
                    json!({"scenario": scenario, "objects": load.objects, "algorithm": id, "ns": ns})
                };
                tuning.costs.iter().map(row).collect::<Vec<_>>()
            };
            Ok(json!(state.sweep.points.iter().flat_map(of_point).collect::<Vec<_>>()).to_string())
        })
    }

    /// Returns the tuning that the built-in model predicts for this machine, for `useTuning`.
    pub fn tuning(&self) -> Result<String, JsError> {
        call(|| Ok(json::write_tuning(&predicted(&self.0.borrow().hardware())?)?))
    }
}
