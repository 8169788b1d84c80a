//! The document that the tables go into.

use std::path::Path;

const BEGIN: &str = "<!-- peers:begin -->";
const END: &str = "<!-- peers:end -->";

/// Replaces what stands between the two marks of a document.
///
/// # Errors
/// When the file can't be read or written, or lacks a mark.
pub(crate) fn put(path: &Path, tables: &str) -> Result<(), String> {
    let told = |e: std::io::Error| format!("{}: {e}", path.display());
    let text = std::fs::read_to_string(path).map_err(told)?;
    let lacks = |mark| format!("{}: it lacks the mark {mark}", path.display());
    let (head, rest) = text.split_once(BEGIN).ok_or_else(|| lacks(BEGIN))?;
    let (_, tail) = rest.split_once(END).ok_or_else(|| lacks(END))?;
    std::fs::write(path, format!("{head}{BEGIN}\n\n{}\n\n{END}{tail}", tables.trim())).map_err(told)
}
