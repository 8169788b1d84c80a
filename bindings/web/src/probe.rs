//! Measures the machine of whoever opens the page, and makes a report of it.

mod parameters;
mod sweep;

use crate::arrays::object;
use crate::clock::{milliseconds, tick_ms};
use crate::fault::{call, error};
use crate::gpu::{WebGpu, entries};
use crate::tuning::predicted;
use js_sys::{Array, Date, Promise, Reflect};
use parameters::Parameters;
use sapwise::Registry;
use sapwise::algorithm::{Entry, Load, SimdLevel};
use sapwise::internals::splitmix::mix;
use sapwise_gpu::AsyncBroadPhase;
use sapwise_tune::hardware::{GpuHardware, GpuIdentity, GpuParameterId, Statistic};
use sapwise_tune::json::{self, Format};
use sapwise_tune::{Hardware, Machine, Parameter};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::rc::Rc;
use sweep::Sweep;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::future_to_promise;

const UNDER_WAY: &str = "a step is under way: await it";

/// Whether this module is built with the vectors of WebAssembly.
const SIMD: bool = cfg!(target_feature = "simd128");

const SEED: u64 = 1;

/// A sample takes at least this many ticks of the clock, so that rounding changes it by 5 %, and this many
/// milliseconds.
const TICKS: f64 = 20.0;
const LEAST_MS: f64 = 1.0;

/// A step of the caller lasts about this long, so that a page stays alive.
const STEP_MS: f64 = 30.0;

/// Measures this machine as a page can, within a minute: clock, latency and bandwidth of memory, then every algorithm
/// over three scenarios. Await `step` until `done` equals `of`. `report` returns what was measured until then. Works
/// in a worker, too.
#[wasm_bindgen]
pub struct Probe(Rc<RefCell<Option<State>>>);

struct State {
    began_ms: f64,
    tick_ms: f64,
    measured: usize,
    parameters: Parameters,
    sweep: Sweep,
    text: String,
    gpu: Option<GpuHardware>,
}

impl State {
    const OF: usize = Parameters::STEPS + Sweep::POINTS;

    fn done(&self) -> usize {
        self.measured + self.sweep.done
    }

    fn hardware(&self) -> Hardware {
        self.parameters.hardware(machine()).with_gpus(self.gpu.iter().cloned().collect())
    }

    /// Measures for some milliseconds.
    async fn step(&mut self) -> JsValue {
        let started = milliseconds();
        while self.done() < Self::OF && milliseconds() - started < STEP_MS {
            if self.measured < Parameters::STEPS {
                self.text = self.parameters.step(self.measured).to_owned();
                self.measured += 1;
            } else {
                self.text = self.sweep.step().await;
            }
        }
        let text = if self.done() < Self::OF { format!("{}.", self.text) } else { "Done.".to_owned() };
        object([("done", self.done().into()), ("of", Self::OF.into()), ("text", text.into())])
    }

    fn report(&self) -> Result<String, JsError> {
        let isolated = Reflect::get(&js_sys::global(), &"crossOriginIsolated".into());
        let isolated = isolated.is_ok_and(|isolated| isolated.is_truthy());
        let mut remarks = vec![format!(
            "the clock of the browser ticks every {:.4} ms, and the page is {}cross-origin isolated; a sample is \
             the mean of the frames of at least {} ms",
            self.tick_ms,
            if isolated { "" } else { "not " },
            self.parameters.least_ms
        )];
        remarks.extend(self.sweep.remarks.iter().cloned());
        if self.done() < Self::OF {
            remarks.push(format!("unfinished: {} of {} parts are done", self.done(), Self::OF));
        }
        let algorithm = |entry: Entry| json!({"id": entry.id, "revision": entry.revision});
        let algorithms = Registry::new().available().into_iter();
        let on_gpu = self.gpu.iter().flat_map(|_| entries());
        let algorithms: Vec<_> = algorithms.chain(on_gpu).map(algorithm).collect();
        let date: String = Date::new_0().to_iso_string().into();
        let seconds = ((milliseconds() - self.began_ms) / 100.0).ceil() / 10.0;
        let report = json!({
            "label": "real_browser",
            "provenance": {
                "version": env!("CARGO_PKG_VERSION"), "date": date[..10], "command": "probe in a browser",
                "seed": SEED, "threads": 1, "simd": null, "optimised": !cfg!(debug_assertions), "seconds": seconds,
            },
            "hardware": self.hardware(),
            "algorithms": algorithms,
            "points": self.sweep.points.iter().map(|point| &point.1).collect::<Vec<_>>(),
            "remarks": remarks,
        });
        Ok(Format::new("report", 3).write(&report)?)
    }

