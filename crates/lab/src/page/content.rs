//! What a page shows: its sections, and the reports that they are from.

use crate::data_table::DataTable;

/// What the page shows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Page {
    pub(crate) title: String,
    /// Paragraphs below the title.
    pub(crate) lead: Vec<String>,
    /// The command that made the page.
    pub(crate) command: String,
    /// The files that every figure is from, as the list at the end of the page.
    pub(crate) reports: Vec<Source>,
    pub(crate) sections: Vec<Section>,
}

/// One of the files that the figures are from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Source {
    /// Short, as tables name it: `R1`.
    pub(crate) label: String,
    pub(crate) file: String,
    /// What there is to know about it.
    pub(crate) note: String,
}

/// A part of the page with a place in the contents.
#[derive(Debug, Clone, Default)]
pub(crate) struct Section {
    /// What a link to it ends with, behind the `#`. Characters other than letters, digits, `-`, `_` and `.` become hyphens, and a
    /// number is added where it is taken. The same holds for tables and figures.
    pub(crate) id: String,
    pub(crate) title: String,
    pub(crate) blocks: Vec<Block>,
}

/// What a section is made of.
#[derive(Debug, Clone)]
pub(crate) enum Block {
    /// A paragraph.
    Text(String),
    /// Points.
    List(Vec<String>),
    /// What can't be shown, and why.
    Missing(String),
    /// A table, and the relative path of its CSV file; an empty one makes no link.
    Table { id: String, caption: String, table: DataTable, csv: String },
    /// An SVG with what it shows in words, and links as text and relative path.
    Figure { id: String, caption: String, svg: String, links: Vec<(String, String)>, alt: String },
}
