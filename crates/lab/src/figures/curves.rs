//! Figures 4, 6 and 7 of Avril, Gouranton and Arnaldi (ISVRI 2011): the time of a frame over the number of objects, with the fields of
//! optimal performance shaded.

use super::axis::{Axis, time_unit};
use super::canvas::Area;
use super::chart::{ABOVE, BELOW, Chart, Frame, Hatch, LEFT, RIGHT, Stroke, fill, hatch, missing, path, words};
use super::legend::{Legend, Sign};
use super::mark::mark;
use super::style::{self, GAP, INK, PANEL, SECONDARY, SMALL, WIDTH};
use super::{Figure, font};
use plotters_backend::text_anchor::{HPos, VPos};

/// One to four panels with the same ranges of both axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Curves {
    pub(crate) title: String,
    pub(crate) panels: Vec<CurvePanel>,
}

/// The curves of one machine or class of processors.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct CurvePanel {
    pub(crate) title: String,
    pub(crate) series: Vec<Curve>,
    pub(crate) fields: Vec<Band>,
    pub(crate) crossovers: Vec<CrossoverLine>,
}

/// One algorithm.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Curve {
    pub(crate) name: String,
    /// Position in the study's list of names, which decides colour, mark and dashes.
    pub(crate) style: usize,
    pub(crate) points: Vec<CurvePoint>,
}

/// The time of a frame at one number of objects.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CurvePoint {
    pub(crate) objects: f64,
    pub(crate) ns: f64,
    /// Quartiles, drawn as a bar.
    pub(crate) low_ns: f64,
    pub(crate) high_ns: f64,
}

/// A field of optimal performance.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Band {
    /// Numbers of objects; the ends may be infinite.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Of its algorithm.
    pub(crate) style: usize,
    pub(crate) name: String,
}

/// Where the next algorithm becomes the fastest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CrossoverLine {
    pub(crate) objects: f64,
    /// The interval of it.
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Height of the row of fields above a panel.
const STRIP: i32 = 20;
/// Height of a panel that has the width for itself, and of one beside others.
const ALONE: i32 = 470;
const BESIDE: i32 = 360;

impl Curves {
    fn rows(&self) -> i32 {
        self.panels.len().div_ceil(2).max(1) as i32
    }

    fn legend(&self) -> Legend {
        let curves = self.panels.iter().flat_map(|p| &p.series).map(|c| (c.style, &c.name, true));
        let fields = self.panels.iter().flat_map(|p| &p.fields).map(|b| (b.style, &b.name, false));
        let mut names: Vec<(usize, &String, bool)> = curves.chain(fields).collect();
        // Of a name that has both, the curve is first and stays.
        names.sort_by_key(|&(style, name, curve)| (style, name, !curve));
        names.dedup_by_key(|&mut (style, name, _)| (style, name));
        let sign = |(style, name, curve): (usize, &String, bool)| {
            (if curve { Sign::Curve(style) } else { Sign::Mark(style) }, name.clone())
        };
        let mut entries: Vec<(Sign, String)> = names.into_iter().map(sign).collect();
        if self.panels.iter().any(|p| !p.crossovers.is_empty()) {
            entries.push((Sign::Interval(CROSSOVER), "crossover, with its 90 % interval".to_owned()));
        }
        Legend::new(entries, WIDTH as i32 - 2 * GAP)
    }

    fn points(&self) -> impl Iterator<Item = &CurvePoint> {
        self.panels.iter().flat_map(|p| &p.series).flat_map(|c| &c.points)
    }
}

/// The line at a crossover.
const CROSSOVER: Stroke = Stroke::dashed(INK, 1);

