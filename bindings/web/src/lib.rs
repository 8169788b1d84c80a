//! Sapwise for browsers and Node.js. What is exported here is JavaScript's: `wasm-bindgen` writes the module and its
//! TypeScript types from these items and their comments.

mod arrays;
mod broad_phase;
mod clock;
mod fault;
mod find;
mod gpu;
mod memberships;
mod probe;
mod scene;
mod space;
mod tuning;

use wasm_bindgen::prelude::*;

/// The types of what is no class.
#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("types.d.ts");

/// Runs once the module is loaded.
#[wasm_bindgen(start)]
fn start() {
    fault::install();
    clock::install();
}
