//! Writing files so that a failure leaves the old one as it was.

use anyhow::Context;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a file through a temporary one beside it that is renamed at the end.
///
/// A device or a pipe is written directly: renaming would put a plain file in its place.
///
/// # Errors
/// Names the path.
pub(crate) fn write_atomically(path: &Path, fill: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    try_write(path, fill).with_context(|| format!("{} can't be written", path.display()))
}

fn try_write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    if path.metadata().is_ok_and(|m| !m.is_file()) {
        return fill_buffered(&mut OpenOptions::new().write(true).open(path)?, fill);
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut temporary = tempfile::Builder::new().prefix(".sapwise-").tempfile_in(folder)?;
    fill_buffered(temporary.as_file_mut(), fill)?;
    temporary.as_file().sync_all()?;
    temporary.persist(path)?;
    Ok(())
}

fn fill_buffered(file: &mut File, fill: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let mut buffered = BufWriter::new(file);
    fill(&mut buffered)?;
    Ok(buffered.flush()?)
}
