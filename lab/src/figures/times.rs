//! Predicted against measured times on what was left out of a training.

use super::axis::{Axis, time_unit};
use super::chart::{BELOW, Chart, Frame, LEFT, Line, RIGHT, missing};
use super::legend::{Legend, Sign};
use super::legended::Legended;
use super::paper::Area;
use super::style::{self, GAP, INK, SECONDARY, WIDTH};
use super::{Figure, Tabled, tabled};
use crate::sheet::Sheet;

/// Both axes are times of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Times {
    pub(crate) title: String,
    pub(crate) methods: Vec<TimesOf>,
}

/// The times of one method.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TimesOf {
    pub(crate) name: String,
    pub(crate) style: usize,
    pub(crate) pairs: Vec<TimePair>,
}

/// One frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct TimePair {
    pub(crate) measured_ns: f64,
    pub(crate) predicted_ns: f64,
}

/// Width and height of the chart, with what stands beside it; the names have the rest of the width.
const CHART: i32 = 600;
const EXACT: Line = Line::solid(INK, 1);
const TWICE: Line = Line::dashed(SECONDARY, 1);

const NOTHING: &str = "Nothing was left out: there is one report only.";

impl Legended for Times {
    fn legend(&self, width: i32) -> Legend {
        let methods = self.methods.iter().map(|m| (Sign::Mark(m.style), m.name.clone()));
        let lines = [(EXACT, "the prediction is right"), (TWICE, "it is off by a factor of two")];
        let lines = lines.map(|(line, name)| (Sign::Line(line), name.to_owned()));
        Legend::new(methods.chain(lines).collect(), width)
    }

    fn chart(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()> {
        let ns = || self.methods.iter().flat_map(|m| &m.pairs).flat_map(|p| [p.measured_ns, p.predicted_ns]);
        if ns().next().is_none() {
            return missing(area, frame, NOTHING);
        }
        let (name, unit) = time_unit(ns());
        let axis = Axis::log(ns().map(|ns| ns / unit), 1.5);
        let chart = Chart::new(area, frame, axis.clone(), axis);
        let names = ["measured", "predicted"].map(|what| format!("{what} time of a frame ({name})"));
        chart.grid(title, &names[0], &names[1])?;
        for method in &self.methods {
            let (shape, colour) = (style::mark(method.style), style::colour(method.style));
            for p in &method.pairs {
                chart.mark(p.measured_ns / unit, p.predicted_ns / unit, shape, colour, 3)?;
            }
        }
        chart.factors(&[(0.5, TWICE), (1.0, EXACT), (2.0, TWICE)])
    }
}

impl Figure for Times {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH, CHART.max(self.legend(WIDTH as i32 - CHART - 2 * GAP).height() + 2 * GAP) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let frame = Frame { left: 0, top: 0, right: CHART, bottom: CHART }.within(LEFT, GAP, RIGHT, BELOW);
        self.chart(area, frame, "")?;
        self.legend(WIDTH as i32 - CHART - 2 * GAP).draw(area, (CHART + GAP, GAP))
    }
}

impl Tabled for Times {
    fn csv(&self) -> Sheet {
        let row = |m: &TimesOf, p: &TimePair| {
            vec![tabled::text(&m.name), tabled::figure(p.measured_ns), tabled::figure(p.predicted_ns)]
        };
        let rows = self.methods.iter().flat_map(|m| m.pairs.iter().map(move |p| row(m, p)));
        let columns = [("method", "method"), ("measured time (ns)", "measured_ns"), ("predicted time (ns)", "predicted_ns")];
        tabled::sheet(&columns, rows.collect())
    }
}
