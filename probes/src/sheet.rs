//! A table of text and figures: for the page, where it sorts, and for a CSV file.

/// Rows under named columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Sheet {
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Row>,
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Column {
    /// What a reader sees at its head.
    pub(crate) title: String,
    /// Its name in CSV, with the unit as the last words.
    pub(crate) key: String,
}

/// One row, and the reports that its figures are from.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Row {
    /// As many as there are columns.
    pub(crate) cells: Vec<Cell>,
    /// Positions in the list of reports, ascending.
    pub(crate) reports: Vec<usize>,
}

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    /// Words.
    Text(String),
    /// A figure in the unit of its column, and as a reader sees it.
    Number { value: f64, shown: String },
    /// No figure, and why: shown as a dash, with the reason to be read; empty in CSV.
    Missing(String),
}
