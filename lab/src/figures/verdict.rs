//! Whether a parameter and an outcome belong together, as a picture shows it.

use super::canvas::Area;
use super::chart::{Frame, Position, fill, words};
use super::mark::{Mark, mark};
use super::style::{self, GRID, INK, LABEL, PANEL, SECONDARY};
use plotters_backend::text_anchor::{HPos, VPos};

/// A verdict.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Verdict {
    Linked,
    NotLinked,
    CannotBeTold,
    #[default]
    Absent,
}

/// Position of the colour of what is linked.
const LINKED: usize = 4;

impl Verdict {
    pub(super) const ALL: [(Self, &'static str); 4] = [
        (Self::Linked, "linked"),
        (Self::NotLinked, "not linked"),
        (Self::CannotBeTold, "cannot be told from these machines"),
        (Self::Absent, "absent: too few values"),
    ];

    /// Shade and symbol, the symbol at `place`.
    pub(super) fn draw(self, area: &Area<'_>, frame: Frame, place: Position) -> anyhow::Result<()> {
        match self {
            Self::Linked => {
                fill(area, frame, style::colour(LINKED), 0.45)?;
                Ok(area.draw(&mark(place, Mark::Disc, INK, 5))?)
            }
            Self::NotLinked => Ok(area.draw(&mark(place, Mark::Ring, INK, 5))?),
            Self::CannotBeTold => {
                fill(area, frame, GRID, 0.6)?;
                words(area, "?", place, PANEL, INK, HPos::Center, VPos::Center)
            }
            Self::Absent => words(area, "-", place, LABEL, SECONDARY, HPos::Center, VPos::Center),
        }
    }
}
