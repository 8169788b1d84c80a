//! The map that the paper could not draw: fields of optimal performance over two axes.

use super::Figure;
use super::axis::Axis;
use super::canvas::Area;
use super::chart::{ABOVE, BELOW, Chart, Frame, Hatch, LEFT, RIGHT, fill, hatch, missing};
use super::legend::{Legend, Sign};
use super::mark::Mark;
use super::style::{self, GAP, INK, WIDTH};

/// Panels beside each other, measured beside predicted, over the number of objects and a density.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FieldMap {
    pub(crate) title: String,
    /// Algorithms, each with its position in the study's list of names.
    pub(crate) names: Vec<(String, usize)>,
    /// Range of the number of objects.
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// What the second axis is, with its unit.
    pub(crate) y_name: String,
    pub(crate) panels: Vec<MapPanel>,
}

/// One map.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MapPanel {
    pub(crate) title: String,
    /// The fields, drawn light, behind the points.
    pub(crate) grid: Vec<MapCell>,
    pub(crate) points: Vec<MapPoint>,
}

/// A rectangle of one field.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct MapCell {
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// Position in `FieldMap::names`.
    pub(crate) algorithm: usize,
}

/// A frame, with the algorithm that was fastest in it or was chosen for it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct MapPoint {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Position in `FieldMap::names`.
    pub(crate) algorithm: usize,
    /// Regret of the choice, 0.1 for 10 %; more than that gets a ring.
    pub(crate) loss: Option<f64>,
}

/// A regret over this gets a ring.
const LOSS: f64 = 0.1;
/// Share of the axes that is left at each end, so that no ring is over the numbers.
const MARGIN: f64 = 0.025;
const ALONE: i32 = 480;
const BESIDE: i32 = 400;

impl MapPoint {
    fn is_lossy(&self) -> bool {
        self.loss.is_some_and(|loss| loss > LOSS)
    }
}

/// Cells beside each other in a row, and then rows of the same width below each other, as one: a picture of a fine grid is smaller by far.
fn merged(grid: &[MapCell]) -> Vec<MapCell> {
    let mut cells: Vec<MapCell> = grid.to_vec();
    cells.sort_by(|a, b| (a.y.0.total_cmp(&b.y.0)).then(a.y.1.total_cmp(&b.y.1)).then(a.x.0.total_cmp(&b.x.0)));
    cells.dedup_by(|next, last| {
        let one = last.algorithm == next.algorithm && last.y == next.y && last.x.1 == next.x.0;
        if one {
            last.x.1 = next.x.1;
        }
        one
    });
    cells.sort_by(|a, b| (a.x.0.total_cmp(&b.x.0)).then(a.x.1.total_cmp(&b.x.1)).then(a.y.0.total_cmp(&b.y.0)));
    cells.dedup_by(|next, last| {
        let one = last.algorithm == next.algorithm && last.x == next.x && last.y.1 == next.y.0;
        if one {
            last.y.1 = next.y.1;
        }
        one
    });
    cells
}

impl FieldMap {
    fn legend(&self) -> Legend {
        let mut entries: Vec<(Sign, String)> =
            self.names.iter().map(|(name, style)| (Sign::Field(*style), name.clone())).collect();
        if self.panels.iter().flat_map(|p| &p.points).any(MapPoint::is_lossy) {
            entries.push((Sign::Ring, format!("regret over {} %", 100.0 * LOSS)));
        }
        Legend::new(entries, WIDTH as i32 - 2 * GAP)
    }

    fn style(&self, algorithm: usize) -> Option<usize> {
        self.names.get(algorithm).map(|name| name.1)
    }

    fn panel(&self, area: &Area<'_>, frame: Frame, panel: &MapPanel) -> anyhow::Result<()> {
        let points = || self.panels.iter().flat_map(|p| &p.points);
        let axes = (
            Axis::log(points().map(|p| p.x).chain([self.x.0, self.x.1]), 1.0).wider(MARGIN),
            Axis::log(points().map(|p| p.y).chain([self.y.0, self.y.1]), 1.0).wider(MARGIN),
        );
        let chart = Chart::new(area, frame.within(LEFT, ABOVE, RIGHT, BELOW), axes.0, axes.1);
        if panel.grid.is_empty() && panel.points.is_empty() {
            return chart.missing(&format!("{}: {NOTHING}", panel.title));
        }
        chart.grid(&panel.title, "objects", &self.y_name)?;
        for cell in merged(&panel.grid) {
            let shaded = chart.rectangle(cell.x, cell.y).zip(self.style(cell.algorithm));
            let Some((shaded, style)) = shaded else { continue };
            fill(area, shaded, style::colour(style), 1.5 * style::FIELD)?;
            hatch(area, shaded, Hatch::of(style), style::colour(style))?;
        }
        chart.border()?;
        for point in &panel.points {
            let Some(style) = self.style(point.algorithm) else { continue };
            chart.mark(point.x, point.y, Mark::Ground, style::GROUND, 6)?;
            chart.mark(point.x, point.y, style::mark(style), style::colour(style), 4)?;
            if point.is_lossy() {
                chart.mark(point.x, point.y, Mark::Ring, INK, 9)?;
            }
        }
        Ok(())
    }
}

const NOTHING: &str = "no fields are known";

impl Figure for FieldMap {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        let panels = if self.panels.len() < 2 { ALONE } else { self.panels.len().div_ceil(2) as i32 * (BESIDE + GAP) };
        (WIDTH, (panels + GAP + self.legend().height()) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let legend = self.legend();
        let bottom = self.size().1 as i32 - legend.height();
        let whole = Frame { left: 0, top: 0, right: WIDTH as i32, bottom: bottom - GAP };
        if self.panels.is_empty() {
            missing(area, whole.within(GAP, GAP, GAP, GAP), NOTHING)?;
        }
        for (panel, frame) in self.panels.iter().zip(whole.parts(self.panels.len(), self.panels.len().min(2), GAP)) {
            self.panel(area, frame, panel)?;
        }
        legend.draw(area, (GAP, bottom))
    }
}
