//! Boxes over ranks: halo, imbalance and weak scaling over the number of ranks.

use super::Figure;
use super::axis::Axis;
use super::canvas::Area;
use super::chart::{ABOVE, BELOW, Chart, Frame, LEFT, RIGHT, Stroke};
use super::legend::{Legend, Sign};
use super::style::{self, GAP, WIDTH};
use crate::ranks::RanksRow;

/// Height of a panel.
const PANEL: i32 = 360;

/// The table of simulated ranks as a picture: a line for each scenario and number of boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct RanksPicture {
    rows: Vec<RanksRow>,
}

/// One panel: its title, the name of its axis, and the value of a row.
type Panel = (&'static str, &'static str, fn(&RanksRow) -> f64);

const PANELS: [Panel; 4] = [
    ("Searched twice", "halo (% of the boxes)", |row| 100.0 * row.halo_share),
    ("Imbalance of the boxes", "most over mean (%)", |row| 100.0 * (row.searched_most_over_mean - 1.0)),
    ("Imbalance of the predicted time", "slowest over mean (%)", |row| 100.0 * (row.slowest_over_mean - 1.0)),
    ("Weak scaling, with the exchange", "efficiency (%)", |row| 100.0 * row.efficiency),
];

impl RanksPicture {
    /// The picture of these rows.
    #[must_use]
    pub fn new(rows: &[RanksRow]) -> Self {
        Self { rows: rows.to_vec() }
    }

    /// Scenario and number of boxes of each line.
    fn series(&self) -> Vec<(&str, u64)> {
        let mut series: Vec<(&str, u64)> = Vec::new();
        for row in &self.rows {
            if !series.contains(&(&*row.scenario, row.boxes)) {
                series.push((&row.scenario, row.boxes));
            }
        }
        series
    }

    fn legend(&self) -> Legend {
        let name = |(k, (scenario, boxes)): (usize, (&str, u64))| {
            (Sign::Curve(k), format!("{scenario}, {} M boxes", boxes >> 20))
        };
        Legend::new(self.series().into_iter().enumerate().map(name).collect(), WIDTH as i32 - 2 * GAP)
    }

    fn panel(&self, area: &Area<'_>, frame: Frame, (title, name, value): Panel) -> anyhow::Result<()> {
        let ranks = |row: &RanksRow| row.ranks as f64;
        let most = self.rows.iter().map(value).filter(|v| v.is_finite()).fold(1.0, f64::max);
        let axes = (Axis::log(self.rows.iter().map(ranks), 1.2), Axis::linear(0.0, 1.1 * most));
        let chart = Chart::new(area, frame.within(LEFT, ABOVE, RIGHT, BELOW), axes.0, axes.1);
        if self.rows.is_empty() {
            return chart.missing("no ranks were counted");
        }
        chart.grid(title, "ranks", name)?;
        for (k, (scenario, boxes)) in self.series().into_iter().enumerate() {
            let points = || {
                self.rows.iter().filter(|r| r.scenario == scenario && r.boxes == boxes).map(|r| (ranks(r), value(r)))
            };
            chart.line(points(), Stroke::of(k))?;
            for (x, y) in points() {
                chart.mark(x, y, style::mark(k), style::colour(k), 4)?;
            }
        }
        Ok(())
    }
}

impl Figure for RanksPicture {
    fn title(&self) -> &str {
        "Boxes over simulated ranks"
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH, (2 * PANEL + GAP + self.legend().height()) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let (width, height) = (WIDTH as i32, 2 * PANEL);
        let frames = Frame { left: 0, top: 0, right: width, bottom: height }.parts(4, 2, 0);
        for (frame, panel) in frames.into_iter().zip(PANELS) {
            self.panel(area, frame, panel)?;
        }
        self.legend().draw(area, (GAP, height + GAP / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::Picture;

    #[test]
    fn every_scenario_and_size_is_drawn_and_no_rows_are_told() {
        let row = |scenario: &str, ranks| RanksRow {
            scenario: scenario.to_owned(),
            boxes: 4 << 20,
            ranks,
            searched_most_over_mean: 1.1,
            slowest_over_mean: 1.05,
            efficiency: 0.9,
            ..RanksRow::default()
        };
        let draw =
            |rows: &[RanksRow]| String::from_utf8(RanksPicture::new(rows).draw(Picture::Svg, &[]).unwrap()).unwrap();
        let svg = draw(&[row("uniform", 2), row("uniform", 64), row("clustered", 64)]);
        assert!(
            svg.contains("uniform, 4 M boxes") && svg.contains("clustered, 4 M boxes") && svg.contains("Weak scaling")
        );
        assert!(draw(&[]).contains("no ranks were counted"));
    }
}
