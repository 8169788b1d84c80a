//! What each hardware parameter is worth to each crossover, as a table of shaded numbers.

use super::{HPos, LINE, Result, colour, svg, text};
use plotters::prelude::*;

/// Pixels of the names of rows, and of a cell.
const ROW_NAMES: i32 = 430;
const CELL: (i32, i32) = (130, 26);

/// A number for each row and column, where it is known.
#[derive(Debug, Clone, Default)]
pub(crate) struct Matrix {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<(String, Vec<Option<f64>>)>,
}

impl Matrix {
    /// Draws the rows from the first at the top; the largest number is the darkest.
    ///
    /// # Errors
    /// When plotters fails.
    pub(crate) fn svg(&self) -> Result<String> {
        let top = 2 * LINE as i32 + 8;
        let width = ROW_NAMES + CELL.0 * self.columns.len() as i32 + 12;
        let height = top + CELL.1 * self.rows.len() as i32 + 12;
        let most = self.rows.iter().flat_map(|r| &r.1).flatten().fold(0.0_f64, |most, v| most.max(*v));
        svg((width as u32, height as u32), &self.title, &[], |area| {
            let left = |column: usize| ROW_NAMES + CELL.0 * column as i32;
            for (column, name) in self.columns.iter().enumerate() {
                for (line, part) in halves(name).iter().enumerate() {
                    let at = (left(column) + CELL.0 / 2, LINE as i32 * line as i32 + LINE as i32 / 2);
                    text(area, part, at, HPos::Center)?;
                }
            }
            for (row, (name, values)) in self.rows.iter().enumerate() {
                let (y, middle) = (top + CELL.1 * row as i32, top + CELL.1 * row as i32 + CELL.1 / 2);
                text(area, name, (ROW_NAMES - 8, middle), HPos::Right)?;
                for (column, value) in values.iter().enumerate() {
                    let Some(value) = value else { continue };
                    let (x, shade) = (left(column), (value / most.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0));
                    let corners = [(x + 1, y + 1), (x + CELL.0 - 1, y + CELL.1 - 1)];
                    area.draw(&Rectangle::new(corners, colour(1).mix(0.05 + 0.9 * shade).filled()))?;
                    text(area, &format!("{value:.2}"), (x + CELL.0 / 2, middle), HPos::Center)?;
                }
            }
            Ok(())
        })
    }
}

/// A name with blanks for underscores, on two lines.
fn halves(name: &str) -> [String; 2] {
    let words = name.replace('_', " ");
    let at = words.match_indices(' ').map(|(at, _)| at).min_by_key(|at| at.abs_diff(words.len() / 2));
    match at {
        Some(at) => [words[..at].to_owned(), words[at + 1..].to_owned()],
        None => [words, String::new()],
    }
}
