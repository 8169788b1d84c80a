//! What boxes may meet.

use crate::arrays::{column, flags};
use crate::fault::error;
use js_sys::{Object, Reflect};
use sapwise::Membership;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// An object with these members, and perhaps others.
    #[wasm_bindgen(typescript_type = "Memberships")]
    pub type Memberships;
}

const KEYS: [&str; 4] = ["groups", "masks", "owner", "fixed"];

/// Returns a member of an options object that is given.
pub(crate) fn member(options: &JsValue, name: &str) -> Option<JsValue> {
    Reflect::get(options, &name.into()).ok().filter(|value| !value.is_null() && !value.is_undefined())
}

impl Memberships {
    /// Reads the memberships of `count` boxes; `None` if none are given. `what` names the object in errors, such as one
    /// for a misspelt member that is none of these and `more`.
    pub(crate) fn read(&self, what: &str, more: &[&str], count: usize) -> Result<Option<Vec<Membership>>, JsError> {
        let Some(object) = self.dyn_ref::<Object>() else { return error(format!("{what} must be an object")) };
        for key in Object::keys(object).iter().filter_map(|key| key.as_string()) {
            if !KEYS.iter().chain(more).any(|known| **known == *key) {
                let known: Vec<&str> = more.iter().chain(&KEYS).copied().collect();
                return error(format!("{what} has no {key}; use {}", known.join(", ")));
            }
        }
        let [groups, masks, owner, fixed] = KEYS.map(|key| member(self, key));
        if [&groups, &masks, &owner, &fixed].iter().all(|given| given.is_none()) {
            return Ok(None);
        }
        let mut all = vec![Membership::ALL; count];
        let numbers: [(_, _, fn(&mut Membership) -> &mut u32); 3] = [
            ("groups", groups, |m| &mut m.groups),
            ("masks", masks, |m| &mut m.mask),
            ("owner", owner, |m| &mut m.owner),
        ];
        for (name, given, of) in numbers {
            for (m, value) in all.iter_mut().zip(given.map_or(Ok(Vec::new()), |given| column(&given, count, name))?) {
                *of(m) = value;
            }
        }
        for (m, value) in all.iter_mut().zip(fixed.map_or(Ok(Vec::new()), |given| flags(&given, count, "fixed"))?) {
            m.fixed = value;
        }
        Ok(Some(all))
    }
}
