//! Judges kernels with the compilers of real GPUs. Each verb is a step of `tools/shader-check.sh`.

mod dxc;
mod hazard;
mod statistics;
mod translate;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
sapwise-shaders translate DIR OUT      writes every entry point of DIR/*.wgsl as SPIR-V, HLSL and Metal
sapwise-shaders dxc LIBRARY DIR        compiles DIR/*.hlsl with that libdxcompiler.so
sapwise-shaders statistics FAMILY DIR  compiles DIR/*.wgsl on the only Vulkan device, prints CSV, fails on spills
sapwise-shaders hazard                 breaks two rules on every Vulkan device, for the validation layers to see";

/// An error is a text that says what to do next.
type Result<T> = std::result::Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["translate", dir, out] => translate::all(Path::new(dir), Path::new(out)),
        ["dxc", library, dir] => dxc::all(Path::new(library), Path::new(dir)),
        ["statistics", family, dir] => statistics::print(family, Path::new(dir)),
        ["hazard"] => hazard::provoke(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    if let Err(why) = done {
        eprintln!("shaders: {why}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Returns the files of a folder with an extension, sorted by name. It is an error if there is none, because nothing
/// would be checked.
fn files(dir: &Path, extension: &str) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut found: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == extension));
    found.sort();
    if found.is_empty() { Err(format!("{} has no .{extension}", dir.display())) } else { Ok(found) }
}

/// Returns the name of a file without its extension.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
