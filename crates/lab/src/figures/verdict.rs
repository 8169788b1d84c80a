//! Whether a parameter and an outcome belong together, as a picture shows it.

use super::canvas::Area;
use super::chart::{Frame, Position, fill, words};
use super::mark::{Mark, mark};
use super::style::{self, GRID, INK, LABEL, PANEL, SECONDARY};
use crate::evaluate::Verdict;
use plotters_backend::text_anchor::{HPos, VPos};

/// Position of the colour of what is linked.
const LINKED: usize = 4;

/// All of them, with `None` of too few values.
pub(super) const ALL: [Option<Verdict>; 4] =
    [Some(Verdict::Linked), Some(Verdict::NotLinked), Some(Verdict::CannotBeTold), None];

/// Draws a verdict as shade and symbol, the symbol at `place`.
pub(super) fn draw(verdict: Option<Verdict>, area: &Area<'_>, frame: Frame, place: Position) -> anyhow::Result<()> {
    match verdict {
        Some(Verdict::Linked) => {
            fill(area, frame, style::colour(LINKED), 0.45)?;
            Ok(area.draw(&mark(place, Mark::Disc, INK, 5))?)
        }
        Some(Verdict::NotLinked) => Ok(area.draw(&mark(place, Mark::Ring, INK, 5))?),
        Some(Verdict::CannotBeTold) => {
            fill(area, frame, GRID, 0.6)?;
            words(area, "?", place, PANEL, INK, HPos::Center, VPos::Center)
        }
        None => words(area, "-", place, LABEL, SECONDARY, HPos::Center, VPos::Center),
    }
}
