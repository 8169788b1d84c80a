//! Tables of text and figures: sortable ones for the page, tidy ones for CSV files.

use crate::text::grouped;
use anyhow::Context;
use std::borrow::Cow;

/// Rows under named columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct DataTable {
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

impl Column {
    /// With what a reader sees, and its name in CSV.
    #[must_use]
    pub(crate) fn new(title: impl Into<String>, key: impl Into<String>) -> Self {
        Self { title: title.into(), key: key.into() }
    }
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

impl DataTable {
    /// Without rows, under columns that are called so for a reader and in CSV.
    #[must_use]
    pub(crate) fn new<const N: usize>(columns: [(&str, &str); N]) -> Self {
        Self { columns: columns.map(|(title, key)| Column::new(title, key)).into(), rows: Vec::new() }
    }

    /// Adds a row whose figures are from these reports.
    pub(crate) fn push(&mut self, cells: Vec<Cell>, reports: &[usize]) {
        debug_assert_eq!(cells.len(), self.columns.len());
        self.rows.push(Row { cells, reports: reports.to_vec() });
    }

    /// The table as CSV in UTF-8: a line of keys, then the rows, as RFC 4180 has it but with bare line feeds. Figures have all their
    /// digits. Where rows name reports, a last column `reports` has their labels, which `labels` holds in the order of the list, with
    /// blanks between.
    ///
    /// A spreadsheet would run a text such as `=HYPERLINK(...)` as a formula, and a report may come from anyone. A quote is put before
    /// every text that begins like one, as OWASP advises ("CSV Injection"): a spreadsheet shows it as text. Figures stay as they are.
    ///
    /// # Errors
    /// When a row has more or fewer cells than there are columns.
    pub(crate) fn csv(&self, labels: &[String]) -> anyhow::Result<String> {
        let traced = self.rows.iter().any(|r| !r.reports.is_empty());
        let mut writer = csv::Writer::from_writer(Vec::new());
        let keys = self.columns.iter().map(|c| inert(&c.key));
        writer.write_record(keys.chain(traced.then(|| "reports".into())).map(Cow::into_owned))?;
        for (k, row) in self.rows.iter().enumerate() {
            let cells = row.cells.iter().map(Cell::csv);
            let labels =
                || row.reports.iter().filter_map(|&r| labels.get(r)).map(String::as_str).collect::<Vec<_>>().join(" ");
            let reports = traced.then(|| inert(&labels()).into_owned().into());
            writer
                .write_record(cells.chain(reports).map(Cow::into_owned))
                .with_context(|| format!("row {} of a table with {} columns", k + 1, self.columns.len()))?;
        }
        let bytes = writer.into_inner().map_err(|e| e.into_error())?;
        Ok(String::from_utf8(bytes)?)
    }
}

impl Cell {
    /// Words.
    pub(crate) fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A figure with `decimals` digits after the point.
    pub(crate) fn number(value: f64, decimals: usize) -> Self {
        if value.is_finite() {
            Self::Number { value, shown: format!("{value:.decimals$}") }
        } else {
            Self::Missing("it is not finite".to_owned())
        }
    }

    /// A figure with all its digits, for tables that are only read by programs.
    #[must_use]
    pub(crate) fn exact(value: f64) -> Self {
        Self::number(value, 0).map_shown(figure)
    }

    /// A figure where there is one.
    pub(crate) fn optional(value: Option<f64>, decimals: usize, why: &str) -> Self {
        value.map_or_else(|| Self::Missing(why.to_owned()), |v| Self::number(v, decimals))
    }

    /// A whole number in groups of three digits.
    pub(crate) fn count(value: u64) -> Self {
        Self::Number { value: value as f64, shown: grouped(value) }
    }

    /// A share as a percentage; its value is the share.
    pub(crate) fn percent(share: f64) -> Self {
        Self::number(share, 4).map_shown(|share| format!("{:.1} %", 100.0 * share))
    }

