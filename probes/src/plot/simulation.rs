//! Figure 8 of Avril, Gouranton and Arnaldi (ISVRI 2011): what each number of GPUs and of cores costs, and what was chosen.

use super::{Picture, colour};
use crate::simulation::{Course, Outcome};
use plotters::coord::Shift;
use plotters::prelude::*;
use sapwise::{AlgorithmId, BackendClass};

/// Width and height. Here and below lengths are in units: pixels of an SVG, which a viewer scales.
const SIZE: (u32, u32) = (1500, 1034);
/// Pixels of a PNG in a unit: with one, letters have too few to be read with ease.
const PNG_UNIT: u32 = 2;
/// Height of the lines of text below, and of each chart of a panel; the objects have the rest.
const CAPTION: u32 = 108;
/// Letters that fit into a line of it.
const LETTERS: usize = 200;
const COSTS: u32 = 520;
const CHOICES: u32 = 190;
/// Room beside the left axis of every chart, so that their frames stand below each other.
const AXIS: u32 = 96;
/// Points of a curve at most: more can't be seen, and make an SVG of megabytes.
const POINTS: usize = 1200;

type Area<D> = DrawingArea<D, Shift>;
/// Frames, each with a value.
type Points = Vec<(usize, f64)>;

/// How many pixels a unit has.
#[derive(Debug, Clone, Copy)]
struct Scale(u32);

impl Scale {
    fn length(self, units: u32) -> u32 {
        units * self.0
    }

    fn offset(self, units: i32) -> i32 {
        units * self.0 as i32
    }

    fn font(self, size: u32) -> (&'static str, u32) {
        ("sans-serif", self.length(size))
    }

    fn line(self, colour: RGBAColor, width: u32) -> ShapeStyle {
        colour.stroke_width(self.length(width))
    }
}

/// One panel: a class of processors, and the best fixed algorithm on each number of them.
struct Panel {
    class: BackendClass,
    /// Numbers of GPUs or cores, ascending, each with a position among the fixed algorithms.
    units: Vec<(u32, usize)>,
    /// Whether algorithms of the other class took part.
    other: bool,
}

impl Panel {
    fn new(class: BackendClass, outcome: &Outcome) -> Self {
        let widths = outcome.fixed.iter().map(AlgorithmId::backend).filter(|b| b.class() == class);
        let mut widths: Vec<u32> = widths.map(|b| b.width()).collect();
        widths.sort_unstable();
        widths.dedup();
        let on = |width: u32| move |id: &AlgorithmId| id.backend().class() == class && id.backend().width() == width;
        // One that sat out frames has no total and is no curve.
        let units = widths.into_iter().filter_map(|width| Some((width, outcome.best_of(on(width))?.0))).collect();
        Self { class, units, other: outcome.fixed.iter().any(|id| id.backend().class() != class) }
    }

    /// The position of an algorithm's number of GPUs or cores. `None` for the other class.
    fn unit(&self, id: &AlgorithmId) -> Option<usize> {
        self.units.iter().position(|u| id.backend().class() == self.class && id.backend().width() == u.0)
    }

    /// The row among the choices: those of the numbers in turn, above that of the other class, where there is one.
    fn row(&self, unit: Option<usize>) -> usize {
        unit.map_or(0, |unit| unit + usize::from(self.other))
    }

    /// What the rows are called from the lowest up.
    fn rows(&self) -> Vec<String> {
        let other = match self.class {
            BackendClass::Cpu => "a GPU",
            BackendClass::Gpu => "the CPU",
        };
        let other = self.other.then(|| other.to_owned());
        let events = ["explored", "switches"].map(str::to_owned);
        other.into_iter().chain(self.units.iter().map(|u| self.name(u.0))).chain(events).collect()
    }

    fn name(&self, width: u32) -> String {
        let (one, many) = match self.class {
            BackendClass::Cpu => ("core", "cores"),
            BackendClass::Gpu => ("GPU", "GPUs"),
        };
        format!("{width} {}", if width == 1 { one } else { many })
    }

    fn title(&self) -> &'static str {
        match self.class {
            BackendClass::Cpu => "Cores",
            BackendClass::Gpu => "GPUs",
        }
    }
}

/// Two panels, GPUs on the left and cores on the right: above the time of the best fixed algorithm on each number of them in colour and that
/// of the adaptive module in black, then what it chose, and the number of objects below. `told` are the lines of the caption.
///
/// # Errors
/// When the picture can't be drawn.
pub(crate) fn simulation(picture: Picture, course: &Course, outcome: &Outcome, told: &[String]) -> anyhow::Result<Vec<u8>> {
    Ok(match picture {
        Picture::Svg => super::svg(SIZE, |root| figure(root, Scale(1), course, outcome, told))?.into_bytes(),
        Picture::Png => {
            let scale = Scale(PNG_UNIT);
            let size = (scale.length(SIZE.0), scale.length(SIZE.1));
            super::png(size, |root| figure(root, scale, course, outcome, told))?
        }
    })
}

