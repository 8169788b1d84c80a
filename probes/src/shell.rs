//! Commands as a shell reads them, for "Next:" and the captions of pictures.

use std::path::Path;

/// Quotes a word for a shell, if it needs to be.
pub(crate) fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./+=,@%:".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Quotes a path for a shell, if it needs to be.
pub(crate) fn path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// Returns the command that this process was started with, followed by these words.
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
