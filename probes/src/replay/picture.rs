//! Figure 8 of Avril, Gouranton and Arnaldi (ISVRI 2011): what each number of GPUs and of cores costs, and what was chosen.

use super::Figure;
use super::axis::{Axis, Tick, time_unit};
use super::chart::{ABOVE, BELOW, Chart, Frame, LEFT, Line, RIGHT, fill, missing};
use super::legend::{Legend, Sign};
use super::mark::Mark;
use super::paper::Area;
use super::style::{self, GAP, GRID, INK, SECONDARY};
use crate::replay::{ReplaySettings, Outcome};
use plotters::style::RGBColor;
use sapwise::{AlgorithmId, BackendClass};

/// Width, and heights of the three charts of a panel: times, choices and objects.
const WIDTH: i32 = 1500;
const TIMES: i32 = 480;
const CHOICES: i32 = 190;
const OBJECTS: i32 = 200;
/// Room on the left of the charts, for the names of choices.
const NAMES: i32 = LEFT + 24;
/// Points of a curve at most: more can't be seen, and make an SVG of megabytes.
const POINTS: usize = 1200;
/// Marks on a curve.
const MARKS: usize = 12;

/// Frames, each with a value.
type Points = Vec<(usize, f64)>;

/// GPUs on the left and cores on the right, where both ran: above the time of the best fixed algorithm on each number of them in colour and that
/// of the adaptive module in black, then what it chose, and the number of objects below.
pub(crate) struct Simulation<'a> {
    pub(crate) settings: &'a ReplaySettings,
    pub(crate) outcome: &'a Outcome,
}

/// The adaptive module, the beginning of a co-runner, and the number of objects.
const ADAPTIVE: Line = Line::solid(INK, 2);
const CO_RUNNER: Line = Line::dashed(SECONDARY, 1);
const COUNT: Line = Line::solid(SECONDARY, 2);

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

/// What is said of a class of processors on which nothing ran.
fn absent(class: BackendClass) -> &'static str {
    match class {
        BackendClass::Gpu => "no GPU algorithm ran here",
        BackendClass::Cpu => "no algorithm ran on the CPU",
    }
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

