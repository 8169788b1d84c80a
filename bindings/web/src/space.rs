//! Bodies with handles.

use crate::arrays::{Numbers, bits, handles, object, own_boxes, three};
use crate::broad_phase::decision;
use crate::fault::{call, error};
use crate::memberships::Memberships;
use crate::tuning::adaptive;
use js_sys::{BigUint64Array, Float32Array};
use sapwise::{Body, Error, Handle, Ray, Space};
use std::cell::RefCell;
use wasm_bindgen::prelude::*;

/// Bodies with handles, the pairs of those that overlap, and queries.
///
/// Set the bodies that moved, then `update`. Bodies that are not set cost nothing. Every call takes effect at the next
/// `update`. A call that throws changes nothing. The same calls give the same arrays on every machine.
#[wasm_bindgen(js_name = Space)]
pub struct WebSpace(RefCell<Space>);

/// Returns the error with handles as JavaScript sees them.
fn failure(failed: Error) -> JsError {
    let text = match failed {
        Error::StaleHandle { handle } => {
            let bits = handle.to_bits();
            format!("handle {bits}n names no body of this space; it was removed, or is of another space")
        }
        Error::InvalidBody { handle, defect } => {
            format!("the box for handle {}n {defect}; the body keeps its previous box", handle.to_bits())
        }
        other => return other.into(),
    };
    JsError::new(&text)
}

fn list(pairs: &[(Handle, Handle)]) -> BigUint64Array {
    bits(pairs.iter().flat_map(|&(a, b)| [a, b]))
}

fn hits(found: &[(Handle, f32)]) -> JsValue {
    let distances: Vec<f32> = found.iter().map(|hit| hit.1).collect();
    let handles = bits(found.iter().map(|hit| hit.0));
    object([("handles", handles.into()), ("distances", Float32Array::from(&distances[..]).into())])
}

#[wasm_bindgen(js_class = Space)]
impl WebSpace {
    /// Makes an empty space.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Result<Self, JsError> {
        call(|| Ok(Self(RefCell::new(Space::with(adaptive()?)))))
    }

    /// Inserts a body for each box, and returns their handles. `body` says what they may meet; with arrays, one value
    /// for each box. Boxes are as in `findPairs`.
    pub fn insert(&self, boxes: &Float32Array, body: Option<Memberships>) -> Result<BigUint64Array, JsError> {
        call(|| {
            let (boxes, space) = (own_boxes(boxes)?, &mut *self.0.borrow_mut());
            let of = body.map_or(Ok(None), |body| body.read("body", &[], boxes.len()))?;
            let handles = space.insert_all(&boxes, Body::default()).map_err(failure)?;
            for (&handle, of) in handles.iter().zip(of.into_iter().flatten()) {
                space.set_body(handle, of.into()).map_err(failure)?;
            }
            Ok(bits(handles))
        })
    }

    /// Sets the box of each of these bodies.
    pub fn set(&self, handles: &BigUint64Array, boxes: &Float32Array) -> Result<(), JsError> {
        call(|| {
            let (handles, boxes) = (self::handles(handles)?, own_boxes(boxes)?);
            if handles.len() != boxes.len() {
                return error(format!("{} handles and {} boxes; give one box for each", handles.len(), boxes.len()));
            }
            self.0.borrow_mut().set_all(&handles, &boxes).map_err(failure)
        })
    }

    /// Removes these bodies. Their pairs end at the next update.
    pub fn remove(&self, handles: &BigUint64Array) -> Result<(), JsError> {
        call(|| self.0.borrow_mut().remove_all(&self::handles(handles)?).map_err(failure))
    }

    /// Finds all pairs, and which began and ended since the previous update.
    pub fn update(&self) -> Result<(), JsError> {
        call(|| self.0.borrow_mut().update().map_err(failure))
    }

    /// Returns the number of bodies.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.0.borrow().len()
    }

    /// Returns the pairs of bodies that overlap and may meet: two handles for each, the lower one first. Each pair
    /// once. Their order depends on the calls alone.
    pub fn pairs(&self) -> Result<BigUint64Array, JsError> {
        call(|| Ok(list(self.0.borrow().pairs())))
    }

    /// Returns the pairs that the previous update did not have, ascending.
    pub fn begun(&self) -> Result<BigUint64Array, JsError> {
        call(|| Ok(list(self.0.borrow().begun())))
    }

    /// Returns the pairs that only the previous update had, ascending. Those of removed bodies are among them.
    pub fn ended(&self) -> Result<BigUint64Array, JsError> {
        call(|| Ok(list(self.0.borrow().ended())))
    }

    /// Returns the bodies whose boxes overlap a box of six numbers, ascending. Queries see the boxes of the last
    /// update.
    #[wasm_bindgen(js_name = queryBox)]
    pub fn query_box(&self, #[wasm_bindgen(js_name = "box")] bounds: &Float32Array) -> Result<BigUint64Array, JsError> {
        call(|| {
            let boxes = own_boxes(bounds)?;
            let [bounds] = boxes[..] else { return error(format!("{} boxes; give one", boxes.len())) };
            self.found(|space, found| space.all().query_box(&bounds, found))
        })
    }

    /// Returns the bodies whose boxes contain a point, ascending.
    #[wasm_bindgen(js_name = queryPoint)]
    pub fn query_point(&self, point: &Numbers) -> Result<BigUint64Array, JsError> {
        call(|| {
            let point = three(point, "point")?;
            self.found(|space, found| space.all().query_point(point, found))
        })
    }

    /// Returns the bodies whose boxes a ray meets, the first one first. `max` is the most lengths of the direction, by
    /// default without end.
    #[wasm_bindgen(js_name = castRay, unchecked_return_type = "Hits")]
    pub fn cast_ray(&self, origin: &Numbers, direction: &Numbers, max: Option<f32>) -> Result<JsValue, JsError> {
        call(|| {
            let ray = Ray::new(three(origin, "origin")?, three(direction, "direction")?);
            let ray = Ray { max: max.unwrap_or(f32::INFINITY), ..ray };
            let mut found = Vec::new();
            self.0.borrow().all().cast_ray(&ray, |handle, t| {
                found.push((handle, t));
                f32::INFINITY
            })?;
            found.sort_unstable_by(|(a, one), (b, other)| one.total_cmp(other).then(a.cmp(b)));
            Ok(hits(&found))
        })
    }

    /// Returns the `count` bodies whose boxes are nearest to a point.
    #[wasm_bindgen(unchecked_return_type = "Hits")]
    pub fn nearest(&self, point: &Numbers, count: usize) -> Result<JsValue, JsError> {
        call(|| Ok(hits(&self.0.borrow().all().nearest(three(point, "point")?, count)?)))
    }

    /// Returns which algorithm searched in the last update, and why; undefined before the first.
    #[wasm_bindgen(unchecked_return_type = "Decision | undefined")]
    pub fn decision(&self) -> JsValue {
        decision(self.0.borrow().search(), None)
    }

    /// Returns what a query finds, ascending.
    fn found(
        &self,
        query: impl FnOnce(&Space, &mut dyn FnMut(Handle)) -> Result<(), Error>,
    ) -> Result<BigUint64Array, JsError> {
        let mut found = Vec::new();
        query(&self.0.borrow(), &mut |handle| found.push(handle))?;
        found.sort_unstable();
        Ok(bits(found))
    }
}
