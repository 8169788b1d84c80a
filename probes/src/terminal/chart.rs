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
        // The axes end one character before they would meet.
        let corner = if terminal.unicode { "└" } else { "+" };
        let at = ((LABELS - 1) * wide, (LINES as i32 - 2) * high);
        root.draw(&Text::new(corner, at, ("sans-serif", high).into_font()))?;
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

/// A number in few characters, from ten thousand on in thousands and from a million on in millions.
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

    const PLAIN: Terminal = Terminal { columns: Some(80), colour: false, unicode: false };

    fn chart(across: Axis) -> Chart {
        let decades = || (0..=30).map(|k| 10.0_f64.powf(f64::from(k) / 10.0));
        let series =
            |name: &str, y: fn(f64) -> f64| Series { name: name.to_owned(), points: decades().map(|x| (x, y(x))).collect() };
        Chart {
            title: "time over objects".to_owned(),
            across,
            series: vec![series("grows", |x| x), series("stays", |_| 30.0)],
        }
    }

    #[test]
    fn curves_lie_where_their_figures_are() {
        let text = chart(Axis::Logarithmic).draw(PLAIN).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines.len(), lines[0], lines[LINES + 1]), (LINES + 2, "time over objects", "   a grows   b stays"));
        assert_eq!(lines[LINES].split_whitespace().collect::<Vec<_>>(), ["1", "10", "100", "1000"]);
        assert!(text.lines().all(|line| line.len() <= 80 && line.is_ascii()), "{text}");
        // The one that grows goes from the lower left to the upper right, half way at the middle; the other keeps its line.
        let of = |letter: char| -> Vec<(usize, usize)> {
            let at = |(y, line): (usize, &&str)| {
                line.char_indices().filter(|c| c.1 == letter).map(|(x, _)| (x, y)).collect::<Vec<_>>()
            };
            lines[1..LINES - 1].iter().enumerate().flat_map(at).collect()
        };
        let (grows, stays) = (of('a'), of('b'));
        let left = LABELS as usize;
        assert!(grows.contains(&(left, LINES - 3)) && grows.iter().any(|&(x, y)| x > 70 && y == 0), "{text}");
        assert!(stays.iter().all(|s| s.1 == stays[0].1) && stays.len() > 50, "{text}");
        let thirty = grows.iter().find(|g| g.1 == stays[0].1).unwrap();
        let wanted = left as f64 + (77 - left) as f64 * 30.0_f64.log10() / 3.0;
        assert!((thirty.0 as f64 - wanted).abs() < 6.0, "{thirty:?} {wanted} {text}");
    }

    #[test]
    fn colours_and_dots_show_where_the_terminal_has_them() {
        let coloured = chart(Axis::Logarithmic).draw(WIDE).unwrap();
        assert!(
            coloured.contains("\u{1b}[32ma grows\u{1b}[0m") && coloured.contains("\u{1b}[35mb stays\u{1b}[0m"),
            "{coloured}"
        );
        assert!(coloured.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)));
        let dots = chart(Axis::Logarithmic).draw(Terminal { colour: false, ..WIDE }).unwrap();
        assert!(!dots.contains('\u{1b}') && dots.lines().all(|line| line.chars().count() <= WIDEST), "{dots}");
        // Without colours the letter on a curve says which it is.
        assert!(dots.lines().skip(1).take(LINES).filter(|l| l.contains('a') || l.contains('b')).count() == 2, "{dots}");
    }

    #[test]
    fn what_can_not_be_drawn_is_left_away() {
        let narrow = Terminal { columns: Some(79), ..WIDE };
        assert_eq!((chart(Axis::Linear).draw(narrow), chart(Axis::Linear).draw(Terminal::NONE)), (None, None));
        let of = |points: &[(f64, f64)]| {
            let series = vec![Series { name: "a".to_owned(), points: points.to_vec() }];
            Chart { title: String::new(), across: Axis::Linear, series }.draw(PLAIN)
        };
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(1.0, 5.0)]), None);
        assert_eq!(of(&[(1.0, 5.0), (2.0, 0.0), (3.0, f64::INFINITY)]), None);
        for points in
            [&[(0.0, 5.0), (2.0, 5.0)][..], &[(0.0, 1e-3), (1e9, 1e12)], &[(0.0, 5.0), (1.0, f64::NAN), (2.0, 6.0)]]
        {
            let text = of(points).unwrap();
            assert!(text.matches('a').count() > 20, "{text}");
        }
    }

    #[test]
    fn marks_are_round_and_few() {
        assert_eq!(marks(3.0, 2e4, 5), [10.0, 100.0, 1000.0, 10_000.0]);
        assert_eq!(marks(2.0, 9.0, 5), [2.0, 5.0]);
        assert_eq!(marks(1.0, 1e9, 5), [1.0, 100.0, 1e4, 1e6, 1e8]);
        assert_eq!([0.001, 0.25, 1000.0, 10_000.0, 2.5e6, 0.0].map(figure), ["0.001", "0.25", "1000", "10k", "2.5M", "0"]);
    }
}
