//! Commands as a shell takes them: what stands behind "Next:" and below pictures.

use std::path::Path;

/// A word as a shell takes it.
pub(crate) fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./+=,@%:".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// A path as a shell takes it.
pub(crate) fn path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// The command that this process was started with, and these words behind it.
pub(crate) fn again(more: &[&str]) -> String {
    let own = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    let words = own.chain(more.iter().map(|word| (*word).to_owned())).map(|word| quoted(&word));
    std::iter::once("sapwise".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_a_shell_would_take_apart_are_quoted() {
        assert_eq!(
            [quoted("a-b/c.json"), quoted("a b"), quoted("it's"), quoted("")],
            ["a-b/c.json", "'a b'", "'it'\\''s'", "''"]
        );
    }
}
