//! Figures 10 and 11 of Avril, Gouranton and Arnaldi (ISVRI 2011): each hardware parameter as a ratio to a reference machine, beside the
//! speed-up of each algorithm.

use super::paper::Area;
use super::style::WIDTH;
use super::{Figure, Tabled};
use crate::sheet::Sheet;

/// A row for each parameter and each algorithm, a mark for each machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Ratios {
    pub(crate) title: String,
    /// Name of the machine that the ratios are to.
    pub(crate) reference: String,
    /// The others: their positions give colours and marks.
    pub(crate) machines: Vec<String>,
    pub(crate) groups: Vec<RatioGroup>,
}

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RatioGroup {
    pub(crate) name: String,
    pub(crate) kind: RatioKind,
    /// One for each machine, `None` where one of the two values is missing.
    pub(crate) values: Vec<Option<RatioValue>>,
}

/// What a ratio is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RatioKind {
    /// The value of a hardware parameter over that of the reference.
    Parameter,
    /// The time of an algorithm on the reference over that on the machine.
    Algorithm,
}

/// A ratio with its interval.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RatioValue {
    pub(crate) ratio: f64,
    pub(crate) low: Option<f64>,
    pub(crate) high: Option<f64>,
}

impl Figure for Ratios {
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

impl Tabled for Ratios {
    fn csv(&self) -> Sheet {
        Sheet::default()
    }
}
