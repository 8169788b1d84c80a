//! The regret on each held-out machine.

use super::Figure;
use super::axis::Axis;
use super::canvas::Area;
use super::chart::{Chart, Frame, Stroke, missing};
use super::legend::{Legend, Sign};
use super::legended::Legended;
use super::style;

/// A regret below this can't be seen on a logarithmic axis: a tenth of a percent.
const LEAST_PERCENT: f64 = 0.1;

/// For each strategy the mean regrets from the least to the most, by itself: at 95 is the 95th percentile.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Regrets {
    pub(crate) title: String,
    /// What was held out: a physical machine, or a profile.
    pub(crate) unit: String,
    pub(crate) strategies: Vec<StrategyRegrets>,
}

/// A way to choose an algorithm.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct StrategyRegrets {
    pub(crate) name: String,
    pub(crate) style: usize,
    /// Of each unit, 0.1 for 10 %.
    pub(crate) regrets: Vec<f64>,
}

/// A regret in percent, no less than what the axis shows.
fn seen(regret: f64) -> f64 {
    // The maximum of no number and a number is the number.
    if regret.is_nan() { f64::NAN } else { (regret * 100.0).max(LEAST_PERCENT) }
}

/// The axis for regrets in percent.
fn percent_axis(seen: impl Iterator<Item = f64>) -> Axis {
    let high = seen.filter(|v| v.is_finite()).fold(1.0, f64::max);
    Axis::log([LEAST_PERCENT / 1.2, high * 1.5], 1.0)
}

const NOTHING: &str = "Nothing was held out: there is one report only.";

impl Legended for Regrets {
    fn legend(&self, width: i32) -> Legend {
        Legend::new(self.strategies.iter().map(|s| (Sign::Curve(s.style), s.name.clone())).collect(), width)
    }

    fn chart(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()> {
        let all = || self.strategies.iter().flat_map(|s| &s.regrets).map(|r| seen(*r));
        if all().next().is_none() {
            return missing(area, frame, NOTHING);
        }
        let chart = Chart::new(area, frame, Axis::linear(0.0, 100.0), percent_axis(all()));
        let x_name = format!("quantile over the held-out {}s (%)", self.unit);
        chart.grid(title, &x_name, &format!("mean regret (%, {LEAST_PERCENT} or less at the bottom)"))?;
        for strategy in &self.strategies {
            let mut regrets = strategy.regrets.clone();
            regrets.sort_by(f64::total_cmp);
            let share = |at: usize| 100.0 * (at as f64 + 0.5) / regrets.len() as f64;
            let points: Vec<(f64, f64)> = regrets.iter().enumerate().map(|(at, r)| (share(at), seen(*r))).collect();
            chart.line(points.iter().copied(), Stroke::of(strategy.style))?;
            for &(x, y) in points.iter().step_by(points.len().div_ceil(20).max(1)) {
                chart.mark(x, y, style::mark(strategy.style), style::colour(strategy.style), 4)?;
            }
        }
        Ok(())
    }
}

impl Figure for Regrets {
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
