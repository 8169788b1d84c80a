//! Pictures, as SVG.

mod mark;
mod training;

use crate::simulation::{Course, Outcome};
use plotters::coord::Shift;
use plotters::prelude::*;

pub(crate) use training::training;

/// Width and height of a picture in pixels.
const SIZE: (u32, u32) = (1000, 720);

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008); black is kept for the adaptive module.
const COLOURS: [RGBColor; 7] = [
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(150, 150, 150),
];

/// The paper's Figure 8: cost of every fixed algorithm in colour, of the adaptive module in black, what it chose as a band
/// below, and the number of objects at the bottom.
///
/// # Errors
/// When the picture can't be drawn.
pub(crate) fn simulation(course: &Course, outcome: &Outcome) -> anyhow::Result<String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let (upper, lower) = root.split_vertically(SIZE.1 * 7 / 10);
        costs(&upper, course, outcome)?;
        objects(&lower, outcome)?;
        root.present()?;
    }
    Ok(svg)
}

fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

fn costs<D>(area: &DrawingArea<D, Shift>, course: &Course, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let times = || outcome.frames.iter().flat_map(|f| f.fixed_ns.iter().chain([&f.adaptive_ns]));
    // Infinite where an algorithm had left the course.
    let times = || times().filter(|ns| ns.is_finite()).map(|ns| ns / 1e3);
    let low = times().fold(f64::INFINITY, f64::min);
    let high = times().fold(0.0, f64::max);
    // Room for the band below the lowest curve.
    let floor = low / 3.0;
    let caption = format!(
        "{}, {} repeats, regret {:.1} %, {} switches",
        course.scenario,
        outcome.repeats,
        outcome.regret() * 100.0,
        outcome.switches()
    );
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 20))
        .margin(10)
        .set_label_area_size(LabelAreaPosition::Left, 80)
        .set_label_area_size(LabelAreaPosition::Bottom, 30)
        .build_cartesian_2d(0..outcome.frames.len(), (floor..high * 1.5).log_scale())?;
    chart
        .configure_mesh()
        .y_desc("time of a frame (us)")
        .light_line_style(WHITE)
        .y_label_formatter(&|us| microseconds(*us))
        .draw()?;
    for (k, id) in outcome.fixed.iter().enumerate() {
        let line = outcome.frames.iter().enumerate().map(|(at, f)| (at, f.fixed_ns[k] / 1e3));
        let line = line.filter(|(_, us)| us.is_finite());
        chart
            .draw_series(LineSeries::new(line, colour(k).stroke_width(2)))?
            .label(id.to_string())
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 16, y + 5)], colour(k).filled()));
        let bands = outcome.frames.iter().enumerate().filter(|(_, f)| f.chosen == Some(k));
        chart.draw_series(bands.map(|(at, _)| Rectangle::new([(at, floor), (at + 1, floor * 1.6)], colour(k).filled())))?;
    }
    let line = outcome.frames.iter().enumerate().map(|(at, f)| (at, f.adaptive_ns / 1e3));
    chart
        .draw_series(LineSeries::new(line, BLACK.stroke_width(2)))?
        .label("adaptive (band: its choice)")
        .legend(|(x, y)| Rectangle::new([(x, y - 1), (x + 16, y + 1)], BLACK.filled()));
    legend(&mut chart, SeriesLabelPosition::UpperLeft)
}

/// Draws the names of the series of a chart.
fn legend<'a, D, C>(chart: &mut ChartContext<'a, D, C>, position: SeriesLabelPosition) -> anyhow::Result<()>
where
    D: DrawingBackend + 'a,
    D::ErrorType: 'static,
    C: CoordTranslate,
{
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(180, 180, 180))
        .draw()?;
    Ok(())
}

fn objects<D>(area: &DrawingArea<D, Shift>, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let counts = || outcome.frames.iter().map(|f| f.objects.max(1) as f64);
    let (low, high) = (counts().fold(f64::INFINITY, f64::min), counts().fold(1.0, f64::max));
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .set_label_area_size(LabelAreaPosition::Left, 80)
        .set_label_area_size(LabelAreaPosition::Bottom, 40)
        .build_cartesian_2d(0..outcome.frames.len(), (low / 1.2..high * 1.2).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("frame")
        .y_desc("objects")
        .light_line_style(WHITE)
        .y_label_formatter(&|n| format!("{n:.0}"))
        .draw()?;
    let line = outcome.frames.iter().enumerate().map(|(at, f)| (at, f.objects.max(1) as f64));
    chart.draw_series(LineSeries::new(line, RGBColor(90, 90, 90).stroke_width(2)))?;
    Ok(())
}

/// A label that needs no exponent.
fn microseconds(us: f64) -> String {
    if us < 1.0 { format!("{us:.2}") } else { format!("{us:.0}") }
}
