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

/// Returns the line that names the next command, from the words after the name of this program.
///
/// `cargo run` sets `CARGO`: a user who started the program with it may not have installed the command.
pub(crate) fn next(words: &str) -> String {
    let own = std::env::current_exe().is_ok_and(|path| path.file_stem().is_some_and(|stem| stem == "sapwise"));
    let program = if own && std::env::var_os("CARGO").is_some() { "cargo run --release --" } else { "sapwise" };
    format!("Next: {program} {words}")
}

/// Returns the words that this process was started with, followed by these.
pub(crate) fn again(more: &[&str]) -> String {
    let own = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    let words = own.chain(more.iter().map(|word| (*word).to_owned())).map(|word| quoted(&word));
    words.collect::<Vec<_>>().join(" ")
}

/// Returns the command that this process was started with, every file named without its folders, which are of this
/// machine alone.
pub(crate) fn own_command() -> String {
    command(std::env::args().skip(1))
}

fn command(words: impl Iterator<Item = String>) -> String {
    let short = |word: String| {
        let (option, path) = word.split_once('=').filter(|_| word.starts_with("--")).unwrap_or(("", &word));
        let name = Path::new(path).file_name().map_or_else(|| path.into(), |name| name.to_string_lossy());
        if option.is_empty() { name.into_owned() } else { format!("{option}={name}") }
    };
    std::iter::once("sapwise".to_owned()).chain(words.map(short)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_a_shell_would_take_apart_are_quoted() {
        let words = ["a-b/c.json", "a b", "it's", ""].map(quoted);
        assert_eq!(words, ["a-b/c.json", "'a b'", "'it'\\''s'", "''"]);
    }

    #[test]
    fn the_command_below_a_picture_names_no_folder() {
        let words = ["run", "/a/s.npy", "--tuning", "/b/t.json", "--plot=c/p.svg", "--seed=3", "--no-gpus"];
        let shown = command(words.into_iter().map(str::to_owned));
        assert_eq!(shown, "sapwise run s.npy --tuning t.json --plot=p.svg --seed=3 --no-gpus");
    }
}
