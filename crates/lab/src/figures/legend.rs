//! What the series are called, in columns below a chart.

use super::canvas::Area;
use super::chart::{Frame, Hatch, Stroke, fill, hatch, path, words};
use super::font;
use super::mark::{Mark, mark};
use super::style::{self, INK, LABEL, SECONDARY, line_height};
use super::verdict;
use crate::evaluate::Verdict;
use plotters_backend::text_anchor::{HPos, VPos};

/// Width of what stands before a name, and the room behind a name.
const SIGN: i32 = 34;
const BEHIND: i32 = 18;
/// Height of a row.
const ROW: i32 = line_height(LABEL) + 3;

/// What stands before a name.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sign {
    /// Stroke and mark of the series at a position.
    Curve(usize),
    /// Its mark on a line without gaps.
    Marked(usize),
    /// Its mark alone.
    Mark(usize),
    /// Its field, the colour and the lines over it, with its mark.
    Field(usize),
    /// A line that is no series.
    Stroke(Stroke),
    /// A line with the interval around it.
    Interval(Stroke),
    /// The ring around a mark.
    Ring,
    /// A verdict in its cell.
    Verdict(Option<Verdict>),
    None,
}

/// The names of some series.
#[derive(Debug, Clone)]
pub(super) struct Legend {
    entries: Vec<(Sign, String)>,
    width: i32,
    columns: usize,
}

impl Legend {
    /// On that width. A name that is wider than all of it is cut.
    pub(super) fn new(entries: Vec<(Sign, String)>, width: i32) -> Self {
        let room = width - SIGN - BEHIND;
        let cut = |text: &str| font::wrapped(text, LABEL, room, 1).concat();
        let entries: Vec<(Sign, String)> = entries.into_iter().map(|(sign, name)| (sign, cut(&name))).collect();
        let widest = entries.iter().map(|(_, name)| font::width(name, LABEL)).max().unwrap_or(0) + SIGN + BEHIND;
        let columns = (width / widest.max(1)).max(1) as usize;
        // As full rows as the number of rows allows.
        let rows = entries.len().div_ceil(columns).max(1);
        let columns = entries.len().div_ceil(rows).max(1);
        Self { entries, width: widest, columns }
    }

    pub(super) fn height(&self) -> i32 {
        self.entries.len().div_ceil(self.columns) as i32 * ROW
    }

    /// From the upper left corner.
    pub(super) fn draw(&self, area: &Area<'_>, (left, top): (i32, i32)) -> anyhow::Result<()> {
        for (k, (sign, name)) in self.entries.iter().enumerate() {
            let (column, row) = ((k % self.columns) as i32, (k / self.columns) as i32);
            let (x, y) = (left + column * self.width, top + row * ROW + ROW / 2);
            sign.draw(area, x, y)?;
            words(area, name, (x + SIGN, y), LABEL, INK, HPos::Left, VPos::Center)?;
        }
        Ok(())
    }
}

impl Sign {
    fn draw(self, area: &Area<'_>, x: i32, y: i32) -> anyhow::Result<()> {
        let (left, right) = (x, x + SIGN - 8);
        let middle = (left + right) / 2;
        let ends = [(left, y), (right, y)];
        match self {
            Self::Curve(k) => {
                path(area, &ends, Stroke::of(k))?;
                area.draw(&mark((middle, y), style::mark(k), style::colour(k), 4))?;
            }
            Self::Marked(k) => {
                path(area, &ends, Stroke::solid(style::colour(k), 2))?;
                area.draw(&mark((middle, y), style::mark(k), style::colour(k), 4))?;
            }
            Self::Mark(k) => area.draw(&mark((middle, y), style::mark(k), style::colour(k), 4))?,
            Self::Field(k) => {
                let frame = Frame { left, top: y - 7, right, bottom: y + 7 };
                fill(area, frame, style::colour(k), style::FIELD)?;
                hatch(area, frame, Hatch::of(k), style::colour(k))?;
                area.draw(&mark((middle, y), Mark::Ground, style::GROUND, 6))?;
                area.draw(&mark((middle, y), style::mark(k), style::colour(k), 4))?;
            }
            Self::Ring => area.draw(&mark((middle, y), Mark::Ring, INK, 7))?,
            Self::Verdict(verdict) => {
                verdict::draw(verdict, area, Frame { left, top: y - 9, right, bottom: y + 9 }, (middle, y))?;
            }
            Self::None => {}
            Self::Stroke(line) => path(area, &ends, line)?,
            Self::Interval(line) => {
                hatch(area, Frame { left, top: y - 7, right, bottom: y + 7 }, Hatch::Interval, SECONDARY)?;
                path(area, &[(middle, y - 7), (middle, y + 7)], line)?;
            }
        }
        Ok(())
    }
}
