//! Lists the public API that the JSON of rustdoc describes, a line for each item. `tools/public-api.sh` runs it.
//!
//! `cargo public-api -sss` lists the same, and is built for minutes: this is the library within it.

use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(json) = std::env::args_os().nth(1) else {
        eprintln!("usage: sapwise-public-api FILE, the JSON that rustdoc wrote");
        return ExitCode::from(2);
    };
    // What the compiler adds by itself would hide what somebody wrote.
    let listed = public_api::Builder::from_rustdoc_json(json)
        .omit_blanket_impls(true)
        .omit_auto_trait_impls(true)
        .omit_auto_derived_impls(true)
        .build();
    match listed {
        Ok(api) => {
            print!("{api}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!(
                "public-api: {why}; another version of rustdoc's JSON needs another version of the library in \
                 Cargo.toml"
            );
            ExitCode::FAILURE
        }
    }
}
