//! Pairs of frames that follow each other.

use crate::arrays::{boxes, object, pairs};
use crate::fault::call;
use crate::find::named;
use crate::tuning::adaptive;
use js_sys::{Float32Array, Uint32Array};
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Pairs, Reason, Registry};
use std::cell::RefCell;
use wasm_bindgen::prelude::*;

/// Returns the decision of a search as JavaScript sees it; `before` is the algorithm of the frame before.
pub(crate) fn decision(search: &Adaptive, before: Option<&AlgorithmId>) -> JsValue {
    search.last_decision().map_or(JsValue::UNDEFINED, |decision| {
        let ms = |ns: f64| {
            // Two significant digits.
            let digits = (7.0 - ns.max(1.0).log10().floor()).clamp(0.0, 6.0) as usize;
            format!("{:.digits$} ms", ns / 1e6)
        };
        let next = decision.runner_up.map_or(String::new(), |(id, ns)| format!(", {} {}", id.method(), ms(ns)));
        let expected = decision.predicted_ns.map_or(String::new(), |ns| format!(" ({} expected{next})", ms(ns)));
        object([
            ("algorithm", decision.algorithm.to_string().into()),
            ("because", format!("{}{expected}", decision.reason).into()),
            ("switched", before.is_some_and(|before| before != decision.algorithm).into()),
            ("trial", (decision.reason == Reason::Explored).into()),
        ])
    })
}

/// Finds the overlapping pairs of frames that follow each other.
///
/// In each frame it runs the algorithm that it expects to be fastest for these boxes, and learns from the times of
/// frames. Some algorithms keep work from frame to frame.
#[wasm_bindgen(js_name = BroadPhase)]
pub struct WebBroadPhase(RefCell<Frames>);

struct Frames {
    search: Adaptive,
    boxes: Vec<Aabb>,
    pairs: Pairs,
    before: Option<AlgorithmId>,
}

#[wasm_bindgen(js_class = BroadPhase)]
impl WebBroadPhase {
    /// Makes a broad phase. With an algorithm of `algorithms()`, such as "bvh@cpu1", it always runs that one.
    #[wasm_bindgen(constructor)]
    pub fn new(algorithm: Option<String>) -> Result<Self, JsError> {
        call(|| {
            let search = match algorithm {
                Some(name) => Adaptive::only(named(&name)?, &Registry::new())?,
                None => adaptive()?,
            };
            Ok(Self(RefCell::new(Frames { search, boxes: Vec::new(), pairs: Pairs::new(), before: None })))
        })
    }

    /// Finds the pairs of the next frame. Boxes and pairs are as in `findPairs`, but the pairs are in any order.
    pub fn update(&self, boxes: &Float32Array) -> Result<Uint32Array, JsError> {
        call(|| {
            let Frames { search, boxes: copy, pairs: found, before } = &mut *self.0.borrow_mut();
            self::boxes(boxes, copy)?;
            *before = search.last_decision().map(|decision| decision.algorithm.clone());
            search.find_pairs(copy, found)?;
            Ok(pairs(found.as_slice()))
        })
    }

    /// Returns which algorithm ran in the last frame, and why; undefined before the first.
    #[wasm_bindgen(unchecked_return_type = "Decision | undefined")]
    pub fn decision(&self) -> JsValue {
        let Frames { search, before, .. } = &*self.0.borrow();
        decision(search, before.as_ref())
    }
}
