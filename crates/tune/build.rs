//! Writes the built-in model without the white space between its tokens, which is half of the file.

use std::{env, fs, path::Path};

fn main() {
    const MODEL: &str = "default.json";
    println!("cargo::rerun-if-changed={MODEL}");
    let text = fs::read_to_string(MODEL).unwrap_or_else(|error| panic!("{MODEL}: {error}"));
    let (mut quoted, mut escaped) = (false, false);
    let outside_of_space = |&c: &char| {
        quoted ^= c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        quoted || !c.is_ascii_whitespace()
    };
    let short: String = text.chars().filter(outside_of_space).collect();
    let folder = env::var_os("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&folder).join("model.json"), short).expect("cargo made the folder");
}
