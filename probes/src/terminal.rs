//! The style of standard output: colours, or plain text.

use console::{Style, Term};
use sapwise_lab::text::columns;

/// Standard output: a terminal, or a pipe or a file, which get plain text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Terminal {
    /// Whether text may be coloured or bold.
    colour: bool,
}

impl Terminal {
    /// Looks at standard output.
    pub(crate) fn of_standard_output() -> Self {
        let out = Term::stdout();
        let is = |name: &str, wanted: fn(&str) -> bool| std::env::var(name).is_ok_and(|value| wanted(&value));
        let refused = is("NO_COLOR", |value| !value.is_empty()) || is("TERM", |value| value == "dumb");
        // The library takes an empty NO_COLOR for a refusal, which it is not. On Windows it also turns colours on.
        Self { colour: out.is_term() && !refused && (cfg!(unix) || out.features().colors_supported()) }
    }

    /// Draws a table whose first row is its head.
    pub(crate) fn table(self, rows: &[Vec<String>]) -> String {
        let text = columns(rows);
        match text.split_once('\n') {
            Some((head, rest)) => format!("{}\n{rest}", self.head(head)),
            None => text,
        }
    }

    /// Styles a heading.
    pub(crate) fn head(self, text: &str) -> String {
        self.styled(text, Style::new().bold())
    }

    /// Styles a good result.
    pub(crate) fn good(self, text: &str) -> String {
        self.styled(text, Style::new().green())
    }

    /// Styles a warning.
    pub(crate) fn warning(self, text: &str) -> String {
        self.styled(text, Style::new().yellow())
    }

    /// Styles a failure.
    pub(crate) fn bad(self, text: &str) -> String {
        self.styled(text, Style::new().red().bold())
    }

    fn styled(self, text: &str, style: Style) -> String {
        if self.colour { style.force_styling(true).apply_to(text).to_string() } else { text.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Vec<String>> {
        [["parameter", "value", "how"], ["clock", "3.2 GHz", "measured, 12 samples"]]
            .map(|r| r.map(str::to_owned).to_vec())
            .to_vec()
    }

    #[test]
    fn only_a_terminal_has_bold_heads_and_colours() {
        let [plain, coloured] = [false, true].map(|colour| Terminal { colour });
        assert_eq!((plain.table(&rows()), plain.warning("warning")), (columns(&rows()), "warning".to_owned()));
        assert!(coloured.table(&rows()).starts_with("\u{1b}[1mparameter  value    how\u{1b}[0m\nclock"));
        assert_eq!(coloured.bad("BAD"), "\u{1b}[31m\u{1b}[1mBAD\u{1b}[0m");
    }
}
