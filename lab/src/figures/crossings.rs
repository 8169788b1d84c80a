//! Predicted against measured positions of the borders between fields.

use super::axis::Axis;
use super::chart::{ABOVE, BELOW, Chart, Frame, LEFT, Line, RIGHT, missing};
use super::legend::{Legend, Sign};
use super::paper::Area;
use super::style::{self, GAP, INK, SECONDARY, WIDTH};
use super::{Figure, Tabled, tabled};
use crate::sheet::Sheet;
use std::collections::BTreeSet;

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

/// Width and height of the chart, with what stands beside it; the names have the rest of the width.
const CHART: i32 = 600;

impl CrossingPair {
    fn is_drawn(&self) -> bool {
        [self.measured, self.predicted].iter().all(|v| v.is_finite() && *v > 0.0)
    }
}

impl Crossings {
    fn legend(&self) -> Legend {
        let names: BTreeSet<(usize, &str)> = self.pairs.iter().map(|p| (p.style, &p.name[..])).collect();
        let mut entries: Vec<(Sign, String)> =
            names.into_iter().map(|(style, name)| (Sign::Mark(style), name.to_owned())).collect();
        let left_out = self.pairs.iter().filter(|p| !p.is_drawn()).count();
        entries.push((Sign::Line(EXACT), "the prediction is right".to_owned()));
        entries.push((Sign::Line(TWICE), "it is off by a factor of two".to_owned()));
        if left_out > 0 {
            entries.push((Sign::None, format!("{left_out} without a position: left out")));
        }
        Legend::new(entries, WIDTH as i32 - CHART - 2 * GAP)
    }
}

const EXACT: Line = Line::solid(INK, 1);
const TWICE: Line = Line::dashed(SECONDARY, 1);

const NOTHING: &str = "no border was both measured and predicted";

impl Figure for Crossings {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH, CHART.max(self.legend().height() + ABOVE + GAP) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let drawn: Vec<&CrossingPair> = self.pairs.iter().filter(|p| p.is_drawn()).collect();
        let frame = Frame { left: 0, top: 0, right: CHART, bottom: CHART }.within(LEFT, GAP, RIGHT, BELOW);
        if drawn.is_empty() {
            return missing(area, Frame { right: WIDTH as i32 - GAP, ..frame }, NOTHING);
        }
        let values = drawn.iter().flat_map(|p| [p.measured, p.measured_low, p.measured_high, p.predicted]);
        let axis = Axis::log(values, 1.5);
        let chart = Chart::new(area, frame, axis.clone(), axis);
        chart.grid("", "measured border (objects)", "predicted border (objects)")?;
        chart.factors(&[(0.5, TWICE), (1.0, EXACT), (2.0, TWICE)])?;
        for pair in &drawn {
            let line = Line::solid(style::colour(pair.style), 1);
            chart.flat_bar(pair.predicted, pair.measured_low, pair.measured_high, line)?;
        }
        for pair in &drawn {
            let (shape, colour) = (style::mark(pair.style), style::colour(pair.style));
            chart.mark(pair.measured, pair.predicted, shape, colour, 5)?;
        }
        self.legend().draw(area, (CHART + GAP, GAP))
    }
}

impl Tabled for Crossings {
    fn csv(&self) -> Sheet {
        let row = |p: &CrossingPair| {
            let figures = [p.measured, p.measured_low, p.measured_high, p.predicted].map(tabled::figure);
            std::iter::once(tabled::text(&p.name)).chain(figures).collect()
        };
        let columns = [
            ("border", "border"),
            ("measured (objects)", "measured_objects"),
            ("low end (objects)", "low_objects"),
            ("high end (objects)", "high_objects"),
            ("predicted (objects)", "predicted_objects"),
        ];
        tabled::sheet(&columns, self.pairs.iter().map(row).collect())
    }
}