fn figure<D>(root: &Area<D>, scale: Scale, course: &Course, outcome: &Outcome, told: &[String]) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let (panels, caption) = root.split_vertically(scale.length(SIZE.1 - CAPTION));
    let (left, right) = panels.split_horizontally(scale.length(SIZE.0 / 2));
    panel(&left, scale, &Panel::new(BackendClass::Gpu, outcome), course, outcome)?;
    panel(&right, scale, &Panel::new(BackendClass::Cpu, outcome), course, outcome)?;
    for (k, line) in told.iter().flat_map(|line| wrapped(line)).enumerate() {
        let place = (scale.offset(24), scale.offset(6 + 24 * k as i32));
        caption.draw(&Text::new(line.as_str(), place, scale.font(17).into_font()))?;
    }
    Ok(())
}

/// The words of a text in lines that fit.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.len() - 1;
        if lines[last].is_empty() {
            lines[last].push_str(word);
        } else if lines[last].chars().count() + 1 + word.chars().count() <= LETTERS {
            lines[last].push(' ');
            lines[last].push_str(word);
        } else {
            lines.push(format!("    {word}"));
        }
    }
    lines
}

fn panel<D>(area: &Area<D>, scale: Scale, panel: &Panel, course: &Course, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    if panel.units.is_empty() {
        let text = match panel.class {
            BackendClass::Gpu => "no GPU algorithm ran here",
            BackendClass::Cpu => "no algorithm ran on the CPU",
        };
        let margin = scale.length(10);
        let area = area.margin(margin, margin, margin, margin).titled(panel.title(), scale.font(22))?;
        let (width, height) = area.dim_in_pixel();
        let style = scale.font(20).into_font().color(&RGBColor(90, 90, 90));
        area.draw(&Text::new(text, (width as i32 / 2 - scale.offset(120), height as i32 / 2), style))?;
        return Ok(());
    }
    let (upper, lower) = area.split_vertically(scale.length(COSTS));
    let (middle, lower) = lower.split_vertically(scale.length(CHOICES));
    costs(&upper, scale, panel, course, outcome)?;
    choices(&middle, scale, panel, outcome)?;
    objects(&lower, scale, outcome)
}

/// Means over equal numbers of frames, few enough to be seen, each at its first frame. Infinite times are left out.
fn curve(values: impl Iterator<Item = f64>, frames: usize) -> Points {
    let step = frames.div_ceil(POINTS).max(1);
    let values: Vec<f64> = values.collect();
    let mean = |(k, chunk): (usize, &[f64])| {
        let ran: Vec<f64> = chunk.iter().copied().filter(|v| v.is_finite()).collect();
        (!ran.is_empty()).then(|| (k * step, ran.iter().sum::<f64>() / ran.len() as f64))
    };
    values.chunks(step).enumerate().filter_map(mean).collect()
}

