//! The field map: the fastest algorithm over the number of objects and the density of pairs.

use super::{Area, Result, chart, colour, grid, mesh, panels, range, svg};
use plotters::prelude::*;

/// Panels over the same axes.
#[derive(Debug, Clone, Default)]
pub(crate) struct FieldMap {
    pub(crate) title: String,
    /// The algorithms that cells and points name by their position.
    pub(crate) names: Vec<String>,
    pub(crate) y_name: &'static str,
    pub(crate) panels: Vec<MapPanel>,
}

/// Cells, and the timed frames as points.
#[derive(Debug, Clone, Default)]
pub(crate) struct MapPanel {
    pub(crate) title: String,
    pub(crate) cells: Vec<Cell>,
    pub(crate) points: Vec<(f64, f64, usize)>,
}

/// A rectangle in which one algorithm is the fastest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Cell {
    pub(crate) from: (f64, f64),
    pub(crate) to: (f64, f64),
    pub(crate) algorithm: usize,
}

impl FieldMap {
    /// Draws the panels.
    ///
    /// # Errors
    /// When plotters fails.
    pub(crate) fn svg(&self) -> Result<String> {
        svg((1400, 520), &self.title, &self.names, |area| {
            debug_assert_eq!(grid(self.panels.len()).0, 1);
            for (panel, area) in self.panels.iter().zip(panels(area, self.panels.len())) {
                self.panel(panel, &area)?;
            }
            Ok(())
        })
    }

    fn panel(&self, panel: &MapPanel, area: &Area<'_>) -> Result<()> {
        let cells = || self.panels.iter().flat_map(|p| &p.cells);
        let x = range(cells().flat_map(|c| [c.from.0, c.to.0]), 1.0);
        let y = range(cells().flat_map(|c| [c.from.1, c.to.1]), 1.0);
        let mut chart = chart(area, &panel.title)?.build_cartesian_2d(x.log_scale(), y.log_scale())?;
        mesh(&mut chart, "objects", self.y_name)?;
        let shade = |c: &Cell| Rectangle::new([c.from, c.to], colour(c.algorithm).mix(0.5).filled());
        chart.draw_series(panel.cells.iter().map(shade))?;
        chart.draw_series(panel.points.iter().map(|(x, y, _)| Circle::new((*x, *y), 5, WHITE.filled())))?;
        chart.draw_series(panel.points.iter().map(|(x, y, k)| Circle::new((*x, *y), 4, colour(*k).filled())))?;
        Ok(())
    }
}
