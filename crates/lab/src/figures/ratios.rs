//! Figures 10 and 11 of Avril, Gouranton and Arnaldi (ISVRI 2011): each hardware parameter as a ratio to a reference machine, beside the
//! speed-up of each algorithm.

use super::axis::Axis;
use super::canvas::Area;
use super::chart::{BELOW, Chart, Frame, RIGHT, Stroke, fill, missing, path, words};
use super::legend::{Legend, Sign};
use super::style::{self, GAP, GRID, GROUND, INK, LABEL, PANEL, SECONDARY, WIDTH, line_height};
use super::{Figure, font};
use plotters_backend::text_anchor::{HPos, VPos};

/// A row for each parameter and each algorithm, a mark for each machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Ratios {
    pub(crate) title: String,
    /// Name of the machine that the ratios are to.
    pub(crate) reference: String,
    /// The others: their positions decide colours and marks.
    pub(crate) machines: Vec<String>,
    pub(crate) groups: Vec<RatioGroup>,
}

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RatioGroup {
    pub(crate) name: String,
    pub(crate) kind: RatioKind,
    /// One for each machine, `None` where one of the two values is missing.
    pub(crate) values: Vec<Option<RatioValue>>,
}

/// What a ratio is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RatioKind {
    /// The value of a hardware parameter over that of the reference.
    Parameter,
    /// The time of an algorithm on the reference over that on the machine.
    Algorithm,
}

/// A ratio with its interval.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RatioValue {
    pub(crate) ratio: f64,
    pub(crate) low: Option<f64>,
    pub(crate) high: Option<f64>,
}

/// Height of the line above each of the two parts.
const HEAD: i32 = line_height(PANEL) + 10;
/// Height for each machine in a row.
const MARK: i32 = 11;
/// Room for the numbers above the chart.
const NUMBERS: i32 = 26;
/// The longest name of a row is cut to this width.
const NAMES: i32 = 330;

impl RatioGroup {
    /// The ratio for a machine, where there is one that has a place on a logarithmic axis.
    fn of(&self, machine: usize) -> Option<RatioValue> {
        self.values.get(machine).copied().flatten().filter(|v| v.ratio.is_finite() && v.ratio > 0.0)
    }
}

impl Ratios {
    /// The two parts with their headings, without one that has no rows.
    fn parts(&self) -> Vec<(&'static str, Vec<&RatioGroup>)> {
        let of = |kind| self.groups.iter().filter(|g| g.kind == kind).collect::<Vec<_>>();
        let parts = [
            ("Hardware parameters: value over that of the reference", of(RatioKind::Parameter)),
            ("Algorithms: speed-up over the reference", of(RatioKind::Algorithm)),
        ];
        parts.into_iter().filter(|(_, groups)| !groups.is_empty()).collect()
    }

    fn row_height(&self) -> i32 {
        (self.machines.len() as i32 * MARK + 8).max(line_height(LABEL) + 6)
    }

    fn chart_height(&self) -> i32 {
        self.parts().len() as i32 * HEAD + self.groups.len() as i32 * self.row_height()
    }

    fn values(&self) -> impl Iterator<Item = RatioValue> {
        self.groups.iter().flat_map(|g| (0..self.machines.len()).filter_map(|k| g.of(k)))
    }

    fn legend(&self) -> Legend {
        let mut entries: Vec<(Sign, String)> =
            self.machines.iter().enumerate().map(|(k, name)| (Sign::Mark(k), name.clone())).collect();
        entries.push((Sign::Stroke(REFERENCE), format!("{} (the reference)", self.reference)));
        if self.groups.iter().any(|g| (0..self.machines.len()).any(|k| g.of(k).is_none())) {
            entries.push((Sign::None, "no mark: a value is missing".to_owned()));
        }
        Legend::new(entries, WIDTH as i32 - 2 * GAP)
    }

    fn row(&self, area: &Area<'_>, chart: &Chart<'_, '_>, group: &RatioGroup, top: i32) -> anyhow::Result<()> {
        let Frame { left, right, .. } = chart.frame;
        let middle = top + self.row_height() / 2;
        let name = font::wrapped(&group.name, LABEL, left - 2 * GAP, 1).concat();
        words(area, &name, (left - 8, middle), LABEL, INK, HPos::Right, VPos::Center)?;
        path(area, &[(left, top), (right, top)], Stroke::solid(GRID, 1))?;
        if (0..self.machines.len()).all(|k| group.of(k).is_none()) {
            return words(area, "missing", (left + 8, middle), LABEL, SECONDARY, HPos::Left, VPos::Center);
        }
        for k in 0..self.machines.len() {
            let Some(value) = group.of(k) else { continue };
            let y = middle + (2 * k as i32 + 1 - self.machines.len() as i32) * MARK / 2;
            // The chart counts from below.
            let y = f64::from(chart.frame.bottom - y);
            let colour = style::colour(k);
            if let (Some(low), Some(high)) = (value.low, value.high) {
                chart.flat_bar(y, low, high, Stroke::solid(colour, 1))?;
            }
            chart.mark(value.ratio, y, style::mark(k), colour, 4)?;
        }
        Ok(())
    }
}

/// The line at one.
const REFERENCE: Stroke = Stroke::solid(INK, 2);

const NOTHING: &str = "there is no parameter and no algorithm that two machines have in common";

impl Figure for Ratios {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        let chart = if self.values().next().is_none() { 160 } else { NUMBERS + self.chart_height() + BELOW };
        (WIDTH, (chart + GAP + self.legend().height()) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let legend = self.legend();
        let bottom = self.size().1 as i32 - legend.height() - GAP;
        legend.draw(area, (GAP, bottom + GAP))?;
        let whole = Frame { left: GAP, top: 0, right: WIDTH as i32 - GAP, bottom };
        if self.values().next().is_none() {
            return missing(area, whole, NOTHING);
        }
        let names = self.groups.iter().map(|g| font::width(&g.name, LABEL)).max().unwrap_or(0).min(NAMES);
        let height = self.chart_height();
        let frame = whole.within(names + GAP, NUMBERS, RIGHT - GAP, BELOW);
        let shown = self.values().flat_map(|v| [Some(v.ratio), v.low, v.high]).flatten();
        // Names instead of numbers: rows have theirs.
        let rows = Axis::linear(0.0, f64::from(height)).with_names(Vec::new());
        let chart = Chart::new(area, frame, Axis::log(shown.chain([1.0]), 1.2), rows);
        chart.grid("", &format!("times the reference ({})", self.reference), "")?;
        chart.numbers_above()?;
        chart.upright(1.0, REFERENCE)?;
        let mut top = frame.top;
        for (heading, groups) in self.parts() {
            let ground = Frame { left: whole.left, top, bottom: top + HEAD, right: frame.right };
            fill(area, ground, GROUND, 1.0)?;
            fill(area, ground, GRID, 0.5)?;
            let place = (whole.left + 6, top + HEAD / 2);
            words(area, heading, place, PANEL, INK, HPos::Left, VPos::Center)?;
            top += HEAD;
            for group in groups {
                self.row(area, &chart, group, top)?;
                top += self.row_height();
            }
        }
        Ok(())
    }
}
