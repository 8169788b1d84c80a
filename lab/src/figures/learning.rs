//! The regret by the number of machines in the training.

use super::axis::{Axis, Tick};
use super::chart::{Chart, Frame, Line, missing};
use super::legend::{Legend, Sign};
use super::legended::Legended;
use super::paper::Area;
use super::regrets::{bottom, percent_axis, seen};
use super::style;
use super::{Figure, Tabled, tabled};
use crate::sheet::Sheet;

/// Means with bars over the trainings.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LearningCurve {
    pub(crate) title: String,
    pub(crate) ways: Vec<LearningWay>,
}

/// A way to choose.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LearningWay {
    pub(crate) name: String,
    pub(crate) style: usize,
    /// By the number of machines, ascending.
    pub(crate) points: Vec<LearningPoint>,
}

/// What some trainings on as many machines gave; regrets are 0.1 for 10 %.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct LearningPoint {
    pub(crate) machines: f64,
    pub(crate) mean_regret: f64,
    /// The 5th and the 95th percentile over the trainings.
    pub(crate) low: f64,
    pub(crate) high: f64,
}

const NOTHING: &str = "there are too few machines to train on fewer";

impl LearningCurve {
    fn points(&self) -> impl Iterator<Item = &LearningPoint> {
        self.ways.iter().flat_map(|w| &w.points)
    }
}

impl Legended for LearningCurve {
    fn legend(&self, width: i32) -> Legend {
        Legend::new(self.ways.iter().map(|w| (Sign::Curve(w.style), w.name.clone())).collect(), width)
    }

    fn chart(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()> {
        let mut counts: Vec<f64> = self.points().map(|p| p.machines).filter(|m| m.is_finite() && *m > 0.0).collect();
        counts.sort_by(f64::total_cmp);
        counts.dedup();
        if counts.is_empty() {
            return missing(area, frame, NOTHING);
        }
        let names = counts.iter().map(|&value| Tick { value, label: value.to_string() }).collect();
        let machines = Axis::log(counts.iter().copied(), 1.2).with_names(names);
        let (first, last) = machines.ends();
        let regrets = percent_axis(self.points().flat_map(|p| [p.mean_regret, p.high]).map(seen));
        let chart = Chart::new(area, frame, machines, regrets);
        let x_name = "physical machines in the training (marks beside each other, bars: 90 % of trainings)";
        chart.grid(title, x_name, &format!("mean regret (%, {})", bottom()))?;
        for (place, way) in self.ways.iter().enumerate() {
            let beside = (last / first).powf(0.008 * (place as f64 - (self.ways.len() as f64 - 1.0) / 2.0));
            let colour = style::colour(way.style);
            for p in &way.points {
                chart.bar(p.machines * beside, seen(p.low), seen(p.high), Line::solid(colour, 1))?;
            }
            let means = || way.points.iter().map(|p| (p.machines * beside, seen(p.mean_regret)));
            chart.line(means(), Line::of(way.style))?;
            for (x, y) in means() {
                chart.mark(x, y, style::mark(way.style), colour, 4)?;
            }
        }
        Ok(())
    }
}

impl Figure for LearningCurve {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        self.size_alone()
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        self.draw_alone(area)
    }
}

impl Tabled for LearningCurve {
    fn csv(&self) -> Sheet {
        let row = |way: &LearningWay, p: &LearningPoint| {
            let figures = [p.machines, p.mean_regret, p.low, p.high].map(tabled::figure);
            std::iter::once(tabled::text(&way.name)).chain(figures).collect()
        };
        let rows = self.ways.iter().flat_map(|w| w.points.iter().map(move |p| row(w, p))).collect();
        let columns = [
            ("way to choose", "way"),
            ("machines", "machines"),
            ("mean regret", "mean_regret"),
            ("5th percentile", "low_regret"),
            ("95th percentile", "high_regret"),
        ];
        tabled::sheet(&columns, rows)
    }
}
