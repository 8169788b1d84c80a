//! Checks of output files before the work is done.

use crate::exit::WrongUsage;
use sapwise_lab::figures::Picture;
use std::path::{Path, PathBuf};

/// Refuses to write over a file that is read, or twice into one file.
///
/// # Errors
/// [`WrongUsage`] that names the file.
pub(crate) fn refuse_overwriting(inputs: &[PathBuf], outputs: &[&PathBuf]) -> Result<(), WrongUsage> {
    let place = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
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

/// The format that the name of a picture asks for.
///
/// # Errors
/// When it ends in neither `.svg` nor `.png`.
pub(crate) fn picture_format(path: &Path) -> Result<Picture, WrongUsage> {
    Picture::of(path).map_err(|why| WrongUsage(format!("--plot {}: {why}", path.display())))
}
