//! Any text as the name of an algorithm, a backend, a SIMD level or a schema: it is written as it was read, and an
//! available algorithm can be made.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sapwise::algorithm::{Backend, SimdLevel};
use sapwise::{AlgorithmId, Registry};
use sapwise_scenes::Scenario;
use sapwise_tune::{ParameterId, json};
use std::fmt::Display;
use std::str::FromStr;
use std::sync::LazyLock;

static REGISTRY: LazyLock<Registry> = LazyLock::new(|| Registry::with_cores(2));

fuzz_target!(|text: &str| {
    same::<Backend>(text);
    same::<SimdLevel>(text);
    same::<Scenario>(text);
    same::<ParameterId>(text);
    if let Ok(schema) = json::Schema::of(text) {
        let _ = schema.to_string();
    }
    if let Some(id) = same::<AlgorithmId>(text) {
        let again = AlgorithmId::new(id.method(), id.backend().clone());
        assert_eq!(again.as_ref(), Ok(&id));
        let available = REGISTRY.available().iter().any(|e| e.id == id);
        assert!(!available || REGISTRY.create(&id).is_ok(), "{id}");
    }
});

/// Parses a text, and checks that the value is written as that text.
fn same<T: FromStr + Display>(text: &str) -> Option<T> {
    let value = T::from_str(text).ok()?;
    assert_eq!(value.to_string(), text);
    Some(value)
}
