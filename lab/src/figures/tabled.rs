//! The data of figures as tables.

use super::Figure;
use super::axis::number;
use crate::sheet::{Cell, Column, Row, Sheet};

/// A figure whose data can be told as a table.
pub(crate) trait Tabled: Figure {
    /// The data: a row for each thing that is drawn. Which reports it is from the figure does not know.
    fn csv(&self) -> Sheet;
}

/// A table of these columns, each a title and a key.
pub(super) fn sheet(columns: &[(&str, &str)], rows: Vec<Vec<Cell>>) -> Sheet {
    let column = |(title, key): &(&str, &str)| Column { title: (*title).to_owned(), key: (*key).to_owned() };
    let rows = rows.into_iter().map(|cells| Row { cells, reports: Vec::new() }).collect();
    Sheet { columns: columns.iter().map(column).collect(), rows }
}

pub(super) fn text(text: &str) -> Cell {
    Cell::Text(text.to_owned())
}

/// A number, or that there is none.
pub(super) fn figure(value: f64) -> Cell {
    if value.is_finite() {
        Cell::Number { value, shown: number(value) }
    } else if value.is_nan() {
        Cell::Missing("not known".to_owned())
    } else {
        Cell::Missing("no end".to_owned())
    }
}

/// As above; `none` says why there may be no number.
pub(super) fn maybe(value: Option<f64>, none: &str) -> Cell {
    value.map_or_else(|| Cell::Missing(none.to_owned()), figure)
}
