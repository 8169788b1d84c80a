//! Ratios of machines to a reference, a row for each parameter or algorithm: Figures 10 and 11 of the paper.

use super::{HPos, Result, colour, mesh, range, svg, text};
use plotters::prelude::*;

/// Pixels of a row, of the names of rows, and of the axis below.
const ROW: u32 = 24;
const ROW_NAMES: u32 = 250;
const AXIS: u32 = 44;

/// A mark for each machine in each row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ratios {
    pub(crate) title: String,
    pub(crate) machines: Vec<String>,
    /// A name, and the ratio of each machine if it is known.
    pub(crate) rows: Vec<(String, Vec<Option<f64>>)>,
}

impl Ratios {
    /// Draws the rows from the first at the top.
    ///
    /// # Errors
    /// When plotters fails.
    pub(crate) fn svg(&self) -> Result<String> {
        let height = self.rows.len() as u32 * ROW;
        svg((1200, height + AXIS), &self.title, &self.machines, |area| {
            let (left, right) = area.split_horizontally(ROW_NAMES);
            let x = range(self.rows.iter().flat_map(|r| &r.1).flatten().copied().chain([0.6, 1.7]), 1.2);
            let (right, _) = right.split_vertically(height + AXIS);
            let mut chart = ChartBuilder::on(&right)
                .margin_right(12)
                .x_label_area_size(AXIS)
                .build_cartesian_2d(x.log_scale(), 0.0..f64::from(height))?;
            mesh(&mut chart, "ratio to the reference", "")?;
            chart.draw_series(LineSeries::new([(1.0, 0.0), (1.0, f64::from(height))], BLACK))?;
            for (row, (name, ratios)) in self.rows.iter().enumerate() {
                let middle = row as u32 * ROW + ROW / 2;
                text(&left, name, (ROW_NAMES as i32 - 8, middle as i32), HPos::Right)?;
                let known = ratios.iter().enumerate().filter_map(|(k, r)| Some((k, (*r)?)));
                chart.draw_series(known.map(|(k, ratio)| {
                    Circle::new((ratio, f64::from(height - middle)), 5, colour(k).mix(0.8).filled())
                }))?;
            }
            Ok(())
        })
    }
}
