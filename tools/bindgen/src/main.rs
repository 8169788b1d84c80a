//! Writes the JavaScript and the TypeScript types of a WebAssembly module, as the command `wasm-bindgen --target web`
//! does.
//!
//!     sapwise-bindgen MODULE.wasm FOLDER

use anyhow::{Context, bail};
use std::env::args;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = args().skip(1).collect();
    let [module, folder] = &arguments[..] else { bail!("give a module and a folder") };
    let mut bindgen = Bindgen::new();
    bindgen.input_path(module).web(true)?.out_name("sapwise").typescript(true);
    // `init()` without an argument loads the module from beside the script.
    bindgen.omit_default_module_path(false);
    bindgen.remove_name_section(true).remove_producers_section(true);
    bindgen.generate(folder).with_context(|| module.clone())
}
