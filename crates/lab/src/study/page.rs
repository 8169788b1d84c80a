//! The page: one HTML file that loads nothing.

use crate::figures::plain;
use std::fmt::Write;

/// The text before the sections. The name of the generator marks the folder of a study.
pub(super) const HEAD: &str = include_str!("head.html");

/// A page under way.
#[derive(Debug, Default)]
pub(super) struct Page {
    body: String,
    /// The files beside it: figures, and tables.
    pub(super) files: Vec<(&'static str, String)>,
    /// Sentences about figures that could not be shown.
    pub(super) missing: Vec<String>,
}

impl Page {
    pub(super) fn section(&mut self, title: &str) {
        self.push(format_args!("<h2>{}</h2>", escaped(title)));
    }

    pub(super) fn text(&mut self, text: &str) {
        self.push(format_args!("<p>{}</p>", escaped(text)));
    }

    /// Adds a sentence about a missing figure.
    pub(super) fn lacks(&mut self, what: &str) {
        self.push(format_args!("<p class=\"lacks\">{}</p>", escaped(what)));
        self.missing.push(what.to_owned());
    }

    /// Shows a figure with a link to its file, and keeps it for that.
    pub(super) fn figure(&mut self, file: &'static str, svg: String, caption: &str) {
        let caption = escaped(caption);
        self.push(format_args!(
            "<figure>\n{svg}<figcaption>{caption} <a href=\"{file}\">{file}</a></figcaption>\n</figure>"
        ));
        self.files.push((file, svg));
    }

    /// Shows a table, the first row its head.
    pub(super) fn table(&mut self, caption: &str, rows: &[Vec<String>]) {
        let caption = escaped(caption);
        self.push(format_args!("<div class=\"wide\"><table><caption>{caption}</caption>{}</table></div>", html(rows)));
    }

    /// Returns its text.
    pub(super) fn text_of(&self) -> String {
        format!("{HEAD}{}</body>\n</html>\n", self.body)
    }

    fn push(&mut self, html: std::fmt::Arguments<'_>) {
        // A string takes everything.
        let _ = writeln!(self.body, "{html}");
    }
}

/// The rows of a table, the first one its head.
fn html(rows: &[Vec<String>]) -> String {
    let row = |(k, row): (usize, &Vec<String>)| {
        let tag = if k == 0 { "th" } else { "td" };
        let cells: String = row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
        format!("\n<tr>{cells}</tr>")
    };
    rows.iter().enumerate().map(row).collect()
}

/// Text that no browser takes for markup.
fn escaped(text: &str) -> String {
    plain(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
