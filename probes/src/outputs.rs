//! Checks of output files before the work is done.

use crate::exit::WrongUsage;
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

/// Checks the output files of a verb before it works for minutes: none is an input, none is named twice, and each can
/// be written.
///
/// # Errors
/// As [`refuse_overwriting`] and [`check_writable`].
pub(crate) fn check(inputs: &[PathBuf], outputs: &[&PathBuf]) -> anyhow::Result<()> {
    refuse_overwriting(inputs, outputs)?;
    outputs.iter().try_for_each(|path| check_writable(path))
}

/// Refuses to write over an input, or twice into one file.
///
/// # Errors
/// [`WrongUsage`] that names the file.
pub(crate) fn refuse_overwriting(inputs: &[PathBuf], outputs: &[&PathBuf]) -> Result<(), WrongUsage> {
    let read: Vec<PathBuf> = inputs.iter().map(|path| place(path)).collect();
    for (k, path) in outputs.iter().enumerate() {
        let own = place(path);
        if read.contains(&own) {
            return Err(WrongUsage(format!("{} is a file that is read; name another", path.display())));
        }
        if outputs[..k].iter().any(|o| place(o) == own) {
            return Err(WrongUsage(format!("{} is named for two outputs", path.display())));
        }
    }
    Ok(())
}

/// Returns the place of a file or folder by links and dots that exist, whether it exists or not.
pub(crate) fn place(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => {
            place(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).join(name)
        }
        _ => path.to_owned(),
    })
}

/// Tries whether a file can be written, by a temporary file in its folder, which is created if it is missing. A device
/// or a pipe is not tried.
///
/// # Errors
/// Names the path and what to do.
pub(crate) fn check_writable(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{} is a folder; name a file", path.display());
    }
    // `Path` itself takes `reports/` for `reports`.
    if path.to_string_lossy().ends_with(std::path::is_separator) {
        bail!("{}: there is no such folder; make it, or name a file", path.display());
    }
    if path.exists() && !path.is_file() {
        return Ok(());
    }
    // A link is followed, as it is when the file is written.
    let place = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = place.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)
        .with_context(|| format!("can't write {}: its folder can't be made; name another", path.display()))?;
    let tried = tempfile::tempfile_in(folder);
    tried.with_context(|| format!("can't write {}: its folder takes no file; name another", path.display()))?;
    Ok(())
}

/// Creates a folder for several files if it is missing.
///
/// # Errors
/// Names the folder and what to do.
pub(crate) fn make_folder(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is a file; name a folder, which is created if it is missing", folder.display());
    }
    std::fs::create_dir_all(folder)
        .with_context(|| format!("the folder {} can't be made; name another", folder.display()))
}

/// Refuses a file whose name promises another format than the one it gets.
///
/// # Errors
/// [`WrongUsage`] that names the option, the file and the ending.
pub(crate) fn check_ending(option: &str, path: &Path, ending: &str) -> Result<(), WrongUsage> {
    match path.extension() {
        Some(own) if own == ending => Ok(()),
        _ => Err(WrongUsage(format!("{option} {}: name a file that ends in .{ending}", path.display()))),
    }
}
