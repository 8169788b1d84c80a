//! A small plot of curves in characters.

use super::Terminal;
use super::canvas::{Canvas, colour_of, dots, letter};
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;
use std::cell::RefCell;
use std::rc::Rc;

/// Lines of the plot, its labels included.
const LINES: usize = 16;
/// Wider plots are no easier to read.
const WIDEST: usize = 110;
/// Characters for the labels on the left, the frame included.
const LABELS: i32 = 9;
/// Labels at most on each axis.
const LABELS_ACROSS: usize = 8;
const LABELS_DOWN: usize = 5;

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Series {
    pub(crate) name: String,
    /// Ascending by the first.
    pub(crate) points: Vec<(f64, f64)>,
}

/// How the values across are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Axis {
    Linear,
    Logarithmic,
}

/// Curves over one axis, on a logarithmic axis upwards.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chart {
    /// What is drawn, with the units of both axes.
    pub(crate) title: String,
    pub(crate) across: Axis,
    /// The first is drawn over all others.
    pub(crate) series: Vec<Series>,
}

impl Chart {
    /// The plot with its title and the names of its curves, where the terminal is wide enough and there are two points at least.
    pub(crate) fn draw(&self, terminal: Terminal) -> Option<String> {
        let columns = terminal.plot_columns()?.min(WIDEST);
        let drawable =
            |&&(x, y): &&(f64, f64)| x.is_finite() && y.is_finite() && y > 0.0 && (self.across == Axis::Linear || x > 0.0);
        let series: Vec<Vec<(f64, f64)>> =
            self.series.iter().map(|s| s.points.iter().filter(drawable).copied().collect()).collect();
        let extent = |pick: fn(&(f64, f64)) -> f64| {
            let all = || series.iter().flatten().map(pick);
            (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max))
        };
        let (left, right) = extent(|p| p.0);
        let (low, high) = extent(|p| p.1);
        if left >= right || !left.is_finite() {
            return None;
        }
        // A curve of one height lies in the middle.
        let (low, high) = if high / low < 1.2 { (low / 1.5, high * 1.5) } else { (low, high) };
        let drawn = match self.across {
            Axis::Linear => plot(terminal, columns, left..right, low..high, &series),
            Axis::Logarithmic => {
                let across = (left..right).log_scale().with_key_points(marks(left, right, LABELS_ACROSS));
                plot(terminal, columns, across, low..high, &series)
            }
        };
        // Nothing but a canvas without room fails, and there is room.
        let drawn = drawn.ok()?;
        Some(format!("{}\n{drawn}{}", terminal.head(&self.title), self.names(terminal, columns)))
    }

    /// The letter and the name of each curve, as many in a line as there is room for.
    fn names(&self, terminal: Terminal, columns: usize) -> String {
        let (mut text, mut used) = (String::new(), 0);
        for (k, series) in self.series.iter().enumerate() {
            let name = format!("{} {}", letter(k), series.name);
            let width = name.chars().count() + 3;
            if used > 0 && used + width > columns {
                text.push('\n');
                used = 0;
            }
            text += &format!("   {}", terminal.series(k, &name));
            used += width;
        }
        text + "\n"
    }
}

fn plot<X>(
    terminal: Terminal,
    columns: usize,
    across: X,
    upwards: std::ops::Range<f64>,
    series: &[Vec<(f64, f64)>],
) -> anyhow::Result<String>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let (wide, high) = dots(terminal);
    let canvas = Rc::new(RefCell::new(Canvas::new(terminal, columns, LINES)));
    {
        let root = DrawingArea::from(&canvas);
        let mut chart = ChartBuilder::on(&root)
            .set_label_area_size(LabelAreaPosition::Left, LABELS * wide)
            .set_label_area_size(LabelAreaPosition::Bottom, 2 * high)
            // Half of the last label.
            .margin_right(3 * wide)
            .build_cartesian_2d(
                across,
                upwards.clone().log_scale().with_key_points(marks(upwards.start, upwards.end, LABELS_DOWN)),
            )?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(LABELS_ACROSS)
            .y_labels(LABELS_DOWN)
            .set_tick_mark_size(LabelAreaPosition::Left, wide / 2)
            .set_tick_mark_size(LabelAreaPosition::Bottom, high / 2)
            .x_label_formatter(&|x| figure(*x))
            .y_label_formatter(&|y| figure(*y))
            .draw()?;
        for (k, points) in series.iter().enumerate().rev() {
            chart.draw_series(LineSeries::new(points.iter().copied(), &colour_of(k)))?;
        }
        // Each letter at another place along its curve, so that those of curves side by side don't hide one another.
        let style = |k: usize| ("sans-serif", high).into_font().color(&colour_of(k));
        for (k, points) in series.iter().enumerate().filter(|s| !s.1.is_empty()) {
            let at = points[(2 * k + 1) * points.len() / (2 * series.len())];
            chart.draw_series([Text::new(letter(k).to_string(), at, style(k))])?;
        }
        root.present()?;
    }
    let text = canvas.borrow().text();
    Ok(text)
}

/// Where a logarithmic axis has labels: at powers of ten, or at every 1, 2 and 5 where that leaves fewer than three. Those of plotters
/// are none within a decade.
fn marks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let of = |leading: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|decade| leading.iter().map(move |digit| digit * 10.0_f64.powi(decade)));
        all.filter(|mark| (low..=high).contains(mark)).collect()
    };
    let powers = of(&[1.0]);
    let marks = if powers.len() < 3 { of(&[1.0, 2.0, 5.0]) } else { powers };
    let step = marks.len().div_ceil(most).max(1);
    marks.into_iter().step_by(step).collect()
}

/// A number in few characters: with a blank between groups of three digits, or in powers of a thousand.
fn figure(value: f64) -> String {
    match value.abs() {
        v if v >= 1e6 => format!("{}M", short(value / 1e6)),
        v if v >= 1e4 => format!("{}k", short(value / 1e3)),
        _ => short(value),
    }
}

fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::tests::WIDE;
    use super::*;

    #[test]
    fn show() {
        let line = |name: &str, a: f64, b: f64| Series {
            name: name.to_owned(),
            points: (4..=24).map(|q| 10f64.powf(f64::from(q) / 4.0)).map(|x| (x, a + b * x)).collect(),
        };
        let chart = Chart {
            title: "uniform: time of a frame (us) over objects".into(),
            across: Axis::Logarithmic,
            series: vec![line("verlet@cpu1", 0.1, 0.02), line("verlet@cpu2", 5.0, 0.011), line("sweep@gpu0", 300.0, 0.001)],
        };
        for t in [
            WIDE,
            Terminal { columns: Some(80), colour: false, unicode: true },
            Terminal { columns: Some(80), colour: false, unicode: false },
        ] {
            println!("{}", chart.draw(t).unwrap());
        }
        let chart = Chart { across: Axis::Linear, ..chart };
        println!("{}", chart.draw(WIDE).unwrap());
    }
}
