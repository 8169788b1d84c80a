//! Judges kernels with the compilers of real GPUs. `tools/shader-check.sh` runs it; each verb is a step of that script.

mod dxc;
mod hazard;
mod statistics;
mod table;
mod translate;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
sapwise-shaders translate DIR OUT        every entry point of DIR/*.wgsl as OUT/NAME.ENTRY.spv, .1_1.spv, .hlsl and .metal
sapwise-shaders dxc LIBRARY DIR          compiles DIR/*.hlsl with that libdxcompiler.so
sapwise-shaders statistics FAMILY DIR    what the Vulkan device of the environment makes of DIR/*.wgsl, as CSV without a head
sapwise-shaders head                     the head of that CSV
sapwise-shaders compare BEFORE AFTER     fails where AFTER spills, takes scratch memory, or differs from BEFORE
sapwise-shaders hazard                   breaks two rules on every Vulkan device, for the validation layers to see";

/// What went wrong, in words that say what to do next.
type Result<T> = std::result::Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["translate", dir, out] => translate::all(Path::new(dir), Path::new(out)),
        ["dxc", library, dir] => dxc::all(Path::new(library), Path::new(dir)),
        ["statistics", family, dir] => statistics::print(family, Path::new(dir)),
        ["head"] => {
            println!("{}", table::head());
            Ok(())
        }
        ["compare", before, after] => table::compare_files(Path::new(before), Path::new(after)),
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

/// The files of a folder with that ending, in the order of their names. None at all is an error: nothing would be checked.
fn files(dir: &Path, ending: &str) -> Result<Vec<std::path::PathBuf>> {
    let entries = std::fs::read_dir(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut found: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == ending));
    found.sort();
    if found.is_empty() { Err(format!("{} holds no .{ending}", dir.display())) } else { Ok(found) }
}

/// The name of a file without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
