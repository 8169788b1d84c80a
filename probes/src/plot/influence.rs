//! Which hardware parameters are linked to which algorithms and crossovers.

use super::paper::Area;
use super::style::WIDTH;
use super::{Figure, Tabled};
use crate::sheet::Sheet;

/// A matrix of verdicts: a row for each parameter, a column for each algorithm or crossover.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Influence {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<String>,
    /// For each row one cell for each column; what is missing is `Mark3::Absent`.
    pub(crate) cells: Vec<Vec<InfluenceCell>>,
}

/// One parameter and one algorithm or crossover.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct InfluenceCell {
    pub(crate) verdict: Mark3,
    /// Signed strength, as the rank correlation.
    pub(crate) value: Option<f64>,
    /// What stands in the cell.
    pub(crate) text: String,
}

/// A verdict.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Mark3 {
    Linked,
    NotLinked,
    CannotBeTold,
    #[default]
    Absent,
}

impl Figure for Influence {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH, 0)
    }

    fn draw_on(&self, _area: &Area<'_>) -> anyhow::Result<()> {
        Ok(())
    }
}

impl Tabled for Influence {
    fn csv(&self) -> Sheet {
        Sheet::default()
    }
}
