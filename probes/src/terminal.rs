//! What standard output can show: its width and its colours.

use console::{Style, Term};
use sapwise_lab::text::{columns, width};

/// Standard output: a terminal, or a pipe or a file, which get plain text and whole tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Terminal {
    /// Characters in a line; `None` if standard output is no terminal.
    pub(crate) columns: Option<usize>,
    /// Whether text may be coloured or bold.
    pub(crate) colour: bool,
}

impl Terminal {
    /// A pipe or a file.
    pub(crate) const NONE: Self = Self { columns: None, colour: false };

    /// Looks at standard output.
    pub(crate) fn of_standard_output() -> Self {
        let out = Term::stdout();
        if !out.is_term() {
            return Self::NONE;
        }
        // 0 stands for an unknown width.
        let columns = out.size_checked().map_or(0, |(_, columns)| usize::from(columns));
        let is = |name: &str, wanted: fn(&str) -> bool| std::env::var(name).is_ok_and(|value| wanted(&value));
        let refused = is("NO_COLOR", |value| !value.is_empty()) || is("TERM", |value| value == "dumb");
        // The library takes an empty NO_COLOR for a refusal, which it is not. On Windows it also turns colours on.
        let colour = !refused && (cfg!(unix) || out.features().colors_supported());
        Self { columns: Some(columns), colour }
    }

    /// Draws a table whose first row is its head.
    ///
    /// Leaves out columns at the right end that the terminal has no room for, and names them in a line below. The first
    /// two stay.
    pub(crate) fn table(self, rows: &[Vec<String>]) -> String {
        let head = rows.first().map_or(&[][..], Vec::as_slice);
        let widths: Vec<usize> = (0..head.len()).map(|k| width(rows, k)).collect();
        let room = self.columns.filter(|&columns| columns > 0).unwrap_or(usize::MAX);
        let fits = |count: &usize| widths[..*count].iter().sum::<usize>() + 2 * (count - 1) <= room;
        let count = (2..=head.len()).rev().find(fits).unwrap_or(head.len().min(2));
        if count == head.len() {
            return self.headed(rows);
        }
        let kept: Vec<Vec<String>> = rows.iter().map(|row| row[..row.len().min(count)].to_vec()).collect();
        let missing = head[count..].join(", ");
        format!("{}No room for: {missing}; a wider terminal or a file has them.\n", self.headed(&kept))
    }

    /// Draws all columns.
    fn headed(self, rows: &[Vec<String>]) -> String {
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

    /// Styles what is as it should be.
    pub(crate) fn good(self, text: &str) -> String {
        self.styled(text, Style::new().green())
    }

    /// Styles what the reader should know before relying on the rest.
    pub(crate) fn warning(self, text: &str) -> String {
        self.styled(text, Style::new().yellow())
    }

    /// Styles what went wrong.
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

    /// A terminal with colours.
    const WIDE: Terminal = Terminal { columns: Some(200), colour: true };

    fn rows() -> Vec<Vec<String>> {
        [["parameter", "value", "how"], ["clock", "3.2 GHz", "measured, 12 samples"]]
            .map(|r| r.map(str::to_owned).to_vec())
            .to_vec()
    }

    #[test]
    fn only_a_terminal_has_bold_heads_and_colours() {
        assert_eq!(Terminal::NONE.table(&rows()), columns(&rows()));
        assert_eq!(Terminal::NONE.warning("warning"), "warning");
        assert!(WIDE.table(&rows()).starts_with("\u{1b}[1mparameter  value    how\u{1b}[0m\nclock"));
        assert_eq!(WIDE.bad("BAD"), "\u{1b}[31m\u{1b}[1mBAD\u{1b}[0m");
        let no_colour = Terminal { colour: false, ..WIDE };
        assert_eq!((no_colour.table(&rows()), no_colour.good("good")), (columns(&rows()), "good".to_owned()));
    }

    #[test]
    fn columns_without_room_are_left_out_and_named() {
        let of = |columns| Terminal { columns: Some(columns), colour: false }.table(&rows());
        let narrow = "parameter  value\nclock      3.2 GHz\nNo room for: how; a wider terminal or a file has them.\n";
        assert_eq!(of(40), columns(&rows()));
        assert_eq!([of(39), of(5)], [narrow, narrow]);
        // A terminal of unknown width may be wide.
        assert_eq!(of(0), columns(&rows()));
    }
}
