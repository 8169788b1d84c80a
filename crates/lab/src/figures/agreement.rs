//! Predicted over measured values of what was held out.

use super::Figure;
use super::axis::{Axis, time_unit};
use super::canvas::Area;
use super::chart::{BELOW, Chart, Frame, LEFT, RIGHT, Stroke, missing};
use super::legend::{Legend, Sign};
use super::legended::Legended;
use super::style::{self, GAP, INK, SECONDARY, WIDTH};

/// Both axes are logarithmic and the same; on the diagonal a prediction is right.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Agreement {
    /// What stands above it.
    pub(crate) title: String,
    /// What the values are.
    pub(crate) values: Values,
    /// Points that share a mark and a name in the legend.
    pub(crate) groups: Vec<AgreementGroup>,
}

/// What is predicted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Values {
    /// Times of a frame in nanoseconds.
    #[default]
    TimesNs,
    /// Positions of crossovers, in objects.
    CrossoversObjects,
}

/// Points with one name.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct AgreementGroup {
    /// What the legend calls them.
    pub(crate) name: String,
    /// Position among the series, which decides colour and mark.
    pub(crate) style: usize,
    /// The points.
    pub(crate) points: Vec<AgreementPoint>,
}

/// One value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AgreementPoint {
    /// The measured value.
    pub(crate) measured: f64,
    /// The predicted value.
    pub(crate) predicted: f64,
    /// The interval of the measured value, drawn as a bar.
    pub(crate) interval: Option<(f64, f64)>,
}

/// Width and height of the chart, with what stands beside it; the names have the rest of the width.
const CHART: i32 = 600;
const EXACT: Stroke = Stroke::solid(INK, 1);
const TWICE: Stroke = Stroke::dashed(SECONDARY, 1);

impl Values {
    fn axis_name(self, what: &str, unit: &str) -> String {
        match self {
            Self::TimesNs => format!("{what} time of a frame ({unit})"),
            Self::CrossoversObjects => format!("{what} crossover ({unit})"),
        }
    }

    fn nothing(self) -> &'static str {
        match self {
            Self::TimesNs => "Nothing was held out: there is one report only.",
            Self::CrossoversObjects => "No crossover was both measured and predicted.",
        }
    }

    /// Half the width of a mark: there are many times and few crossovers.
    fn mark_size(self) -> i32 {
        match self {
            Self::TimesNs => 3,
            Self::CrossoversObjects => 5,
        }
    }
}

impl AgreementPoint {
    fn is_drawn(&self) -> bool {
        [self.measured, self.predicted].iter().all(|v| v.is_finite() && *v > 0.0)
    }

    fn ends(&self) -> [f64; 2] {
        self.interval.map_or([self.measured; 2], |(low, high)| [low, high])
    }
}

impl Agreement {
    fn points(&self) -> impl Iterator<Item = &AgreementPoint> {
        self.groups.iter().flat_map(|g| &g.points)
    }

    fn drawn(&self) -> impl Iterator<Item = &AgreementPoint> {
        self.points().filter(|p| p.is_drawn())
    }
}

impl Legended for Agreement {
    fn legend(&self, width: i32) -> Legend {
        let mut entries: Vec<(Sign, String)> =
            self.groups.iter().map(|g| (Sign::Mark(g.style), g.name.clone())).collect();
        let lines = [(EXACT, "the prediction is right"), (TWICE, "it is off by a factor of two")];
        entries.extend(lines.map(|(stroke, name)| (Sign::Stroke(stroke), name.to_owned())));
        let without = self.points().count() - self.drawn().count();
        if without > 0 {
            entries.push((Sign::None, format!("{without} without a position are not drawn")));
        }
        Legend::new(entries, width)
    }

    fn chart(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()> {
        if self.drawn().next().is_none() {
            return missing(area, frame, self.values.nothing());
        }
        let all = || self.drawn().flat_map(|p| [p.measured, p.predicted].into_iter().chain(p.ends()));
        let (name, unit) = match self.values {
            Values::TimesNs => time_unit(all()),
            Values::CrossoversObjects => ("objects", 1.0),
        };
        let axis = Axis::log(all().map(|v| v / unit), 1.5);
        let chart = Chart::new(area, frame, axis.clone(), axis);
        let [x_name, y_name] = ["measured", "predicted"].map(|what| self.values.axis_name(what, name));
        chart.grid(title, &x_name, &y_name)?;
        chart.factors(&[(0.5, TWICE), (1.0, EXACT), (2.0, TWICE)])?;
        for group in &self.groups {
            let (shape, colour) = (style::mark(group.style), style::colour(group.style));
            for p in group.points.iter().filter(|p| p.is_drawn()) {
                let (measured, predicted, [low, high]) = (p.measured / unit, p.predicted / unit, p.ends());
                chart.flat_bar(predicted, low / unit, high / unit, Stroke::solid(colour, 1))?;
                chart.mark(measured, predicted, shape, colour, self.values.mark_size())?;
            }
        }
        Ok(())
    }
}

impl Figure for Agreement {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH, CHART.max(self.legend(WIDTH as i32 - CHART - 2 * GAP).height() + 2 * GAP) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let frame = Frame { left: 0, top: 0, right: CHART, bottom: CHART }.within(LEFT, GAP, RIGHT, BELOW);
        if self.drawn().next().is_none() {
            return self.chart(area, Frame { right: WIDTH as i32 - GAP, ..frame }, "");
        }
        self.chart(area, frame, "")?;
        self.legend(WIDTH as i32 - CHART - 2 * GAP).draw(area, (CHART + GAP, GAP))
    }
}
