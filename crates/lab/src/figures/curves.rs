//! Curves over two logarithmic axes, with the fields of optimal performance behind them: Figures 4, 6 and 7 of the
//! paper.

use super::{Area, Result, chart, colour, grid, log, mesh, panels, range, svg};
use crate::text::once;
use plotters::prelude::*;

/// Panels with the same axes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Curves {
    pub(crate) title: String,
    pub(crate) x_name: &'static str,
    pub(crate) y_name: &'static str,
    pub(crate) panels: Vec<CurvePanel>,
}

/// The curves of one report.
#[derive(Debug, Clone, Default)]
pub(crate) struct CurvePanel {
    pub(crate) title: String,
    pub(crate) curves: Vec<Curve>,
    pub(crate) fields: Vec<Field>,
}

/// A named series of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// The range of x over which the curve of a name is the lowest.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Curves {
    /// Draws the panels.
    ///
    /// # Errors
    /// When plotters fails.
    pub(crate) fn svg(&self) -> Result<String> {
        let names = once(self.panels.iter().flat_map(|p| &p.curves).map(|curve| curve.name.clone()));
        let (rows, columns) = grid(self.panels.len());
        let size = (if columns == 1 { 900 } else { 1400 }, if rows == 1 { 460 } else { 340 * rows as u32 });
        svg(size, &self.title, &names, |area| {
            for (panel, area) in self.panels.iter().zip(panels(area, self.panels.len())) {
                self.panel(panel, &names, &area)?;
            }
            Ok(())
        })
    }

    fn panel(&self, panel: &CurvePanel, names: &[String], area: &Area<'_>) -> Result<()> {
        let points = || self.panels.iter().flat_map(|p| &p.curves).flat_map(|c| &c.points);
        let (x, y) = (range(points().map(|p| p.0), 1.1), range(points().map(|p| p.1), 1.2));
        let mut chart = chart(area, &panel.title)?.build_cartesian_2d(log(x.clone()), log(y.clone()))?;
        let place = |name: &str| colour(names.iter().position(|n| n == name).unwrap_or_default());
        let rectangle = |f: &Field| {
            let corners = [(f.from.clamp(x.start, x.end), y.start), (f.to.clamp(x.start, x.end), y.end)];
            Rectangle::new(corners, place(&f.name).mix(0.18).filled())
        };
        chart.draw_series(panel.fields.iter().map(rectangle))?;
        mesh(&mut chart, self.x_name, self.y_name)?;
        for curve in &panel.curves {
            let colour = place(&curve.name);
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), colour.stroke_width(2)))?;
            chart.draw_series(curve.points.iter().map(|p| Circle::new(*p, 3, colour.filled())))?;
        }
        Ok(())
    }
}
