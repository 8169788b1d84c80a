//! Figures as SVG, drawn by plotters from plain data.

mod curves;
mod map;
mod ratios;
mod replay;

use anyhow::Result;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub(crate) use curves::{Curve, CurvePanel, Curves, Field};
pub(crate) use map::{Cell, FieldMap, MapPanel};
pub(crate) use ratios::Ratios;
pub use replay::Replay;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Pixels of the title, of a line of text, and of the names at the right.
const HEAD: u32 = 40;
const LINE: u32 = 20;
const NAMES: u32 = 230;
/// Size of letters, as plotters counts it: 1.24 em.
const LETTERS: u32 = 15;

/// Okabe and Ito's colours, which colour-blind readers can distinguish, then four more. Black is for the choice.
const COLOURS: [RGBColor; 11] = [
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(220, 205, 50),
    RGBColor(120, 94, 240),
    RGBColor(140, 90, 40),
    RGBColor(160, 40, 90),
    RGBColor(150, 150, 150),
];

/// Returns the colour of the series at a position.
fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

/// Replaces characters that an SVG can't hold or that turn the direction of the text after them.
pub(crate) fn plain(text: &str) -> String {
    let turns = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().map(|c| if c.is_control() || turns(c) { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

fn style(h: HPos, v: VPos) -> TextStyle<'static> {
    ("sans-serif", LETTERS).into_font().color(&BLACK).pos(Pos::new(h, v))
}

/// Draws a text at a place in pixels.
fn text(area: &Area<'_>, text: &str, at: (i32, i32), h: HPos) -> Result<()> {
    Ok(area.draw(&Text::new(plain(text), at, style(h, VPos::Center)))?)
}

/// Draws an SVG of this width and height, with a title above and the names of the colours at the right.
///
/// # Errors
/// When `content` fails or plotters does.
fn svg(
    (width, height): (u32, u32),
    title: &str,
    names: &[String],
    content: impl FnOnce(&Area<'_>) -> Result<()>,
) -> Result<String> {
    let mut file = String::new();
    let height = (height + HEAD).max(HEAD + LINE * (names.len() as u32 + 1));
    let root = SVGBackend::with_string(&mut file, (width, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, rest) = root.split_vertically(HEAD);
    let large = ("sans-serif", LETTERS + 5).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    head.draw(&Text::new(plain(title), (12, HEAD as i32 / 2), large))?;
    let (body, legend) = rest.split_horizontally(if names.is_empty() { width } else { width - NAMES });
    content(&body)?;
    for (k, name) in names.iter().enumerate() {
        let y = (LINE * (k as u32 + 1)) as i32;
        legend.draw(&Rectangle::new([(8, y - 6), (26, y + 6)], colour(k).filled()))?;
        text(&legend, name, (34, y), HPos::Left)?;
    }
    root.present()?;
    drop((root, head, rest, body, legend));
    Ok(file)
}

/// Draws the grid with its numbers and the names of both axes.
fn mesh<'a, X, Y>(chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>, x: &str, y: &str) -> Result<()>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT).bold_line_style(BLACK.mix(0.15)).x_desc(x).y_desc(y);
    mesh.label_style(style(HPos::Left, VPos::Top)).axis_desc_style(style(HPos::Left, VPos::Top));
    Ok(mesh.x_labels(7).y_labels(8).x_label_formatter(&tick).y_label_formatter(&tick).draw()?)
}

/// Returns the smallest range that holds all values above zero, widened by a factor at both ends.
fn range(values: impl Iterator<Item = f64>, wider: f64) -> std::ops::Range<f64> {
    let known = values.filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = known.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    if low <= high { low / wider..high * wider } else { 0.1..10.0 }
}

/// Returns a logarithmic axis with numbers at powers of ten, or at powers of 2 or √2 over a short range.
fn log(range: std::ops::Range<f64>) -> LogCoord<f64> {
    let base = match range.end / range.start {
        ratio if ratio < 5.0 => std::f64::consts::SQRT_2,
        ratio if ratio < 100.0 => 2.0,
        _ => 10.0,
    };
    range.log_scale().base(base).into()
}

/// Formats a number on an axis: `100 000`, `0.01`.
fn tick(value: &f64) -> String {
    let rounded = |fine: f64| format!("{}", (value * fine).round() / fine);
    match *value {
        v if v >= 1000.0 => crate::text::grouped(v as u64),
        v if v >= 1.0 => rounded(100.0),
        _ => rounded(1e6),
    }
}

/// Prepares a chart with its title above and room for the numbers on both axes.
fn chart<'a, 'b>(area: &'a Area<'b>, title: &str) -> Result<ChartBuilder<'a, 'b, SVGBackend<'b>>> {
    text(area, title, (76, 10), HPos::Left)?;
    let mut chart = ChartBuilder::on(area);
    // Without a margin at the left the name of the axis loses its edge.
    chart.margin_top(22).margin_right(16).margin_left(6).x_label_area_size(44).y_label_area_size(70);
    Ok(chart)
}

/// Returns areas for this number of panels, in rows of up to three.
fn panels<'a>(area: &Area<'a>, count: usize) -> Vec<Area<'a>> {
    area.split_evenly(grid(count))
}

/// Returns the rows and columns of this number of panels.
fn grid(count: usize) -> (usize, usize) {
    let columns = if count == 4 { 2 } else { count.clamp(1, 3) };
    (count.div_ceil(columns).max(1), columns)
}

#[cfg(test)]
mod tests;
