//! What a caller sees of a fault of the library.

use std::sync::OnceLock;
use wasm_bindgen::prelude::*;

static FAULT: OnceLock<String> = OnceLock::new();

/// Makes a panic a JavaScript error with its message, in place of a trap without one.
pub(crate) fn install() {
    std::panic::set_hook(Box::new(|info| {
        let text = format!("a fault of Sapwise, please report it: {info}; load the module again");
        wasm_bindgen::throw_str(FAULT.get_or_init(|| text))
    }));
}

/// Runs the body of a function. A panic left what it worked on half changed, so every call after one fails with its
/// message.
pub(crate) fn call<T>(run: impl FnOnce() -> Result<T, JsError>) -> Result<T, JsError> {
    FAULT.get().map_or_else(run, |text| Err(JsError::new(text)))
}

/// Returns an error with this message.
pub(crate) fn error<T>(text: impl AsRef<str>) -> Result<T, JsError> {
    Err(JsError::new(text.as_ref()))
}
