//! The map that the paper could not draw: fields of optimal performance over two axes.

use super::paper::Area;
use super::style::WIDTH;
use super::{Figure, Tabled};
use crate::sheet::Sheet;

/// Panels beside each other, measured beside predicted, over the number of objects and a density.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FieldMap {
    pub(crate) title: String,
    /// Algorithms, each with its position in the study's list of names.
    pub(crate) names: Vec<(String, usize)>,
    /// Range of the number of objects.
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// What the second axis is, with its unit.
    pub(crate) y_name: String,
    pub(crate) panels: Vec<MapPanel>,
}

/// One map.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MapPanel {
    pub(crate) title: String,
    /// The fields, drawn light, behind the points.
    pub(crate) grid: Vec<MapCell>,
    pub(crate) points: Vec<MapPoint>,
}

/// A rectangle of one field.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct MapCell {
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// Position in `FieldMap::names`.
    pub(crate) algorithm: usize,
}

/// A frame, with the algorithm that was fastest in it or was chosen for it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct MapPoint {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Position in `FieldMap::names`.
    pub(crate) algorithm: usize,
    /// Regret of the choice, 0.1 for 10 %; more than that gets a ring.
    pub(crate) loss: Option<f64>,
}

impl Figure for FieldMap {
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

impl Tabled for FieldMap {
    fn csv(&self) -> Sheet {
        Sheet::default()
    }
}