impl Simulation<'_> {
    /// Those of the classes that ran; the one that is alone has the whole width.
    fn panels(&self) -> Vec<Panel> {
        let all = [BackendClass::Gpu, BackendClass::Cpu].map(|class| Panel::new(class, self.outcome));
        let alone = all.iter().filter(|p| !p.units.is_empty()).count() == 1;
        all.into_iter().filter(|p| !alone || !p.units.is_empty()).collect()
    }

    fn legend(&self, panel: &Panel, width: i32) -> Legend {
        let mut entries: Vec<(Sign, String)> = Vec::new();
        for (at, (width, k)) in panel.units.iter().enumerate() {
            entries.push((Sign::Marked(at), format!("{}: {}", panel.name(*width), self.outcome.fixed[*k])));
        }
        entries.push((Sign::Line(ADAPTIVE), "adaptive".to_owned()));
        if self.settings.co_runner.is_some() {
            entries.push((Sign::Line(CO_RUNNER), "a co-runner begins".to_owned()));
        }
        Legend::new(entries, width - 2 * GAP)
    }

    fn panel(&self, area: &Area<'_>, frame: Frame, panel: &Panel) -> anyhow::Result<()> {
        let Frame { left, top, right, .. } = frame.within(NAMES, ABOVE, RIGHT, 0);
        if panel.units.is_empty() {
            let text = absent(panel.class);
            return missing(area, Frame { left, top, right, bottom: top + TIMES + CHOICES + OBJECTS - BELOW }, text);
        }
        let strip = |top: i32, height: i32, below: i32| Frame { left, top, right, bottom: top + height - below };
        self.times(area, strip(top, TIMES, 26), panel)?;
        self.choices(area, strip(top + TIMES, CHOICES, GAP), panel)?;
        self.objects(area, strip(top + TIMES + CHOICES, OBJECTS, BELOW))?;
        self.legend(panel, right - frame.left).draw(area, (frame.left + GAP, top + TIMES + CHOICES + OBJECTS))
    }

    /// The frames from the first to the last.
    fn frames(&self) -> Axis {
        Axis::linear(0.0, self.outcome.frames.len().max(1) as f64)
    }

    fn times(&self, area: &Area<'_>, frame: Frame, panel: &Panel) -> anyhow::Result<()> {
        let count = self.outcome.frames.len();
        let of = |k: usize| curve(self.outcome.frames.iter().map(|f| f.fixed_ns[k]), count);
        let adaptive = curve(self.outcome.frames.iter().map(|f| f.adaptive_ns), count);
        let curves: Vec<Points> = panel.units.iter().map(|&(_, k)| of(k)).collect();
        let all = || curves.iter().flatten().chain(&adaptive).map(|point| point.1);
        let (name, unit) = time_unit(all());
        let chart = Chart::new(area, frame, self.frames(), Axis::log(all().map(|ns| ns / unit), 1.5));
        let mut title = format!("{} ({})", panel.title(), self.settings.source.name());
        if !panel.other {
            let other = if panel.class == BackendClass::Cpu { BackendClass::Gpu } else { BackendClass::Cpu };
            title += &format!("; {}", absent(other));
        }
        chart.grid(&title, "", &format!("time of a frame ({name})"))?;
        let drawn = |points: &Points| points.iter().map(|&(at, ns)| (at as f64, ns / unit)).collect::<Vec<_>>();
        // The dearest first, so that no area hides another one's curve.
        let mut order: Vec<usize> = (0..curves.len()).collect();
        let total = |at: usize| curves[at].iter().map(|point| point.1).sum::<f64>();
        order.sort_by(|&a, &b| total(b).total_cmp(&total(a)));
        for at in order {
            chart.below(drawn(&curves[at]), style::colour(at), style::FIELD)?;
        }
        for (at, own) in curves.iter().enumerate() {
            chart.line(drawn(own), Line::solid(style::colour(at), 2))?;
            // Each begins elsewhere, so that marks of curves at one height are beside each other.
            let every = own.len().div_ceil(MARKS).max(1);
            for (x, y) in drawn(own).into_iter().skip(at * every / curves.len()).step_by(every) {
                chart.mark(x, y, style::mark(at), style::colour(at), 4)?;
            }
        }
        chart.line(drawn(&adaptive), ADAPTIVE)?;
        match self.settings.co_runner {
            Some(co_runner) => chart.upright(co_runner.from_frame as f64, CO_RUNNER),
            None => Ok(()),
        }
    }

    /// What ran in each frame of the last repeat: a row for each number, the black line through what was chosen.
    fn choices(&self, area: &Area<'_>, frame: Frame, panel: &Panel) -> anyhow::Result<()> {
        let taken = self.outcome.last_taken();
        let names = panel.rows();
        let middle = |row: usize| row as f64 + 0.5;
        let rows = Axis::linear(0.0, names.len() as f64);
        let top = names.len();
        let names = names.into_iter().enumerate().map(|(row, label)| Tick { value: middle(row), label }).collect();
        let chart = Chart::new(
            area,
            frame,
            Axis::linear(0.0, taken.len().max(1) as f64).with_names(Vec::new()),
            rows.with_names(names),
        );
        chart.grid("", "", "")?;
        let unit = |at: usize| taken[at].chosen.map(|k| panel.unit(&self.outcome.fixed[k]));
        // Frames in a row that are alike are one rectangle and one line.
        let mut line: Vec<(f64, f64)> = Vec::new();
        let mut first = 0;
        for at in 1..=taken.len() {
            if at < taken.len() && unit(at) == unit(first) {
                continue;
            }
            if let Some(unit) = unit(first) {
                let shade: RGBColor = unit.map_or(GRID, style::colour);
                let row = panel.row(unit);
                if let Some(frame) = chart.rectangle((first as f64, at as f64), (row as f64, row as f64 + 1.0)) {
                    fill(area, frame, shade, 0.75)?;
                }
                line.extend([first, at].map(|end| (end as f64, middle(row))));
            }
            first = at;
        }
        chart.line(line, ADAPTIVE)?;
        // The line does not show where another algorithm takes over on as many as before.
        for at in self.outcome.switches() {
            let ends = [top - 1, top].map(|y| (at as f64, y as f64));
            chart.line(ends, Line::solid(INK, 1))?;
        }
        for (at, _) in taken.iter().enumerate().filter(|(_, t)| t.explored) {
            chart.mark(at as f64, middle(top - 2), Mark::Ring, INK, 5)?;
        }
        Ok(())
    }

    fn objects(&self, area: &Area<'_>, frame: Frame) -> anyhow::Result<()> {
        let count = self.outcome.frames.len();
        let line = curve(self.outcome.frames.iter().map(|f| f.objects.max(1) as f64), count);
        let chart = Chart::new(area, frame, self.frames(), Axis::log(line.iter().map(|p| p.1), 1.2));
        chart.grid("", "frame", "objects")?;
        chart.line(line.into_iter().map(|(at, n)| (at as f64, n)), COUNT)
    }
}

impl Figure for Simulation<'_> {
    fn title(&self) -> &str {
        ""
    }

    fn size(&self) -> (u32, u32) {
        let panels = self.panels();
        let legends = panels.iter().map(|panel| self.legend(panel, WIDTH / panels.len() as i32).height());
        (WIDTH as u32, (ABOVE + TIMES + CHOICES + OBJECTS + legends.max().unwrap_or(0)) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let whole = Frame { left: 0, top: 0, right: WIDTH, bottom: self.size().1 as i32 };
        let panels = self.panels();
        for (panel, frame) in panels.iter().zip(whole.parts(panels.len(), panels.len(), 0)) {
            self.panel(area, frame, panel)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
