//! Predicted against measured positions of the borders between fields.

use super::paper::Area;
use super::style::WIDTH;
use super::{Figure, Tabled};
use crate::sheet::Sheet;

/// Both axes in objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Crossings {
    pub(crate) title: String,
    pub(crate) pairs: Vec<CrossingPair>,
}

/// One border on one machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct CrossingPair {
    /// What the legend calls it: one entry for those with the same name.
    pub(crate) name: String,
    pub(crate) style: usize,
    /// Objects, with the interval.
    pub(crate) measured: f64,
    pub(crate) measured_low: f64,
    pub(crate) measured_high: f64,
    pub(crate) predicted: f64,
}

impl Figure for Crossings {
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

impl Tabled for Crossings {
    fn csv(&self) -> Sheet {
        Sheet::default()
    }
}
