//! A table that the script of the page makes sortable.

use super::link::Reports;
use crate::data_table::{Cell, DataTable, Row, figure};
use maud::{Markup, html};
use std::collections::BTreeMap;

/// A longer table can be filtered.
const FILTERED: usize = 15;

/// A longer table scrolls in a box of its own.
const TALL: usize = 60;

/// A wider table is printed across the page.
const WIDE: usize = 12;

/// Longer texts are words, which go over several lines; shorter ones stay on one.
const WORDS: usize = 32;

/// The table below the caption `{id}-caption`. `row_id` returns the name of a row's place, by its position.
pub(super) fn table(
    id: &str,
    data: &DataTable,
    reports: &Reports<'_>,
    row_id: &dyn Fn(usize) -> Option<String>,
) -> Markup {
    let traced = data.rows.iter().any(|r| !r.reports.is_empty());
    let numeric: Vec<bool> = (0..data.columns.len()).map(|k| is_numeric(&data.rows, k)).collect();
    let (tall, wide) = (data.rows.len() > TALL, data.columns.len() + usize::from(traced) > WIDE);
    let class =
        [("scroll", true), ("tall", tall), ("wide", wide)].map(|(name, is)| if is { name } else { "" }).join(" ");
    html! {
        div class=(class.trim_end()) tabindex="0" role="region" aria-labelledby={ (id) "-caption" } {
            table aria-labelledby={ (id) "-caption" } data-filter[data.rows.len() > FILTERED] {
                thead {
                    tr {
                        @for (column, &numeric) in data.columns.iter().zip(&numeric) {
                            th.n[numeric] scope="col" { (column.title) }
                        }
                        @if traced { th scope="col" { "Reports" } }
                    }
                }
                tbody {
                    @for (k, row) in data.rows.iter().enumerate() {
                        tr id=[row_id(k)] {
                            @for (k, cell) in row.cells.iter().enumerate() { (self::cell(cell, k == 0)) }
                            @if traced { td.reports { (reports.links(&row.reports)) } }
                        }
                    }
                }
            }
        }
        @if data.rows.is_empty() { p.note { "This table has no rows." } }
        (reasons(data))
    }
}

fn cell(cell: &Cell, heads_row: bool) -> Markup {
    match cell {
        Cell::Text(text) if heads_row => html! { th.words[is_long(text)] scope="row" { (text) } },
        Cell::Text(text) => html! { td.words[is_long(text)] { (text) } },
        Cell::Number { value, shown } if value.is_finite() => html! { td data-value=(figure(*value)) { (shown) } },
        Cell::Number { shown, .. } => html! { td { (shown) } },
        Cell::Missing(why) => html! { td.missing title=(why) { "–" span.heard { (why) } } },
    }
}

/// Why cells are empty, for print and for fingers, which no title serves.
fn reasons(data: &DataTable) -> Markup {
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for cell in data.rows.iter().flat_map(|r| &r.cells) {
        if let Cell::Missing(why) = cell {
            *reasons.entry(why).or_default() += 1;
        }
    }
    let all: usize = reasons.values().sum();
    html! {
        @if all > 0 {
            details.note {
                summary { "Why " (all) @if all == 1 { " figure is" } @else { " figures are" } " missing (–)" }
                ul { @for (why, count) in &reasons { li { (why) " (" (count) ")" } } }
            }
        }
    }
}

fn is_long(text: &str) -> bool {
    text.chars().nth(WORDS).is_some()
}

fn is_numeric(rows: &[Row], column: usize) -> bool {
    let mut cells =
        rows.iter().filter_map(|r| r.cells.get(column)).filter(|c| !matches!(c, Cell::Missing(_))).peekable();
    cells.peek().is_some() && cells.all(|c| matches!(c, Cell::Number { .. }))
}