impl CurvePanel {
    fn draw(&self, area: &Area<'_>, frame: Frame, axes: &(Axis, Axis), unit: (&str, f64)) -> anyhow::Result<()> {
        let strip = if self.fields.is_empty() { 0 } else { STRIP };
        let chart = Chart::new(area, frame.within(LEFT, ABOVE + strip, RIGHT, BELOW), axes.0.clone(), axes.1.clone());
        let drawn = |p: &CurvePoint| chart.place(p.objects, p.ns / unit.1).is_some();
        if !self.series.iter().flat_map(|s| &s.points).any(drawn) {
            let sentence =
                if self.title.is_empty() { NOTHING.to_owned() } else { format!("{}: {NOTHING}", self.title) };
            return chart.missing(&sentence);
        }
        for field in &self.fields {
            if let Some(shaded) = chart.rectangle((field.from, field.to), (0.0, f64::INFINITY)) {
                fill(area, shaded, style::colour(field.style), style::FIELD)?;
            }
        }
        for crossover in &self.crossovers {
            if let Some(shaded) = chart.rectangle((crossover.low, crossover.high), (0.0, f64::INFINITY)) {
                hatch(area, shaded, Hatch::Interval, SECONDARY)?;
            }
        }
        chart.grid("", "objects", &format!("time of a frame ({})", unit.0))?;
        for field in &self.fields {
            field.name(area, &chart)?;
        }
        for crossover in &self.crossovers {
            chart.upright(crossover.objects, CROSSOVER)?;
        }
        for curve in &self.series {
            let points: Vec<CurvePoint> = curve.points.iter().copied().filter(drawn).collect();
            let colour = style::colour(curve.style);
            for p in &points {
                chart.bar(p.objects, p.low_ns / unit.1, p.high_ns / unit.1, Stroke::solid(colour, 1))?;
            }
            chart.line(points.iter().map(|p| (p.objects, p.ns / unit.1)), Stroke::of(curve.style))?;
            for p in &points {
                chart.mark(p.objects, p.ns / unit.1, style::mark(curve.style), colour, 4)?;
            }
        }
        let title = font::wrapped(&self.title, PANEL, chart.frame.width(), 1).concat();
        let place = (chart.frame.left, chart.frame.top - strip - 8);
        words(area, &title, place, PANEL, INK, HPos::Left, VPos::Bottom)
    }
}

impl Band {
    /// The name in the row above; where it is too narrow for that, the mark that the legend explains.
    fn name(&self, area: &Area<'_>, chart: &Chart<'_, '_>) -> anyhow::Result<()> {
        let Some(below) = chart.rectangle((self.from, self.to), (0.0, f64::INFINITY)) else { return Ok(()) };
        let (top, bottom) = (chart.frame.top - STRIP, chart.frame.top);
        let frame = Frame { top, bottom, ..below };
        fill(area, frame, style::colour(self.style), 2.0 * style::FIELD)?;
        let sides = [(frame.left, bottom), (frame.left, top), (frame.right, top), (frame.right, bottom)];
        path(area, &sides, Stroke::solid(SECONDARY, 1))?;
        let place = ((frame.left + frame.right) / 2, (top + bottom) / 2);
        if font::width(&self.name, SMALL) + 6 <= frame.width() {
            return words(area, &self.name, place, SMALL, INK, HPos::Center, VPos::Center);
        }
        if frame.width() >= 12 {
            area.draw(&mark(place, style::mark(self.style), INK, 4))?;
        }
        Ok(())
    }
}

const NOTHING: &str = "no times were measured";

impl Figure for Curves {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> (u32, u32) {
        let panels = if self.panels.len() < 2 { ALONE } else { self.rows() * (BESIDE + GAP) };
        (WIDTH, (panels + GAP + self.legend().height()) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let legend = self.legend();
        let (width, height) = (WIDTH as i32, self.size().1 as i32 - legend.height());
        let whole = Frame { left: 0, top: 0, right: width, bottom: height - GAP };
        if self.panels.is_empty() {
            return missing(area, whole.within(GAP, GAP, GAP, GAP), NOTHING);
        }
        let ns = || self.points().flat_map(|p| [p.ns, p.low_ns, p.high_ns]);
        let unit = time_unit(ns());
        let objects = self.points().map(|p| p.objects);
        let crossovers = self.panels.iter().flat_map(|p| &p.crossovers).map(|b| b.objects);
        let axes = (Axis::log(objects.chain(crossovers), 1.15), Axis::log(ns().map(|ns| ns / unit.1), 1.3));
        let columns = self.panels.len().min(2);
        for (panel, frame) in self.panels.iter().zip(whole.parts(self.panels.len(), columns, GAP)) {
            panel.draw(area, frame, &axes, unit)?;
        }
        legend.draw(area, (GAP, height))
    }
}
