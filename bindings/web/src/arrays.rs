//! Arrays of JavaScript.

use crate::fault::error;
use js_sys::{Array, ArrayBuffer, BigUint64Array, Float32Array, Function, Object, Reflect, Symbol, Uint32Array};
use sapwise::{Aabb, Error, Handle};
use std::mem::offset_of;
use wasm_bindgen::prelude::*;

// An `Aabb` is six floats, minimum then maximum, and nothing else. The compiler orders the members of a tuple.
const _: () = assert!(size_of::<Aabb>() == 24 && align_of::<Aabb>() == 4 && offset_of!(Aabb, max) == 12);
const _: () = assert!(size_of::<(u32, u32)>() == 8 && offset_of!((u32, u32), 1) == 4);

#[wasm_bindgen]
extern "C" {
    /// A point or a vector.
    #[wasm_bindgen(typescript_type = "ArrayLike<number>")]
    pub type Numbers;
}

/// Checks the class of an array by its tag, which arrays of another window or realm have too. JavaScript may pass
/// anything, whatever the types of parameters say.
fn typed<T: JsCast>(value: &JsValue, class: &str, what: &str) -> Result<T, JsError> {
    let tag = if value.is_object() { Reflect::get(value, &Symbol::to_string_tag()) } else { Ok(JsValue::UNDEFINED) };
    if tag.is_ok_and(|tag| tag.as_string().as_deref() == Some(class)) {
        return Ok(value.clone().unchecked_into());
    }
    error(format!("{what} must be a {class}"))
}

/// Copies boxes. An array in the memory of this module is none that JavaScript may copy while that grows.
pub(crate) fn boxes(array: &Float32Array, to: &mut Vec<Aabb>) -> Result<(), JsError> {
    let array: Float32Array = typed(array, "Float32Array", "boxes")?;
    let (buffer, floats) = (array.buffer(), array.length() as usize);
    if floats == 0 && is_detached(&buffer) {
        return error("boxes is an array of this module from before its memory grew; call boxes() of the scene again");
    }
    if !floats.is_multiple_of(6) {
        return error(format!("boxes has {floats} numbers; give six for each box: its minimum x, y, z, its maximum"));
    }
    let own =
        Reflect::get(&wasm_bindgen::memory(), &"buffer".into()).is_ok_and(|memory| memory == JsValue::from(&buffer));
    // Memory that grows detaches its old views, whose place is 0 then.
    let (at, elements) = (array.byte_offset() as usize, floats / 6);
    to.clear();
    to.try_reserve(elements).map_err(|_| Error::OutOfMemory { what: "boxes", elements })?;
    if own {
        // SAFETY: a view of the memory of this module lies within it, and memory never shrinks. Every bit pattern is a
        // float, and `Float32Array` aligns them.
        to.extend_from_slice(unsafe { std::slice::from_raw_parts(at as *const Aabb, elements) });
    } else {
        to.resize(elements, Aabb::default());
        // SAFETY: an `Aabb` is six floats.
        array.copy_to(unsafe { std::slice::from_raw_parts_mut(to.as_mut_ptr().cast(), floats) });
    }
    Ok(())
}

/// Returns whether the memory of an array is gone: then nobody can make another array of it.
fn is_detached(buffer: &ArrayBuffer) -> bool {
    let class = Reflect::get(&js_sys::global(), &"Uint8Array".into()).map(JsCast::unchecked_into::<Function>);
    class.is_ok_and(|class| Reflect::construct(&class, &Array::of1(buffer)).is_err())
}

/// Copies boxes to a vector of their own.
pub(crate) fn own_boxes(array: &Float32Array) -> Result<Vec<Aabb>, JsError> {
    let mut own = Vec::new();
    boxes(array, &mut own).map(|()| own)
}

/// Reads three numbers of an array of any kind.
pub(crate) fn three(value: &Numbers, what: &str) -> Result<[f32; 3], JsError> {
    let mut numbers = [0.0; 3];
    for (k, number) in numbers.iter_mut().enumerate() {
        let found = if value.is_object() { Reflect::get_u32(value, k as u32).ok() } else { None };
        match found.and_then(|found| found.as_f64()) {
            Some(found) => *number = found as f32,
            None => return error(format!("{what} must be three numbers")),
        }
    }
    Ok(numbers)
}

/// Copies numbers of a `Uint32Array`, or repeats one number.
pub(crate) fn column(value: &JsValue, count: usize, what: &str) -> Result<Vec<u32>, JsError> {
    if let Some(number) = value.as_f64().or(value.as_bool().map(f64::from)) {
        return Ok(vec![whole(number, what)?; count]);
    }
    let array: Uint32Array = typed(value, "Uint32Array", what)?;
    checked(array.length(), count, what).map(|()| array.to_vec())
}

/// Copies flags of a `Uint8Array`, or repeats one.
pub(crate) fn flags(value: &JsValue, count: usize, what: &str) -> Result<Vec<bool>, JsError> {
    if let Some(flag) = value.as_bool() {
        return Ok(vec![flag; count]);
    }
    let array: js_sys::Uint8Array = typed(value, "Uint8Array", what)?;
    checked(array.length(), count, what).map(|()| array.to_vec().into_iter().map(|flag| flag != 0).collect())
}

fn checked(length: u32, count: usize, what: &str) -> Result<(), JsError> {
    if length as usize == count {
        return Ok(());
    }
    error(format!("{what} has {length} entries for {count} boxes; give one for each box"))
}

/// Converts a number without a fraction.
pub(crate) fn whole(number: f64, what: &str) -> Result<u32, JsError> {
    if number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number) {
        return Ok(number as u32);
    }
    error(format!("{what} is {number}; give a whole number from 0 to {}", u32::MAX))
}

/// Copies handles.
pub(crate) fn handles(array: &BigUint64Array) -> Result<Vec<Handle>, JsError> {
    let array: BigUint64Array = typed(array, "BigUint64Array", "handles")?;
    let handle = |bits| Handle::from_bits(bits).map_or_else(|| error("0 is no handle; use those of insert"), Ok);
    array.to_vec().into_iter().map(handle).collect()
}

/// Returns pairs as JavaScript sees them: two numbers for each.
pub(crate) fn pairs(pairs: &[(u32, u32)]) -> Uint32Array {
    // SAFETY: a pair is two integers.
    Uint32Array::from(unsafe { std::slice::from_raw_parts(pairs.as_ptr().cast::<u32>(), 2 * pairs.len()) })
}

/// Returns handles as JavaScript sees them.
pub(crate) fn bits(handles: impl IntoIterator<Item = Handle>) -> BigUint64Array {
    let bits: Vec<u64> = handles.into_iter().map(Handle::to_bits).collect();
    BigUint64Array::from(&bits[..])
}

/// Returns a view of boxes in the memory of this module, valid until that grows or the boxes change their place.
pub(crate) fn view(boxes: &[Aabb]) -> Float32Array {
    // SAFETY: an `Aabb` is six floats. A view that is no longer valid shows other numbers, which JavaScript may read.
    unsafe { Float32Array::view(std::slice::from_raw_parts(boxes.as_ptr().cast(), 6 * boxes.len())) }
}

/// Makes an object of these members.
pub(crate) fn object<const N: usize>(members: [(&str, JsValue); N]) -> JsValue {
    let object = Object::new();
    for (name, value) in members {
        // A new object takes any member.
        let _ = Reflect::set(&object, &name.into(), &value);
    }
    object.into()
}
