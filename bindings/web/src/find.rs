//! Pairs of one array of boxes.

use crate::arrays::{own_boxes, pairs, whole};
use crate::fault::{call, error};
use crate::memberships::{Memberships, member};
use js_sys::{Float32Array, Uint32Array};
use sapwise::{Aabb, AlgorithmId, Error, Filter, PairOrder, Pairs, Registry};
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Options of [`find_pairs`].
    #[wasm_bindgen(extends = Memberships, typescript_type = "FindOptions")]
    pub type FindOptions;
}

/// Fewest boxes for which `grid-sap` replaces `brute`, as in the Python package.
const GRID_FROM: usize = 300;

/// Returns all algorithms, as "bvh@cpu1": the method and the processor, here one thread of the CPU.
#[wasm_bindgen]
pub fn algorithms() -> Vec<String> {
    Registry::new().available().iter().map(|entry| entry.id.to_string()).collect()
}

/// Returns the algorithm of a name, with or without the processor.
pub(crate) fn named(name: &str) -> Result<AlgorithmId, JsError> {
    let (known, text) = (algorithms(), format!("{}@cpu1", name.trim_end_matches("@cpu1")));
    if known.contains(&text) {
        return Ok(text.parse()?);
    }
    let hint = format!("use {}", known.join(", "));
    Err(Error::UnknownAlgorithm { text: name.to_owned(), hint }.into())
}

/// Finds all pairs of overlapping boxes. Boxes that touch overlap.
///
/// `boxes` holds six numbers for each box: its minimum x, y, z, then its maximum x, y, z. The answer holds two numbers
/// for each pair: the positions of both boxes, the lower one first. Pairs ascend: the answer is the same from every
/// algorithm and on every machine.
///
/// Each call stands for itself. For frames that follow each other use `BroadPhase` or `Space`, which are faster there.
///
/// Throws if a bound is NaN, if a minimum lies above its maximum, and if an option can't be used.
#[wasm_bindgen(js_name = findPairs)]
pub fn find_pairs(boxes: &Float32Array, options: Option<FindOptions>) -> Result<Uint32Array, JsError> {
    call(|| {
        let mut boxes = own_boxes(boxes)?;
        let mut found = Pairs::with_order(PairOrder::Canonical);
        let mut name = if boxes.len() < GRID_FROM { "brute".to_owned() } else { "grid-sap".to_owned() };
        if let Some(options) = options {
            let members = options.read("options", &["algorithm", "limit", "margin"], boxes.len())?;
            found.set_filter(members.map(Filter::new));
            let [limit, margin] = ["limit", "margin"].map(|name| member(&options, name));
            if let Some(limit) = limit {
                found.set_limit(Some(whole(limit.as_f64().unwrap_or(f64::NAN), "limit")? as usize));
            }
            if let Some(margin) = margin {
                grow(&mut boxes, margin.as_f64().unwrap_or(f64::NAN))?;
            }
            if let Some(algorithm) = member(&options, "algorithm") {
                name = algorithm.as_string().map_or_else(|| error("algorithm must be a text"), Ok)?;
            }
        }
        Registry::new().create(&named(&name)?)?.find_pairs(&boxes, &mut found)?;
        Ok(pairs(found.as_slice()))
    })
}

/// Grows boxes by a margin at their upper ends: those of a pair are then no further apart than that.
fn grow(boxes: &mut [Aabb], margin: f64) -> Result<(), JsError> {
    if !(margin >= 0.0 && margin.is_finite()) {
        return error(format!("margin is {margin}; give 0 or more and finite"));
    }
    // Growing would hide what is inverted.
    Aabb::check(boxes, 0)?;
    for aabb in boxes {
        // The sums are rounded down, and so to the highest 32-bit minimum that is not beyond them.
        let sums = aabb.max.map(|high| f64::from(high) + margin);
        aabb.max = Aabb::from_f64(sums, sums).min;
    }
    Ok(())
}
