//! Standard output and standard error, without the panics of `println!`.

use crate::exit::Outcome;
use serde::Serialize;
use std::io::{ErrorKind, Write};

/// Standard output is closed. A broken pipe elsewhere, such as one given to `--out`, is an ordinary error.
#[derive(Debug, thiserror::Error)]
#[error("standard output is closed")]
struct Closed;

/// Writes a text and a line end to standard output.
///
/// # Errors
/// When the output is closed, which [`is_closed`] recognises, or its disk is full.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.trim_end_matches('\n').as_bytes()).and_then(|()| out.write_all(b"\n"));
    written.and_then(|()| out.flush()).map_err(refused)
}

/// Returns the error for a standard output that was not written, which [`is_closed`] may recognise.
pub(crate) fn refused(error: std::io::Error) -> anyhow::Error {
    if error.kind() == ErrorKind::BrokenPipe {
        return Closed.into();
    }
    anyhow::Error::from(error).context("standard output can't be written")
}

/// Writes a value as one line of JSON to standard output.
///
/// # Errors
/// As [`print()`].
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print(&serde_json::to_string(value)?)
}

/// Prints the answer of a verb: as JSON, or as its text.
///
/// # Errors
/// As [`print()`].
pub(crate) fn answer(json: bool, answer: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<Outcome> {
    let printed = if json { print_json(answer) } else { print(&text()) };
    printed.map(|()| Outcome::Done)
}

/// Writes the JSON text of a file as one line to standard output.
///
/// # Errors
/// As [`print()`].
pub(crate) fn print_file(text: &str) -> anyhow::Result<()> {
    print_json(&serde_json::from_str::<serde_json::Value>(text)?)
}

/// Writes a line to standard error, and ignores a closed one.
pub(crate) fn complain(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Writes a warning to standard error.
pub(crate) fn warn(text: &str) {
    complain(&format!("warning: {text}"));
}

/// Returns whether a reader such as `head` has closed standard output, which is no failure.
pub(crate) fn is_closed(error: &anyhow::Error) -> bool {
    error.is::<Closed>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_standard_output_is_closed_without_an_error() {
        let pipe = anyhow::Error::from(std::io::Error::from(ErrorKind::BrokenPipe)).context("can't write out.json");
        assert!(!is_closed(&pipe));
        assert!(is_closed(&anyhow::Error::from(Closed).context("a table")));
    }
}