fn costs<D>(area: &Area<D>, scale: Scale, panel: &Panel, course: &Course, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let count = outcome.frames.len();
    let of = |k: usize| curve(outcome.frames.iter().map(|f| f.fixed_ns[k] / 1e3), count);
    let adaptive = curve(outcome.frames.iter().map(|f| f.adaptive_ns / 1e3), count);
    let curves: Vec<(u32, usize, Points)> = panel.units.iter().map(|&(width, k)| (width, k, of(k))).collect();
    let all = || curves.iter().flat_map(|c| &c.2).chain(&adaptive).map(|point| point.1);
    let floor = all().fold(f64::INFINITY, f64::min) / 1.5;
    // Room for the names above the highest curve.
    let high = all().fold(0.0, f64::max) * 4.0;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{} ({})", panel.title(), course.footage.name()), scale.font(22))
        .margin(scale.length(10))
        .set_label_area_size(LabelAreaPosition::Left, scale.length(AXIS))
        .set_label_area_size(LabelAreaPosition::Bottom, scale.length(30))
        .build_cartesian_2d(0..count.max(1), (floor..high).log_scale())?;
    chart
        .configure_mesh()
        .y_desc("time of a frame (us)")
        .light_line_style(WHITE)
        .axis_desc_style(scale.font(17))
        .label_style(scale.font(15))
        .x_label_formatter(&|frame| frame.to_string())
        .y_label_formatter(&|us| number(*us))
        .draw()?;
    // The dearest first, so that no area hides another one's curve.
    let mut order: Vec<usize> = (0..curves.len()).collect();
    let total = |at: usize| curves[at].2.iter().map(|point| point.1).sum::<f64>();
    order.sort_by(|&a, &b| total(b).total_cmp(&total(a)));
    for at in order {
        let own = curves[at].2.iter().copied();
        chart.draw_series(AreaSeries::new(own, floor, colour(at).mix(0.22)))?;
    }
    for (at, (width, k, own)) in curves.iter().enumerate() {
        chart
            .draw_series(LineSeries::new(own.iter().copied(), scale.line(colour(at).into(), 2)))?
            .label(format!("{}: {}", panel.name(*width), outcome.fixed[*k]))
            .legend(move |(x, y)| {
                Rectangle::new([(x, y - scale.offset(5)), (x + scale.offset(16), y + scale.offset(5))], colour(at).filled())
            });
    }
    chart.draw_series(LineSeries::new(adaptive, scale.line(BLACK.into(), 2)))?.label("adaptive").legend(move |(x, y)| {
        Rectangle::new([(x, y - scale.offset(1)), (x + scale.offset(16), y + scale.offset(1))], BLACK.filled())
    });
    if let Some(co_runner) = course.co_runner {
        let from = co_runner.from_frame;
        chart
            .draw_series(DashedLineSeries::new(
                [(from, floor), (from, high)],
                scale.length(4),
                scale.length(4),
                scale.line(BLACK.mix(0.6), 1),
            ))?
            .label("a co-runner begins")
            .legend(move |(x, y)| PathElement::new([(x, y), (x + scale.offset(16), y)], BLACK.mix(0.6)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(scale.font(15))
        .legend_area_size(scale.length(24))
        .margin(scale.length(10))
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(180, 180, 180))
        .draw()?;
    Ok(())
}

/// What ran in each frame of the last repeat: a row for each number, the black line through what was chosen.
fn choices<D>(area: &Area<D>, scale: Scale, panel: &Panel, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let taken = outcome.last_taken();
    let rows = panel.rows();
    let label = |y: &SegmentValue<usize>| match y {
        SegmentValue::CenterOf(row) => rows.get(*row).cloned().unwrap_or_default(),
        _ => String::new(),
    };
    let mut chart = ChartBuilder::on(area)
        .margin(scale.length(10))
        .set_label_area_size(LabelAreaPosition::Left, scale.length(AXIS))
        .set_label_area_size(LabelAreaPosition::Bottom, scale.length(12))
        .build_cartesian_2d(0..taken.len().max(1), (0..rows.len() - 1).into_segmented())?;
    chart
        .configure_mesh()
        .disable_mesh()
        .y_labels(rows.len())
        .label_style(scale.font(15))
        .x_label_formatter(&|_| String::new())
        .y_label_formatter(&label)
        .draw()?;
    let unit = |at: usize| taken[at].chosen.map(|k| panel.unit(&outcome.fixed[k]));
    // Frames in a row that are alike are one rectangle and one line.
    let mut line: Vec<(usize, SegmentValue<usize>)> = Vec::new();
    let mut first = 0;
    for at in 1..=taken.len() {
        if at < taken.len() && unit(at) == unit(first) {
            continue;
        }
        if let Some(unit) = unit(first) {
            let shade = unit.map_or(RGBColor(190, 190, 190), colour);
            let row = panel.row(unit);
            let corners = [(first, SegmentValue::Exact(row)), (at, SegmentValue::Exact(row + 1))];
            chart.draw_series([Rectangle::new(corners, shade.mix(0.75).filled())])?;
            line.extend([first, at].map(|end| (end, SegmentValue::CenterOf(row))));
        }
        first = at;
    }
    chart.draw_series(LineSeries::new(line, scale.line(BLACK.into(), 2)))?;
    // The line does not show where another algorithm takes over on as many as before.
    let top = rows.len();
    let tick =
        |at: usize| PathElement::new([top - 1, top].map(|y| (at, SegmentValue::Exact(y))), scale.line(BLACK.into(), 1));
    chart.draw_series(outcome.switches().into_iter().map(tick))?;
    let explored = taken.iter().enumerate().filter(|(_, t)| t.explored).map(|(at, _)| at);
    let ring = |at: usize| Circle::new((at, SegmentValue::CenterOf(top - 2)), scale.length(5), scale.line(BLACK.into(), 1));
    chart.draw_series(explored.map(ring))?;
    Ok(())
}

fn objects<D>(area: &Area<D>, scale: Scale, outcome: &Outcome) -> anyhow::Result<()>
where
    D: DrawingBackend,
    D::ErrorType: 'static,
{
    let count = outcome.frames.len();
    let line = curve(outcome.frames.iter().map(|f| f.objects.max(1) as f64), count);
    let low = line.iter().map(|p| p.1).fold(f64::INFINITY, f64::min) / 1.2;
    let high = line.iter().map(|p| p.1).fold(1.0, f64::max) * 1.2;
    let mut chart = ChartBuilder::on(area)
        .margin(scale.length(10))
        .set_label_area_size(LabelAreaPosition::Left, scale.length(AXIS))
        .set_label_area_size(LabelAreaPosition::Bottom, scale.length(45))
        .build_cartesian_2d(0..count.max(1), (low..high).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("frame")
        .y_desc("objects")
        .light_line_style(WHITE)
        .axis_desc_style(scale.font(17))
        .label_style(scale.font(15))
        .x_label_formatter(&|frame| frame.to_string())
        .y_label_formatter(&|n| number(*n))
        .draw()?;
    chart.draw_series(LineSeries::new(line, scale.line(RGBColor(90, 90, 90).into(), 2)))?;
    Ok(())
}

/// A label that needs no exponent.
fn number(value: f64) -> String {
    if value < 1.0 { format!("{value:.2}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests;
