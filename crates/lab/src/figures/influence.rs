//! Which hardware parameters are linked to which algorithms and crossovers.

use super::canvas::Area;
use super::chart::{Frame, Stroke, missing, path, words};
use super::legend::{Legend, Sign};
use super::style::{self, GAP, GRID, INK, LABEL, SMALL, WIDTH, line_height};
use super::{Figure, font, verdict};
use crate::evaluate::Verdict;
use plotters::element::Text;
use plotters::style::FontTransform;
use plotters_backend::text_anchor::{HPos, VPos};

/// A matrix of verdicts: a row for each parameter, a column for each algorithm or crossover.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Influence {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<String>,
    /// For each row one cell for each column; one that is missing has no verdict.
    pub(crate) cells: Vec<Vec<InfluenceCell>>,
}

/// One parameter and one algorithm or crossover.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct InfluenceCell {
    /// `None` of too few values.
    pub(crate) verdict: Option<Verdict>,
    /// What stands in the cell, as the rank correlation.
    pub(crate) text: String,
}

/// The longest name of a row and of a column is cut to these widths.
const ROW_NAME: i32 = 300;
const COLUMN_NAME: i32 = 240;
/// Width of a cell: no narrower, where needed the whole picture is wider; no wider.
const NARROW: i32 = 46;
const WIDE: i32 = 150;
/// Height of a cell.
const CELL: i32 = 40;
/// Lines of a name above a column that is not turned.
const NAME_LINES: usize = 3;

/// Where the cells are, and how the names of the columns stand.
struct Plan {
    left: i32,
    top: i32,
    cell: i32,
    /// Lines of each name; `None` where they are turned.
    upright: Option<Vec<Vec<String>>>,
}

impl Influence {
    fn plan(&self) -> Plan {
        let names = self.rows.iter().map(|name| font::width(name, LABEL)).max().unwrap_or(0).min(ROW_NAME);
        let left = GAP + names + 10;
        let columns = self.columns.len().max(1) as i32;
        let cell = ((WIDTH as i32 - GAP - left) / columns).clamp(NARROW, WIDE);
        let lines: Vec<Vec<String>> =
            self.columns.iter().map(|name| font::wrapped(name, SMALL, cell - 6, usize::MAX)).collect();
        // A word that was cut to fit is not to be read.
        let whole = |(name, lines): (&String, &Vec<String>)| lines.join(" ") == *name && lines.len() <= NAME_LINES;
        let upright = self.columns.iter().zip(&lines).all(whole);
        let top = if upright {
            lines.iter().map(Vec::len).max().unwrap_or(0) as i32 * line_height(SMALL)
        } else {
            self.columns.iter().map(|name| font::width(name, SMALL)).max().unwrap_or(0).min(COLUMN_NAME)
        };
        Plan { left, top: top + GAP, cell, upright: upright.then_some(lines) }
    }

    fn legend(&self) -> Legend {
        let entries = verdict::ALL.map(|verdict| {
            let name = verdict.map_or_else(|| "absent: too few values".to_owned(), |verdict| verdict.to_string());
            (Sign::Verdict(verdict), name)
        });
        Legend::new(entries.to_vec(), WIDTH as i32 - 2 * GAP)
    }

    fn is_empty(&self) -> bool {
        self.rows.is_empty() || self.columns.is_empty()
    }

    fn heads(&self, area: &Area<'_>, plan: &Plan) -> anyhow::Result<()> {
        let bottom = plan.top - 6;
        for (k, name) in self.columns.iter().enumerate() {
            let x = plan.left + k as i32 * plan.cell + plan.cell / 2;
            if let Some(lines) = plan.upright.as_ref().map(|all| &all[k]) {
                for (up, line) in lines.iter().rev().enumerate() {
                    let place = (x, bottom - 8 - up as i32 * line_height(SMALL));
                    words(area, line, place, SMALL, INK, HPos::Center, VPos::Center)?;
                }
            } else {
                let name = font::wrapped(name, SMALL, COLUMN_NAME, 1).concat();
                let turned = style::text(SMALL, INK, HPos::Left, VPos::Center).transform(FontTransform::Rotate270);
                area.draw(&Text::new(name, (x, bottom), turned))?;
            }
        }
        Ok(())
    }
}

const NOTHING: &str = "there are too few machines to tell what is linked";

impl Figure for Influence {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        let legend = self.legend().height() + GAP;
        if self.is_empty() {
            return (WIDTH, (160 + legend) as u32);
        }
        let plan = self.plan();
        let width = plan.left + self.columns.len() as i32 * plan.cell + GAP;
        (WIDTH.max(width as u32), (plan.top + self.rows.len() as i32 * CELL + GAP + legend) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let legend = self.legend();
        let bottom = self.size().1 as i32 - legend.height();
        legend.draw(area, (GAP, bottom))?;
        if self.is_empty() {
            let frame = Frame { left: GAP, top: GAP, right: WIDTH as i32 - GAP, bottom: bottom - GAP };
            return missing(area, frame, NOTHING);
        }
        let plan = self.plan();
        self.heads(area, &plan)?;
        for (row, name) in self.rows.iter().enumerate() {
            let top = plan.top + row as i32 * CELL;
            let name = font::wrapped(name, LABEL, ROW_NAME, 1).concat();
            words(area, &name, (plan.left - 8, top + CELL / 2), LABEL, INK, HPos::Right, VPos::Center)?;
            for column in 0..self.columns.len() {
                let left = plan.left + column as i32 * plan.cell;
                let frame = Frame { left, top, right: left + plan.cell, bottom: top + CELL };
                let absent = InfluenceCell::default();
                let cell = self.cells.get(row).and_then(|cells| cells.get(column)).unwrap_or(&absent);
                cell.draw(area, frame)?;
            }
        }
        Ok(())
    }
}

impl InfluenceCell {
    fn draw(&self, area: &Area<'_>, frame: Frame) -> anyhow::Result<()> {
        let Frame { left, top, right, bottom } = frame;
        let middle = (left + right) / 2;
        let text = font::wrapped(&self.text, SMALL, frame.width() - 4, 1).concat();
        let symbol = if text.is_empty() { (top + bottom) / 2 } else { top + 12 };
        verdict::draw(self.verdict, area, frame, (middle, symbol))?;
        words(area, &text, (middle, bottom - 11), SMALL, INK, HPos::Center, VPos::Center)?;
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        path(area, &corners, Stroke::solid(GRID, 1))
    }
}