    fn map_shown(self, shown: impl Fn(f64) -> String) -> Self {
        match self {
            Self::Number { value, .. } => Self::Number { value, shown: shown(value) },
            other => other,
        }
    }

    fn csv(&self) -> Cow<'_, str> {
        match self {
            Self::Text(text) => inert(text),
            Self::Number { value, .. } => figure(*value).into(),
            Self::Missing(_) => "".into(),
        }
    }
}

/// All digits that tell this figure from every other; nothing where it is none.
pub(crate) fn figure(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => String::new(),
        size if size == 0.0 || (1e-5..1e16).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// A text that no spreadsheet takes for a formula. The wide forms count: Japanese spreadsheets read them as the narrow ones.
fn inert(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠']) {
        format!("'{text}").into()
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64) -> Cell {
        Cell::Number { value, shown: "about".to_owned() }
    }

    fn one_column(cells: Vec<Cell>) -> DataTable {
        let rows = cells.into_iter().map(|c| Row { cells: vec![c], reports: Vec::new() }).collect();
        DataTable { columns: vec![Column::new("x", "x")], rows }
    }

    fn read(text: &str) -> Vec<Vec<String>> {
        let records = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes()).into_records();
        records.map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect()
    }

    #[test]
    fn what_would_break_a_line_is_quoted() {
        let texts = ["a,b", "say \"no\"", "two\nlines", "plain", "<b> & \u{202e}é"];
        let csv = one_column(texts.iter().map(|&t| Cell::Text(t.to_owned())).collect()).csv(&[]).unwrap();
        assert!(csv.starts_with("x\n\"a,b\"\n\"say \"\"no\"\"\"\n\"two\nlines\"\nplain\n"), "{csv}");
        assert_eq!(read(&csv).concat()[1..], texts);
    }

    #[test]
    fn a_figure_has_all_its_digits_and_a_missing_one_none() {
        let figures = [0.1, -3.0, 1e300, 2.5e-9, 1_000_000.0, 0.0, 1.0 / 3.0];
        let csv = one_column(figures.iter().map(|&f| number(f)).collect()).csv(&[]).unwrap();
        let back: Vec<f64> = csv.lines().skip(1).map(|l| l.parse().unwrap()).collect();
        assert_eq!(back, figures);
        assert!(csv.contains("\n1000000\n") && csv.contains("\n1e300\n"), "{csv}");
        let none = [Cell::Missing("no GPU".to_owned()), number(f64::NAN), number(f64::INFINITY)];
        assert_eq!(one_column(none.to_vec()).csv(&[]).unwrap(), "x\n\"\"\n\"\"\n\"\"\n");
    }

    #[test]
    fn no_text_is_a_formula() {
        for bad in ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "＝1", "＠x"] {
            let csv = one_column(vec![Cell::Text(bad.to_owned())]).csv(&[]).unwrap();
            assert_eq!(read(&csv)[1][0], format!("'{bad}"));
        }
        let mut table = one_column(vec![number(-1.0)]);
        table.columns[0].key = "=x".to_owned();
        assert_eq!(table.csv(&[]).unwrap(), "'=x\n-1\n");
    }

    #[test]
    fn a_row_names_its_reports() {
        let labels = ["R1".to_owned(), "R2".to_owned(), "=R3".to_owned()];
        let mut table = one_column(vec![number(1.0), number(2.0), number(3.0)]);
        table.rows[0].reports = vec![0, 1];
        table.rows[2].reports = vec![2];
        assert_eq!(table.csv(&labels).unwrap(), "x,reports\n1,R1 R2\n2,\n3,'=R3\n");
    }

    #[test]
    fn a_row_that_does_not_fit_is_an_error() {
        let mut table = one_column(vec![number(1.0), number(2.0)]);
        table.rows[1].cells.push(number(3.0));
        let error = table.csv(&[]).unwrap_err();
        assert!(error.to_string().contains("row 2 of a table with 1 column"), "{error}");
    }
}