    fn prediction(&self) -> Result<String, JsError> {
        if self.sweep.points.is_empty() {
            return Ok("[]".to_owned());
        }
        let tuning = predicted(&self.hardware())?;
        let of_point = |(load, point): &(Load, Value)| {
            let scenario = point["scenario"].clone();
            let row = |cost: &sapwise::tuning::AlgorithmCost| {
                let (id, ns) = (&cost.algorithm, cost.curve.cost_ns(load));
                json!({"scenario": scenario, "objects": load.objects, "algorithm": id, "ns": ns})
            };
            tuning.costs.iter().map(row).collect::<Vec<_>>()
        };
        Ok(json!(self.sweep.points.iter().flat_map(of_point).collect::<Vec<_>>()).to_string())
    }
}

/// Reads a text of an object of the global scope.
pub(crate) fn told(object: &str, name: &str) -> Option<JsValue> {
    let object = Reflect::get(&js_sys::global(), &object.into()).ok().filter(JsValue::is_object)?;
    Reflect::get(&object, &name.into()).ok()
}

/// Returns the parameters of a GPU from an object of samples.
fn of_gpu(samples: &JsValue) -> Vec<Parameter> {
    let how = "through WebGPU from a worker, with the way from the worker to the GPU and back";
    let parameter = |id: GpuParameterId| {
        let raw = Reflect::get(samples, &id.as_str().into()).ok().filter(Array::is_array)?;
        let raw = Array::from(&raw).iter().filter_map(|sample| sample.as_f64()).collect();
        Some(Parameter::from_samples(id, Statistic::Median, raw, how))
    };
    let missing = |id| Parameter::missing(id, "WebGPU does not report it");
    GpuParameterId::OF_ONE.into_iter().map(|id| parameter(id).unwrap_or_else(|| missing(id))).collect()
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
            let text = String::new();
            let state = State { began_ms, tick_ms, measured: 0, parameters, sweep, text, gpu: None };
            Ok(Self(Rc::new(RefCell::new(Some(state)))))
        })
    }

    /// Adds WebGPU before the first step: `parameters` maps names of `sapwise schema` to samples, and `name` is the
    /// GPU's. Rejects if the GPU refuses an algorithm; the probe can go on without it.
    #[wasm_bindgen(js_name = addGpu)]
    pub async fn add_gpu(&self, gpu: &WebGpu, name: String, parameters: JsValue) -> Result<(), JsError> {
        let mut identity = GpuIdentity::new(0, name, gpu.0.identity().kind);
        "webgpu".clone_into(&mut identity.api);
        let mut added = Vec::new();
        for entry in entries() {
            added.push(AsyncBroadPhase::new(&gpu.0, entry.id.method()).await?);
        }
        self.with(|state| {
            state.gpu = Some(GpuHardware::new(identity, of_gpu(&parameters)));
            added.into_iter().for_each(|algorithm| state.sweep.add(algorithm));
            Ok(())
        })
    }

    /// Measures for some milliseconds, in a slow browser tenths of a second.
    #[wasm_bindgen(unchecked_return_type = "Promise<Progress>")]
    pub fn step(&self) -> Result<Promise, JsError> {
        call(|| {
            let home = Rc::clone(&self.0);
            let Some(mut state) = home.take() else { return error(UNDER_WAY) };
            Ok(future_to_promise(async move {
                let progress = state.step().await;
                home.replace(Some(state));
                Ok(progress)
            }))
        })
    }

    fn with<T>(&self, run: impl FnOnce(&mut State) -> Result<T, JsError>) -> Result<T, JsError> {
        call(|| self.0.borrow_mut().as_mut().map_or_else(|| error(UNDER_WAY), run))
    }

    /// Returns the report: the text of a file that `sapwise check` checks and `sapwise study` shows. It names no
    /// person and no machine.
    pub fn report(&self) -> Result<String, JsError> {
        self.with(|state| state.report())
    }

    /// Returns what the built-in model predicts for this machine at each point of the report, as JSON: a list of
    /// objects with `scenario`, `objects`, `algorithm` and `ns`.
    pub fn prediction(&self) -> Result<String, JsError> {
        self.with(|state| state.prediction())
    }

    /// Returns the tuning that the built-in model predicts for this machine, for `useTuning`.
    pub fn tuning(&self) -> Result<String, JsError> {
        self.with(|state| Ok(json::write_tuning(&predicted(&state.hardware())?)?))
    }
}
